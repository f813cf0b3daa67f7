// SPDX-License-Identifier: Apache-2.0
#include "engines.hpp"
#include "gsnav/detail/eval/oracle_photo.hpp"
#include "gsnav/detail/scene/lod_build.hpp"
#include "gsnav/device/renderer.hpp"
#include "gsnav/eval/oracle.hpp"
#include "gsnav/scene/visible_sets.hpp"
#if defined(GSNAV_DEVICE_OPENMP)
#include "gsnav/backends/openmp.hpp"
#else
#include "gsnav/backends/serial.hpp"
#endif

namespace gsnav {
namespace {

#if defined(GSNAV_DEVICE_OPENMP)
OpenMPBackend host_of(const Device& device) {
  return OpenMPBackend(device.kind() == DeviceKind::serial ? 1 : device.threads());
}
#else
SerialBackend host_of(const Device&) { return {}; }
#endif

}  // namespace

Result<LodTree> build_lod(const Device& device, const GaussianCloud& cloud,
                          const LodSettings& settings) {
  auto backend = host_of(device);
  return build_lod(backend, cloud, settings);
}

Result<VisibleSets> build_visible_sets(const Device& device, const GaussianCloud& cloud,
                                       std::span<const Vec3d> viewpoints,
                                       const VisibleSettings& settings,
                                       const Similarity& world_from_asset) {
#if defined(GSNAV_DEVICE_CUDA)
  if (device.kind() == DeviceKind::cuda)
    return detail::visible_sets_on_cuda(device, cloud, viewpoints, settings, world_from_asset);
#endif
  auto backend = host_of(device);
  return build_visible_sets(backend, cloud, viewpoints, settings, world_from_asset);
}

Result<eval::OracleFrames> eval::oracle_render(const Device& device, std::span<const GaussianSet> sets,
                                               const Camera& camera, const OracleConfig& config) {
  auto backend = host_of(device);
  return oracle_render(backend, sets, camera, config);
}

Result<eval::OracleFrames> eval::oracle_photo(const Device& device, std::span<const GaussianSet> sets,
                                              const Camera& camera, int k, const OracleConfig& config) {
  auto backend = host_of(device);
  return oracle_photo(backend, sets, camera, k, config);
}

}  // namespace gsnav
