// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "gsnav/core/backend.hpp"
#include "gsnav/core/buffer.hpp"
#include "gsnav/detail/core/move_to.hpp"
#include "gsnav/detail/scene/needed_bands.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"
#include "gsnav/scene/packed_cloud.hpp"

namespace gsnav {

/// The arrays of a cloud in a backend's memory. On host backends nothing is copied, and the cloud (and
/// `bands`, if given) must outlive this object. Other backends get a copy, in which a packed cloud
/// becomes floats. Temporaries do not compile on any backend, so that code which is right on one is
/// right on all (docs/reference/ownership.md). The backend must outlive this object.
template <Backend B>
class GaussianArrays {
 public:
  /// Views the cloud on host backends, copies it to others.
  GaussianArrays(B& backend, const GaussianCloud& cloud) : set_(cloud.set()) {
    if constexpr (!is_host_backend<B>) upload(backend, cloud);
  }
  /// Leaves out the SH bands that no chunk needs (detail/scene/scene_bands.hpp). On other backends than
  /// host backends, bands that no chunk needs take no memory; bands that one chunk does not need are not
  /// read for it.
  GaussianArrays(B& backend, const GaussianCloud& cloud, const SceneBands& bands)
      : set_(bands.applied_to(cloud.set())) {
    if constexpr (!is_host_backend<B>) {
      upload(backend, cloud);
      detail::move_to(backend, set_.gaussians.color.chunk_degrees, bytes_);
    }
  }
  /// Places a packed cloud.
  GaussianArrays(B& backend, const PackedCloud& cloud) : set_(cloud.set()) {
    if constexpr (!is_host_backend<B>) {
      const GaussianCloud floats = unpack_cloud(cloud);
      set_ = floats.set();
      upload(backend, floats);
    }
  }
  /// Places a packed cloud, of whose SH only `bands` are read.
  GaussianArrays(B& backend, const PackedCloud& cloud, const SceneBands& bands)
      : set_(bands.applied_to(cloud.set())) {
    if constexpr (!is_host_backend<B>) {
      const GaussianCloud floats = unpack_cloud(cloud);
      set_ = bands.applied_to(floats.set());
      upload(backend, floats);
      detail::move_to(backend, set_.gaussians.color.chunk_degrees, bytes_);
    }
  }
  GaussianArrays(B& backend, const GaussianCloud&& cloud) = delete;
  GaussianArrays(B& backend, const GaussianCloud&& cloud, const SceneBands& bands) = delete;
  GaussianArrays(B& backend, const GaussianCloud& cloud, const SceneBands&& bands) = delete;
  GaussianArrays(B& backend, const PackedCloud&& cloud) = delete;
  GaussianArrays(B& backend, const PackedCloud&& cloud, const SceneBands& bands) = delete;
  GaussianArrays(B& backend, const PackedCloud& cloud, const SceneBands&& bands) = delete;

  /// The arrays placed in the world. Valid while this object lives.
  GaussianSet set(const Similarity& world_from_asset = {}) const& noexcept {
    GaussianSet s = set_;
    s.world_from_asset = world_from_asset;
    return s;
  }
  GaussianSet set(const Similarity& world_from_asset = {}) const&& = delete;

 private:
  void upload(B& backend, const GaussianCloud& cloud) {
    GaussianRows& v = set_.gaussians;
    detail::move_to(backend, v.shape.means, floats_);
    detail::move_to(backend, v.shape.quats, floats_);
    detail::move_to(backend, v.shape.scales, floats_);
    detail::move_to(backend, v.shape.opacities, floats_);
    detail::move_to(backend, v.shape.origin_ids, ids_);
    detail::move_to(backend, v.color.sh0, floats_);
    std::vector<float> floats;
    std::vector<std::uint16_t> halves;
    drop_bands(v.color, v.size(), floats, halves);
    detail::move_to(backend, v.color.shN, floats_);
    detail::move_to(backend, v.color.shN_half, halves_);
    detail::move_to(backend, v.row_ids, ids_);
    detail::move_to(backend, v.chunk_bounds, bounds_);
    detail::move_to(backend, v.part_bounds, bounds_);
    origins_ = cloud.origins;  // origins stay on the host, which reads them
    v.origins = view_of(std::as_const(origins_));
  }
  /// Shortens the rows by the bands that no chunk needs.
  static void drop_bands(ColorRows& v, std::size_t size, std::vector<float>& floats,
                         std::vector<std::uint16_t>& halves) {
    const int most = needed_sh_degree(v);
    if (most == v.degree) return;
    const auto drop = [&]<class T>(View<const T>& from, std::vector<T>& to) {
      if (from.empty()) return;
      to.resize(sh_band_numbers(most) * size);
      narrow_rows(from.data, size, v.rest(), sh_band_numbers(most), to.data());
      from = view_of(std::as_const(to));
    };
    drop(v.shN, floats);
    drop(v.shN_half, halves);
    v.degree = most;
  }
  GaussianSet set_;
  std::vector<Buffer<float, B>> floats_;
  std::vector<Buffer<std::uint16_t, B>> halves_;
  std::vector<Buffer<std::uint32_t, B>> ids_;
  std::vector<Buffer<ChunkBounds, B>> bounds_;
  std::vector<Buffer<std::uint8_t, B>> bytes_;
  std::vector<Vec3d> origins_;
};

}  // namespace gsnav
