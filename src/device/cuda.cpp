// SPDX-License-Identifier: Apache-2.0
#include "gsnav/backends/cuda.hpp"

#include "engines_on.hpp"

namespace gsnav::detail {
namespace {

std::unique_ptr<CudaBackend> make_cuda(const Device& device) {
  return std::make_unique<CudaBackend>(device.index());
}

}  // namespace

const EngineFactory cuda_engines = engines_on<CudaBackend, make_cuda>();

int cuda_count() noexcept { return CudaBackend::device_count(); }
std::string cuda_name(int index) { return CudaBackend(index).device_name(); }

}  // namespace gsnav::detail
