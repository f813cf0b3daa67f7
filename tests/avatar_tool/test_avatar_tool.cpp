// SPDX-License-Identifier: Apache-2.0
// The program as people run it.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "gsnav/detail/demo/humanoid.hpp"
#include "gsnav/detail/io/avatar_file.hpp"
#include "gsnav/detail/io/motion_file.hpp"
#include "gsnav/detail/nav/navmesh_file.hpp"
#include "gsnav/detail/rigging/clip_walk.hpp"
#include "gsnav/io/image_file.hpp"
#include "io/gltf_builder.hpp"
#include "support/command.hpp"
#include "support/data.hpp"
#include "support/files.hpp"

using namespace gsnav;
using gsnav_test::data_file;
using gsnav_test::Outcome;
using gsnav_test::quoted;
using gsnav_test::run_command;
using gsnav_test::TempFolder;

namespace {

Outcome run(const TempFolder& folder, const std::string& arguments) {
  return run_command(GSNAV_AVATAR, arguments, folder.path());
}

/// A floor of 10 m by 10 m with a wall in it that leaves a passage at one end.
void write_floor(const std::filesystem::path& path) {
  std::vector<Vec3d> v{{0, 0, 0}, {10, 0, 0}, {10, 0, 10}, {0, 0, 10},
                       {0, 0, 5}, {7, 0, 5},  {7, 2, 5},   {0, 2, 5}};
  const std::vector<NavMesh::Triangle> t{{0, 2, 1}, {0, 3, 2}, {4, 5, 6},
                                         {4, 6, 7}, {4, 6, 5}, {4, 7, 6}};
  NavMeshSettings settings;
  settings.agent_radius = 0.25;
  save_navmesh(NavMesh::build(settings, v, t).value(), path).throw_if_error();
}

/// A clip of a person's own walk, two cycles, as a driver.
void write_own_walk(const std::filesystem::path& path, const AvatarAsset& person) {
  const WalkMotion gait = WalkMotion::create(person.skeleton).value();
  io::DriverFrames clip;
  clip.frame_rate = 60;
  clip.joints = person.skeleton.size();
  LocalPose pose;
  std::vector<Affine3<double>> joints;
  for (int k = 0; k <= 60; ++k) {
    gait.pose(k / 60.0, 1.0, 0.0, pose);
    forward_kinematics(person.skeleton, pose, joints);
    clip.matrices.insert(clip.matrices.end(), joints.begin(), joints.end());
  }
  io::save_driver(path, clip).throw_if_error();
}

/// Pixels of a picture in a strip of three, each 64 x 48 pixels, that show somebody.
int lit_pixels(const io::PngImage& strip, int picture) {
  int count = 0;
  for (int y = 0; y < 48; ++y) {
    for (int x = 64 * picture; x < 64 * (picture + 1); ++x) {
      const std::size_t at = 3 * static_cast<std::size_t>(y * 3 * 64 + x);
      count += strip.samples[at] + strip.samples[at + 1] + strip.samples[at + 2] > 60 ? 1 : 0;
    }
  }
  return count;
}

}  // namespace

TEST_CASE("avatar tool: somebody walks around a wall") {
  const TempFolder folder("avatar_tool_walk");
  write_floor(folder / "floor.navmesh");
  const AvatarAsset person = make_humanoid({.gaussians = 4000});
  io::save_avatar(folder / "person.npz", person).throw_if_error();
  write_own_walk(folder / "clip.npz", person);
  const std::string common = "walk --avatar " + quoted(folder / "person.npz") + " --navmesh " +
                             quoted(folder / "floor.navmesh") + " --clip " +
                             quoted(folder / "clip.npz") + " --out " + quoted(folder / "walk.npz");
  const Outcome made = run(folder, common + " --from 1,0,2 --via 5,0,4 --to 1,0,8 --speed 1.2");
  INFO(made.text);
  REQUIRE(made.ok);
  CHECK(made.says("feet slide"));
  LocalPose pose;
  std::vector<Affine3<double>> joints;
  const auto driver = io::load_driver(folder / "walk.npz", person.skeleton);
  REQUIRE(driver.ok());
  const MotionClip& walk = driver->clip;
  CHECK(walk.frame_rate == 40);
  REQUIRE(driver->capsules.size() == walk.frames());
  REQUIRE(driver->capsules[0].size() == person.capsules.size());
  const auto mesh = load_navmesh(folder / "floor.navmesh").value();
  double length = 0, turn = 0, off = 0, lowest = 9, highest = -9;
  Vec3d before{}, heading{};
  for (std::size_t t = 0; t < walk.frames(); ++t) {
    MotionInput in;
    in.time = static_cast<double>(t) / 40;
    walk.pose(in, pose);
    forward_kinematics(person.skeleton, pose, joints);
    const Vec3d root = joints[0].translation + pose.root;
    double low = 9;
    for (const auto& j : joints) low = std::min(low, (j.translation + pose.root).y);
    lowest = std::min(lowest, low);
    highest = std::max(highest, low);
    const Vec3d left = joints[1].translation - joints[2].translation, ahead{left.z, 0, -left.x};
    if (t > 0) {
      length += std::hypot(root.x - before.x, root.z - before.z);
      const double c = dot(normalized(ahead), normalized(heading));
      turn = std::max(turn, std::acos(std::min(1.0, c)) * 40);
    }
    before = root;
    heading = ahead;
    const auto on = mesh.snap_point({root.x, 0, root.z});
    REQUIRE(on);
    off = std::max(off, std::hypot(on->position.x - root.x, on->position.z - root.z));
  }
  const double shortest =
      mesh.geodesic_distance({1, 0, 2}, {5, 0, 4}) + mesh.geodesic_distance({5, 0, 4}, {1, 0, 8});
  CHECK(length > 0.98 * shortest);
  CHECK(length < 1.10 * shortest);  // hips sway
  CHECK(off < 0.06);
  CHECK(turn < 5.0);  // radians a second: nobody spins round
  // The root follows the surface, which the mesh keeps to within its cells' height.
  CHECK(lowest > -0.02);
  CHECK(highest < 0.35);
  CHECK(std::hypot(before.x - 1, before.z - 8) < 0.06);

  // Holding the feet can be left out, and both say how far they slide.
  CHECK(made.says("as recorded"));
  CHECK(made.says("with the feet held"));
  CHECK_FALSE(run(folder, common + " --from 1,0,2 --to 5,0,4 --no-lock-feet").says("feet held"));

  const std::string strip = "strip --avatar " + quoted(folder / "person.npz") + " --driver " +
                            quoted(folder / "walk.npz") + " --eye 4,1.6,8 --target 3,0.9,3 --out " +
                            quoted(folder / "strip.png");
  const Outcome drawn = run(folder, strip + " --frames 3 --width 64 --height 48");
  INFO(drawn.text);
  REQUIRE(drawn.ok);
  const auto picture = io::load_png(folder / "strip.png");
  REQUIRE(picture.ok());
  CHECK(picture->width == 3 * 64);
  CHECK(picture->height == 48);
  CHECK(lit_pixels(*picture, 0) > 20);
  CHECK(lit_pixels(*picture, 1) > 20);
  CHECK(run(folder, strip + " --frames 0").says("frames"));
  CHECK(run(folder, strip + " --flat --scene x.ply").says("--scene"));

  // The shortest path touches the wall's end; by default there is room.
  const auto clearance = [](const Outcome& o) {
    const std::string words = "edges are at least ";
    const std::size_t at = o.text.find(words);
    return at == std::string::npos ? -1.0 : std::stod(o.text.substr(at + words.size()));
  };
  const std::string across = " --from 1,0,2 --to 1,0,8";
  CHECK(clearance(run(folder, common + across)) >= 0.19);
  CHECK(clearance(run(folder, common + across + " --clearance 0.4")) >= 0.38);
  CHECK(clearance(run(folder, common + across + " --clearance 0")) == 0.0);
  CHECK(run(folder, common + across + " --clearance -1").says("clearance"));
  // The generated flat needs no file.
  const std::string clip_of = "walk --avatar " + quoted(folder / "person.npz") + " --clip " +
                              quoted(folder / "clip.npz") + " --out " + quoted(folder / "flat.npz") +
                              across;
  CHECK(run(folder, clip_of).says("--navmesh or --flat"));
  CHECK(run(folder, clip_of + " --flat --navmesh x").says("--navmesh"));
  CHECK(run(folder, "walk --flat --avatar " + quoted(folder / "person.npz") + " --clip " +
                        quoted(folder / "clip.npz") + " --out " + quoted(folder / "flat.npz") +
                        " --from 1.7,0,3.3 --to 6.6,0,5.3")
            .says("walls another 0.25 m"));

  CHECK(run(folder, common + " --from 1,0,2 --to 30,0,8").says("floor.navmesh"));
  CHECK(run(folder, common + " --from 1,0 --to 3,0,8").says("'1,0' is not a point"));
  CHECK(run(folder, common + " --from 1,0,2 --to 3,0,8 --first-key 50 --keys 20").says("no cycle"));
  CHECK(run(folder,
            "walk --avatar none.npz --navmesh none --clip none.bvh --from 0,0,0 --to 1,0,0 --out x.npz")
            .says("none.npz"));
  CHECK_FALSE(run(folder, "").ok);
  CHECK(run(folder, "--help").ok);
}

TEST_CASE("avatar tool: from a rigged file to an avatar and its driver") {
  const TempFolder folder("avatar_tool_mesh");
  const std::string glb = data_file("avatars/lumberjack.glb");
  if (glb.empty()) return;
  const std::string common = "from-gltf " + quoted(std::filesystem::path(glb)) +
                             " --gaussians 5000 --out " + quoted(folder / "a.npz");
  const Outcome made = run(folder, common + " --clip Walk --driver " + quoted(folder / "d.npz"));
  INFO(made.text);
  REQUIRE(made.ok);
  const auto avatar = io::load_avatar(folder / "a.npz");
  REQUIRE(avatar.ok());
  CHECK(avatar->asset.size() > 4500);
  CHECK(avatar->asset.capsules.size() > 10);
  const auto driver = io::load_driver(folder / "d.npz", avatar->asset.skeleton);
  REQUIRE(driver.ok());
  CHECK(driver->clip.frames() == 41);
  CHECK(driver->capsules[0].size() == avatar->asset.capsules.size());
  CHECK(run(folder, common + " --clip Dance").says("there are: Walk, Poses, A-pose"));
  CHECK(run(folder, common + " --influences 5").says("5"));
}

namespace {

/// A column of 180 x 30 x 30 units that bends at the middle, in three parts of a skin each on one pair
/// of joints, and a clip whose first key is at 0.5 s.
gsnav_test::TestGltf column() {
  using gsnav_test::json;
  gsnav_test::TestGltf g;
  const std::size_t binds = g.add(std::vector<float>{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0,   0, 1,
                                                     1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, -90, 0, 1},
                                  "MAT4", 5126);
  const char* const names[] = {"legs", "trunk", "head"};
  for (int part = 0; part < 3; ++part) {
    std::vector<float> positions, weights;
    std::vector<std::uint8_t> joints;
    std::vector<std::uint16_t> triangles;
    for (int ring = 0; ring < 2; ++ring) {
      const float y = static_cast<float>(60 * (part + ring));
      for (int k = 0; k < 4; ++k) {
        positions.insert(positions.end(),
                         {k == 1 || k == 2 ? 15.0f : -15.0f, y, k >= 2 ? 15.0f : -15.0f});
        weights.insert(weights.end(), {1 - y / 180, y / 180, 0, 0});
        joints.insert(joints.end(), {0, 1, 0, 0});
      }
    }
    for (std::uint16_t k = 0; k < 4; ++k) {
      const auto n = static_cast<std::uint16_t>((k + 1) % 4), up = static_cast<std::uint16_t>(k + 4),
                 next = static_cast<std::uint16_t>(n + 4);
      triangles.insert(triangles.end(), {k, up, n, n, up, next});
    }
    const json attributes = {{"POSITION", g.add(positions, "VEC3", 5126)},
                             {"JOINTS_0", g.add(joints, "VEC4", 5121)},
                             {"WEIGHTS_0", g.add(weights, "VEC4", 5126)}};
    g.doc["meshes"].push_back(
        {{"primitives",
          json::array({{{"attributes", attributes}, {"indices", g.add(triangles, "SCALAR", 5123)}}})}});
    g.doc["skins"].push_back(
        {{"name", names[part]}, {"joints", {0, 1}}, {"inverseBindMatrices", binds}});
  }
  g.doc["nodes"] = json::array(
      {{{"name", "foot"}, {"children", {1}}}, {{"name", "back"}, {"translation", {0, 90, 0}}}});
  for (int part = 0; part < 3; ++part) g.doc["nodes"].push_back({{"mesh", part}, {"skin", part}});
  const std::size_t times = g.add(std::vector<float>{0.5f, 1.0f}, "SCALAR", 5126),
                    turns = g.add(std::vector<float>{0, 0, 0, 1, 0.6f, 0, 0, 0.8f}, "VEC4", 5126);
  g.doc["animations"] = json::array(
      {{{"name", "bow"},
        {"channels", json::array({{{"sampler", 0}, {"target", {{"node", 1}, {"path", "rotation"}}}}})},
        {"samplers", json::array({{{"input", times}, {"output", turns}}})}}});
  g.doc.erase("scenes");
  return g;
}

}  // namespace

TEST_CASE("avatar tool: skins of one rig in centimetres, and a clip from a file without a skin") {
  const TempFolder folder("avatar_tool_skins");
  gsnav_test::TestGltf g = column();
  g.write(folder / "column.glb");
  const std::string common = "from-gltf column.glb --gaussians 3000 --out " + quoted(folder / "a.npz");
  const Outcome large = run(folder, common);
  CHECK_FALSE(large.ok);
  CHECK(
      large.says("more than 32 m from the root (it is 180 m large); --scale sets metres a unit, 0.01 "
                 "for centimetres"));
  const Outcome made =
      run(folder, common + " --scale 0.01 --clip bow --driver " + quoted(folder / "own.npz"));
  INFO(made.text);
  REQUIRE(made.ok);
  CHECK(made.says("24 vertices, 24 triangles, 2 joints, 1 clips; 3 of 3 skins"));
  CHECK(made.says("clip \"bow\": its first key is at 0.5"));
  const auto avatar = io::load_avatar(folder / "a.npz");
  REQUIRE(avatar.ok());
  double low = 9, high = -9;
  for (std::size_t i = 0; i < avatar->asset.size(); ++i) {
    const double y = avatar->asset.cloud.mean(i).y;
    low = std::min(low, y), high = std::max(high, y);
  }
  CHECK(high - low == doctest::Approx(1.8).epsilon(0.02));  // all three parts
  CHECK(run(folder, common + " --scale 0.01 --skin head")
            .says("8 vertices, 8 triangles, 2 joints, 1 clips; 1 of 3 skins"));
  CHECK(run(folder, common + " --scale 0.01 --skin 0 --skin trunk").says("2 of 3 skins"));
  CHECK(run(folder, common + " --scale 0.01 --skin tail")
            .says("no skin is \"tail\"; there are 0 '\"legs\"'"));
  // The clip alone: nodes, no skin, no mesh. The rig's unit is the body's.
  g.doc.erase("skins");
  g.doc.erase("meshes");
  g.doc["nodes"].erase(g.doc["nodes"].begin() + 2, g.doc["nodes"].end());
  g.write(folder / "bow.glb");
  const Outcome apart =
      run(folder, common + " --scale 0.01 --clip bow.glb:bow --driver " + quoted(folder / "apart.npz"));
  INFO(apart.text);
  REQUIRE(apart.ok);
  const auto a = io::load_driver(folder / "own.npz", avatar->asset.skeleton),
             b = io::load_driver(folder / "apart.npz", avatar->asset.skeleton);
  REQUIRE(a.ok());
  REQUIRE(b.ok());
  CHECK(a->clip.frames() == 41);  // from 0 to 1 s
  CHECK(a->clip.rotations.size() == b->clip.rotations.size());
  for (std::size_t k = 0; k < std::min(a->clip.rotations.size(), b->clip.rotations.size()); ++k) {
    CHECK(std::fabs(a->clip.rotations[k].x - b->clip.rotations[k].x) < 1e-6);
  }
}
