// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "gsnav/math/aabb.hpp"
#include "gsnav/math/similarity.hpp"
#include "gsnav/scene/drop_bands.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"
#include "gsnav/scene/sh_rotation.hpp"
#include "gsnav/scene/spatial_order.hpp"

namespace gsnav {

/// Moves, turns and scales a cloud as a solid body, SH bands included. Chunk bounds are dropped: sort
/// again. `by.rotation` must be a unit quaternion and `by.scale` positive. A compact cloud's bands are rounded again.
inline void transform(GaussianCloud& cloud, const Similarity& by) {
  const bool compact = !cloud.shN_half.empty();
  expand_sh(cloud);
  GaussianCloud moved;
  MeanWriter writer;
  for (auto& plane : moved.means) plane.reserve(cloud.size());
  for (std::size_t i = 0; i < cloud.size(); ++i) writer.push(moved, by * cloud.mean(i));
  cloud.means = std::move(moved.means);
  cloud.origin_ids = std::move(moved.origin_ids);
  cloud.origins = std::move(moved.origins);
  cloud.chunk_bounds.clear();
  cloud.part_bounds.clear();
  const ShRotation bands(by.rotation);
  const std::size_t rest = cloud.size() == 0 ? 0 : cloud.shN.size() / cloud.size();
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const auto part = [&](std::size_t k) { return static_cast<double>(cloud.quats[k][i]); };
    Quatd q = by.rotation * Quatd{part(0), part(1), part(2), part(3)};
    normalize(q);
    const double parts[] = {q.w, q.x, q.y, q.z};
    for (std::size_t k = 0; k < 4; ++k) cloud.quats[k][i] = static_cast<float>(parts[k]);
    for (auto& plane : cloud.scales)
      plane[i] = static_cast<float>(static_cast<double>(plane[i]) * by.scale);
    if (rest != 0) bands.apply(cloud.sh_degree, cloud.shN.data() + i * rest);
  }
  if (compact) compact_sh(cloud);
}

/// Keeps the rows for which `keep(i)` holds, in their order and with the order in which they were read.
/// Chunk bounds are dropped: sort again.
template <class Keep>
void filter_rows(GaussianCloud& cloud, const Keep& keep) {
  std::vector<std::uint32_t> rows;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (keep(i)) rows.push_back(static_cast<std::uint32_t>(i));
  }
  const auto pick = [&rows](auto& plane, std::size_t stride) {
    if (plane.empty()) return;
    for (std::size_t to = 0; to < rows.size(); ++to) {  // rows[to] >= to: nothing is overwritten early
      for (std::size_t k = 0; k < stride; ++k) plane[to * stride + k] = plane[rows[to] * stride + k];
    }
    plane.resize(rows.size() * stride);
  };
  const std::size_t rest = 3 * static_cast<std::size_t>(sh_coefficient_count(cloud.sh_degree) - 1);
  for (auto& plane : cloud.means) pick(plane, 1);
  for (auto& plane : cloud.quats) pick(plane, 1);
  for (auto& plane : cloud.scales) pick(plane, 1);
  pick(cloud.opacities, 1);
  pick(cloud.sh0, 3);
  pick(cloud.shN, rest);
  pick(cloud.shN_half, rest);
  pick(cloud.origin_ids, 1);
  pick(cloud.row_ids, 1);
  if (!cloud.row_ids.empty()) {  // places among those that are left
    const std::vector<std::uint32_t> order = rows_as_read(cloud);
    for (std::size_t i = 0; i < order.size(); ++i)
      cloud.row_ids[order[i]] = static_cast<std::uint32_t>(i);
  }
  cloud.chunk_bounds.clear();
  cloud.part_bounds.clear();
}

/// Keeps the Gaussians whose means lie in the box, bounds included.
inline void crop(GaussianCloud& cloud, const Aabb<double>& box) {
  filter_rows(cloud, [&](std::size_t i) {
    const Vec3d m = cloud.mean(i);
    bool inside = true;
    for (int k = 0; k < 3; ++k) inside = inside && m[k] >= box.low[k] && m[k] <= box.high[k];
    return inside;
  });
}

}  // namespace gsnav
