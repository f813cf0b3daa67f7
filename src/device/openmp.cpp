// SPDX-License-Identifier: Apache-2.0
#include "gsnav/backends/openmp.hpp"

#include <string>
#include <string_view>

#include "engines_on.hpp"

namespace gsnav::detail {
namespace {

std::unique_ptr<OpenMPBackend> make_openmp(const Device& device) {
  return std::make_unique<OpenMPBackend>(device.threads());
}

}  // namespace

const EngineFactory openmp_engines = engines_on<OpenMPBackend, make_openmp>();

int cpu_threads(int threads) { return threads > 0 ? threads : OpenMPBackend().threads(); }
std::string cpu_instruction_set() {
  const std::string_view name = lane_kernels().name;
  if (name == "avx512") return "AVX-512";
  if (name == "avx2") return "AVX2";
  if (name == "neon") return "NEON";
#if defined(__x86_64__) && !defined(__FMA__)
  return "SSE2 (no FMA: a frame takes 5 times as long as with AVX2)";
#else
  return "portable code";
#endif
}

}  // namespace gsnav::detail
