// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "gsnav/core/status.hpp"
#include "gsnav/detail/scene/drop_bands.hpp"
#include "gsnav/detail/scene/sh_rotation.hpp"
#include "gsnav/detail/scene/spatial_order.hpp"
#include "gsnav/math/aabb.hpp"
#include "gsnav/math/similarity.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"
#include "gsnav/skin/lbs.hpp"

namespace gsnav {

/// Returns true if all means and scales of a cloud are finite. transform() may exceed the range of
/// float32.
inline bool is_finite(const GaussianCloud& cloud) {
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    bool finite = is_finite(vec_cast<float>(cloud.mean(i)));
    for (const auto& axis : cloud.scales) finite = finite && std::isfinite(axis[i]);
    if (!finite) return false;
  }
  return true;
}

namespace detail {
/// Replaces the mean of each row i by f(i).
template <class F>
void replace_means(GaussianCloud& cloud, const F& f) {
  GaussianCloud moved;
  MeanWriter writer;
  for (auto& plane : moved.means) plane.reserve(cloud.size());
  for (std::size_t i = 0; i < cloud.size(); ++i) writer.push(moved, f(i));
  cloud.means = std::move(moved.means);
  cloud.origin_ids = std::move(moved.origin_ids);
  cloud.origins = std::move(moved.origins);
}
}  // namespace detail

/// Moves, rotates and scales a cloud as a rigid body, with its SH bands. Chunk bounds are dropped, so
/// sort again. `by.rotation` must be a unit quaternion and `by.scale` positive. The bands of a compact
/// cloud are rounded once more.
inline void transform(GaussianCloud& cloud, const Similarity& by) {
  const bool compact = cloud.compact();
  expand_sh(cloud);
  detail::replace_means(cloud, [&](std::size_t i) { return by * cloud.mean(i); });
  cloud.chunk_bounds.clear();
  cloud.part_bounds.clear();
  const ShRotation bands(by.rotation);
  const std::size_t rest = cloud.size() == 0 ? 0 : cloud.shN.size() / cloud.size();
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    Quatd q = by.rotation * cloud.quat(i);
    normalize(q);
    cloud.set_quat(i, q);
    for (auto& plane : cloud.scales)
      plane[i] = static_cast<float>(static_cast<double>(plane[i]) * by.scale);
    if (rest != 0) bands.apply(cloud.sh_degree, cloud.shN.data() + i * rest);
  }
  if (compact) compact_sh(cloud);
}

namespace detail {

/// Rotates the columns of `a` until they are orthogonal (one-sided Jacobi): a = rotation * diag(lengths)
/// * v for some rotation v. Flat and needle-like shapes keep their small lengths, which a decomposition
/// of squares would lose.
inline void orthogonal_columns(Mat3d& a, Mat3d& rotation, Vec3d& lengths) {
  const auto column = [&a](int k) { return Vec3d{a(0, k), a(1, k), a(2, k)}; };
  for (int sweep = 0; sweep < 16; ++sweep) {
    bool turned = false;
    for (int p = 0; p < 2; ++p) {
      for (int q = p + 1; q < 3; ++q) {
        const Vec3d u = column(p), v = column(q);
        const double uu = dot(u, u), vv = dot(v, v), uv = dot(u, v);
        if (!(std::fabs(uv) > 1e-15 * std::sqrt(uu) * std::sqrt(vv))) continue;
        turned = true;
        const double zeta = (vv - uu) / (2 * uv);
        const double t = std::copysign(1.0, zeta) / (std::fabs(zeta) + std::hypot(1.0, zeta));
        const double c = 1 / std::hypot(1.0, t), s = c * t;
        for (int i = 0; i < 3; ++i) {
          a(i, p) = c * u[i] - s * v[i];
          a(i, q) = s * u[i] + c * v[i];
        }
      }
    }
    if (!turned) break;
  }
  int longest = 0, shortest = 0;
  for (int k = 0; k < 3; ++k) {
    lengths[k] = norm(column(k));
    if (lengths[k] > lengths[longest]) longest = k;
    if (lengths[k] <= lengths[shortest]) shortest = k;
  }
  if (!(lengths[longest] > 0) || longest == shortest) {
    rotation = Mat3d::identity();  // A point has no axes. (Three equal lengths above 0 do not come here:
                                   // the last counts as shortest.)
    return;
  }
  const int middle = 3 - longest - shortest;
  Vec3d axes[3];
  axes[longest] = column(longest) * (1 / lengths[longest]);
  // A length of 0 has no direction of its own: take any orthogonal one.
  Vec3d second = column(middle);
  if (!(lengths[middle] > 1e-12 * lengths[longest])) {
    int least = 0;
    for (int k = 1; k < 3; ++k) {
      if (std::fabs(axes[longest][k]) < std::fabs(axes[longest][least])) least = k;
    }
    second = {};
    second[least] = 1;
  }
  second = second - axes[longest] * dot(second, axes[longest]);
  axes[middle] = second * (1 / norm(second));
  const Vec3d third = cross(axes[longest], axes[middle]);
  // whether the columns' order is even, so that the determinant is 1
  const bool even = (middle - longest + 3) % 3 == 1;
  axes[shortest] = even ? third : -third;
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) rotation(i, k) = axes[k][i];
  }
}

}  // namespace detail

/// Moves a cloud by an invertible affine map, M and a translation: uneven scales, shears and mirrors. A
/// covariance C becomes M C M^T, which is split into a rotation and scales again. Colours turn with the
/// orthogonal factor Q of M = Q P (P symmetric and positive definite): the colour seen from direction d
/// is then seen from Q d. A direction that is only stretched keeps its colours. Where M mirrors, so does
/// Q: SH bands of odd degree change sign and then turn by the rotation -Q.
///
/// Chunk bounds are dropped, so sort again. Error: invalid_argument where M is not finite or too flat
/// (smallest stretch at most 1e-6 of the largest); the cloud is then unchanged.
inline Status transform(GaussianCloud& cloud, const Affine3<double>& by) {
  const Mat3d& m = by.linear;
  Mat3d columns = m, axes;
  Vec3d stretches{};
  bool finite = is_finite(by.translation);
  for (int i = 0; i < 3; ++i) finite = finite && is_finite(m.row[i]);
  if (finite) detail::orthogonal_columns(columns, axes, stretches);
  const double greatest = max(stretches.x, max(stretches.y, stretches.z)),
               least = min(stretches.x, min(stretches.y, stretches.z));
  if (!finite || !(least > 1e-6 * greatest)) {
    return {Errc::invalid_argument, "transform: the matrix is flat or not finite (it stretches by " +
                                        std::to_string(least) + " to " + std::to_string(greatest) + ")"};
  }
  const double sign = determinant(m) < 0 ? -1 : 1;
  const Mat3d turn = polar_rotation(m * (sign / std::cbrt(std::fabs(determinant(m))))),
              stretch = transpose(turn) * m * sign;
  const bool compact = cloud.compact();
  expand_sh(cloud);
  detail::replace_means(cloud, [&](std::size_t i) { return (stretch * cloud.mean(i)) * sign; });
  const std::size_t rest = cloud.size() == 0 ? 0 : cloud.shN.size() / cloud.size();
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    Mat3d shape = stretch * rotation_matrix(cloud.quat(i)), rotation;
    for (int k = 0; k < 3; ++k) {
      for (int j = 0; j < 3; ++j)
        shape(j, k) *= static_cast<double>(cloud.scales[static_cast<std::size_t>(k)][i]);
    }
    Vec3d scales{};
    detail::orthogonal_columns(shape, rotation, scales);
    Quatd q = quat_from_matrix(rotation);
    normalize(q);
    cloud.set_quat(i, q);
    for (int k = 0; k < 3; ++k)
      cloud.scales[static_cast<std::size_t>(k)][i] = static_cast<float>(scales[k]);
    // In shN, coefficients 0 to 2 are degree 1 and 8 to 14 degree 3.
    for (std::size_t k = 0; sign < 0 && k < rest / 3; ++k) {
      if (k >= 3 && k < 8) continue;
      for (std::size_t c = 0; c < 3; ++c) cloud.shN[i * rest + 3 * k + c] *= -1.0f;
    }
  }
  Quatd rotation = quat_from_matrix(turn);
  normalize(rotation);
  transform(cloud, Similarity{rotation, by.translation, 1});
  if (compact) compact_sh(cloud);
  return {};
}

/// Keeps the rows for which `keep(i)` is true, in their order. `row_ids` is renumbered from 0 in the
/// order in which the kept rows were read. Chunk bounds are dropped; sort_spatially makes new ones.
template <class Keep>
void filter_rows(GaussianCloud& cloud, const Keep& keep) {
  std::vector<std::uint32_t> rows;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (keep(i)) rows.push_back(static_cast<std::uint32_t>(i));
  }
  const auto pick = [&rows](auto& plane, std::size_t stride) {
    if (plane.empty()) return;
    // rows[to] >= to, so no row is overwritten before it is read
    for (std::size_t to = 0; to < rows.size(); ++to) {
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
  if (!cloud.row_ids.empty()) {  // renumber to places among the rows that are left
    const std::vector<std::uint32_t> order = rows_as_read(cloud);
    for (std::size_t i = 0; i < order.size(); ++i)
      cloud.row_ids[order[i]] = static_cast<std::uint32_t>(i);
  }
  cloud.chunk_bounds.clear();
  cloud.part_bounds.clear();
}

/// Keeps the Gaussians whose means lie in the box, borders included.
inline void crop(GaussianCloud& cloud, const Aabb<double>& box) {
  filter_rows(cloud, [&](std::size_t i) {
    const Vec3d m = cloud.mean(i);
    bool inside = true;
    for (int k = 0; k < 3; ++k) inside = inside && m[k] >= box.low[k] && m[k] <= box.high[k];
    return inside;
  });
}

}  // namespace gsnav
