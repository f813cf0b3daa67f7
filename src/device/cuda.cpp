// SPDX-License-Identifier: Apache-2.0
#include "gsnav/backends/cuda.hpp"

#include "engines_on.hpp"
#include "gsnav/detail/core/guarded.hpp"
#include "gsnav/detail/render/frame_batch.hpp"
#include "gsnav/scene/visible_sets.hpp"

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
Result<VisibleSets> visible_sets_on_cuda(const Device& device, const GaussianCloud& cloud,
                                         std::span<const Vec3d> viewpoints,
                                         const VisibleSettings& settings,
                                         const Similarity& world_from_asset) {
  std::unique_ptr<CudaBackend> backend;
  const Status made = guarded([&]() -> Status {
    backend = make_cuda(device);
    return {};
  });
  if (!made) return made;
  return build_visible_sets(*backend, cloud, viewpoints, settings, world_from_asset);
}
std::string cuda_name(int index) { return CudaBackend(index).device_name(); }

}  // namespace gsnav::detail
