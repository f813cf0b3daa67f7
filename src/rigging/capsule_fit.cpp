// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/rigging/capsule_fit.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "gsnav/detail/core/field_check.hpp"
#include "gsnav/detail/rigging/capsule_volume.hpp"
#include "gsnav/detail/rigging/proxy_fit.hpp"
#include "gsnav/math/capsule.hpp"
#include "gsnav/sweep/capsule.hpp"

namespace gsnav {

namespace {

double value_at(std::vector<double>& v, double share) {
  const auto at =
      v.begin() + static_cast<std::ptrdiff_t>(std::ceil(share * static_cast<double>(v.size() - 1)));
  std::nth_element(v.begin(), at, v.end());
  return *at;
}

/// Axis of the greatest spread of the points about their mean (power iteration on the covariance).
Vec3d main_axis(const std::vector<Vec3d>& points, const Vec3d& mean) {
  Mat3d c;
  for (const Vec3d& p : points) {
    const Vec3d d = p - mean;
    for (int i = 0; i < 3; ++i) c.row[i] += d * d[i];
  }
  Vec3d v{0.62, 0.55, 0.56};
  for (int k = 0; k < 100; ++k) {
    const Vec3d next = c * v;
    const double n = norm(next);
    if (!(n > 0)) break;
    v = next * (1.0 / n);
  }
  return normalized(v);
}

/// The capsule with direction `axis` and least volume that contains `share` of the points.
Capsule<double> capsule_about(const std::vector<Vec3d>& points, const Vec3d& axis, double share) {
  const Vec3d u = detail::any_perpendicular(axis), v = cross(axis, u);
  std::vector<double> a, b, t;
  for (const Vec3d& p : points) {
    a.push_back(dot(p, u));
    b.push_back(dot(p, v));
    t.push_back(dot(p, axis));
  }
  const auto middle = [&](std::vector<double> x) {
    return 0.5 * (value_at(x, 1 - share) + value_at(x, share));
  };
  const double a0 = middle(a), b0 = middle(b), t0 = middle(t);
  std::vector<double> across(points.size()), reach(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) across[i] = std::hypot(a[i] - a0, b[i] - b0);
  Capsule<double> best;
  double least = std::numeric_limits<double>::max();
  std::vector<double> sorted = across;
  const double tight = value_at(sorted, share);
  for (double grow = 1.0; grow < 1.6; grow += 0.1) {
    const double r = tight * grow;
    for (std::size_t i = 0; i < points.size(); ++i) {
      reach[i] = abs(t[i] - t0) - std::sqrt(max(0.0, r * r - across[i] * across[i]));
      // No length is enough for a point that is further from the axis than the radius.
      if (across[i] > r) reach[i] = std::numeric_limits<double>::max();
    }
    sorted = reach;
    const double half = value_at(sorted, share);
    if (half == std::numeric_limits<double>::max()) continue;
    const double length = max(0.0, half), volume = r * r * (2 * length + 4.0 / 3 * r);
    if (volume < least) {
      least = volume;
      const Vec3d center = u * a0 + v * b0 + axis * t0;
      best = {center - axis * length, center + axis * length,
              r * (1 + 1e-9)};  // include points that touch it
    }
  }
  return best;
}

double capsule_volume(const Capsule<double>& c) noexcept {
  return std::numbers::pi * c.radius * c.radius * (norm(c.p1 - c.p0) + 4.0 / 3 * c.radius);
}

/// Appends one capsule that contains `share` of the points. If that takes a quarter less volume, splits
/// the points at their middle and appends the capsules of both halves: a trunk is wide, and a belt of
/// points is hollow.
double capsules_of(const std::vector<Vec3d>& points, double share, int splits, std::size_t least,
                   std::vector<Capsule<double>>& out) {
  Vec3d mean{};
  for (const Vec3d& p : points) mean += p * (1.0 / static_cast<double>(points.size()));
  const Vec3d first = main_axis(points, mean);
  std::vector<Vec3d> flat;
  for (const Vec3d& p : points) flat.push_back(p - first * dot(p - mean, first));
  const Vec3d second = main_axis(flat, mean);
  const Vec3d axes[3] = {first, second, cross(first, second)};
  Capsule<double> best;
  double volume = std::numeric_limits<double>::max();
  for (const Vec3d& axis : axes) {
    const Capsule<double> c = capsule_about(points, axis, share);
    if (capsule_volume(c) < volume) volume = capsule_volume(c), best = c;
  }
  std::vector<Capsule<double>> chosen{best};
  for (int k = 0; splits > 0 && k < 2; ++k) {
    std::vector<Vec3d> half[2];
    for (const Vec3d& p : points) half[dot(p - mean, axes[k]) > 0 ? 1 : 0].push_back(p);
    if (half[0].size() < least || half[1].size() < least) continue;
    std::vector<Capsule<double>> both;
    const double sum = capsules_of(half[0], share, splits - 1, least, both) +
                       capsules_of(half[1], share, splits - 1, least, both);
    if (sum < 0.75 * volume) volume = sum, chosen = both;
  }
  out.insert(out.end(), chosen.begin(), chosen.end());
  return volume;
}

/// Distance of p from the nearest capsule's surface, negative inside.
double capsules_distance(const std::vector<Capsule<double>>& capsules, const Vec3d& p) noexcept {
  double best = std::numeric_limits<double>::max();
  for (const Capsule<double>& c : capsules) best = min(best, capsule_distance(c, p));
  return best;
}

/// Joint whose capsules cover the Gaussians of each joint: itself, or the nearest ancestor whose
/// Gaussians extend over at least `shortest` or that has no parent.
std::vector<std::size_t> capsule_owners(const AvatarAsset& asset, const CapsuleFitOptions& options) {
  const std::size_t joints = asset.skeleton.size(), row = static_cast<std::size_t>(asset.influences);
  std::vector<Vec3d> low(joints, Vec3d{1e9, 1e9, 1e9}), high(joints, Vec3d{-1e9, -1e9, -1e9});
  std::vector<std::size_t> count(joints, 0), owner(joints);
  for (std::size_t i = 0; i < asset.size(); ++i) {
    const std::size_t j = asset.joint_indices[i * row];
    const Vec3d p = asset.cloud.mean(i);
    for (int k = 0; k < 3; ++k) low[j][k] = min(low[j][k], p[k]), high[j][k] = max(high[j][k], p[k]);
    ++count[j];
  }
  for (std::size_t j = 0; j < joints; ++j) {
    const bool small = count[j] < options.least || norm(high[j] - low[j]) < options.shortest;
    const std::int32_t parent = asset.skeleton.parents[j];
    owner[j] = small && parent >= 0 ? owner[static_cast<std::size_t>(parent)] : j;
  }
  return owner;
}

}  // namespace

std::vector<ProxyCapsule> habitat_capsules(const Skeleton& skeleton) {
  std::vector<ProxyCapsule> out;
  const auto rest = skeleton.rest_globals();
  for (std::size_t j = 0; j < skeleton.size(); ++j) {
    if (skeleton.parents[j] < 0) continue;
    const auto parent = static_cast<std::size_t>(skeleton.parents[j]);
    const Vec3d tip = rigid_inverse(rest[parent]) * rest[j].translation;
    const double length = norm(tip);
    if (length < 1e-6) continue;
    const double radius = min(max(0.1 * length, 0.01), 0.5 * length),
                 half = 0.5 * max(length - 2 * radius, 0.001);
    const Vec3d d = tip * (1.0 / length);
    out.push_back(
        {static_cast<std::uint16_t>(parent), tip * 0.5 - d * half, tip * 0.5 + d * half, radius});
  }
  return out;
}

CapsuleReport measure_capsules(const AvatarAsset& asset, const std::vector<ProxyCapsule>& capsules,
                               const std::vector<std::vector<Affine3<double>>>& poses, bool volumes) {
  CapsuleReport report{.capsules = capsules.size(), .poses = poses.size()};
  std::vector<double> over;
  for (const auto& pose : poses) {
    const std::vector<Vec3d> centers = skinned_centers(asset, pose);
    std::vector<Capsule<double>> placed;
    for (const ProxyCapsule& c : capsules)
      placed.push_back({pose[c.joint] * c.p0, pose[c.joint] * c.p1, c.radius});
    std::size_t inside = 0;
    for (const Vec3d& p : centers) {
      const double d = capsules_distance(placed, p);
      inside += d <= 0 ? 1 : 0;
      report.outside_greatest = max(report.outside_greatest, d);
    }
    const double share =
        static_cast<double>(inside) / static_cast<double>(max<std::size_t>(1, centers.size()));
    report.contained_least = min(report.contained_least, share);
    if (volumes) {
      const CapsuleVolume volume = measure_capsule_volume(centers, placed);
      const double part = 1.0 / static_cast<double>(poses.size()), body = max(volume.body, 1e-30);
      report.body_volume += volume.body * part;
      report.uncovered_mean += volume.uncovered / body * part;
      report.uncovered_greatest = max(report.uncovered_greatest, volume.uncovered / body);
      report.over_volume += volume.over / body * part;
    }
    if (&pose != &poses.front()) continue;
    // Over-cover, in the first pose: distance from points on each capsule that no other covers to the
    // nearest centre.
    for (const Capsule<double>& c : placed) {
      const Vec3d axis = norm(c.p1 - c.p0) > 0 ? normalized(c.p1 - c.p0) : Vec3d{0, 1, 0};
      const Vec3d u = detail::any_perpendicular(axis), v = cross(axis, u);
      for (int k = 0; k < 96; ++k) {
        const double angle = 2.399963229728653 * k,
                     z = -1 + (2.0 * k + 1) / 96;  // a spiral of even steps
        const double q = std::sqrt(1 - z * z);
        const Vec3d end = z > 0 ? c.p1 : c.p0,
                    d = u * (q * std::cos(angle)) + v * (q * std::sin(angle)) + axis * z;
        // Half of the points lie on the straight part.
        const Vec3d p = k % 2 == 0 ? end + d * c.radius
                                   : c.p0 + (c.p1 - c.p0) * (0.5 * (z + 1)) +
                                         (u * std::cos(angle) + v * std::sin(angle)) * c.radius;
        if (capsules_distance(placed, p) < -1e-9) continue;
        double nearest = std::numeric_limits<double>::max();
        for (const Vec3d& center : centers) nearest = min(nearest, dot(center - p, center - p));
        over.push_back(std::sqrt(nearest));
      }
    }
  }
  if (!over.empty()) {
    for (const double d : over) report.over_mean += d / static_cast<double>(over.size());
    report.over_p99 = value_at(over, 0.99);
  }
  return report;
}

Result<CapsuleReport> fit_body_capsules(AvatarAsset& asset,
                                        const std::vector<std::vector<Affine3<double>>>& poses,
                                        const CapsuleFitOptions& options) {
  const BadArgument bad{"fit_body_capsules: "};
  if (Status s = asset.validate(); !s) return s;
  if (poses.empty() || asset.size() == 0) return bad("no poses or no Gaussians");
  for (const auto& pose : poses) {
    if (pose.size() != asset.skeleton.size()) {
      return bad("a pose of " + std::to_string(pose.size()) + " joints for " +
                 std::to_string(asset.skeleton.size()));
    }
  }
  detail::FieldCheck check("fit_body_capsules: ");
  const double p = options.percentile;
  check.need(p > 0.5 && p <= 1, "percentile", p, "must be in (0.5, 1]");
  check.in("contained", options.contained, 0, 1);
  check.need(options.shortest >= 0, "shortest", options.shortest, "must be >= 0");
  if (!check.status()) return check.status();

  const std::size_t row = static_cast<std::size_t>(asset.influences);
  const std::vector<std::size_t> owner = capsule_owners(asset, options);
  std::vector<std::vector<Vec3d>> local(asset.skeleton.size());
  // A percentile does not need all centres: use each Gaussian in some of the poses only.
  const std::size_t stride = max<std::size_t>(1, asset.size() * poses.size() / 2000000);
  for (std::size_t s = 0; s < poses.size(); ++s) {
    const std::vector<Vec3d> centers = skinned_centers(asset, poses[s]);
    for (std::size_t i = s % stride; i < centers.size(); i += stride) {
      const std::size_t j = owner[asset.joint_indices[i * row]];
      local[j].push_back(rigid_inverse(poses[s][j]) * centers[i]);
    }
  }
  CapsuleReport report;
  for (const double share : {options.percentile, 0.995, 0.998, 0.9995, 1.0}) {
    if (share < options.percentile) continue;
    asset.capsules.clear();
    for (std::size_t j = 0; j < local.size(); ++j) {
      if (local[j].empty()) continue;
      std::vector<Capsule<double>> held;
      capsules_of(local[j], share, 2, options.least, held);
      for (const Capsule<double>& c : held)
        asset.capsules.push_back({static_cast<std::uint16_t>(j), c.p0, c.p1, c.radius});
    }
    report = measure_capsules(asset, asset.capsules, poses, false);
    report.percentile = share;
    if (report.contained_least >= options.contained) break;
  }
  const double percentile = report.percentile;
  report = measure_capsules(asset, asset.capsules, poses);
  report.percentile = percentile;
  return report;
}

}  // namespace gsnav
