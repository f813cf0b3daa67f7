// SPDX-License-Identifier: Apache-2.0
// Compiled once per instruction set. Every definition is in the set's own namespace or always inlined,
// so that no other object can pick up a function from here.
#include "gsnav/backends/openmp.hpp"
#include "gsnav/detail/lanes/kernels.hpp"

namespace gsnav::lanes {
inline namespace GSNAV_LANES_TAG {

extern const LaneKernels kKernels;
constexpr LaneKernels kKernels = kernel_table<LaneKernels>(GSNAV_LANES_NAME);

}  // namespace GSNAV_LANES_TAG
}  // namespace gsnav::lanes
