// SPDX-License-Identifier: Apache-2.0
#include "humanoid_surface.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "../rigging/point_grid.hpp"
#include "body_shape.hpp"
#include "gsnav/avatar/asset.hpp"
#include "gsnav/core/rng.hpp"
#include "gsnav/core/status.hpp"
#include "gsnav/detail/math/angles.hpp"
#include "gsnav/frame/sh.hpp"
#include "humanoid_body.hpp"

namespace gsnav::detail {

namespace {

/// A point of the surface, before it becomes a Gaussian.
struct BodyPoint {
  Vec3d position{}, normal{};
  double spacing = 0;    // least distance to other points, metres
  std::size_t lobe = 0;  // the nearest lobe
};

/// Spreads points over the surface: random points on the lobes are moved to the smooth union and kept if
/// no other is near (dart throwing).
std::vector<BodyPoint> sample_surface(const BodyShape& shape, const HumanoidOptions& o,
                                      const std::vector<double>& density) {
  Rng rng(o.seed);
  double weighted = 0;
  for (std::size_t i = 0; i < shape.lobes.size(); ++i)
    weighted += shape.lobes[i].area() * density[i] * density[i];
  // Measured: lobes overlap by more than half, and dart throwing keeps 0.7 points per square of the
  // spacing.
  const double spacing = std::sqrt(0.285 * weighted / o.gaussians);
  const double scale = o.height / 1.70;
  PointGrid grid(spacing, static_cast<std::size_t>(o.gaussians));
  std::vector<BodyPoint> out;
  std::vector<std::vector<std::size_t>> among;
  std::vector<double> sum{0.0};
  for (std::size_t i = 0; i < shape.lobes.size(); ++i) {
    among.push_back(shape.neighbours(i, 0.04 * scale));
    sum.push_back(sum.back() + shape.lobes[i].area() * density[i] * density[i]);
  }
  const int tries = 30 * o.gaussians;
  for (int n = 0; n < tries; ++n) {
    const auto at = std::upper_bound(sum.begin(), sum.end(), rng.uniform() * sum.back());
    const std::size_t i = min(static_cast<std::size_t>(at - sum.begin()) - 1, shape.lobes.size() - 1);
    const Lobe& l = shape.lobes[i];
    const double z = rng.uniform(-1, 1), angle = rng.uniform(0, kTwoPi), q = std::sqrt(1 - z * z);
    const Vec3d unit{q * std::cos(angle), z, q * std::sin(angle)};
    // The round ends get a share of the points in proportion to their length.
    const double straight = norm(l.b - l.a), ends = l.radii_a.y + l.radii_b.y;
    BodyPoint p;
    const Mat3d back = transpose(l.axes);
    if (rng.uniform() * (straight + ends) < straight) {
      const double t = rng.uniform(), c = std::cos(angle), s = std::sin(angle);
      const Vec3d r = lerp(l.radii_a, l.radii_b, t);
      // Around the segment, whatever its direction relative to the axes.
      const Vec3d along = normalized(l.axes * (l.b - l.a));
      Vec3d u = abs(along.y) < 0.9 ? cross(along, Vec3d{0, 1, 0}) : cross(along, Vec3d{1, 0, 0});
      u = normalized(u);
      const Vec3d v = cross(along, u), d = u * c + v * s;
      p.position = lerp(l.a, l.b, t) + back * Vec3d{d.x * r.x, d.y * r.y, d.z * r.z};
    } else {
      const bool first = rng.uniform() < 0.5;
      const Vec3d r = first ? l.radii_a : l.radii_b;
      p.position = (first ? l.a : l.b) + back * Vec3d{unit.x * r.x, unit.y * r.y, unit.z * r.z};
    }
    if (!shape.project(p.position, among[i], p.normal)) continue;
    double nearest = std::numeric_limits<double>::max();
    for (const std::size_t k : among[i]) {
      const double d = shape.lobes[k].distance(p.position);
      if (d < nearest) {
        nearest = d;
        p.lobe = k;
      }
    }
    p.spacing = spacing / density[p.lobe];
    if (!grid.add(p.position, p.spacing)) continue;
    p.normal = normalized(p.normal);
    out.push_back(p);
  }
  return out;
}

/// Computes the colour of a point: its part, small features of the face, folds, and shading from above
/// and in crevices, like the light of a room in a captured person.
class HumanoidPainter {
 public:
  HumanoidPainter(const HumanoidOptions& o, const BodyShape& shape)
      : o_(o), shape_(shape), scale_(o.height / 1.70) {
    for (std::size_t i = 0; i < shape.lobes.size(); ++i) among_.push_back(shape.neighbours(i, 0.08));
  }

  Vec3d color(const BodyPoint& p, Rng& rng) const {
    const Vec3d x = p.position * (1.0 / scale_);
    const Lobe& lobe = shape_.lobes[p.lobe];
    Vec3d c;
    double noise = 0.009, fold = 0.0;
    switch (part(x, lobe)) {
      case BodyPart::skin:
        c = face(x);
        break;
      case BodyPart::hair:
        c = o_.hair * (1.0 + 0.09 * std::sin(90 * x.x + 25 * std::sin(20 * x.y)));
        noise = 0.02;
        break;
      case BodyPart::top:
        c = o_.top;
        fold = std::sin(21 * x.y + 7 * std::sin(9 * x.x + 3) + 5 * x.z);
        break;
      case BodyPart::trousers:
        c = o_.trousers;
        fold = std::sin(17 * x.y + 6 * std::sin(11 * x.x) + 9 * x.z);
        break;
      case BodyPart::shoes:
        c = x.y < 0.014 ? Vec3d{0.55, 0.54, 0.52} : o_.shoes;
        break;  // sole
    }
    const double light = 0.80 + 0.20 * (0.5 + 0.5 * p.normal.y) + 0.03 * fold;
    const double reach = 0.05 * scale_;
    const double open =
        clamp(shape_.distance(p.position + p.normal * reach, among_[p.lobe]) / reach, 0.0, 1.0);
    const double shade = light * (0.62 + 0.38 * open) + noise * rng.normal();
    for (int k = 0; k < 3; ++k) c[k] = clamp(c[k] * shade, 0.0, 1.0);
    return c;
  }

 private:
  // Clothes end at neckline, hem and sleeves, not where lobes meet.
  BodyPart part(const Vec3d& x, const Lobe& lobe) const noexcept {
    const double side = abs(x.x);
    if (lobe.part == BodyPart::skin || lobe.part == BodyPart::top) {
      if (x.y > 1.37 && x.y < 1.50 && std::hypot(x.x, x.z - 0.018) < 0.080) {
        return x.y > 1.428 + 0.4 * x.z ? BodyPart::skin : BodyPart::top;
      }
    }
    if ((lobe.part == BodyPart::trousers || lobe.part == BodyPart::top) && side < 0.22 && x.y < 1.1) {
      return x.y > 0.955 ? BodyPart::top : BodyPart::trousers;
    }
    // Distance along the arm from the shoulder, metres. The arm hangs 50 degrees below the horizontal.
    const double along = 0.643 * (side - 0.165 * o_.shoulders) + 0.766 * (1.385 - x.y);
    if (o_.short_sleeves && lobe.part == BodyPart::top && side > 0.19 && along > 0.17)
      return BodyPart::skin;
    return lobe.part;
  }

  static double spot(const Vec3d& x, const Vec3d& at, double rx, double ry) noexcept {
    const double dx = (x.x - at.x) / rx, dy = (x.y - at.y) / ry;
    return x.z < 0 ? dx * dx + dy * dy : 1e3;
  }

  Vec3d face(const Vec3d& x) const {
    if (x.y < 1.47) return o_.skin;
    const auto mix = [](const Vec3d& a, const Vec3d& b, double t) {
      return lerp(a, b, clamp(t, 0.0, 1.0));
    };
    Vec3d c = o_.skin;
    const Vec3d m{abs(x.x), x.y, x.z};
    if (spot(m, {0.034, 1.586, 0}, 0.015, 0.007) < 1) {
      c = spot(m, {0.034, 1.586, 0}, 0.0065, 0.0065) < 1 ? Vec3d{0.12, 0.09, 0.07}
                                                         : Vec3d{0.88, 0.86, 0.84};
    } else if (spot(m, {0.034, 1.590, 0}, 0.018, 0.0075) < 1) {
      c = o_.skin * 0.55;  // lashes
    } else if (spot(m, {0.035, 1.607 - 0.06 * (m.x - 0.035), 0}, 0.020, 0.0040) < 1) {
      c = mix(o_.hair, o_.skin, 0.2);
    } else if (spot(m, {0, 1.533, 0}, 0.024, 0.008) < 1) {
      c = abs(x.y - 1.5335) < 0.0016 ? o_.skin * 0.5 : mix(o_.skin, Vec3d{0.66, 0.30, 0.29}, 0.55);
    } else if (spot(m, {0.045, 1.560, 0}, 0.022, 0.018) < 1) {
      c = mix(o_.skin, Vec3d{0.85, 0.45, 0.40}, 0.12);
    }
    return c;
  }

  HumanoidOptions o_;
  const BodyShape& shape_;
  double scale_;
  std::vector<std::vector<std::size_t>> among_;
};

/// Skinning weights of surface points.
class HumanoidWeigher {
 public:
  HumanoidWeigher(const BodyShape& shape, const Skeleton& skeleton, double scale) : shape_(shape) {
    const std::size_t n = skeleton.size();
    softness_.assign(n * n, 0.0);
    // whether b is a, or at most two steps above it
    const auto above = [&](std::size_t a, std::size_t b) {
      for (int step = 0; step < 3; ++step) {
        if (a == b) return true;
        if (skeleton.parents[a] < 0) return false;
        a = static_cast<std::size_t>(skeleton.parents[a]);
      }
      return false;
    };
    // Distance over which a joint's motion reaches into the part above it, metres.
    const auto soft = [&](const std::string& name) {
      const auto has = [&](const char* word) { return name.find(word) != name.npos; };
      if (has("spine") || has("collar")) return 0.030;
      if (has("hip") || has("shoulder")) return 0.022;
      if (has("knee") || has("neck") || has("head")) return 0.016;
      if (has("elbow")) return 0.013;
      if (has("ankle") || has("foot") || has("wrist")) return 0.010;
      return 0.005;
    };
    for (std::size_t a = 0; a < n; ++a) {
      for (std::size_t b = 0; b < n; ++b) {
        if (above(a, b) || above(b, a)) softness_[a * n + b] = scale * soft(skeleton.names[max(a, b)]);
      }
    }
    distance_.resize(n);
  }

  /// Fills `row` [J]. Weights fall off exponentially with the distance from the lobes of each joint.
  /// Only joints within two steps up or down the tree from the nearest lobe's joint get weight.
  void weigh(const BodyPoint& p, std::vector<float>& row) {
    const std::size_t n = distance_.size(), home = shape_.lobes[p.lobe].joint;
    std::fill(distance_.begin(), distance_.end(), 1e3);
    for (const Lobe& l : shape_.lobes) {
      if (softness_[home * n + l.joint] > 0)
        distance_[l.joint] = min(distance_[l.joint], l.distance(p.position));
    }
    row.assign(n, 0.0f);
    for (std::size_t j = 0; j < n; ++j) {
      if (distance_[j] > 100) continue;
      const double w = std::exp(-(distance_[j] - max(distance_[home], -0.01)) / softness_[home * n + j]);
      row[j] = w > 1e-4 ? static_cast<float>(min(w, 1.0)) : 0.0f;
    }
  }

 private:
  const BodyShape& shape_;
  std::vector<double> softness_;  // [J][J]; 0: not related
  std::vector<double> distance_;
};

}  // namespace

Status cover_with_gaussians(const HumanoidOptions& o, const BodyShape& shape, AvatarAsset& asset) {
  std::vector<double> density;
  for (const Lobe& l : shape.lobes) {
    const std::string& n = asset.skeleton.names[l.joint];
    const bool fine = n.find("index") != n.npos || n.find("middle") != n.npos ||
                      n.find("ring") != n.npos || n.find("pinky") != n.npos || n.find("thumb") != n.npos;
    density.push_back(n == "head" ? (l.part == BodyPart::skin ? 2.2 : 1.4) : fine ? 1.8 : 1.0);
  }
  const std::vector<BodyPoint> points = sample_surface(shape, o, density);
  const HumanoidPainter painter(o, shape);
  HumanoidWeigher weigher(shape, asset.skeleton, o.height / 1.70);
  Rng rng(o.seed ^ 0x636f6c6f7572ull);
  GaussianCloudBuilder builder(o.sh_degree, "procedural humanoid");
  builder.reserve(points.size());
  const std::vector<float> rest(3 * static_cast<std::size_t>(sh_coefficient_count(o.sh_degree) - 1),
                                0.0f);
  std::vector<std::uint16_t> indices;
  std::vector<float> weights, row;
  for (const BodyPoint& p : points) {
    RawGaussian g;
    g.mean = p.position;
    const Vec3d n = p.normal,
                u = normalized(abs(n.y) < 0.9 ? cross(Vec3d{0, 1, 0}, n) : cross(Vec3d{1, 0, 0}, n));
    const Vec3d v = cross(n, u);
    g.quat = quat_from_matrix(transpose(Mat3d{{u, v, n}}));
    const double flat = std::log(0.80 * p.spacing);
    g.log_scales = {flat, flat, std::log(0.12 * p.spacing)};
    g.opacity_logit = 4.6;  // 0.99
    const Vec3d c = painter.color(p, rng);
    for (int k = 0; k < 3; ++k)
      g.sh0[static_cast<std::size_t>(k)] = static_cast<float>(sh0_of_color(c[k]));
    g.shN = rest.empty() ? nullptr : rest.data();
    if (!builder.add(g)) continue;
    weigher.weigh(p, row);
    // The heaviest eight suffice for set_weights to choose four from.
    std::array<std::size_t, 8> best{};
    for (auto& b : best) {
      b = static_cast<std::size_t>(std::max_element(row.begin(), row.end()) - row.begin());
      indices.push_back(static_cast<std::uint16_t>(b));
      weights.push_back(row[b]);
      row[b] = 0.0f;
    }
  }
  asset.cloud = std::move(builder.cloud());
  return asset.set_weights(8, indices, weights).status();
}

}  // namespace gsnav::detail
