// SPDX-License-Identifier: Apache-2.0
#include "gsnav/backends/cuda/device.cuh"
#include "gsnav/detail/sweep/first_impacts.hpp"

// Capsule kernels of the library, with one pair or leg per thread.

namespace gsnav {

template Status capsule_gaps<CudaBackend, float>(CudaBackend&, const CapsuleGapArgs<float>&);
template Status capsule_gaps<CudaBackend, double>(CudaBackend&, const CapsuleGapArgs<double>&);
template Status sweep_capsules<CudaBackend, float>(CudaBackend&, const SweepArgs<float>&);
template Status sweep_capsules<CudaBackend, double>(CudaBackend&, const SweepArgs<double>&);
template Status first_impacts<float, CudaBackend>(CudaBackend&, const FirstImpactArgs<float>&);
template Status first_impacts<double, CudaBackend>(CudaBackend&, const FirstImpactArgs<double>&);

}  // namespace gsnav
