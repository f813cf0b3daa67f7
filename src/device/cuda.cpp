// SPDX-License-Identifier: Apache-2.0
#include "gsnav/backends/cuda.hpp"

#include "engines_on.hpp"
#include "gsnav/detail/render/frame_batch.hpp"

namespace gsnav::detail {
namespace {

// A renderer that lacks a member of the concept would be passed over, and cameras drawn one by one.
static_assert(BatchBackend<CudaBackend> && CountsReruns<CudaBatchRenderer>);

std::unique_ptr<CudaBackend> make_cuda(const Device& device) {
  return std::make_unique<CudaBackend>(device.index());
}

}  // namespace

const EngineFactory cuda_engines = engines_on<CudaBackend, make_cuda>();

int cuda_count() noexcept { return CudaBackend::device_count(); }
std::string cuda_name(int index) { return CudaBackend(index).device_name(); }

}  // namespace gsnav::detail
