// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "gsnav/detail/scene/load_report.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"

namespace gsnav {

/// The highest SH band in which any Gaussian has a non-zero coefficient, 0 to sh_degree.
inline int sh_degree_in_use(const GaussianCloud& cloud) noexcept {
  const auto highest = [&](const auto& bands) {
    int found = 0;
    const std::size_t rest = 3 * static_cast<std::size_t>(sh_coefficient_count(cloud.sh_degree) - 1);
    for (std::size_t row = 0; row + rest <= bands.size() && rest != 0 && found < cloud.sh_degree;
         row += rest) {
      for (int degree = cloud.sh_degree; degree > found; --degree) {
        const auto first = bands.begin() + static_cast<std::ptrdiff_t>(row);
        const auto band = first + 3 * (sh_coefficient_count(degree - 1) - 1);
        const auto next = first + 3 * (sh_coefficient_count(degree) - 1);
        // In binary16, -0 (0x8000) counts as non-zero. That only overestimates the degree.
        if (std::any_of(band, next, [](auto v) { return v != 0; })) found = degree;
      }
    }
    return found;
  };
  return cloud.compact() ? highest(cloud.shN_half) : highest(cloud.shN);
}

/// A guess of the up axis, and how sure it is.
struct UpGuess {
  Vec3d up{};             ///< A unit axis of the asset's frame; zero for an empty cloud.
  bool seen = false;      ///< Whether the ground of the cloud decided it. false: `up` is the format's
                          ///< usual axis.
  double confidence = 0;  ///< Confidence if `seen`, 0 to 1: how far the axis is ahead of the other axes
                          ///< and of its opposite.
};

namespace detail {

/// The best candidate for the ground across one axis: the slab that is covered most by flat Gaussians
/// facing along the axis.
struct GroundSearch {
  double area = 0;   ///< Covered area of that slab, square metres.
  double share = 0;  ///< Share of the box's cross section that the slab covers.
  double side = 0;   ///< From 1, where everything else lies further along the axis than the slab, to -1,
                     ///< where it lies before it.
};

/// Searches the ground across one axis.
/// @param points sampled means.
/// @param facing unit normals of the flat ones; zero for others, which may face anywhere.
/// @param low,high box that holds most of the points.
inline GroundSearch search_ground(const std::vector<Vec3d>& points, const std::vector<Vec3d>& facing,
                                  const Vec3d& low, const Vec3d& high, int axis) {
  constexpr std::size_t kCells = 16;  // cells of a slab along each side
  constexpr double kAlong = 0.9;      // cosine of 26 degrees
  constexpr double kBeyond = 0.3;     // share of the box's height added on each side: ground may lie in
                                      // the outer tenth
  constexpr double kThick = 0.015;    // thickness as a share of the box's shorter side: ground is
                                      // neither thin nor level
  constexpr double kMostSlabs = 512, kLeastSlabs = 8;
  const int b = (axis + 1) % 3, c = (axis + 2) % 3;
  const double height = (1 + 2 * kBeyond) * (high[axis] - low[axis]),
               bottom = low[axis] - kBeyond * (high[axis] - low[axis]);
  const double shorter = std::min(high[b] - low[b], high[c] - low[c]);
  GroundSearch out;
  if (!(height > 0) || !(shorter > 0)) return out;
  const double wanted = std::clamp(height / (kThick * shorter), kLeastSlabs, kMostSlabs);
  const auto slabs = static_cast<std::size_t>(wanted);
  const double slab = height / static_cast<double>(slabs);
  std::vector<std::uint8_t> covered(slabs * kCells * kCells);
  std::vector<double> mass(slabs), upright(slabs);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vec3d& p = points[i];
    const auto cell = [&](int k) {
      // In a box of 1e20 m, a p just below `high` rounds to it.
      const double at_cell = kCells * (p[k] - low[k]) / (high[k] - low[k]);
      return std::min(static_cast<std::size_t>(at_cell), kCells - 1);
    };
    const double at = (p[axis] - bottom) / slab;
    if (p[b] < low[b] || p[b] >= high[b] || p[c] < low[c] || p[c] >= high[c] || !(at >= 0) ||
        !(at < static_cast<double>(slabs))) {
      continue;
    }
    const auto s = static_cast<std::size_t>(at);
    mass[s] += 1;
    const bool flat = facing[i] != Vec3d{}, along = std::fabs(facing[i][axis]) > kAlong;
    if (!flat || along) covered[(s * kCells + cell(b)) * kCells + cell(c)] = 1;
    if (!flat || !along) upright[s] += 1;
  }
  // Merge neighbouring slabs in pairs, so that a floor on a border is not cut in two.
  std::vector<double> share(slabs);
  for (std::size_t s = 0; s + 1 < slabs; ++s) {
    std::size_t cells = 0;
    for (std::size_t k = 0; k < kCells * kCells; ++k) {
      cells +=
          covered[s * kCells * kCells + k] != 0 || covered[(s + 1) * kCells * kCells + k] != 0 ? 1 : 0;
    }
    share[s] = static_cast<double>(cells) / (kCells * kCells);
  }
  const auto best =
      static_cast<std::size_t>(std::max_element(share.begin(), share.end()) - share.begin());
  out.share = share[best];
  out.area = share[best] * (high[b] - low[b]) * (high[c] - low[c]);
  std::size_t first = best, last = best;
  for (std::size_t s = 0; s < slabs; ++s) {
    if (share[s] < 0.6 * share[best]) continue;
    first = std::min(first, s);
    last = std::max(last, s);
  }
  double above = 0, below = 0;
  if (last > first + 5) {  // floor and ceiling: more things stand than hang
    const std::size_t third = (last - first) / 3;
    for (std::size_t s = first + 2; s <= first + third; ++s) above += upright[s];
    for (std::size_t s = last - third; s + 2 <= last; ++s) below += upright[s + 1];
  } else {  // ground alone: everything else is above it
    for (std::size_t s = 0; s < slabs; ++s) {
      if (s > last + 1) above += mass[s];
      if (s < first) below += mass[s];
    }
  }
  if (above + below > 0) out.side = (above - below) / (above + below);
  return out;
}

}  // namespace detail

/// Guesses the up axis from the ground: the largest surface across an axis, of Gaussians that face along
/// the axis. Up is the side of the ground with more Gaussians. If there are a floor and a ceiling, the
/// floor is the one with more Gaussians near it. Where that is undecided, up is +z or has the sign of
/// `usual`. Where there is no ground (an object), the result is `usual`.
///
/// The guess is one of +y, -y and +z, which are all that tools produce. It is for people to check and
/// for default cameras. It depends on the Gaussians only, not on the order of their rows.
inline UpGuess guess_up(const GaussianCloud& cloud, const Vec3d& usual = {0, -1, 0}) {
  constexpr std::size_t kSample = 1 << 14;
  constexpr double kOutliers = 0.1, kFlat = 0.5, kLeastAhead = 0.4, kLeastShare = 0.55, kDecided = 0.1;
  if (cloud.size() == 0) return {};
  // Sample by a hash of the position, so that any order of the rows gives the same sample.
  const std::size_t every = (cloud.size() + kSample - 1) / kSample;
  std::vector<Vec3d> points, facing;
  points.reserve(kSample + kSample / 8);
  facing.reserve(kSample + kSample / 8);
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    std::uint64_t bits = 0;
    for (const auto& plane : cloud.means)
      bits = (bits ^ std::bit_cast<std::uint32_t>(plane[i])) * 0x9e3779b97f4a7c15u;
    if ((bits >> 32) % every != 0) continue;
    points.push_back(cloud.mean(i));
    std::array<float, 3> scale{cloud.scales[0][i], cloud.scales[1][i], cloud.scales[2][i]};
    const int thin = static_cast<int>(std::min_element(scale.begin(), scale.end()) - scale.begin());
    std::nth_element(scale.begin(), scale.begin() + 1, scale.end());
    Vec3d axis{};
    axis[thin] = 1;
    facing.push_back(static_cast<double>(scale[0]) < kFlat * static_cast<double>(scale[1])
                         ? rotate(cloud.quat(i), axis)
                         : Vec3d{});
  }
  Vec3d low, high;
  std::vector<double> along(points.size());
  for (int k = 0; k < 3 && !points.empty(); ++k) {
    for (std::size_t i = 0; i < along.size(); ++i) along[i] = points[i][k];
    const auto at = [&](double share) {
      const auto place =
          along.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(along.size() - 1));
      std::nth_element(along.begin(), place, along.end());
      return *place;
    };
    low[k] = at(kOutliers);
    high[k] = at(1 - kOutliers);
  }
  std::array<detail::GroundSearch, 3> found;
  for (int k = 0; k < 3; ++k)
    found[static_cast<std::size_t>(k)] = detail::search_ground(points, facing, low, high, k);
  std::size_t axis = 0;
  for (std::size_t k = 1; k < 3; ++k) axis = found[k].area > found[axis].area ? k : axis;
  double second = 0;
  for (std::size_t k = 0; k < 3; ++k) second = k == axis ? second : std::max(second, found[k].area);
  const detail::GroundSearch& ground = found[axis];
  const double ahead = ground.area > 0 ? 1 - second / ground.area : 0;
  if (axis == 0 || ahead < kLeastAhead || ground.share < kLeastShare) return {usual, false, 0};
  const bool decided = std::fabs(ground.side) >= kDecided;
  const double before = usual[static_cast<int>(axis)];
  Vec3d up{};
  up[static_cast<int>(axis)] = decided ? std::copysign(1.0, ground.side) : before < 0 ? -1 : 1;
  if (up.z < 0) return {usual, false, 0};  // No tool writes scenes with -z up.
  const double confidence = std::min(ahead, decided ? std::fabs(ground.side) : kDecided);
  return {up, true, confidence};
}

/// Fills in the fields of a report that describe the cloud as a whole: SH bands in use, filter, order,
/// memory, up axis.
inline void describe(const GaussianCloud& cloud, LoadReport& report,
                     const Vec3d& usual_up = {0, -1, 0}) {
  report.sh_degree_used = sh_degree_in_use(cloud);
  report.filter = cloud.filter;
  report.eps2d = cloud.eps2d;
  report.sort_order = cloud.sort_order;
  report.memory = cloud.bytes();
  report.compact = cloud.compact();
  const UpGuess guess = guess_up(cloud, usual_up);
  report.up = guess.up;
  report.up_seen = guess.seen;
  report.up_confidence = guess.confidence;
}

}  // namespace gsnav
