// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "avatar_files/bodies.hpp"
#include "gsnav/detail/demo/humanoid.hpp"
#include "gsnav/detail/io/motion_file.hpp"
#include "gsnav/detail/rigging/clip_walk.hpp"
#include "gsnav/detail/rigging/foot_contact.hpp"
#include "gsnav/detail/rigging/foot_lock.hpp"
#include "gsnav/detail/rigging/joint_match.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

/// One cycle of the procedural walk as a clip with the root's way in it, turned by `heading`.
MotionClip recorded(const Skeleton& skeleton, double heading, bool on_the_spot) {
  const WalkMotion walk = WalkMotion::create(skeleton).value();
  const Quatd turn = axis_angle(Vec3d{0, 1, 0}, heading);
  MotionClip clip;
  clip.frame_rate = 60;
  clip.joints = skeleton.size();
  LocalPose pose;
  for (int k = 0; k <= 60; ++k) {
    walk.pose(k / 60.0, 1.0, 0.0, pose);
    pose.rotations[0] = turn * pose.rotations[0];
    pose.translations[0] = rotate(turn, pose.translations[0]);
    clip.rotations.insert(clip.rotations.end(), pose.rotations.begin(), pose.rotations.end());
    clip.translations.insert(clip.translations.end(), pose.translations.begin(),
                             pose.translations.end());
    clip.root_translation.push_back(on_the_spot ? Vec3d{}
                                                : rotate(turn, Vec3d{0, 0, -walk.stride() * k / 60.0}));
  }
  return clip;
}

/// Feet while somebody walks straight on at 1 m/s.
FootSlide slide_of(const Skeleton& skeleton, const MotionSource& walk, double seconds) {
  FootSlideMeter meter(find_feet(skeleton));
  LocalPose pose;
  std::vector<Affine3<double>> globals;
  for (double t = 0; t < seconds; t += 0.01) {
    MotionInput in;
    in.time = in.distance = t;
    in.walking = 1;
    walk.pose(in, pose);
    forward_kinematics(skeleton, pose, globals);
    for (auto& g : globals) g.translation += pose.root + Vec3d{0, 0, -t};
    meter.add(globals, {0, 0, -t});
  }
  return meter.measure();
}

}  // namespace

TEST_CASE("feet are found by where they are") {
  const Skeleton s = make_humanoid({.gaussians = 2000}).skeleton;
  const auto feet = find_feet(s);
  REQUIRE(feet.size() == 2);
  for (const Foot& f : feet) {
    REQUIRE(f.joints.size() == 2);
    CHECK(s.names[f.joints[0]].find("ankle") != std::string::npos);
    CHECK(s.names[f.joints[1]].find("foot") != std::string::npos);
    const auto rest = s.rest_globals();
    REQUIRE(f.sole.size() == 3);
    for (const SolePoint& p : f.sole) CHECK((rest[p.joint] * p.local).y == doctest::Approx(0.0));
    CHECK((rest[f.sole[0].joint] * f.sole[0].local).z >
          (rest[f.sole[1].joint] * f.sole[1].local).z + 0.1);
  }
  FootSlideMeter meter({Foot{{0}, {{0, {}}}}});
  for (int k = 0; k < 10; ++k)
    meter.add({{Mat3d::identity(), {0.001 * k, k < 5 ? 0.0 : 0.1, 0}}}, {0.02 * k, 0, 0});
  const FootSlide slide = meter.measure();
  CHECK(slide.contacts == 1);
  CHECK(slide.total == doctest::Approx(0.004));
}

TEST_CASE("a recorded walk goes where it is sent without sliding, whatever its own root did") {
  const Skeleton s = make_humanoid({.gaussians = 2000}).skeleton;
  const WalkMotion gait = WalkMotion::create(s).value();
  const double truth = gait.stride();
  // Its feet stay where they are put: what is measured is how the meter sees a foot land and leave.
  const FootSlide pinned = slide_of(s, gait, 6.0);
  MESSAGE("the procedural walk itself: " << 1e3 * pinned.mean << " mm a step");
  for (const double heading : {0.0, 2.0}) {
    for (const bool on_the_spot : {false, true}) {
      const ClipWalk walk = ClipWalk::create(s, recorded(s, heading, on_the_spot)).value();
      CHECK(walk.keys() == 60);
      CHECK(walk.stride() == doctest::Approx(truth).epsilon(0.03));
      const FootSlide slide = slide_of(s, walk, 6.0);
      MESSAGE("heading " << heading << std::string(on_the_spot ? ", on the spot" : "") << ": stride "
                         << walk.stride() << " of " << truth << " m, feet slide " << 1e3 * slide.mean
                         << " mm a step, " << 1e3 * slide.greatest << " at most");
      CHECK(slide.contacts >= 8);
      CHECK(slide.mean < pinned.mean + 0.012);
      // It stands on the floor, faces -Z, and repeats after a stride.
      LocalPose a, b;
      MotionInput in;
      in.walking = 1;
      in.distance = 0.4;
      walk.pose(in, a);
      in.distance += 3 * walk.stride();
      walk.pose(in, b);
      for (std::size_t j = 0; j < s.size(); ++j)
        CHECK(std::abs(dot(a.rotations[j], b.rotations[j])) > 1 - 1e-9);
      const auto joints = joints_at(s, a);
      const auto at = [&](const char* n) {
        return joints[static_cast<std::size_t>(s.find(n))].translation;
      };
      CHECK(at("left_hip").x < at("right_hip").x - 0.1);
      double low = 9;
      for (const Foot& f : find_feet(s)) {
        for (const SolePoint& p : f.sole) low = std::min(low, (joints[p.joint] * p.local).y + a.root.y);
      }
      CHECK(std::abs(low) < 0.02);
    }
  }
  MotionClip clip = recorded(s, 0, false);
  ClipWalkOptions options;
  options.first = 30;
  options.keys = 40;
  CHECK(ClipWalk::create(s, clip, options).message().find("keys 30 to 70 of 61") != std::string::npos);
  options = {};
  options.turn_per_cycle = 0;
  CHECK(ClipWalk::create(s, clip, options).message().find("turn_per_cycle") != std::string::npos);
  for (std::size_t t = 1; t < clip.frames(); ++t) {
    std::copy_n(clip.rotations.begin(), s.size(),
                clip.rotations.begin() + static_cast<std::ptrdiff_t>(t * s.size()));
    std::copy_n(clip.translations.begin(), s.size(),
                clip.translations.begin() + static_cast<std::ptrdiff_t>(t * s.size()));
  }
  CHECK(ClipWalk::create(s, clip).message().find("the feet lead") != std::string::npos);
}

TEST_CASE("joints are matched by name, between rigs that face different ways") {
  const Skeleton body = make_humanoid({.gaussians = 2000}).skeleton;
  CHECK(rest_heading(body).value() == doctest::Approx(0.0));
  const auto found = find_body_joints(body);
  CHECK(std::all_of(found.begin(), found.end(), [](int j) { return j >= 0; }));
  Skeleton none = body;
  for (std::string& n : none.names) n = "x" + n;
  CHECK(match_joints(none, body).message().find("left_hip") != std::string::npos);
  const std::string asf = data_file("avatars/cmu_mocap/11.asf"),
                    amc = data_file("avatars/cmu_mocap/11_01.amc");
  if (asf.empty() || amc.empty()) return;
  const io::LoadedMotion cmu = io::load_amc(asf, amc).value();
  CHECK(std::abs(rest_heading(cmu.skeleton).value()) ==
        doctest::Approx(3.14159265).epsilon(1e-3));  // it faces +Z
  std::vector<std::pair<const char*, Skeleton>> targets{{"humanoid", body}};
  const TestBody makehuman = makehuman_body("male");
  if (makehuman.ok) targets.emplace_back("makehuman", makehuman.loaded.mesh.skeleton);
  for (const auto& [name, target] : targets) {
    const auto options = match_joints(cmu.skeleton, target);
    CAPTURE(options.status().message());
    REQUIRE(options.ok());
    CHECK(options->joints.size() >= 20);
    const MotionClip clip = retarget(cmu.clip, cmu.skeleton, target, *options).value();
    // Limbs point where the recording's do, turned to face -Z.
    const auto from = find_body_joints(cmu.skeleton), to = find_body_joints(target);
    double worst = 0;
    for (std::size_t t = 0; t < clip.frames(); t += 40) {
      LocalPose a, b;
      cmu.clip.pose({static_cast<double>(t) / 120}, a);
      clip.pose({static_cast<double>(t) / 120}, b);
      const auto ga = joints_at(cmu.skeleton, a), gb = joints_at(target, b);
      for (const auto& [upper, lower] :
           {std::pair{6, 7}, {7, 8}, {10, 11}, {11, 12}, {15, 16}, {16, 17}, {19, 20}, {20, 21}}) {
        const auto place = [](const auto& g, int j) {
          return g[static_cast<std::size_t>(j)].translation;
        };
        const std::size_t u = static_cast<std::size_t>(upper), l = static_cast<std::size_t>(lower);
        const Vec3d d = normalized(place(ga, from[l]) - place(ga, from[u])),
                    e = normalized(place(gb, to[l]) - place(gb, to[u]));
        worst = std::max(worst, norm(Vec3d{-d.x, d.y, -d.z} - e));
      }
    }
    CHECK(worst < 1e-2);  // the rigs' headings are those of their hips
    ClipWalkOptions cycle;
    const auto walk = ClipWalk::create(target, clip, cycle);
    CAPTURE(walk.status().message());
    REQUIRE(walk.ok());
    LocalPose pose;
    MotionInput in;
    in.walking = 1;
    walk->pose(in, pose);
    const auto joints = joints_at(target, pose);
    const auto hip = [&](std::size_t k) { return joints[static_cast<std::size_t>(to[k])].translation; };
    CHECK(hip(6).x < hip(10).x);  // nobody walks backwards
    const FootSlide slide = slide_of(target, *walk, 8.0);
    std::printf(
        "11_01 on the %s: keys %zu to %zu are a cycle of %.2f m at %.2f m/s; feet slide %.1f mm a step, "
        "%.1f at most\n",
        name, walk->first_key(), walk->first_key() + walk->keys(), walk->stride(), walk->speed(),
        1e3 * slide.mean, 1e3 * slide.greatest);
    CHECK(walk->stride() > 0.5);
    CHECK(walk->stride() < 2.0);  // the recording speeds up to a kick
    CHECK(slide.mean < 0.05);
  }
}

TEST_CASE("MakeHuman walks upright and on the floor, by its own clip and by others'") {
  const TestBody body = makehuman_body("male");
  const std::string bvh = data_file("avatars/makehuman_cc0/walk1.bvh"),
                    asf = data_file("avatars/cmu_mocap/11.asf"),
                    amc = data_file("avatars/cmu_mocap/11_01.amc");
  if (!body.ok || bvh.empty() || asf.empty()) return;
  const Skeleton& target = body.loaded.mesh.skeleton;
  struct Source {
    const char* name;
    Skeleton skeleton;
    MotionClip clip;
    ClipWalkOptions cycle;
  };
  std::vector<Source> sources;
  {
    io::LoadedMotion m = io::load_bvh(bvh, {0.1, true}).value();
    sources.push_back({"walk1.bvh", m.skeleton, m.clip, {}});
    m = io::load_amc(asf, amc).value();
    sources.push_back({"11_01.amc, keys 200 to 330", m.skeleton, m.clip, {}});
    sources.back().cycle.first = 200;
    sources.back().cycle.keys = 130;
    const TestBody lumberjack = gltf_body("lumberjack.glb");
    if (lumberjack.ok)
      sources.push_back(
          {"lumberjack.glb", lumberjack.loaded.mesh.skeleton, lumberjack.loaded.clips[0].clip, {}});
  }
  const auto joints = find_body_joints(target);
  const double rest_height = target.rest_globals()[static_cast<std::size_t>(joints[5])].translation.y;
  for (Source& source : sources) {
    CAPTURE(source.name);
    const MotionClip clip =
        retarget(source.clip, source.skeleton, target, match_joints(source.skeleton, target).value())
            .value();
    const auto walk = ClipWalk::create(target, clip, source.cycle);
    CAPTURE(walk.status().message());
    REQUIRE(walk.ok());
    const auto feet = find_feet(target);
    double lean = 0, low = 9, high = -9, head = 0;
    LocalPose pose;
    for (int k = 0; k < 100; ++k) {
      MotionInput in;
      in.walking = 1;
      in.distance = 0.01 * k * walk->stride();
      walk->pose(in, pose);
      const auto at = joints_at(target, pose);
      const auto place = [&](std::size_t j) {
        return at[static_cast<std::size_t>(joints[j])].translation;
      };
      const Vec3d trunk = place(4) - place(0);
      lean = std::max(lean, std::atan2(std::hypot(trunk.x, trunk.z), trunk.y) * 57.29577951308232);
      double sole = 9;
      for (const Foot& f : feet) {
        for (std::size_t i = 0; i < 2; ++i)  // heel and ball; toes bend
          sole = std::min(sole, (at[f.sole[i].joint] * f.sole[i].local + pose.root).y);
      }
      low = std::min(low, sole);
      high = std::max(high, sole);
      head = std::max(head, (place(5) + pose.root).y / rest_height);
    }
    const FootSlide slide = slide_of(target, *walk, 8.0);
    std::printf(
        "MakeHuman by %s: %.2f m a cycle, leans %.0f degrees at most, soles %.0f to %.0f mm over the "
        "floor, feet slide "
        "%.1f mm a step, %.1f at most\n",
        source.name, walk->stride(), lean, 1e3 * low, 1e3 * high, 1e3 * slide.mean,
        1e3 * slide.greatest);
    CHECK(walk->stride() > 0.6);
    CHECK(walk->stride() < 2.0);
    CHECK(lean < 35);
    CHECK(low > -0.03);
    CHECK(high < 0.03);
    CHECK(head > 0.9);
    CHECK(head < 1.05);
    CHECK(slide.mean < 0.08);
  }
}

TEST_CASE("feet that are held stay where they are; what they carry keeps its shape") {
  const Skeleton s = make_humanoid({.gaussians = 2000}).skeleton;
  const auto feet = find_feet(s);
  const auto legs = find_legs(s, feet).value();
  CHECK(s.names[legs[0].hip].find("hip") != std::string::npos);
  CHECK(s.names[legs[0].knee].find("knee") != std::string::npos);
  CHECK(s.names[legs[1].ankle].find("ankle") != std::string::npos);
  // The recorded walk round a bend of 1 m, on which its feet would slide.
  const ClipWalk walk = ClipWalk::create(s, recorded(s, 0, false)).value();
  std::vector<std::vector<Affine3<double>>> frames;
  std::vector<Vec3d> bodies;
  FootSlideMeter before(feet), after(feet);
  for (double t = 0; t < 6; t += 0.025) {
    LocalPose pose;
    MotionInput in;
    in.time = in.distance = t;
    in.walking = 1;
    walk.pose(in, pose);
    auto& globals = frames.emplace_back(joints_at(s, pose));
    bodies.push_back({1 - std::cos(t), 0, -std::sin(t)});
    const Affine3<double> placed{rotation_matrix(axis_angle(Vec3d{0, 1, 0}, -t)), bodies.back()};
    for (auto& g : globals) {
      g.translation += pose.root;
      g = placed * g;
    }
    before.add(globals, bodies.back());
  }
  const auto free = frames;
  const FootLockReport report = lock_feet(s, feet, 40, bodies, frames).value();
  for (std::size_t t = 0; t < frames.size(); ++t) after.add(frames[t], bodies[t]);
  const FootSlide a = before.measure(), b = after.measure();
  std::printf(
      "round a bend of 1 m: feet slide %.1f mm a step, %.1f at most; held %.1f and %.1f (moved by up to "
      "%.1f mm)\n",
      1e3 * a.mean, 1e3 * a.greatest, 1e3 * b.mean, 1e3 * b.greatest, 1e3 * report.moved);
  CHECK(a.mean > 0.02);
  CHECK(b.mean < 0.25 * a.mean);
  CHECK(report.moved <= 0.1);
  double stretch = 0, rigid = 0, jump = 0, heading = 0;
  for (std::size_t t = 0; t < frames.size(); ++t) {
    for (const LegJoints& leg : legs) {
      const auto length = [&](const auto& g, std::size_t i, std::size_t j) {
        return norm(g[i].translation - g[j].translation);
      };
      stretch = std::max(
          stretch, std::abs(length(frames[t], leg.hip, leg.knee) - length(free[t], leg.hip, leg.knee)));
      stretch = std::max(stretch, std::abs(length(frames[t], leg.knee, leg.ankle) -
                                           length(free[t], leg.knee, leg.ankle)));
      for (const std::size_t j : leg.foot) {
        heading = std::max(heading, norm(frames[t][j].linear.row[0] - free[t][j].linear.row[0]));
        if (t > 0) {
          const Vec3d moved = frames[t][j].translation - frames[t - 1][j].translation;
          jump = std::max(jump, norm(moved - (free[t][j].translation - free[t - 1][j].translation)));
        }
      }
    }
    for (std::size_t j = 0; j < s.size(); ++j) {
      const Mat3d m = frames[t][j].linear * transpose(frames[t][j].linear);
      for (int k = 0; k < 9; ++k)
        rigid = std::max(rigid, std::abs(m(k / 3, k % 3) - (k % 4 == 0 ? 1.0 : 0.0)));
    }
  }
  CHECK(stretch < 1e-9);
  CHECK(rigid < 1e-9);
  CHECK(heading < 1e-12);
  CHECK(jump < 0.03);  // metres a frame on top of the walk's own: nothing snaps
  bodies.pop_back();
  CHECK(lock_feet(s, feet, 40, bodies, frames).message().find("bodies") != std::string::npos);
  CHECK(find_legs(s, {feet[0]}).message().find("1 feet") != std::string::npos);
}

TEST_CASE("real walks on their own bodies do not slide") {
  for (const char* name : {"lumberjack.glb", "cesium_man.gltf"}) {
    const TestBody body = gltf_body(name);
    if (!body.ok) continue;
    const auto walk = ClipWalk::create(body.loaded.mesh.skeleton, body.loaded.clips[0].clip);
    CAPTURE(walk.status().message());
    REQUIRE(walk.ok());
    const FootSlide slide = slide_of(body.loaded.mesh.skeleton, *walk, 8.0);
    std::printf(
        "%s: a cycle of %.2f m at %.2f m/s; feet slide %.1f mm a step, %.1f at most, %zu steps\n", name,
        walk->stride(), walk->speed(), 1e3 * slide.mean, 1e3 * slide.greatest, slide.contacts);
    CHECK(walk->stride() > 0.5);
    CHECK(walk->stride() < 2.5);
    CHECK(slide.mean < 0.05);
  }
}
