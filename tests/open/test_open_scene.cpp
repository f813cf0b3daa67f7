// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <stdexcept>

#include "files.hpp"
#include "gsnav/demo.hpp"
#include "gsnav/io/scene_file.hpp"
#include "gsnav/nav.hpp"
#include "gsnav/open.hpp"
#include "gsnav/scene/prepare.hpp"
#include "support/data.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

std::string all(const std::vector<std::string>& lines) {
  std::string out;
  for (const std::string& line : lines) out += line + "\n";
  return out;
}

/// A coarse flat, so that little is to be done.
OpenOptions coarse() {
  OpenOptions o;
  o.density = 0.05;
  return o;
}

}  // namespace

TEST_CASE("open: by default the flat is opened as it is, without a NavMesh or people") {
  const OpenedScene flat = open_scene("default", coarse()).value();
  const DefaultScene made = make_default_scene(0.05).value();
  REQUIRE(flat.scene->assets.size() == 1);
  CHECK(flat.scene->assets[0].cloud->opacities == made.cloud.opacities);
  CHECK(flat.scene->assets[0].world_from_asset.rotation.w == 1.0);
  CHECK(flat.scene->navmesh == nullptr);
  CHECK(flat.scene->avatars.empty());
  CHECK(flat.name == "embedded flat");
  CHECK_FALSE(flat.up_guessed);
}

TEST_CASE("open: the flat with NavMesh and people is the demo's scene") {
  OpenOptions o = coarse();
  o.navmesh = "auto";
  o.people = 1;
  o.seed = 7;
  const OpenedScene flat = open_scene("default", o).value();
  TaskConfig body;
  body.agent_radius = o.agent_radius;
  body.agent_height = o.agent_height;
  const SimulatorScene demo = default_simulator_scene(1, 7, 0.05, body).value();
  REQUIRE(flat.scene->navmesh != nullptr);
  CHECK(flat.navmesh_source == "from the mesh");
  CHECK(flat.scene->navmesh->polygon_count() == demo.navmesh->polygon_count());
  CHECK(flat.scene->navmesh->navigable_area() == demo.navmesh->navigable_area());
  REQUIRE(flat.scene->avatars.size() == 1);
  const Vec3d here = flat.scene->avatars[0].placement(3.5).translation;
  CHECK(norm(here - demo.avatars[0].placement(3.5).translation) == 0);
}

TEST_CASE("open: a file's up axis is guessed from its ground, given, or kept") {
  const TempFolder folder("open_up");
  const std::string file = (folder / "room.ply").string();
  REQUIRE(io::save_ply(file, room_z_up()).ok());
  const auto ground_of = [&](const OpenedScene& s) {  // the middle of the floor in the world
    return s.scene->assets[0].world_from_asset * Vec3d{4, 4, 1};
  };
  const OpenedScene guessed = open_scene(file).value();
  CHECK(guessed.up == "z");
  CHECK(guessed.up_guessed);
  CHECK(guessed.report.up_confidence > 0.5);
  CHECK(all(guessed.notes).find("up is z, by the scene's ground") != std::string::npos);
  CHECK(norm(ground_of(guessed) - Vec3d{4, 1, -4}) < 1e-12);
  OpenOptions o;
  o.up = "-y";
  CHECK(norm(ground_of(open_scene(file, o).value()) - Vec3d{4, -4, -1}) < 1e-12);
  o.up = "keep";
  const OpenedScene kept = open_scene(file, o).value();
  CHECK(norm(ground_of(kept) - Vec3d{4, 4, 1}) == 0);
  CHECK(kept.up == "keep");
  o.up = "w";
  const auto wrong = open_scene(file, o);
  CHECK(wrong.code() == Errc::invalid_argument);
  CHECK(wrong.message().find("OpenOptions.up: axis 'w'") != std::string::npos);
}

TEST_CASE("open: each signed axis turns to +Y and keeps hands right") {
  for (const char* axis : {"x", "+x", "-x", "y", "+y", "-y", "z", "+z", "-z"}) {
    CAPTURE(axis);
    const std::string name(axis);
    Vec3d up{};
    up[name.back() - 'x'] = name.front() == '-' ? -1 : 1;
    const Similarity turn = upright(name).value();
    CHECK(norm(turn * up - Vec3d{0, 1, 0}) < 1e-15);
    const Vec3d x = turn * Vec3d{1, 0, 0}, y = turn * Vec3d{0, 1, 0}, z = turn * Vec3d{0, 0, 1};
    CHECK(norm(cross(x, y) - z) < 1e-15);
    CHECK(axis_name(up) == (name.front() == '+' ? name.substr(1) : name));
  }
}

TEST_CASE("open: the NavMesh beside a file is read, unless another is asked for") {
  const TempFolder folder("open_navmesh");
  const std::string file = (folder / "room.ply").string();
  REQUIRE(io::save_ply(file, room_z_up()).ok());
  CHECK(open_scene(file)->scene->navmesh == nullptr);
  OpenOptions o;
  o.navmesh = "auto";
  const OpenedScene built = open_scene(file, o).value();
  CHECK(built.navmesh_source == "from the Gaussians");
  // The floor less the agent's radius on each side, and a voxel or two.
  CHECK(built.scene->navmesh->navigable_area() > 7.2 * 7.2);
  CHECK(built.scene->navmesh->navigable_area() < 8.0 * 8.0);
  CHECK(built.scene->navmesh->bounds().low.y == doctest::Approx(1).epsilon(0.1));
  // One that can be told from it, as it lies beside the file.
  const std::vector<Vec3d> corners{{0, 1, -2}, {0, 1, 0}, {2, 1, 0}, {2, 1, -2}};
  const std::vector<NavMesh::Triangle> halves{{0, 1, 2}, {0, 2, 3}};
  const NavMesh small = NavMesh::build({}, corners, halves).value();
  REQUIRE(save_navmesh(small, folder / "room.navmesh").ok());
  for (const char* asked : {"", "auto"}) {
    o.navmesh = asked;
    const OpenedScene found = open_scene(file, o).value();
    CHECK(found.navmesh_source == "from " + (folder / "room.navmesh").string());
    CHECK(found.scene->navmesh->navigable_area() == doctest::Approx(small.navigable_area()));
  }
  o.navmesh = "none";
  CHECK(open_scene(file, o)->scene->navmesh == nullptr);
  for (const char* asked : {"gaussians", "build"}) {
    o.navmesh = asked;
    CHECK(open_scene(file, o)->navmesh_source == "from the Gaussians");
  }
  o.navmesh = (folder / "absent.navmesh").string();
  CHECK(open_scene(file, o).code() == Errc::file_not_found);
  o.navmesh = "mesh";
  const auto none = open_scene(file, o);
  CHECK(none.code() == Errc::invalid_argument);
  CHECK(none.message().find("has no triangles") != std::string::npos);
  o.navmesh = "nav.obj";
  CHECK(open_scene(file, o).message().find("OpenOptions.navmesh = nav.obj: use auto") !=
        std::string::npos);
}

TEST_CASE("open: triangles alone are a scene, drawn and walked on") {
  const TempFolder folder("open_triangles");
  write_file(folder / "floor.obj", floor_obj(3));
  OpenOptions o;
  o.navmesh = "auto";
  const OpenedScene floor = open_scene((folder / "floor.obj").string(), o).value();
  CHECK(floor.scene->assets.empty());
  REQUIRE(floor.scene->meshes.size() == 1);
  CHECK(floor.navmesh_source == "from the mesh");
  CHECK(floor.scene->navmesh->navigable_area() == doctest::Approx(5.7 * 5.7).epsilon(0.05));
  // Among Gaussians they stand by the same up axis.
  REQUIRE(io::save_ply(folder / "room.ply", room_z_up()).ok());
  o = {};
  o.meshes = {(folder / "floor.obj").string()};
  const OpenedScene both = open_scene((folder / "room.ply").string(), o).value();
  REQUIRE(both.scene->meshes.size() == 1);
  CHECK(norm(both.scene->meshes[0].world_from_surface * Vec3d{0, 0, 1} - Vec3d{0, 1, 0}) < 1e-12);
  o.meshes = {"absent.obj"};
  CHECK(open_scene((folder / "room.ply").string(), o).code() == Errc::file_not_found);
}

TEST_CASE("open: a NavMesh is built with the settings that are given") {
  OpenOptions o = coarse();
  o.navmesh = "build";
  o.keep_triangles = true;
  NavMeshSettings settings;
  settings.cell_size = 0.1;
  settings.cell_height = 0.1;
  settings.agent_radius = 0.3;
  settings.agent_max_climb = 0.5;
  settings.region_min_size = 4;
  settings.filter_ledge_spans = false;
  o.navmesh_settings = settings;
  o.agent_radius = 5;  // Has no effect.
  const OpenedScene flat = open_scene("default", o).value();
  const NavMesh want =
      NavMesh::build(settings, flat.triangles->vertices, flat.triangles->triangles).value();
  const NavMesh& got = *flat.scene->navmesh;
  CHECK(got.settings() == settings);
  CHECK(got.surface().vertices == want.surface().vertices);
  CHECK(got.surface().triangles == want.surface().triangles);
  // The floor of Gaussians has lower voxels.
  const TempFolder folder("open_settings");
  REQUIRE(io::save_ply(folder / "room.ply", room_z_up()).ok());
  settings.cell_height = 0.2;
  o.navmesh_settings = settings;
  const OpenedScene room = open_scene((folder / "room.ply").string(), o).value();
  settings.cell_height = 0.1;
  CHECK(room.scene->navmesh->settings() == settings);
  o.navmesh_settings->agent_max_slope = -1;
  const auto wrong = open_scene("default", o);
  CHECK(wrong.code() == Errc::invalid_argument);
  CHECK(wrong.message().find("agent_max_slope") != std::string::npos);
}

TEST_CASE("open: a Habitat data set's scene comes as the data set says") {
  const TempFolder folder("open_habitat");
  REQUIRE(io::save_ply(folder / "room.gs.ply", room_z_up()).ok());
  write_file(folder / "floor.obj", floor_obj(3));
  write_file(folder / "a.stage_config.json",
             R"({"render_asset":"room.gs.ply","collision_asset":"floor.obj","up":[0,1,0]})");
  write_file(folder / "b.stage_config.json", R"({"render_asset":"floor.obj"})");
  const std::string set = (folder / "s.scene_dataset_config.json").string();
  write_file(set, R"({"stages":{"paths":{".json":["*.stage_config.json"]}}})");
  const auto unnamed = open_scene(set);
  CHECK(unnamed.code() == Errc::invalid_argument);
  CHECK(unnamed.message().find("#NAME; it has 2: a, b") != std::string::npos);
  CHECK(open_scene(set + "#c").message().find("has no scene 'c'; it has 2: a, b") != std::string::npos);
  CHECK(open_scene(set + "x").code() == Errc::invalid_argument);
  OpenOptions o;
  o.navmesh = "auto";
  const OpenedScene room = open_scene(set + "#a", o).value();
  // Habitat-GS takes Gaussians as they are stored.
  CHECK(room.up == "y");
  CHECK(room.scene->assets[0].world_from_asset.rotation.w == 1.0);
  CHECK(room.scene->meshes.empty());  // a collision asset is not drawn
  CHECK(room.navmesh_source == "from the mesh");
  CHECK(room.scene->navmesh->navigable_area() == doctest::Approx(5.7 * 5.7).epsilon(0.05));
  const OpenedScene floor = open_scene((folder / "b.stage_config.json").string()).value();
  CHECK(floor.scene->assets.empty());
  CHECK(floor.scene->meshes.size() == 1);
}

TEST_CASE("open: triangles, and all SH bands of a file, are kept where they are asked for") {
  const TempFolder folder("open_kept");
  write_file(folder / "floor.obj", floor_obj(3));
  OpenOptions o;
  CHECK(open_scene((folder / "floor.obj").string(), o)->triangles == nullptr);
  o.keep_triangles = true;
  const auto floor = open_scene((folder / "floor.obj").string(), o);
  REQUIRE(floor.ok());
  REQUIRE(floor->triangles != nullptr);
  const TriangleMesh want = io::load_obj(folder / "floor.obj").value();
  CHECK(floor->triangles->triangles == want.triangles);
  CHECK(floor->scene->navmesh == nullptr);
  const auto flat = open_scene("default", o);
  CHECK(flat->triangles->triangles == make_default_scene()->triangles);

  const std::array<float, 24> zeros{};
  GaussianCloudBuilder builder(2);
  for (int i = 0; i < 9; ++i) {
    RawGaussian g;
    g.mean = {0.1 * i, 0, 0.2 * (i % 3)};
    g.log_scales = {-3, -3, -3};
    g.shN = zeros.data();
    builder.add(g);
  }
  io::save_ply(folder / "plain.ply", builder.cloud()).throw_if_error();
  const std::string plain = (folder / "plain.ply").string();
  CHECK(open_scene(plain, {})->scene->assets[0].cloud->sh_degree == 0);
  OpenOptions all;
  all.keep_zero_bands = true;
  const auto kept = open_scene(plain, all);
  CHECK(kept->scene->assets[0].cloud->sh_degree == 2);
}

TEST_CASE("open: levels of detail and visible sets are kept beside the scene's file") {
  const TempFolder folder("open_levels");
  const std::string file = (folder / "room.ply").string();
  REQUIRE(io::save_ply(file, room_z_up()).ok());
  OpenOptions o;
  o.levels = SceneLevels::shipped;
  o.unseen_color = kUnseenColor;
  const OpenedScene first = open_scene(file, o).value();
  CHECK(all(first.notes).find("MB, built") != std::string::npos);
  const OpenedScene again = open_scene(file, o).value();
  CHECK(all(again.notes).find("MB, read") != std::string::npos);
  CHECK(again.scene->assets[0].lod->bytes() == first.scene->assets[0].lod->bytes());
  o.levels = SceneLevels::none;
  o.visible_sets = "auto";
  const auto nowhere = open_scene(file, o);
  CHECK(nowhere.message().find("there is none") != std::string::npos);
  o.storage = CloudStorage::packed;
  CHECK(open_scene(file, o).message().find("not of packed Gaussians") != std::string::npos);
  o.visible_sets.clear();
  CHECK(open_scene(file, o)->scene->assets[0].packed != nullptr);
  o.levels = SceneLevels::built;
  CHECK(open_scene(file, o).message().find("OpenOptions.storage") != std::string::npos);
}

TEST_CASE("open: an exception of progress leaves at any task, and is the last call") {
  OpenOptions o = coarse();
  o.navmesh = "gaussians";
  o.people = 1;
  o.levels = SceneLevels::built;
  std::vector<std::string> tasks;
  o.progress = [&](const std::string& task, double share) {
    CHECK(share >= 0);
    CHECK(share <= 1);
    tasks.push_back(task);
  };
  const OpenedScene whole = open_scene("default", o).value();
  for (const char* task :
       {"Gaussians", "levels of detail", "triangles", "NavMesh", "NavMesh: voxels", "NavMesh: floors",
        "NavMesh: polygons", "NavMesh of people: voxels", "people"}) {
    CAPTURE(task);
    CHECK(std::count(tasks.begin(), tasks.end(), task) > 0);
    std::size_t calls = 0;
    o.progress = [&](const std::string& now, double) {
      calls += calls > 0 || now == task ? 1 : 0;
      if (now == task) throw std::range_error(now);
    };
    CHECK_THROWS_AS((void)open_scene("default", o), std::range_error);
    CHECK(calls == 1);
  }
  o.progress = {};
  CHECK(open_scene("default", o)->scene->navmesh->polygon_count() ==
        whole.scene->navmesh->polygon_count());
}

TEST_CASE("open: the embedded flat is stored as asked") {
  OpenOptions o;
  o.density = 0.05;
  const OpenedScene full = open_scene("default", o).value();
  o.storage = CloudStorage::packed;
  const OpenedScene packed = open_scene("default", o).value();
  REQUIRE(packed.scene->assets[0].packed != nullptr);
  CHECK(packed.report.packed);
  CHECK(packed.scene->assets[0].cloud == nullptr);
  CHECK(packed.scene->assets[0].packed->size() == full.scene->assets[0].cloud->size());
  CHECK(packed.scene->assets[0].packed->bytes() < full.scene->assets[0].cloud->bytes());
  o.storage = CloudStorage::compact;
  // Compact storage halves SH above degree 0, of which the flat has none.
  CHECK(open_scene("default", o).value().scene->assets[0].cloud->bytes() ==
        full.scene->assets[0].cloud->bytes());
}

TEST_CASE("open: names and options that cannot be are said, and nothing crashes") {
  const TempFolder folder("open_bad");
  write_file(folder / "text.ply", "no header");
  for (const std::string& name :
       {std::string(), std::string("/dev/zero"), std::string("/dev/zero.ply"), std::string("absent.glb"),
        folder.path().string(), (folder / "text.ply").string(), std::string("a\nb.ply"),
        std::string("absent.scene_dataset_config.json#x")}) {
    CAPTURE(name);
    const auto scene = open_scene(name);
    CHECK_FALSE(scene.ok());
    CHECK_FALSE(scene.message().empty());
  }
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto refused = [](const char* field, const auto& change) {
    OpenOptions o;
    change(o);
    const auto scene = open_scene("default", o);
    CAPTURE(field);
    CHECK(scene.code() == Errc::invalid_argument);
    CHECK(scene.message().find(std::string("OpenOptions.") + field) != std::string::npos);
  };
  refused("time", [&](OpenOptions& o) { o.time = nan; });
  refused("cell_size", [&](OpenOptions& o) { o.cell_size = nan; });
  refused("cell_size", [&](OpenOptions& o) { o.cell_size = 0; });
  refused("density", [&](OpenOptions& o) { o.density = 1e9; });
  refused("agent_radius", [&](OpenOptions& o) { o.agent_radius = -1; });
  refused("agent_height", [&](OpenOptions& o) { o.agent_height = 0; });
  refused("unseen_color", [&](OpenOptions& o) { o.unseen_color = -1; });
  refused("crop.low", [&](OpenOptions& o) { o.crop = Aabb<double>{{0, nan, 0}, {1, 1, 1}}; });
  refused("crop.high", [&](OpenOptions& o) { o.crop = Aabb<double>{{0, 0, 0}, {nan, 1, 1}}; });
  refused("level", [](OpenOptions& o) { o.level = -1; });
  refused("people", [&](OpenOptions& o) { o.density = 0.05, o.people = 1; });
}
