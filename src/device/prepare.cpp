// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/scene/lod_build.hpp"
#include "gsnav/device/renderer.hpp"
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
  auto backend = host_of(device);
  return build_visible_sets(backend, cloud, viewpoints, settings, world_from_asset);
}

}  // namespace gsnav
