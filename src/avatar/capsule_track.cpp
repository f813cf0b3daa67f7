// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/avatar/capsule_track.hpp"

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace gsnav {

Result<TrackedCapsules> capsules_from_track(const Skeleton& skeleton, const MotionClip& clip,
                                            const std::vector<std::vector<Capsule<double>>>& track) {
  const BadArgument bad{"capsules_from_track: "};
  if (Status s = clip.validate(); !s) return s;
  if (clip.joints != skeleton.size()) return bad("the clip is of another skeleton");
  if (track.size() != clip.frames()) {
    return bad(std::to_string(track.size()) + " frames of capsules for " +
               std::to_string(clip.frames()) + " keys");
  }
  const std::size_t count = track[0].size(), joints = skeleton.size(), frames = track.size();
  struct Ends {
    Vec3d p0{}, p1{};
  };
  std::vector<Ends> first(count * joints);
  std::vector<double> spread(count * joints, 0.0);
  std::vector<std::vector<Affine3<double>>> back(frames);  // from the driver's frame to that of the
                                                           // joint
  LocalPose pose;
  for (std::size_t t = 0; t < frames; ++t) {
    if (track[t].size() != count) return bad("frames of different numbers of capsules");
    MotionInput at;
    at.time = (static_cast<double>(t) / clip.frame_rate - clip.start) / clip.playback_rate;
    clip.pose(at, pose);
    forward_kinematics(skeleton, pose, back[t]);
    for (auto& m : back[t]) {
      m.translation += pose.root;
      m = rigid_inverse(m);
    }
    for (std::size_t c = 0; c < count; ++c) {
      for (std::size_t j = 0; j < joints; ++j) {
        const Ends e{back[t][j] * track[t][c].p0, back[t][j] * track[t][c].p1};
        Ends& f = first[c * joints + j];
        if (t == 0) f = e;
        double& s = spread[c * joints + j];
        s = max(s, max(norm(e.p0 - f.p0), norm(e.p1 - f.p1)));
      }
    }
  }
  TrackedCapsules out;
  for (std::size_t c = 0; c < count; ++c) {
    std::size_t best = 0;
    for (std::size_t j = 1; j < joints; ++j) {
      // Joints that do not move relative to each other are equally good: keep the first.
      if (spread[c * joints + j] < spread[c * joints + best] - 1e-6) best = j;
    }
    ProxyCapsule p{static_cast<std::uint16_t>(best), {}, {}, 0.0};
    const double share = 1.0 / static_cast<double>(frames);
    for (std::size_t t = 0; t < frames; ++t) {
      p.p0 += (back[t][best] * track[t][c].p0) * share;
      p.p1 += (back[t][best] * track[t][c].p1) * share;
      p.radius += track[t][c].radius * share;
    }
    for (std::size_t t = 0; t < frames; ++t) {
      const double ends =
          max(norm(back[t][best] * track[t][c].p0 - p.p0), norm(back[t][best] * track[t][c].p1 - p.p1));
      out.error = max(out.error, max(ends, abs(track[t][c].radius - p.radius)));
    }
    out.capsules.push_back(p);
  }
  return out;
}

}  // namespace gsnav
