// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "gsnav/core/backend.hpp"
#include "gsnav/core/status.hpp"
#include "gsnav/core/view.hpp"
#include "gsnav/kernels/camera.hpp"
#include "gsnav/math/similarity.hpp"
#include "gsnav/ops/chunk_weights.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"

namespace gsnav {

/// Which chunks of a cloud can be seen from where cameras go: what stands behind walls need not be
/// looked at. Sampled: chunks of which nobody saw anything from viewpoints in and around a cell are left
/// out for cameras in it. An approximation, for the profiles `fast` and `lod`; docs/lod.md has its
/// error.
struct VisibleSets {
  using Key = std::array<std::int32_t, 3>;

  /// Side of the cubic cells, in the asset's frame: cell k spans [k, k + 1) times this along each axis.
  double cell = 0;
  /// Focal length of the viewpoints' images, pixels: of cameras with a longer one nothing is known.
  double focal = 0;
  double near_plane = 0;            ///< metres in the world: nor of those with a farther one
  double near_sigma = 0;            ///< Camera::near_sigma: nor of those with another
  double min_weight = 0;            ///< VisibleSettings::min_weight
  std::size_t cloud_chunks = 0;     ///< of the cloud that these are of
  std::size_t viewpoints = 0;       ///< that were looked from
  std::vector<Key> keys;            ///< of the cells, ascending
  std::vector<std::uint32_t> bits;  ///< [cells][words()]: GaussianView::seen_chunks of each

  std::size_t cells() const noexcept { return keys.size(); }
  std::size_t words() const noexcept { return (cloud_chunks + 31) / 32; }
  std::size_t bytes() const noexcept {
    return keys.size() * sizeof(Key) + bits.size() * sizeof(std::uint32_t);
  }
  /// What a cell sees; `there`: `bits` in a backend's memory, null: here.
  View<const std::uint32_t> seen_from(std::size_t cell_index,
                                      const std::uint32_t* there = nullptr) const noexcept {
    return {(there != nullptr ? there : bits.data()) + cell_index * words(), words()};
  }
  /// How many chunks it sees.
  std::size_t count_seen(std::size_t cell_index) const noexcept {
    std::size_t sum = 0;
    for (const std::uint32_t word : seen_from(cell_index))
      sum += static_cast<std::size_t>(std::popcount(word));
    return sum;
  }
  /// Share of the chunks that a cell sees, on average.
  double mean_share() const noexcept {
    std::size_t sum = 0;
    for (const std::uint32_t word : bits) sum += static_cast<std::size_t>(std::popcount(word));
    return static_cast<double>(sum) /
           static_cast<double>(std::max<std::size_t>(cells() * cloud_chunks, 1));
  }

  /// The cell of a position in the asset's frame; none where its numbers do not fit.
  static std::optional<Key> key_of(const Vec3d& p, double cell) noexcept {
    Key key{};
    for (int k = 0; k < 3; ++k) {
      const double at = std::floor(p[k] / cell);
      if (!(std::abs(at) < 2e9)) return std::nullopt;
      key[static_cast<std::size_t>(k)] = static_cast<std::int32_t>(at);
    }
    return key;
  }
  /// Index of the cell that knows what a camera sees of the asset where it stands so; none: anything may
  /// be seen.
  std::optional<std::size_t> cell_of(const Camera& camera,
                                     const Similarity& world_from_asset = {}) const noexcept {
    const bool known = std::max(camera.fx, camera.fy) <= focal * (1 + 1e-6) &&
                       camera.near_plane <= near_plane * (1 + 1e-6) && camera.near_sigma == near_sigma;
    if (!known) return {};
    const auto key = key_of(inverse(world_from_asset) * camera.position(), cell);
    if (!key) return {};
    const auto at = std::lower_bound(keys.begin(), keys.end(), *key);
    if (at == keys.end() || *at != *key) return {};
    return static_cast<std::size_t>(at - keys.begin());
  }
};

/// How build_visible_sets works. Lengths in metres in the world.
struct VisibleSettings {
  double cell = 0.5;         ///< side of a cell
  double margin = 0.25;      ///< viewpoints so far outside of a cell count for it too
  double min_weight = 1e-3;  ///< a chunk is seen where one of its Gaussians has so much of a pixel
  int face = 256;            ///< pixels along a face of the cube that is looked at from each viewpoint
  double near_plane = 0.2;   ///< of these images (Camera); what lies nearer to a cell is in its set in any case
  double near_sigma = 0;     ///< likewise

  /// How far apart viewpoints should be (navmesh_viewpoints): with a margin of as much every cell has several, each
  /// with its own directions.
  double spacing() const noexcept { return 0.5 * cell; }
  /// Has `face`, `near_plane` and `near_sigma` be such that the sets serve this camera.
  void serve(const Camera& camera) noexcept {
    face = static_cast<int>(std::ceil(2 * std::max(camera.fx, camera.fy) - 1e-6));
    near_plane = camera.near_plane;
    near_sigma = camera.near_sigma;
  }
  /// Told the share of the work that is done, in [0, 1], for each viewpoint, by the calling thread.
  std::function<void(double)> progress;
};

/// Names the field that cannot be, or ok.
inline Status validate(const VisibleSettings& s) {
  const auto bad = [](const char* field, double value, const char* rule) {
    return Status(Errc::invalid_argument,
                  std::string("VisibleSettings.") + field + " = " + std::to_string(value) + ": " + rule);
  };
  if (!(s.cell > 0 && is_finite(s.cell))) return bad("cell", s.cell, "must be positive");
  if (!(s.margin >= 0 && is_finite(s.margin))) return bad("margin", s.margin, "must be >= 0");
  if (!(s.min_weight >= 0 && s.min_weight < 1))
    return bad("min_weight", s.min_weight, "must be in [0, 1)");
  if (s.face < 16 || s.face > 4096) return bad("face", s.face, "must be in [16, 4096]");
  if (!(s.near_plane > 0 && is_finite(s.near_plane)))
    return bad("near_plane", s.near_plane, "must be positive");
  if (!(s.near_sigma >= 0 && is_finite(s.near_sigma)))
    return bad("near_sigma", s.near_sigma, "must be >= 0");
  return {};
}

namespace detail {

/// Distance between two boxes, along no axis less than 0.
inline double box_distance(const Vec3d& low, const Vec3d& high, const Vec3d& other_low,
                           const Vec3d& other_high) noexcept {
  Vec3d gap;
  for (int k = 0; k < 3; ++k) gap[k] = std::max({0.0, other_low[k] - high[k], low[k] - other_high[k]});
  return norm(gap);
}

/// Cameras that look at the six faces of a cube, turned about the world's up (Y) by another angle for
/// each viewpoint: in what order Gaussians are blended depends on where a camera looks, so that some are
/// seen in one direction only.
inline std::array<Camera, 6> cube_cameras(const Vec3d& eye, std::size_t viewpoint,
                                          const VisibleSettings& settings) noexcept {
  constexpr double kGoldenRatio = 0.6180339887498949, kQuarter = 1.5707963267948966;
  const double turned = static_cast<double>(viewpoint) * kGoldenRatio;
  const double turn = (turned - std::floor(turned)) * kQuarter;
  std::array<Camera, 6> out;
  for (std::size_t f = 0; f < 6; ++f) {
    const double angle = turn + kQuarter * static_cast<double>(f);
    const Vec3d level{std::cos(angle), 0, std::sin(angle)};
    const Vec3d forward = f < 4 ? level : Vec3d{0, f == 4 ? 1.0 : -1.0, 0};
    out[f] = Camera::look_at(eye, eye + forward, f < 4 ? Vec3d{0, 1, 0} : level, settings.face,
                             settings.face, 90);
    out[f].near_plane = settings.near_plane;
    out[f].near_sigma = settings.near_sigma;
  }
  return out;
}

}  // namespace detail

/// Finds what of a cloud is seen from each cell that has a viewpoint in it or within 5 cm (world, metres;
/// navmesh_viewpoints makes them): the cloud stands in the world by `world_from_asset`, with bounds of its
/// chunks (sort_spatially). Each viewpoint costs six frames of settings.face pixels a side. The same bits for
/// any number of threads.
///
/// Errors: invalid_argument (a setting; no viewpoint, or one that is not finite; a cloud that is not in
/// spatial order); those of rendering.
template <Backend B>
requires is_host_backend<B> Result<VisibleSets> build_visible_sets(
    B& backend, const GaussianCloud& cloud, std::span<const Vec3d> viewpoints,
    const VisibleSettings& settings = {}, const Similarity& world_from_asset = {}) {
  if (Status s = validate(settings); !s) return s;
  if (viewpoints.empty()) return Status(Errc::invalid_argument, "build_visible_sets: no viewpoint");
  if (cloud.chunk_bounds.size() != cloud.view().all_chunks()) {
    return Status(Errc::invalid_argument,
                  "build_visible_sets: the cloud's rows are not in spatial order: sort_spatially first");
  }
  VisibleSets out;
  out.cell = settings.cell / world_from_asset.scale;
  out.focal = 0.5 * settings.face;
  out.near_plane = settings.near_plane;
  out.near_sigma = settings.near_sigma;
  out.min_weight = settings.min_weight;
  out.cloud_chunks = cloud.view().all_chunks();
  out.viewpoints = viewpoints.size();
  constexpr double kBeside = 0.05;  // metres
  std::vector<Vec3d> eyes;  // in the asset's frame
  for (std::size_t v = 0; v < viewpoints.size(); ++v) {
    eyes.push_back(inverse(world_from_asset) * viewpoints[v]);
    const auto key = VisibleSets::key_of(eyes.back(), out.cell);
    if (!key) {
      return Status(Errc::invalid_argument,
                    "build_visible_sets: viewpoint " + std::to_string(v) + " is not finite or too far");
    }
    // Rounding, or a step in the floor, must not take a camera that is where a viewpoint is to a cell that has none.
    for (int corner = 0; corner < 8; ++corner) {
      Vec3d beside = eyes.back();
      for (int k = 0; k < 3; ++k) beside[k] += ((corner >> k & 1) != 0 ? 1 : -1) * kBeside / world_from_asset.scale;
      out.keys.push_back(VisibleSets::key_of(beside, out.cell).value_or(*key));
    }
  }
  std::sort(out.keys.begin(), out.keys.end());
  out.keys.erase(std::unique(out.keys.begin(), out.keys.end()), out.keys.end());

  const std::size_t words = out.words();
  out.bits.resize(out.cells() * words);
  const auto see = [&out, words](std::size_t c, std::size_t chunk) {
    out.bits[c * words + chunk / 32] |= std::uint32_t{1} << (chunk % 32);
  };
  const auto box_of = [&out](const VisibleSets::Key& key, Vec3d& low, Vec3d& high) {
    for (int k = 0; k < 3; ++k) {
      low[k] = static_cast<double>(key[static_cast<std::size_t>(k)]) * out.cell;
      high[k] = low[k] + out.cell;
    }
  };
  // What is so near that a camera in the cell may be in front of it and a viewpoint not.
  const double near_distance = settings.near_plane / world_from_asset.scale;
  backend.parallel_for(out.cells(), [&](std::size_t c) {
    Vec3d low, high;
    box_of(out.keys[c], low, high);
    for (std::size_t i = 0; i < out.cloud_chunks; ++i) {
      const ChunkBounds& b = cloud.chunk_bounds[i];
      if (detail::box_distance(low, high, b.low, b.high) <= near_distance) see(c, i);
    }
  });
  const double margin = settings.margin / world_from_asset.scale;
  const GaussianSet set = cloud.set(world_from_asset);
  ChunkWeightsWorkspace<B> workspace(backend);
  std::vector<float> most(out.cloud_chunks);
  for (std::size_t v = 0; v < viewpoints.size(); ++v) {
    std::fill(most.begin(), most.end(), 0.0f);
    for (const Camera& camera : detail::cube_cameras(viewpoints[v], v, settings)) {
      if (Status s = add_chunk_weights(backend, workspace, set, camera, most); !s) return s;
    }
    for (std::size_t c = 0; c < out.cells(); ++c) {
      Vec3d low, high;
      box_of(out.keys[c], low, high);
      if (detail::box_distance(low, high, eyes[v], eyes[v]) > margin) continue;
      for (std::size_t i = 0; i < out.cloud_chunks; ++i) {
        if (static_cast<double>(most[i]) > settings.min_weight) see(c, i);
      }
    }
    if (settings.progress)
      settings.progress(static_cast<double>(v + 1) / static_cast<double>(viewpoints.size()));
  }
  return out;
}

}  // namespace gsnav
