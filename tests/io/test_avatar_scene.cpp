// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "gsnav/detail/demo/humanoid.hpp"
#include "gsnav/detail/io/avatar_file.hpp"
#include "gsnav/detail/io/avatar_scene_file.hpp"
#include "gsnav/detail/io/motion_file.hpp"
#include "gsnav/detail/io/npz_file.hpp"
#include "support/files.hpp"
#include "support/joints.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

/// A walk of 41 frames along -Z, at a height of 3 m, moved by `by` as a whole.
io::DriverFrames walking(const AvatarAsset& person, const Affine3<double>& by, bool capsules) {
  const WalkMotion walk = WalkMotion::create(person.skeleton).value();
  io::DriverFrames frames;
  frames.joints = person.skeleton.size();
  LocalPose pose;
  std::vector<Affine3<double>> joints;
  for (int t = 0; t <= 40; ++t) {
    walk.pose(t / 40.0, 1.0, 0.0, pose);
    forward_kinematics(person.skeleton, pose, joints);
    for (auto& m : joints) {
      m.translation += Vec3d{0.5, 3, -0.03 * t};
      m = by * m;
    }
    frames.matrices.insert(frames.matrices.end(), joints.begin(), joints.end());
    if (!capsules) continue;
    auto& row = frames.capsules.emplace_back();
    for (const ProxyCapsule& c : person.capsules)
      row.push_back({joints[c.joint] * c.p0, joints[c.joint] * c.p1, c.radius});
  }
  return frames;
}

const Affine3<double> kFlipped{{{{1, 0, 0}, {0, -1, 0}, {0, 0, -1}}}, {}};

double apart(const std::vector<Vec3d>& a, const std::vector<Vec3d>& b) {
  double worst = 0;
  for (std::size_t j = 0; j < a.size(); ++j) worst = std::max(worst, norm(a[j] - b[j]));
  return worst;
}

}  // namespace

TEST_CASE("avatar scene: Habitat-GS's file puts people where its frames say") {
  const TempFolder folder("avatar_scene");
  AvatarAsset person = make_humanoid({.gaussians = 2000});
  AvatarAsset bare = person;
  bare.capsules.clear();
  REQUIRE(io::save_avatar(folder / "a.npz", bare).ok());
  const Affine3<double> moved{rotation_matrix(axis_angle(Vec3d{0, 1, 0}, 0.4)), {1, 0.25, 2}};
  REQUIRE(io::save_driver(folder / "d.npz", walking(person, {}, true)).ok());
  REQUIRE(io::save_driver(folder / "down.npz", walking(person, kFlipped, false)).ok());
  std::vector<float> rows;
  for (int t = 0; t <= 40; ++t)
    rows.insert(rows.end(), {1, 0.25f, 2, 0, std::sin(0.2f), 0, std::cos(0.2f)});
  const std::vector<io::NpzEntry> trajectory{{"trajectory", {41, 7}, rows}};
  REQUIRE(io::save_npz(folder / "t.npz", trajectory).ok());
  write_file(folder / "x.scene_instance.json", R"({"time_loop": true, "gaussian_avatars": [
    {"name": "plain", "canonical_gaussians": "a.npz", "driver": "d.pkl", "smpl_type": "smplx", "fps": 40},
    {"canonical_gaussians": "a.npz", "driver": "down.npz", "time_begin": 2, "time_end": 9},
    {"canonical_gaussians": "a.npz", "driver": {"smpl_params": "down.npz", "trajectory": null},
     "coord_system": "opencv"},
    {"canonical_gaussians": "a.npz", "driver": {"smpl_parms": "d.npz", "trajectory": "t.npz"}},
    {"canonical_gaussians": "a.npz", "driver": "d.npz", "scale": 1.5, "offset_y": 0.1},
    {"canonical_gaussians": "a.npz", "driver": "d.npz",
     "coord_transform": [[0, 0, 1, 5], [0, 1, 0, 0], [-1, 0, 0, 0], [0, 0, 0, 1]]}]})");
  const auto scene = io::load_avatar_scene(folder / "x.scene_instance.json");
  CAPTURE(scene.status().message());
  REQUIRE(scene.ok());
  REQUIRE(scene->avatars.size() == 6);
  REQUIRE(scene->warnings.size() == 1);
  CHECK(contains(scene->warnings[0], "'fps'"));
  const auto actors = io::load_scene_actors(*scene);
  CAPTURE(actors.status().message());
  REQUIRE(actors.ok());
  const io::DriverFrames truth = walking(person, {}, true);
  for (const int t : {0, 7, 40}) {
    std::vector<Vec3d> want;
    for (std::size_t j = 0; j < 55; ++j)
      want.push_back(truth.matrices[static_cast<std::size_t>(t) * 55 + j].translation);
    const double time = t / 40.0;
    CHECK(apart(joints_in_world((*actors)[0], time), want) < 1e-5);
    CHECK(apart(joints_in_world((*actors)[1], 2 + time), want) < 1e-5);  // guessed to stand on its head
    CHECK(apart(joints_in_world((*actors)[2], time), want) < 1e-5);
    std::vector<Vec3d> turned, far;
    for (const Vec3d& p : want) {
      turned.push_back(moved * p);
      far.push_back({p.z + 5, p.y, -p.x});
    }
    CHECK(apart(joints_in_world((*actors)[3], time), turned) < 1e-5);
    CHECK(apart(joints_in_world((*actors)[5], time), far) < 1e-5);
    // Scaled about the floor below the root: that point stays, so do feet on the floor of 3 m; all
    // distances grow.
    const auto large = joints_in_world((*actors)[4], time);
    CHECK(norm(Vec3d{large[0].x, 0, large[0].z} - Vec3d{want[0].x, 0, want[0].z}) < 1e-5);
    CHECK(norm(large[15] - large[7]) == doctest::Approx(1.5 * norm(want[15] - want[7])).epsilon(1e-5));
    double low = 9, least = 9;
    for (const Vec3d& p : large) low = std::min(low, p.y);
    for (const Vec3d& p : want) least = std::min(least, p.y);
    CHECK(low - 0.1 == doctest::Approx(least).epsilon(0.01));
    CHECK(std::abs((low - 0.1 - 3) - 1.5 * (least - 3)) < 0.02);
  }
  CHECK((*actors)[0].asset()->capsules.size() == person.capsules.size());  // from the driver
  CHECK_FALSE((*actors)[1].active(1.9));
  CHECK((*actors)[1].active(8.9));
  // The last pose is held.
  CHECK(apart(joints_in_world((*actors)[1], 8.9), joints_in_world((*actors)[1], 3.0)) < 1e-9);
  CHECK((*actors)[0].active(0.99));
  CHECK_FALSE((*actors)[0].active(1.01));
}

TEST_CASE("avatar scene: a body of several roots is moved as one, by a path and by coordinates") {
  const TempFolder folder("avatar_roots");
  const AvatarAsset person = make_humanoid({.gaussians = 2000});
  AvatarAsset cut = person;
  const auto rest = person.skeleton.rest_globals();
  for (const std::size_t j :
       {std::size_t{15}, std::size_t{20}}) {  // the head and a hand hang on nothing
    cut.skeleton.parents[j] = -1;
    cut.skeleton.rest_local[j] = rest[j];
  }
  REQUIRE(io::save_avatar(folder / "a.npz", cut).ok());
  const io::DriverFrames truth = walking(person, {}, false);
  REQUIRE(io::save_driver(folder / "d.npz", truth).ok());
  const auto place = [](double key) {  // a walk on a circle
    return Affine3<double>{rotation_matrix(axis_angle(Vec3d{0, 1, 0}, 0.02 * key)),
                           {3 * std::cos(0.02 * key), 0.25, 2}};
  };
  std::vector<float> rows;
  for (int t = 0; t <= 40; ++t) {
    const Vec3d at = place(t).translation;
    for (const double v : {at.x, at.y, at.z, 0.0, std::sin(0.01 * t), 0.0, std::cos(0.01 * t)})
      rows.push_back(static_cast<float>(v));
  }
  const std::vector<io::NpzEntry> trajectory{{"trajectory", {41, 7}, rows}};
  REQUIRE(io::save_npz(folder / "t.npz", trajectory).ok());
  write_file(folder / "x.json", R"({"gaussian_avatars": [{"canonical_gaussians": "a.npz",
    "driver": {"smpl_params": "d.npz", "trajectory": "t.npz"},
    "coord_transform": [[0, 0, 1, 5], [0, 1, 0, 0], [-1, 0, 0, 0], [0, 0, 0, 1]]}]})");
  const auto actors = io::load_scene_actors(io::load_avatar_scene(folder / "x.json").value());
  CAPTURE(actors.status().message());
  REQUIRE(actors.ok());
  REQUIRE((*actors)[0].asset()->skeleton.parents == cut.skeleton.parents);
  const auto in_world = [&](int t) {
    std::vector<Vec3d> out;
    for (std::size_t j = 0; j < 55; ++j) {
      const Vec3d p = place(t) * truth.matrices[static_cast<std::size_t>(t) * 55 + j].translation;
      out.push_back({p.z + 5, p.y, -p.x});
    }
    return out;
  };
  for (const int t : {0, 7, 25, 40})
    CHECK(apart(joints_in_world((*actors)[0], t / 40.0), in_world(t)) < 1e-5);
  // Between two keys nothing comes off either.
  auto half = in_world(7);
  const auto next = in_world(8);
  for (std::size_t j = 0; j < half.size(); ++j) half[j] = (half[j] + next[j]) * 0.5;
  CHECK(apart(joints_in_world((*actors)[0], 7.5 / 40), half) < 2e-3);
}

TEST_CASE("avatar scene: what is wrong is named with the avatar and the key") {
  const TempFolder folder("avatar_scene_bad");
  const auto fails = [&](const std::string& avatar, Errc code, const std::string& part) {
    write_file(folder / "some.json", "{\"gaussian_avatars\": [" + avatar + "]}");
    const Status s = io::load_avatar_scene(folder / "some.json").status();
    CAPTURE(s.message());
    CHECK(s.code() == code);
    CHECK(contains(s.message(), "some.json"));
    CHECK(contains(s.message(), part));
  };
  const Errc bad = Errc::invalid_file;
  const std::string good = R"("canonical_gaussians": "a.npz", "driver": "d.npz")";
  fails("7", bad, "gaussian_avatars[0] is '7'");
  fails(R"({"driver": "d.npz"})", bad, "'canonical_gaussians' is missing");
  fails(R"({"canonical_gaussians": 3, "driver": "d.npz"})", bad, "'canonical_gaussians' is '3'");
  fails(R"({"canonical_gaussians": "a.npz"})", bad, "'driver' is missing");
  fails(R"({"canonical_gaussians": "a.npz", "driver": {}})", bad, "'smpl_parms' is missing");
  fails("{" + good + R"(, "scale": 0})", bad, "'scale' is 0");
  fails("{" + good + R"(, "scale": "big"})", bad, "'scale'");
  fails("{" + good + R"(, "time_begin": 3, "time_end": 2})", bad, "'time_end' lies before");
  fails("{" + good + R"(, "coord_system": "upside"})", bad, "upside");
  fails("{" + good + R"(, "coord_transform": [1, 2]})", bad, "'coord_transform' is no rigid");
  fails("{" + good + R"(, "proxy_urdf": "x"})", Errc::unsupported, "proxy_urdf");
  write_file(folder / "some.json", R"({"time_max": -1})");
  CHECK(contains(io::load_avatar_scene(folder / "some.json").status().message(),
                 "'time_max' is negative"));
  write_file(folder / "some.json", R"({"time_loop": 1})");
  CHECK(contains(io::load_avatar_scene(folder / "some.json").status().message(), "'time_loop'"));
  write_file(folder / "some.json", R"({"avatars": {}})");
  CHECK(contains(io::load_avatar_scene(folder / "some.json").status().message(), "must be an array"));
  write_file(folder / "some.json", "{}");
  CHECK(io::load_avatar_scene(folder / "some.json").value().avatars.empty());
  CHECK(io::load_avatar_scene(folder / "none.json").code() == Errc::file_not_found);
  io::AvatarScene scene;
  scene.avatars.emplace_back();
  scene.avatars[0].name = "bob";
  scene.avatars[0].canonical = folder / "none.npz";
  const Status s = io::load_scene_actors(scene).status();
  CHECK(s.code() == Errc::file_not_found);
  CHECK(contains(s.message(), "bob"));
}

TEST_CASE("avatar scene: each of two drivers of one body gives it its own capsules") {
  const TempFolder folder("scene_capsules");
  const AvatarAsset person = make_humanoid({.gaussians = 2000});
  AvatarAsset bare = person;
  bare.capsules.clear();
  io::save_avatar(folder / "a.npz", bare).throw_if_error();
  for (const auto& [name, wider] : {std::pair{"thin", 0.5}, {"fat", 2.0}, {"none", 0.0}}) {
    io::DriverFrames frames = walking(person, {}, wider > 0);
    for (auto& row : frames.capsules) {
      for (auto& c : row) c.radius *= wider;
    }
    io::save_driver(folder / (std::string(name) + ".npz"), frames).throw_if_error();
  }
  const auto radii = [&](const std::vector<std::string>& drivers) {
    std::string entries;
    for (const std::string& d : drivers)
      entries += (entries.empty() ? "" : ",") +
                 std::string(R"({"canonical_gaussians":"a.npz","driver":")") + d + ".npz\"}";
    write_file(folder / "s.json", "{\"gaussian_avatars\":[" + entries + "]}");
    std::vector<double> out;
    for (const AvatarActor& actor :
         io::load_scene_actors(io::load_avatar_scene(folder / "s.json").value()).value()) {
      const auto capsules = actor.capsules(0.2);
      out.push_back(capsules.empty() ? 0.0 : capsules[0].radius);
    }
    return out;
  };
  const double of_person = person.capsules[0].radius;
  for (const std::vector<std::string>& drivers :
       {std::vector<std::string>{"thin", "fat", "none"}, {"none", "fat", "thin", "fat"}}) {
    const std::vector<double> got = radii(drivers);
    REQUIRE(got.size() == drivers.size());
    for (std::size_t i = 0; i < got.size(); ++i) {
      const double wider = drivers[i] == "thin" ? 0.5 : drivers[i] == "fat" ? 2.0 : 0.0;
      CHECK(got[i] == doctest::Approx(wider * of_person).epsilon(1e-4));
    }
  }
}
