// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/rigging/clip_walk.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
#include <vector>

#include "gsnav/detail/avatar/blend_pose.hpp"
#include "gsnav/detail/math/angles.hpp"

namespace gsnav {

namespace {

void blend(const LocalPose& a, const LocalPose& b, double u, LocalPose& out) {
  out.rotations.resize(a.rotations.size());
  out.translations.resize(a.translations.size());
  blend_joints(a, b, u, out);
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

/// Moving means of cyclic values, over `reach` values to each side.
std::vector<double> smoothed(const std::vector<double>& v, std::size_t reach) {
  const std::size_t n = v.size();
  std::vector<double> out(n, 0.0);
  for (std::size_t k = 0; k < n; ++k) {
    for (std::size_t i = 0; i <= 2 * reach; ++i) out[k] += v[(k + n + i - reach) % n];
    out[k] /= static_cast<double>(2 * reach + 1);
  }
  return out;
}

/// Positions of the points of both soles in each frame of a cycle.
class SolePaths {
 public:
  SolePaths(const Skeleton& skeleton, const std::vector<Foot>& feet,
            const std::vector<LocalPose>& cycle) {
    double least = std::numeric_limits<double>::max();
    std::vector<Affine3<double>> globals;
    for (std::size_t k = 0; k < cycle.size(); ++k) {
      forward_kinematics(skeleton, cycle[k], globals);
      std::vector<Vec3d>& at = at_.emplace_back();
      for (const Foot& foot : feet) {
        for (const SolePoint& p : foot.sole) at.push_back(globals[p.joint] * p.local + cycle[k].root);
      }
      const double apart =
          norm(globals[feet[0].joints[0]].translation - globals[feet[1].joints[0]].translation);
      if (apart < least) least = apart, closest_ = k;
    }
  }

  /// The frame in which the feet are closest together.
  std::size_t closest() const { return closest_; }

  /// Height of the lower sole in each frame. Tips of toes are left out, because their position is a
  /// guess.
  std::vector<double> heights() const {
    std::vector<double> out;
    for (const std::vector<Vec3d>& at : at_) {
      out.push_back(std::numeric_limits<double>::max());
      for (std::size_t i = 0; i < at.size(); ++i) {
        if (i % 3 != 2) out.back() = min(out.back(), at[i].y);
      }
    }
    return out;
  }

  void lower(const std::vector<double>& by) {
    for (std::size_t k = 0; k < at_.size(); ++k) {
      for (Vec3d& p : at_[k]) p.y -= by[k];
    }
  }

  /// Direction along the ground in which the toes point; any length.
  Vec3d toes() const {
    Vec3d out{};
    for (const std::vector<Vec3d>& at : at_) {
      for (std::size_t i = 0; i + 2 < at.size(); i += 3) out += at[i + 2] - at[i];
    }
    out.y = 0;
    return out;
  }

  /// Movement of the body along the ground from each frame to the next: the foot that is down stays
  /// behind by the same distance. That foot is low and moves against the unit vector `ahead`.
  std::vector<Vec3d> steps(const Vec3d& ahead) const {
    std::vector<double> lowest(at_[0].size(), std::numeric_limits<double>::max());
    for (const std::vector<Vec3d>& at : at_) {
      for (std::size_t i = 0; i < at.size(); ++i) lowest[i] = min(lowest[i], at[i].y);
    }
    std::vector<Vec3d> out;
    for (std::size_t k = 0; k < at_.size(); ++k) {
      const std::vector<Vec3d>&at = at_[k], &next = at_[(k + 1) % at_.size()];
      double sum = 1e-12;
      Vec3d step{};
      for (std::size_t i = 0; i < at.size(); ++i) {
        const double up = 0.5 * (at[i].y + next[i].y) - lowest[i];
        const Vec3d d{at[i].x - next[i].x, 0, at[i].z - next[i].z};
        const double back = max(0.0, dot(d, ahead));
        const double w = std::exp(-up / 0.015) * back * back * 1e6;
        step += d * w;
        sum += w;
      }
      out.push_back(step * (1.0 / sum));
    }
    return out;
  }

 private:
  std::vector<std::vector<Vec3d>> at_;  ///< [frame][point]: heel, ball and tip of each foot.
  std::size_t closest_ = 0;
};

/// Rotates the roots of all poses. The first joint keeps its mean position relative to the middle of the
/// feet.
void turn_roots(const Skeleton& skeleton, const Quatd& turn, std::vector<LocalPose>& cycle) {
  const Affine3<double> turned{rotation_matrix(turn), {}};
  Vec3d mean{};
  for (const LocalPose& p : cycle) {
    mean += p.translations[0] * (1.0 / static_cast<double>(cycle.size()));
  }
  for (LocalPose& p : cycle) {
    for (std::size_t j = 0; j < skeleton.size(); ++j) {
      if (skeleton.parents[j] >= 0) continue;
      p.rotations[j] = turn * p.rotations[j];
      p.translations[j] = turned * (p.translations[j] - Vec3d{mean.x, 0, mean.z});
    }
  }
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
  // Slow steps keep their length down to about half the speed. A turn on the spot lifts the feet a
  // little.
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
  // Poses count as equal relative to the greatest difference within the clip.
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
      // Compare the poses, and also those before and after, so that velocities match.
      double d = difference(clip, a, b) + difference(clip, a - tenth, b - tenth) +
                 difference(clip, a + tenth, b + tenth);
      // Divide by the distance, since two short steps are not a cycle: of parts that close equally well,
      // prefer the longer way.
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
  SolePaths soles(skeleton, feet_, cycle_);
  // In a walk one foot is on the floor in nearly every frame.
  const std::vector<double> heights = soles.heights();
  const std::vector<double> sunk =
      options_.grounded ? smoothed(heights, n / 24) : std::vector(n, median(heights));
  soles.lower(sunk);
  for (std::size_t k = 0; k < n; ++k) cycle_[k].root.y -= sunk[k];

  // Use the first guess of the direction once, then the direction found from the feet.
  Vec3d total = norm(ahead) > 0 ? ahead : soles.toes();
  std::vector<Vec3d> steps;
  for (int pass = 0; pass < 2; ++pass) {
    steps = soles.steps(norm(total) > 0 ? normalized(total) : Vec3d{});
    total = {};
    for (const Vec3d& step : steps) total += step;
  }
  const double stride = std::hypot(total.x, total.z);
  if (!(stride > 0.1))
    return {Errc::invalid_argument,
            "ClipWalk: the feet lead " + std::to_string(stride) + " m in a cycle"};

  const Quatd turn = axis_angle(Vec3d{0, 1, 0}, -heading_of(total));
  const Mat3d turned = rotation_matrix(turn);
  way_.assign(1, 0.0);
  std::vector<double> sides{0.0};
  for (const Vec3d& step : steps) {
    const Vec3d d = turned * step;
    // Never move back, also where one foot takes over from the other.
    way_.push_back(way_.back() + max(-d.z, 0.05 * stride / static_cast<double>(n)));
    sides.push_back(sides.back() + d.x);
  }
  const double shrink = stride / way_.back();
  for (double& v : way_) v *= shrink;
  double middle = 0.0;
  for (const double s : sides) middle += s / static_cast<double>(sides.size());

  turn_roots(skeleton, turn, cycle_);
  still_ = cycle_[soles.closest()];
  for (std::size_t k = 0; k < n; ++k) cycle_[k].root.x = sides[k] - middle;
  return {};
}

}  // namespace gsnav
