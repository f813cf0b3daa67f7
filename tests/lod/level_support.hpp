// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "gsnav/backends/serial.hpp"
#include "gsnav/detail/scene/edit_cloud.hpp"
#include "gsnav/detail/scene/lod_build.hpp"
#include "gsnav/detail/scene/lod_levels.hpp"
#include "gsnav/math/aabb.hpp"
#include "lod/lod_support.hpp"

namespace gsnav_test {

/// Levels of a cloud as a set ships them: boxes x boxes over its two longest sides, each halved
/// `coarser` times by a tree of its own. Rows of the coarser levels come box after box.
inline std::vector<gsnav::LodLevel> shipped_levels(const gsnav::GaussianCloud& wall, std::size_t coarser,
                                                   std::size_t boxes = 4) {
  using namespace gsnav;
  Aabb<double> all;
  for (std::size_t i = 0; i < wall.size(); ++i) all.add(wall.mean(i));
  const Vec3d size = all.high - all.low;
  const int shortest = size.x < size.y && size.x < size.z ? 0 : size.y < size.z ? 1 : 2;
  const auto box_of = [&](const Vec3d& p) {
    std::uint32_t box = 0;
    for (int k = 0; k < 3; ++k) {
      if (k == shortest) continue;
      const double most = static_cast<double>(boxes) - 1;
      const double along = clamp((p[k] - all.low[k]) / size[k] * static_cast<double>(boxes), 0.0, most);
      box = box * static_cast<std::uint32_t>(boxes) + static_cast<std::uint32_t>(along);
    }
    return box;
  };
  std::vector<LodLevel> levels(coarser + 1);
  levels[0].cloud = wall;
  levels[0].cloud.row_ids.clear();
  levels[0].cloud.chunk_bounds.clear();
  levels[0].cloud.part_bounds.clear();
  for (std::size_t i = 0; i < wall.size(); ++i) levels[0].boxes.push_back(box_of(wall.mean(i)));
  SerialBackend backend;
  for (std::uint32_t b = 0; b < boxes * boxes; ++b) {
    GaussianCloud own = levels[0].cloud;
    filter_rows(own, [&](std::size_t i) { return levels[0].boxes[i] == b; });
    sort_spatially(own);
    const LodTree tree = build_lod(backend, own).value();
    for (std::size_t l = 1; l <= coarser && l < tree.levels(); ++l) {
      GaussianCloud rows = tree.merged;
      const std::size_t first = (tree.level_begin[l] - tree.leaves()) * kProjectChunk;
      const std::size_t end = (tree.level_begin[l + 1] - tree.leaves()) * kProjectChunk;
      filter_rows(rows, [&](std::size_t i) { return i >= first && i < end && rows.opacities[i] > 0; });
      append(levels[l].cloud, rows).throw_if_error();
      levels[l].boxes.resize(levels[l].cloud.size(), b);
    }
  }
  for (LodLevel& level : levels) {
    level.cloud.chunk_bounds.clear();
    level.cloud.part_bounds.clear();
  }
  return levels;
}

}  // namespace gsnav_test
