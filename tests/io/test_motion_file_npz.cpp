// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cmath>

#include "avatar_npz.hpp"
#include "gsnav/detail/avatar/smpl_joints.hpp"
#include "gsnav/detail/demo/humanoid.hpp"
#include "gsnav/detail/io/avatar_file.hpp"
#include "gsnav/detail/io/motion_file.hpp"
#include "support/files.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

void put_matrix(std::vector<double>& to, const Affine3<double>& m) {
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) to.push_back(m.linear(i, k));
    to.push_back(m.translation[i]);
  }
  to.insert(to.end(), {0.0, 0.0, 0.0, 1.0});
}

TestArray number(double v) { return {{}, {v}, false}; }

/// A driver of the walking humanoid.
TestArrays walking(const Skeleton& skeleton, std::size_t frames) {
  const auto walk = WalkMotion::create(skeleton, GaitOptions{});
  TestArray mats{{frames, skeleton.size(), 4, 4}, {}, false};
  LocalPose pose;
  std::vector<Affine3<double>> globals;
  for (std::size_t t = 0; t < frames; ++t) {
    walk->pose(static_cast<double>(t) / 25.0, 1.0, 0.0, pose);
    forward_kinematics(skeleton, pose, globals);
    for (auto g : globals) {
      g.translation.z -= 0.03 * static_cast<double>(t);
      put_matrix(mats.values, g);
    }
  }
  TestArrays out;
  out["joint_mats"] = mats;
  out["joint_mats_fps"] = out["fps"] = number(25);
  out["joint_mats_version"] = number(1);
  out["joint_mats_joint_count"] = number(static_cast<double>(skeleton.size()));
  return out;
}

std::vector<Affine3<double>> pose_at(const MotionClip& clip, const Skeleton& skeleton, double time) {
  LocalPose pose;
  clip.pose({time}, pose);
  std::vector<Affine3<double>> globals;
  forward_kinematics(skeleton, pose, globals);
  for (auto& g : globals) g.translation += pose.root;
  return globals;
}

}  // namespace

TEST_CASE("driver: keys come back, bones keep their length between them") {
  TempFolder folder("driver");
  const Skeleton skeleton = make_humanoid({.gaussians = 2000}).skeleton;
  TestArrays arrays = walking(skeleton, 20);
  arrays["proxy_capsules"] = {{20, 1, 7}, std::vector<double>(140, 0.25)};
  write_npz(folder / "d.npz", arrays);
  const auto driver = io::load_driver(folder / "d.npz", skeleton);
  CAPTURE(driver.status().message());
  REQUIRE(driver.ok());
  CHECK(driver->clip.frame_rate == 25.0);
  REQUIRE(driver->clip.frames() == 20);
  REQUIRE(driver->capsules.size() == 20);
  CHECK(driver->capsules[7].at(0).radius == 0.25);
  double worst = 0, stretch = 0;
  for (int t = 0; t < 20; ++t) {
    const auto g = pose_at(driver->clip, skeleton, t / 25.0),
               half = pose_at(driver->clip, skeleton, (t + 0.5) / 25.0);
    for (std::size_t j = 0; j < 55; ++j) {
      const double* m = &arrays["joint_mats"].values[16 * (55 * static_cast<std::size_t>(t) + j)];
      worst = max(worst, norm(g[j].translation - Vec3d{m[3], m[7], m[11]}));
      for (int k = 0; k < 9; ++k)
        worst = max(worst, std::abs(g[j].linear(k / 3, k % 3) - m[4 * (k / 3) + k % 3]));
      if (t == 19 || j == 0) continue;
      const auto p = static_cast<std::size_t>(skeleton.parents[j]);
      stretch = max(stretch, std::abs(norm(half[j].translation - half[p].translation) -
                                      norm(skeleton.rest_local[j].translation)));
    }
  }
  CHECK(worst < 1e-12);
  CHECK(stretch < 1e-12);
}

TEST_CASE("driver: what does not fit is named") {
  TempFolder folder("driver_bad");
  const Skeleton skeleton = make_humanoid({.gaussians = 2000}).skeleton;
  const TestArrays good = walking(skeleton, 3);
  const auto fails = [&](auto change, Errc code, const std::string& part) {
    TestArrays arrays = good;
    change(arrays);
    write_npz(folder / "some.npz", arrays);
    const Status s = io::load_driver(folder / "some.npz", skeleton).status();
    CAPTURE(s.message());
    CHECK(s.code() == code);
    CHECK(contains(s.message(), "some.npz"));
    CHECK(contains(s.message(), part));
  };
  fails([](auto& a) { a.erase("joint_mats"); }, Errc::invalid_file, "'joint_mats'");
  fails([](auto& a) { a["fps"] = number(30); }, Errc::invalid_file, "fps is 30");
  fails([](auto& a) { a["joint_mats_fps"] = number(0); }, Errc::invalid_file, "must be positive");
  fails([](auto& a) { a.erase("fps"), a.erase("joint_mats_fps"); }, Errc::invalid_file, "neither");
  fails([](auto& a) { a["joint_mats_version"] = number(2); }, Errc::unsupported,
        "joint_mats_version is 2");
  fails([](auto& a) { a["joint_mats_joint_count"] = number(24); }, Errc::invalid_file,
        "joint_mats_joint_count");
  fails([](auto& a) { a["joint_mats"].shape = {15, 11, 4, 4}; }, Errc::invalid_file, "[15, 11, 4, 4]");
  fails([](auto& a) { a["joint_mats"].values[16 * 60] = 2; }, Errc::invalid_file,
        "frame 1, joint 5 is not rigid");
  fails([](auto& a) { a["joint_mats"].values[16 * 60 + 3] = NAN; }, Errc::invalid_file, "row 1 has nan");
  fails(
      [](auto& a) {
        a["proxy_capsules"] = {{2, 1, 7}, std::vector<double>(14, 0.1)};
      },
      Errc::invalid_file, "[2, 1, 7]");
  fails(
      [](auto& a) {
        a["proxy_capsules"] = {{3, 1, 7}, std::vector<double>(21, -1)};
      },
      Errc::invalid_file, "radius");
  const std::vector<io::NpzEntry> text{{"joint_mats_space", {}, std::string("world")}};
  REQUIRE(io::save_npz(folder / "t.npz", text).ok());
  CHECK(contains(io::load_driver(folder / "t.npz", skeleton).status().message(), "'world'"));
}

TEST_CASE("smpl motion: rest joints of a shaped body, kinematics by hand") {
  TempFolder folder("smpl");
  // A body of 55 vertices, each of which is a joint; the one shape moves all of them up by their number.
  const BodyJoints body = body_joints(55);
  TestArrays model;
  TestArray vertices{{55, 3}, {}, false}, regressor{{55, 55}, {}, false}, tree{{2, 55}, {}, false},
      shapes{{55, 3, 1}, {}, false};
  for (std::size_t j = 0; j < 55; ++j) {
    const auto x = static_cast<double>(j);
    vertices.values.insert(vertices.values.end(), {0.1 * x, 1 + 0.01 * x * x, 0.0});
    shapes.values.insert(shapes.values.end(), {0.0, x, 0.0});
    for (std::size_t k = 0; k < 55; ++k) regressor.values.push_back(j == k ? 1.0 : 0.0);
    tree.values.push_back(j == 0 ? 4294967295.0 : static_cast<double>(body.parents[j]));
  }
  for (std::size_t j = 0; j < 55; ++j) tree.values.push_back(static_cast<double>(j));
  model["v_template"] = vertices;
  model["J_regressor"] = regressor;
  model["kintree_table"] = tree;
  model["shapedirs"] = shapes;
  write_npz(folder / "model.npz", model);
  const auto rest = [](std::size_t j) {
    const auto x = static_cast<double>(j);
    return Vec3d{0.1 * x, 1 + 0.01 * x * x + 0.5 * x, 0};
  };
  for (const std::size_t given : {52u, 55u}) {
    TestArrays motion;
    TestArray poses{{2, 3 * given}, std::vector<double>(6 * given), false};
    poses.values[2] = 1.5707963267948966;  // the root by 90 degrees about Z in the first frame
    poses.values[3 * given + 3] =
        1.0471975511965976;  // the left hip by 60 degrees about X in the second
    poses.values[3 * given + 3 * (given == 52 ? 22 : 25) + 1] = 0.25;  // the left index
    motion["poses"] = poses;
    motion["trans"] = {{2, 3}, {1, 2, 3, 4, 5, 6}, false};
    motion["betas"] = {{1}, {0.5}, false};
    motion["mocap_framerate"] = number(120);
    write_npz(folder / "m.npz", motion);
    const auto m = io::load_smpl_motion(folder / "m.npz", folder / "model.npz", {false});
    CAPTURE(m.status().message());
    REQUIRE(m.ok());
    CHECK(m->clip.frame_rate == 120.0);
    const auto first = pose_at(m->clip, m->skeleton, 0),
               second = pose_at(m->clip, m->skeleton, 1 / 120.0);
    const double c = 0.5, s = std::sqrt(0.75);
    for (std::size_t j = 0; j < 55; ++j) {
      const Vec3d d = rest(j) - rest(0);
      CHECK(norm(first[j].translation - (rest(0) + Vec3d{1 - d.y, 2 + d.x, 3})) < 1e-12);
    }
    const Vec3d knee = rest(4) - rest(1);
    CHECK(norm(second[4].translation - (rest(1) + Vec3d{4 + knee.x, 5 + c * knee.y, 6 + s * knee.y})) <
          1e-12);
    CHECK(second[25].linear(0, 2) == doctest::Approx(std::sin(0.25)).epsilon(1e-12));
    const auto up = io::load_smpl_motion(folder / "m.npz", folder / "model.npz").value();
    const auto turned = pose_at(up.clip, up.skeleton, 0);
    for (std::size_t j = 0; j < 55; ++j) {
      const Vec3d p = first[j].translation;
      CHECK(norm(turned[j].translation - Vec3d{p.x, p.z, -p.y}) < 1e-12);
    }
    const auto fails = [&](TestArrays a, TestArrays b, Errc code, const std::string& part) {
      write_npz(folder / "x.npz", a);
      write_npz(folder / "y.npz", b);
      const Status status = io::load_smpl_motion(folder / "x.npz", folder / "y.npz").status();
      CAPTURE(status.message());
      CHECK(status.code() == code);
      CHECK(contains(status.message(), part));
    };
    const auto with = [](TestArrays a, const std::string& key, const TestArray& value) {
      a[key] = value;
      return a;
    };
    fails(with(motion, "poses", {{2, 72}, std::vector<double>(144)}), model, Errc::unsupported,
          "[2, 72]");
    fails(with(motion, "trans", {{3, 3}, std::vector<double>(9)}), model, Errc::invalid_file, "trans");
    fails(with(motion, "betas", {{2}, {0.5, 0.5}}), model, Errc::invalid_file, "1 shapes for 2 betas");
    fails(with(motion, "mocap_framerate", number(-1)), model, Errc::invalid_file, "frame_rate");
    fails(motion, with(model, "kintree_table", {{2, 55}, std::vector<double>(110)}), Errc::invalid_file,
          "kintree_table");
    fails(motion, with(model, "J_regressor", {{3, 55}, std::vector<double>(165)}), Errc::unsupported,
          "3 joints");
  }
}
