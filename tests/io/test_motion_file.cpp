// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <random>
#include <sstream>
#include <tuple>
#include <utility>

#include "allocations.hpp"
#include "gsnav/detail/demo/humanoid.hpp"
#include "gsnav/detail/io/motion_file.hpp"
#include "gsnav/detail/rigging/retarget.hpp"
#include "pose_at.hpp"
#include "support/data.hpp"
#include "support/files.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

const char* const kArm =
    "HIERARCHY\nROOT hips\n{\n OFFSET 1 2 3\n CHANNELS 6 Xposition Zposition Yposition Yrotation "
    "Xrotation Zrotation\n"
    " JOINT arm\n {\n  OFFSET 0 5 0\n  CHANNELS 3 Zrotation Xrotation Yrotation\n"
    "  JOINT hand\n  {\n   OFFSET -4 0 0.5\n   CHANNELS 1 Yrotation\n   End Site\n   {\n    OFFSET 0 1 "
    "0\n   }\n  }\n }\n}\n"
    "MOTION\nFrames: 2\nFrame Time: 0.05\n"
    "0.5 0.25 -1 10 20 30 40 50 60 70\n1 2 3 -10 -200 30 -40 150 -60 7e1\n";

Result<io::LoadedMotion> load_clip(const std::string& text, const io::BvhOptions& options = {}) {
  TempFolder folder("bvh");
  write_file(folder / "some.bvh", text);
  return io::load_bvh(folder / "some.bvh", options);
}

using Real = long double;
using Matrix4 = std::array<std::array<Real, 4>, 4>;

Matrix4 times(const Matrix4& a, const Matrix4& b) {
  Matrix4 c{};
  for (std::size_t i = 0; i < 4; ++i) {
    for (std::size_t j = 0; j < 4; ++j) {
      for (std::size_t k = 0; k < 4; ++k) c[i][j] += a[i][k] * b[k][j];
    }
  }
  return c;
}

Matrix4 moved(Real x, Real y, Real z) {
  return {{{1, 0, 0, x}, {0, 1, 0, y}, {0, 0, 1, z}, {0, 0, 0, 1}}};
}

/// Rotation about 'X', 'Y' or 'Z', by the textbook.
Matrix4 turned(char axis, Real degrees) {
  const Real a = degrees * std::acos(Real{-1}) / 180, c = std::cos(a), s = std::sin(a);
  if (axis == 'X') return {{{1, 0, 0, 0}, {0, c, -s, 0}, {0, s, c, 0}, {0, 0, 0, 1}}};
  if (axis == 'Y') return {{{c, 0, s, 0}, {0, 1, 0, 0}, {-s, 0, c, 0}, {0, 0, 0, 1}}};
  return {{{c, -s, 0, 0}, {s, c, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}}};
}

}  // namespace

TEST_CASE("bvh: kinematics against matrices in long double") {
  const io::LoadedMotion m = load_clip(kArm).value();
  CHECK(m.skeleton.names == std::vector<std::string>{"hips", "arm", "hand"});
  CHECK(m.skeleton.parents == std::vector<std::int32_t>{-1, 0, 1});
  CHECK(m.clip.frame_rate == doctest::Approx(20.0));
  REQUIRE(m.clip.frames() == 2);
  const Real f[2][10] = {{0.5L, 0.25L, -1, 10, 20, 30, 40, 50, 60, 70},
                         {1, 2, 3, -10, -200, 30, -40, 150, -60, 70}};
  for (std::size_t t = 0; t < 2; ++t) {
    // The first frame's place is nearer to zero than to the OFFSET, so places are added to it.
    const Matrix4 hips =
        times(times(times(moved(1 + f[t][0], 2 + f[t][2], 3 + f[t][1]), turned('Y', f[t][3])),
                    turned('X', f[t][4])),
              turned('Z', f[t][5]));
    const Matrix4 arm =
        times(times(times(times(hips, moved(0, 5, 0)), turned('Z', f[t][6])), turned('X', f[t][7])),
              turned('Y', f[t][8]));
    const Matrix4 hand = times(times(arm, moved(-4, 0, 0.5L)), turned('Y', f[t][9]));
    const auto globals = pose_at(m, 0.05 * static_cast<double>(t));
    const Matrix4* truth[3] = {&hips, &arm, &hand};
    for (std::size_t j = 0; j < 3; ++j) {
      for (std::size_t i = 0; i < 3; ++i) {
        const int row = static_cast<int>(i);
        CHECK(globals[j].translation[row] ==
              doctest::Approx(static_cast<double>((*truth[j])[i][3])).epsilon(1e-12));
        for (std::size_t k = 0; k < 3; ++k) {
          CHECK(std::abs(globals[j].linear(row, static_cast<int>(k)) -
                         static_cast<double>((*truth[j])[i][k])) < 1e-12);
        }
      }
    }
  }
}

TEST_CASE("bvh: units, Z up, and places that replace the offset") {
  const io::LoadedMotion plain = load_clip(kArm).value(), other = load_clip(kArm, {0.01, true}).value();
  for (const double time : {0.0, 0.02, 0.05}) {
    const auto a = pose_at(plain, time), b = pose_at(other, time);
    for (std::size_t j = 0; j < 3; ++j) {
      const Vec3d p = a[j].translation * 0.01;
      CHECK(norm(b[j].translation - Vec3d{p.x, p.z, -p.y}) < 1e-12);
    }
  }
  std::string text = kArm;
  text.replace(text.find("0.5 0.25 -1"), 11, "1.2 2.5 2.2");  // near (1, 2, 3) with its channels X Z Y
  const io::LoadedMotion replaced = load_clip(text).value();
  CHECK(norm(pose_at(replaced, 0)[0].translation - Vec3d{1.2, 2.2, 2.5}) < 1e-12);
  CHECK(norm(pose_at(replaced, 0.05)[0].translation - Vec3d{1, 3, 2}) < 1e-12);
}

TEST_CASE("bvh: what is wrong is named with its line") {
  const auto fails = [](const std::string& from, const std::string& to, const std::string& part) {
    std::string text = kArm;
    text.replace(text.find(from), from.size(), to);
    const Status s = load_clip(text).status();
    CAPTURE(s.message());
    CHECK(s.code() == Errc::invalid_file);
    CHECK(contains(s.message(), "some.bvh"));
    CHECK(contains(s.message(), part));
  };
  fails("HIERARCHY", "HIERARCHIE", "line 1");
  fails("OFFSET 0 5 0", "OFFSET 0 five 0", "line 8: 'five' is not a number");
  fails("OFFSET 0 5 0", "OFFSET 0 nan 0", "'nan' is not a number");
  fails("CHANNELS 1 Yrotation", "CHANNELS 1 Wrotation", "'Wrotation' is not a channel");
  fails("CHANNELS 1 Yrotation", "CHANNELS 7 Yrotation", "must be 0 to 6");
  fails("JOINT hand", "JOINT arm", "name of another joint");
  fails("JOINT hand", "JOINTS hand", "'JOINTS'");
  fails("Frames: 2", "Frames: 3", "is not a number");
  fails("Frames: 2", "Frames: 1", "behind the last frame");
  fails("Frames: 2", "Frames: 1.5", "frames of 10 channels");
  fails("Frames: 2", "Frames: 1e12", "frames of 10 channels");
  fails("Frame Time: 0.05", "Frame Time: 0", "not positive");
  CHECK(load_clip(kArm, {0.0, false}).code() == Errc::invalid_argument);
  CHECK(io::load_bvh("/none/a.bvh").code() == Errc::file_not_found);
  std::mt19937 generator(3);
  int refused = 0;
  for (int i = 0; i < 2000; ++i) {
    std::string text = kArm;
    const std::size_t at = generator() % text.size();
    if (i % 4 == 0) {
      text.resize(at);
    } else {
      text[at] = i % 4 == 1 ? "0123456789-.eE {}\n"[generator() % 18] : static_cast<char>(generator());
    }
    reset_largest_allocation();
    const auto m = load_clip(text);
    REQUIRE(largest_allocation() < 100000);
    REQUIRE((m.ok() || contains(m.status().message(), "some.bvh")));
    refused += m.ok() ? 0 : 1;
  }
  std::printf("bvh: of 2000 mutations %d were refused\n", refused);
  CHECK(refused > 700);
}

TEST_CASE("bvh: the rest pose of real files is the sum of their offsets") {
  for (const char* name :
       {"makehuman_cc0/walk1.bvh", "makehuman_cc0/tpose.bvh", "cmu_mocap/sinusoidal.bvh"}) {
    const std::string path = data_file(std::string("avatars/") + name);
    if (path.empty()) continue;
    const auto m = io::load_bvh(path);
    CAPTURE(m.status().message());
    REQUIRE(m.ok());
    // A reader of its own: offsets summed along the open braces.
    std::istringstream text(read_file(path));
    std::vector<std::array<Real, 3>> sums;
    std::size_t joint = 0;
    const auto rest = m->skeleton.rest_globals();
    bool end_site = false;
    for (std::string word; text >> word && word != "MOTION";) {
      if (word == "End") end_site = true;
      if (word == "}") {
        sums.pop_back();
      } else if (word == "OFFSET") {
        std::array<Real, 3> p = sums.empty() ? std::array<Real, 3>{} : sums.back();
        for (Real& v : p) {
          Real add = 0;
          text >> add;
          v += add;
        }
        sums.push_back(p);
        if (!end_site) {
          for (std::size_t k = 0; k < 3; ++k) {
            CHECK(std::abs(rest[joint].translation[static_cast<int>(k)] - static_cast<double>(p[k])) <
                  1e-12);
          }
          ++joint;
        }
        end_site = false;
      }
    }
    CHECK(joint == m->skeleton.size());
  }
}

TEST_CASE("retarget: to itself, to another size, and from a T pose to an A pose") {
  const io::LoadedMotion m = load_clip(kArm).value();
  RetargetOptions options;
  for (const std::string& name : m.skeleton.names) options.joints.emplace_back(name, name);
  options.root_scale = 1.0;
  const MotionClip same = retarget(m.clip, m.skeleton, m.skeleton, options).value();
  const auto globals = [](const MotionClip& clip, const Skeleton& skeleton, double time) {
    return pose_at({skeleton, clip, {}}, time);
  };
  for (const double time : {0.0, 0.025, 0.05}) {
    const auto a = globals(m.clip, m.skeleton, time), b = globals(same, m.skeleton, time);
    for (std::size_t j = 0; j < 3; ++j) CHECK(norm(a[j].translation - b[j].translation) < 1e-12);
  }
  // A target whose bones are half as long, lie in other directions and have turned frames: each limb
  // points where the source's does.
  Skeleton target;
  target.names = {"a", "b", "c"};
  target.parents = {-1, 0, 1};
  const Mat3d r = rotation_matrix(axis_angle(normalized(Vec3d{1, 2, 3}), 0.7));
  target.rest_local = {{r, {0, 4, 0}}, {r, {1, 2, -1}}, {transpose(r), {0, 2, 0.5}}};
  options.joints = {{"a", "hips"}, {"b", "arm"}, {"c", "hand"}};
  options.yaw = 0.5;
  options.root_scale = 0.5;
  const MotionClip clip = retarget(m.clip, m.skeleton, target, options).value();
  const Mat3d turn = rotation_matrix(axis_angle(Vec3d{0, 1, 0}, 0.5));
  for (const double time : {0.0, 0.05}) {
    const auto a = globals(m.clip, m.skeleton, time), b = globals(clip, target, time);
    for (std::size_t j = 1; j < 3; ++j) {
      const Vec3d want = normalized(turn * (a[j].translation - a[j - 1].translation));
      const Vec3d bone = b[j].translation - b[j - 1].translation;
      CHECK(norm(normalized(bone) - want) < 1e-12);
      CHECK(norm(bone) == doctest::Approx(norm(target.rest_local[j].translation)).epsilon(1e-12));
    }
    const Vec3d path = turn * (a[0].translation - m.skeleton.rest_local[0].translation) * 0.5;
    CHECK(norm(b[0].translation - target.rest_local[0].translation - path) < 1e-12);
  }
  options.joints[1].second = "leg";
  CHECK(contains(retarget(m.clip, m.skeleton, target, options).status().message(), "\"leg\""));
  options.joints.erase(options.joints.begin());
  options.joints[0].second = "arm";
  CHECK(contains(retarget(m.clip, m.skeleton, target, options).status().message(), "root"));
}

TEST_CASE("retarget: further roots of the target go with the first one, with a pair or without") {
  const io::LoadedMotion m = load_clip(kArm).value();
  Skeleton target;
  target.names = {"a", "b", "c", "loose", "paired", "finger"};
  target.parents = {-1, 0, 1, -1, -1, 3};
  const Mat3d r = rotation_matrix(axis_angle(normalized(Vec3d{1, 2, 3}), 0.7));
  target.rest_local = {{r, {0, 4, 0}},           {r, {1, 2, -1}},           {transpose(r), {0, 2, 0.5}},
                       {r * r, {0.5, 5, -0.25}}, {transpose(r), {2, 1, 1}}, {r, {0, 0.5, 0}}};
  RetargetOptions options;
  options.joints = {{"a", "hips"}, {"b", "arm"}, {"c", "hand"}};
  options.yaw = 0.5;
  options.root_scale = 0.5;
  const MotionClip without = retarget(m.clip, m.skeleton, target, options).value();
  options.joints.emplace_back("paired", "arm");
  const MotionClip with = retarget(m.clip, m.skeleton, target, options).value();
  const auto rest = target.rest_globals();
  for (const double time : {0.0, 0.05}) {
    const auto a = pose_at({target, without, {}}, time), b = pose_at({target, with, {}}, time);
    const Affine3<double> moved = a[0] * rigid_inverse(rest[0]);
    const auto differ = [](const Affine3<double>& p, const Affine3<double>& q) {
      double worst = norm(p.translation - q.translation);
      for (int i = 0; i < 3; ++i) {
        for (int k = 0; k < 3; ++k) worst = std::max(worst, std::abs(p.linear(i, k) - q.linear(i, k)));
      }
      return worst;
    };
    CHECK(norm(moved.translation) > 0.5);
    for (const std::size_t j : {0u, 3u, 4u, 5u}) {
      CHECK(differ(a[j], moved * rest[j]) < 1e-12);
      if (j != 4) CHECK(differ(b[j], moved * rest[j]) < 1e-12);
    }
    CHECK(norm(b[4].translation - moved * rest[4].translation) < 1e-12);
    // A pair turns it as its source has turned.
    const auto source = pose_at(m, time);
    const std::size_t arm = static_cast<std::size_t>(m.skeleton.find("arm"));
    const Mat3d turn = rotation_matrix(axis_angle(Vec3d{0, 1, 0}, 0.5));
    const Mat3d want = turn * source[arm].linear * transpose(m.skeleton.rest_globals()[arm].linear) *
                       transpose(turn) * rest[4].linear;
    CHECK(differ(b[4], {want, b[4].translation}) < 1e-12);
  }
}

TEST_CASE("retarget: a clip's own time is kept: its rate, its start, and what comes after its end") {
  const io::LoadedMotion m = load_clip(kArm).value();  // two keys, 0.05 s apart
  RetargetOptions options;
  for (const std::string& name : m.skeleton.names) options.joints.emplace_back(name, name);
  options.root_scale = 1.0;
  for (const ClipEnd end : {ClipEnd::hold, ClipEnd::loop, ClipEnd::loop_forward}) {
    MotionClip clip = m.clip;
    clip.end = end;
    clip.playback_rate = 0.4;
    clip.start = 0.02;
    clip.wrap_time = 0.13;
    const MotionClip same = retarget(clip, m.skeleton, m.skeleton, options).value();
    for (const double time : {0.0, 0.05, 0.11, 0.2, 0.5, 1.3}) {
      const auto a = pose_at({m.skeleton, clip, {}}, time), b = pose_at({m.skeleton, same, {}}, time);
      CAPTURE(time);
      for (std::size_t j = 0; j < 3; ++j) CHECK(norm(a[j].translation - b[j].translation) < 1e-12);
    }
  }
}

TEST_CASE("retarget: a real walk on the humanoid, limb by limb") {
  const std::string path = data_file("avatars/makehuman_cc0/walk1.bvh");
  if (path.empty()) return;
  const io::LoadedMotion walk = io::load_bvh(path, {0.1, true}).value();
  const Skeleton body = make_humanoid({.gaussians = 2000}).skeleton;
  RetargetOptions options;
  options.yaw = std::acos(-1.0);  // MakeHuman faces +Z here
  options.joints = {{"pelvis", "Root"}};
  for (const std::string side : {"L", "R"}) {
    const std::string name = side == "L" ? "left_" : "right_";
    for (const auto& [to, from] : {std::pair{"hip", "UpLeg_"},
                                   {"knee", "LoLeg_"},
                                   {"ankle", "Foot_"},
                                   {"shoulder", "UpArm_"},
                                   {"elbow", "LoArm_"},
                                   {"wrist", "Hand_"}}) {
      options.joints.emplace_back(name + to, from + side);
    }
  }
  const MotionClip clip = retarget(walk.clip, walk.skeleton, body, options).value();
  REQUIRE(clip.frames() == 14);
  double worst = 0, lowest = 1, highest = -1;
  for (std::size_t t = 0; t < 14; ++t) {
    const double time = static_cast<double>(t) / clip.frame_rate;
    const auto a = pose_at(walk, time), b = pose_at({body, clip, {}}, time);
    const auto place = [](const auto& globals, const Skeleton& s, const std::string& name) {
      return globals[static_cast<std::size_t>(s.find(name))].translation;
    };
    double foot = 9;
    for (const std::string side : {"L", "R"}) {
      const std::string name = side == "L" ? "left_" : "right_";
      for (const auto& [to, from, next_to, next_from] : {std::tuple{"hip", "UpLeg_", "knee", "LoLeg_"},
                                                         {"knee", "LoLeg_", "ankle", "Foot_"},
                                                         {"shoulder", "UpArm_", "elbow", "LoArm_"},
                                                         {"elbow", "LoArm_", "wrist", "Hand_"}}) {
        const Vec3d d =
            normalized(place(a, walk.skeleton, next_from + side) - place(a, walk.skeleton, from + side));
        const Vec3d e = normalized(place(b, body, name + next_to) - place(b, body, name + to));
        worst = max(worst, norm(Vec3d{-d.x, d.y, -d.z} - e));
      }
      foot = min(foot, place(b, body, name + "ankle").y);
    }
    lowest = min(lowest, foot);
    highest = max(highest, foot);
  }
  CHECK(worst < 1e-12);
  // The clip walks on the spot without rising: the standing foot stays near the floor.
  std::printf("walk1 on the humanoid: the lower ankle is %.3f to %.3f m high\n", lowest, highest);
  CHECK(lowest > -0.05);
  CHECK(highest < 0.25);
}
