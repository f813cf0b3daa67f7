// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "gsnav/core/backend.hpp"
#include "gsnav/core/status.hpp"
#include "gsnav/detail/core/pool_backend.hpp"
#include "gsnav/detail/scene/seen_cells.hpp"
#include "gsnav/detail/scene/seen_on_device.hpp"
#include "gsnav/detail/scene/seen_viewpoints.hpp"
#include "gsnav/detail/scene/view_cells.hpp"
#include "gsnav/detail/scene/visible_settings.hpp"
#include "gsnav/image/camera.hpp"
#include "gsnav/math/similarity.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"

namespace gsnav {

namespace detail {

/// Sets out.keys to the cells within 5 cm (world) of a viewpoint. Their size, out.cell, must be set.
/// Returns the viewpoints in the asset's frame. Error: invalid_argument for a viewpoint that is not
/// finite or too far away.
inline Result<std::vector<Vec3d>> find_cells(VisibleSets& out, std::span<const Vec3d> viewpoints,
                                             const Similarity& world_from_asset) {
  constexpr double kBeside = 0.05;  // metres
  std::vector<Vec3d> eyes;
  for (std::size_t v = 0; v < viewpoints.size(); ++v) {
    eyes.push_back(inverse(world_from_asset) * viewpoints[v]);
    const auto key = VisibleSets::key_of(eyes.back(), out.cell);
    if (!key) {
      return Status(Errc::invalid_argument,
                    "build_visible_sets: viewpoint " + std::to_string(v) + " is not finite or too far");
    }
    // Rounding, or a step in the floor, must not move a camera at a viewpoint's position into a cell
    // without a set.
    for (int corner = 0; corner < 8; ++corner) {
      Vec3d beside = eyes.back();
      for (int k = 0; k < 3; ++k)
        beside[k] += ((corner >> k & 1) != 0 ? 1 : -1) * kBeside / world_from_asset.scale;
      out.keys.push_back(VisibleSets::key_of(beside, out.cell).value_or(*key));
    }
  }
  std::sort(out.keys.begin(), out.keys.end());
  out.keys.erase(std::unique(out.keys.begin(), out.keys.end()), out.keys.end());
  return eyes;
}

/// Adds all rows of the chunks within `distance` of each cell. A camera in the cell may be in front of
/// such a chunk where no viewpoint is.
template <Backend B>
void add_near_chunks(B& backend, const VisibleSets& sets, const GaussianCloud& cloud, double distance,
                     std::vector<SeenOfCell>& found) {
  backend.parallel_for(sets.cells(), [&](std::size_t c) {
    const CellCube cube(sets.keys[c], sets.cell);
    for (std::size_t i = 0; i < sets.cloud_chunks; ++i) {
      const ChunkBounds& b = cloud.chunk_bounds[i];
      if (cube.distance(b.low, b.high) <= distance) found[c].add(i, all_rows(cloud.size(), i));
    }
  });
}

/// build_visible_sets with the object that make_seen() returns. It has the members `at_once`, `look` and
/// `rows` of SeenFromViewpoints, and is made once the arguments have been checked.
/// @param backend runs the rest of the work, on the host.
template <Backend B, class MakeSeen>
requires is_host_backend<B> Result<VisibleSets> collect_visible_sets(
    B& backend, const GaussianCloud& cloud, std::span<const Vec3d> viewpoints,
    const VisibleSettings& settings, const Similarity& world_from_asset, const MakeSeen& make_seen) {
  if (Status s = validate(settings); !s) return s;
  if (viewpoints.empty()) return Status(Errc::invalid_argument, "build_visible_sets: no viewpoint");
  if (cloud.chunk_bounds.size() != cloud.view().chunk_count()) {
    return Status(Errc::invalid_argument,
                  "build_visible_sets: the cloud's rows are not in spatial order: sort_spatially first");
  }
  VisibleSets out;
  out.cell = settings.cell / world_from_asset.scale;
  out.focal = 0.5 * settings.face;
  out.near_plane = settings.near_plane;
  out.near_sigma = settings.near_sigma;
  out.min_weight = settings.min_weight;
  out.cloud_chunks = cloud.view().chunk_count();
  out.viewpoints = viewpoints.size();
  const auto eyes = find_cells(out, viewpoints, world_from_asset);
  if (!eyes) return eyes.status();

  std::vector<SeenOfCell> found(out.cells(), SeenOfCell(out.cloud_chunks));
  add_near_chunks(backend, out, cloud, settings.near_plane / world_from_asset.scale, found);
  const double margin = settings.margin / world_from_asset.scale;
  const auto counts_for = [&](std::size_t cell, std::size_t v) {
    const Vec3d& eye = (*eyes)[v];
    return CellCube(out.keys[cell], out.cell).distance(eye, eye) <= margin;
  };
  const bool with_sample = settings.most_share < 1 && out.cells() >= kLeastSampled;
  const auto [sample, order, sampled] =
      order_viewpoints(out.cells(), viewpoints.size(), with_sample, counts_for);

  auto seen = make_seen();
  for (std::size_t done = 0; done < order.size();) {
    if (done == sampled && !sample.empty()) {
      const double share = sampled_share(found, sample, cloud.size());
      if (share > settings.most_share) {
        out.keys.clear();
        out.refused_share = share;
        return out;
      }
    }
    const std::size_t end = done < sampled ? sampled : order.size();
    const auto which = std::span(order).subspan(done, std::min(seen.at_once(), end - done));
    if (Status s = seen.look(which); !s) return s;
    backend.parallel_for(out.cells(), [&](std::size_t c) {
      for (std::size_t k = 0; k < which.size(); ++k) {
        if (counts_for(c, which[k])) found[c].add(seen.rows(k));
      }
    });
    for (std::size_t k = 0; k < which.size(); ++k) {
      ++done;
      if (settings.progress)
        settings.progress(static_cast<double>(done) / static_cast<double>(order.size()));
    }
  }
  for (SeenOfCell& of_cell : found) {
    of_cell.append_to(out.bits, settings.rows != 0);
    out.ends.push_back(out.bits.size());
    of_cell = SeenOfCell(0);
  }
  return out;
}

}  // namespace detail

/// Finds the chunks and rows of a cloud that are seen from each cell. The cells are those with a
/// viewpoint in them or within 5 cm. Each viewpoint costs six square frames, settings.face pixels wide.
/// The result has the same bits for any number of threads, and on a GPU.
/// @param backend a host backend or CudaBackend.
/// @param cloud a sorted cloud (sort_spatially) in host memory.
/// @param viewpoints world frame, metres; navmesh_viewpoints makes them.
/// @param world_from_asset placement of the cloud in the world.
/// @return the sets, without cells if they would gain nothing (VisibleSets::refused_share); or one of
///   these errors:
/// - invalid_argument: a setting out of range, no viewpoint, a viewpoint that is not finite, or a cloud
///   that is not sorted.
/// - those of rendering.
/// settings.progress may throw; its exceptions are passed on.
template <Backend B>
requires is_host_backend<B> || detail::WeighsBatches<B> Result<VisibleSets> build_visible_sets(
    B& backend, const GaussianCloud& cloud, std::span<const Vec3d> viewpoints,
    const VisibleSettings& settings = {}, const Similarity& world_from_asset = {}) {
  if constexpr (is_host_backend<B>) {
    return detail::collect_visible_sets(backend, cloud, viewpoints, settings, world_from_asset, [&] {
      return detail::SeenFromViewpoints<B>(backend, cloud.set(world_from_asset), viewpoints, settings);
    });
  } else {
    PoolBackend host;
    return detail::collect_visible_sets(host, cloud, viewpoints, settings, world_from_asset, [&] {
      return detail::SeenOnDevice<B>(backend, host, cloud, world_from_asset, viewpoints, settings);
    });
  }
}

}  // namespace gsnav
