// SPDX-License-Identifier: Apache-2.0
#include "gsnav/backends/openmp.hpp"

#include "engines_on.hpp"

namespace gsnav::detail {
namespace {

std::unique_ptr<OpenMPBackend> make_openmp(const Device& device) {
  return std::make_unique<OpenMPBackend>(device.threads());
}

}  // namespace

const EngineFactory openmp_engines = engines_on<OpenMPBackend, make_openmp>();

int cpu_threads(int threads) { return threads > 0 ? threads : OpenMPBackend().threads(); }
const char* cpu_lanes() { return lane_kernels().name; }

}  // namespace gsnav::detail
