// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/rigging/clip_walk.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
#include <vector>

namespace gsnav {

namespace {

void blend(const LocalPose& a, const LocalPose& b, double u, LocalPose& out) {
  out.rotations.resize(a.rotations.size());
  out.translations.resize(a.translations.size());
  for (std::size_t j = 0; j < a.rotations.size(); ++j) {
    out.rotations[j] = slerp(a.rotations[j], b.rotations[j], u);
    out.translations[j] = lerp(a.translations[j], b.translations[j], u);
  }
  out.root = lerp(a.root, b.root, u);
}

double difference(const MotionClip& clip, std::size_t a, std::size_t b) {
  double sum = 0.0;
  for (std::size_t j = 0; j < clip.joints; ++j) {
    const double c = dot(clip.rotations[a * clip.joints + j], clip.rotations[b * clip.joints + j]);
    sum += 1.0 - min(1.0, c * c);
  }
  return sum;
}

double median(std::vector<double> v) {
  std::nth_element(v.begin(), v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2), v.end());
  return v[v.size() / 2];
}

/// Means over a round's values, `reach` to each side.
std::vector<double> smoothed(const std::vector<double>& v, std::size_t reach) {
  const std::size_t n = v.size();
  std::vector<double> out(n, 0.0);
  for (std::size_t k = 0; k < n; ++k) {
    for (std::size_t i = 0; i <= 2 * reach; ++i) out[k] += v[(k + n + i - reach) % n];
    out[k] /= static_cast<double>(2 * reach + 1);
  }
  return out;
}

}  // namespace

Result<ClipWalk> ClipWalk::create(const Skeleton& skeleton, const MotionClip& clip,
                                  const ClipWalkOptions& options) {
  const auto bad = [](const std::string& what) {
    return Status(Errc::invalid_argument, "ClipWalk: " + what);
  };
  if (Status s = skeleton.validate(); !s) return s;
  if (Status s = clip.validate(); !s) return s;
  if (clip.joints != skeleton.size()) return bad("the clip is of another skeleton");
  if (!(options.turn_per_cycle > 0)) return bad("ClipWalkOptions.turn_per_cycle must be positive");
  ClipWalk w;
  w.options_ = options;
  w.feet_ = find_feet(skeleton, options.floor);
  if (w.feet_.size() != 2)
    return bad("the skeleton has " + std::to_string(w.feet_.size()) +
               " feet in its rest pose, must be 2");
  std::size_t first = options.first, keys = options.keys;
  if (keys == 0) w.find_cycle(clip, first, keys);
  if (keys < 4 || first + keys >= clip.frames()) {
    return bad("keys " + std::to_string(first) + " to " + std::to_string(first + keys) + " of " +
               std::to_string(clip.frames()) + " are no cycle");
  }
  w.first_ = first;
  w.seconds_ = static_cast<double>(keys) / clip.frame_rate;
  w.close(clip, first, keys);
  const Vec3d way = clip.root_translation.empty()
                        ? Vec3d{}
                        : clip.root_translation[first + keys] - clip.root_translation[first];
  if (Status s = w.lead(skeleton, std::hypot(way.x, way.z) > 0.3 ? Vec3d{way.x, 0, way.z} : Vec3d{}); !s)
    return s;
  if (w.options_.idle.rotations.empty()) {
    w.options_.idle = w.still_;
  } else if (w.options_.idle.rotations.size() != skeleton.size() ||
             w.options_.idle.translations.size() != skeleton.size()) {
    return bad("ClipWalkOptions.idle is of another skeleton");
  }
  return w;
}

void ClipWalk::pose(const MotionInput& input, LocalPose& out) const {
  const double cycles = input.distance / stride() + input.turned / options_.turn_per_cycle;
  const double d = (cycles - std::floor(cycles)) * stride();
  const auto after = std::upper_bound(way_.begin(), way_.end(), d);
  const std::size_t b =
      clamp(static_cast<std::size_t>(after - way_.begin()), std::size_t{1}, cycle_.size());
  const double u = clamp((d - way_[b - 1]) / (way_[b] - way_[b - 1]), 0.0, 1.0);
  LocalPose& walk = out;
  blend(cycle_[b - 1], cycle_[b % cycle_.size()], u, walk);
  // Steps are as long as ever at half the speed; a turn on the spot lifts the feet a little.
  const double slow = 1.0 - clamp(input.walking, 0.0, 1.0);
  const double share = max(1.0 - slow * slow * slow, 0.35 * clamp(input.turning, 0.0, 1.0));
  if (share < 1.0) {
    const LocalPose moving = walk;
    blend(options_.idle, moving, share, out);
  }
}

void ClipWalk::find_cycle(const MotionClip& clip, std::size_t& first, std::size_t& keys) const {
  const std::size_t n = clip.frames();
  first = 0;
  keys = n - 1;
  // The greatest change within the clip says what "the same" is.
  double most = 0.0;
  for (std::size_t k = 0; k < n; k += max<std::size_t>(1, n / 50))
    most = max(most, difference(clip, 0, k));
  if (n < 8 || difference(clip, 0, n - 1) < 0.02 * most) return;
  double best = std::numeric_limits<double>::max();
  const auto span = [&](double seconds) {
    return static_cast<std::size_t>(min(seconds * clip.frame_rate, 1e9));
  };
  const bool path = !clip.root_translation.empty();
  const std::size_t tenth = max<std::size_t>(1, span(0.1));
  const auto speed = [&](std::size_t k) {
    return norm(clip.root_translation[k + tenth] - clip.root_translation[k - tenth]) * clip.frame_rate /
           (2.0 * static_cast<double>(tenth));
  };
  for (std::size_t a = tenth; a + span(0.7) + tenth < n; ++a) {
    if (path && speed(a) < 0.8) continue;
    for (std::size_t b = a + max<std::size_t>(4, span(0.7)); b + tenth < n && b <= a + span(1.8); ++b) {
      if (path && (speed(b) < 0.8 || norm(clip.root_translation[b] - clip.root_translation[a]) < 0.8))
        continue;
      // The poses and where they come from and go.
      double d = difference(clip, a, b) + difference(clip, a - tenth, b - tenth) +
                 difference(clip, a + tenth, b + tenth);
      // Of parts that close as well the one that leads further: two short steps are no cycle.
      const double way = path ? norm(clip.root_translation[b] - clip.root_translation[a]) : 1.0;
      d /= way;
      if (d < best) best = d, first = a, keys = b - a;
    }
  }
}

void ClipWalk::close(const MotionClip& clip, std::size_t first, std::size_t keys) {
  const std::size_t joints = clip.joints, last = first + keys;
  const bool moving = clip.translations.size() != joints;
  const auto place = [&](std::size_t t, std::size_t j) {
    return clip.translations[(moving ? t * joints : 0) + j];
  };
  const auto height = [&](std::size_t t) {
    return clip.root_translation.empty() ? 0.0 : clip.root_translation[t].y;
  };
  for (std::size_t t = first; t < last; ++t) {
    const double u = static_cast<double>(t - first) / static_cast<double>(keys);
    LocalPose& p = cycle_.emplace_back();
    for (std::size_t j = 0; j < joints; ++j) {
      const Quatd gap =
          conjugate(clip.rotations[last * joints + j]) * clip.rotations[first * joints + j];
      p.rotations.push_back(clip.rotations[t * joints + j] * slerp(Quatd{}, gap, u));
      normalize(p.rotations.back());
      p.translations.push_back(place(t, j) + (place(first, j) - place(last, j)) * u);
    }
    p.root = {0, height(t) + (height(first) - height(last)) * u, 0};
  }
}

Status ClipWalk::lead(const Skeleton& skeleton, Vec3d ahead) {
  const std::size_t n = cycle_.size();
  std::vector<SolePoint> points;
  for (const Foot& foot : feet_) points.insert(points.end(), foot.sole.begin(), foot.sole.end());
  std::vector<std::vector<Vec3d>> at(n);
  std::vector<double> lowest(points.size(), std::numeric_limits<double>::max());
  std::vector<Affine3<double>> globals;
  double closest = std::numeric_limits<double>::max();
  std::size_t still = 0;
  for (std::size_t k = 0; k < n; ++k) {
    forward_kinematics(skeleton, cycle_[k], globals);
    for (std::size_t i = 0; i < points.size(); ++i) {
      at[k].push_back(globals[points[i].joint] * points[i].local + cycle_[k].root);
      lowest[i] = min(lowest[i], at[k][i].y);
    }
    const double apart =
        norm(globals[feet_[0].joints[0]].translation - globals[feet_[1].joints[0]].translation);
    if (apart < closest) closest = apart, still = k, still_ = cycle_[k];
  }
  // One foot is on the floor at nearly every key; the tip of the toes may be a little off where it is
  // taken to be.
  std::vector<double> soles;
  for (std::size_t k = 0; k < n; ++k) {
    soles.push_back(std::numeric_limits<double>::max());
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (i % 3 != 2) soles.back() = min(soles.back(), at[k][i].y);
    }
  }
  const std::vector<double> sunk =
      options_.grounded ? smoothed(soles, n / 24) : std::vector(n, median(soles));
  std::fill(lowest.begin(), lowest.end(), std::numeric_limits<double>::max());
  for (std::size_t k = 0; k < n; ++k) {
    cycle_[k].root.y -= sunk[k];
    for (std::size_t i = 0; i < points.size(); ++i) lowest[i] = min(lowest[i], at[k][i].y -= sunk[k]);
  }
  still_.root.y -= sunk[still];
  // The foot that is down is low and moves back against the body: from where the toes point if the clip
  // does not say.
  if (!(norm(ahead) > 0)) {
    for (std::size_t k = 0; k < n; ++k) {
      for (std::size_t i = 0; i + 2 < points.size(); i += 3) ahead += at[k][i + 2] - at[k][i];
    }
    ahead.y = 0;
  }
  std::vector<Vec3d> step(n);
  Vec3d total = ahead;
  for (int pass = 0; pass < 2; ++pass) {
    ahead = norm(total) > 0 ? normalized(total) : Vec3d{};
    total = {};
    for (std::size_t k = 0; k < n; ++k) {
      const std::size_t next = (k + 1) % n;
      double sum = 1e-12;
      step[k] = {};
      for (std::size_t i = 0; i < points.size(); ++i) {
        const double up = 0.5 * (at[k][i].y + at[next][i].y) - lowest[i];
        const Vec3d d{at[k][i].x - at[next][i].x, 0, at[k][i].z - at[next][i].z};
        const double back = max(0.0, dot(d, ahead));
        const double w = std::exp(-up / 0.015) * back * back * 1e6;
        step[k] += d * w;
        sum += w;
      }
      step[k] = step[k] * (1.0 / sum);
      total += step[k];
    }
  }
  const double stride = std::hypot(total.x, total.z);
  if (!(stride > 0.1))
    return {Errc::invalid_argument,
            "ClipWalk: the feet lead " + std::to_string(stride) + " m in a cycle"};
  const Quatd turn = axis_angle(Vec3d{0, 1, 0}, -std::atan2(-total.x, -total.z));
  const Affine3<double> turned{rotation_matrix(turn), {}};
  way_.assign(1, 0.0);
  double side = 0.0;
  std::vector<double> sides{0.0};
  for (std::size_t k = 0; k < n; ++k) {
    const Vec3d d = turned.linear * step[k];
    // Never back: where a foot lands the other one takes over.
    way_.push_back(way_.back() + max(-d.z, 0.05 * stride / static_cast<double>(n)));
    sides.push_back(side += d.x);
  }
  const double shrink = stride / way_.back();
  for (double& v : way_) v *= shrink;
  double middle = 0.0;
  for (const double s : sides) middle += s / static_cast<double>(sides.size());
  // The root joint as it stood over the middle of its feet.
  Vec3d mean{};
  for (const LocalPose& p : cycle_) mean += p.translations[0] * (1.0 / static_cast<double>(n));
  for (std::size_t k = 0; k < n; ++k) {
    LocalPose& p = cycle_[k];
    for (std::size_t j = 0; j < skeleton.size(); ++j) {
      if (skeleton.parents[j] >= 0) continue;
      p.rotations[j] = turn * p.rotations[j];
      p.translations[j] = turned * (p.translations[j] - Vec3d{mean.x, 0, mean.z});
    }
    p.root.x = sides[k] - middle;
  }
  for (std::size_t j = 0; j < skeleton.size(); ++j) {
    if (skeleton.parents[j] >= 0) continue;
    still_.rotations[j] = turn * still_.rotations[j];
    still_.translations[j] = turned * (still_.translations[j] - Vec3d{mean.x, 0, mean.z});
  }
  return {};
}

}  // namespace gsnav
