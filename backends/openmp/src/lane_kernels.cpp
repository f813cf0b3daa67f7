// SPDX-License-Identifier: Apache-2.0
#include <cstring>

#include "gsnav/backends/openmp.hpp"
#include "gsnav/detail/core/instruction_set.hpp"

namespace gsnav {

namespace lanes {
#if defined(__aarch64__)
namespace neon {
#else
namespace baseline {
#endif
extern const LaneKernels kKernels;
}
#if defined(GSNAV_ISA_DISPATCH)
namespace avx2 {
extern const LaneKernels kKernels;
}
#if defined(GSNAV_ISA_AVX512)
namespace avx512 {
extern const LaneKernels kKernels;
}
#endif
#endif
}  // namespace lanes

namespace {

const LaneKernels& choose() noexcept {
#if defined(GSNAV_ISA_DISPATCH)
  const char* const limit = detail::instruction_set_limit();
  const auto allowed = [limit](const char* name) {
    return limit == nullptr || std::strcmp(limit, name) == 0 ||
           (std::strcmp(limit, "avx512") == 0 && std::strcmp(name, "avx2") == 0);
  };
  __builtin_cpu_init();
#if defined(GSNAV_ISA_AVX512)
  if (allowed("avx512") && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
      __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512bw")) {
    return lanes::avx512::kKernels;
  }
#endif
  if (allowed("avx2") && __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) {
    return lanes::avx2::kKernels;
  }
#endif
#if defined(__aarch64__)
  return lanes::neon::kKernels;
#else
  return lanes::baseline::kKernels;
#endif
}

}  // namespace

const LaneKernels& lane_kernels() noexcept {
  static const LaneKernels& chosen = choose();
  return chosen;
}

}  // namespace gsnav
