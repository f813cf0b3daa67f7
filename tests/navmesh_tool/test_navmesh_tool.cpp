// SPDX-License-Identifier: Apache-2.0
// The program as people run it.
#include <doctest/doctest.h>

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <iterator>
#include <string>
#include <vector>

#include "gsnav/demo.hpp"
#include "gsnav/detail/io/mesh_file.hpp"
#include "gsnav/detail/io/navmesh_settings_file.hpp"
#include "gsnav/detail/io/ply.hpp"
#include "gsnav/detail/nav/navmesh_file.hpp"
#include "gsnav/io/image_file.hpp"
#include "support/command.hpp"
#include "support/data.hpp"
#include "support/files.hpp"
#include "support/small_disk.hpp"

using namespace gsnav;
using gsnav_test::Outcome;
using gsnav_test::quoted;
using gsnav_test::read_file;
using gsnav_test::run_command;
using gsnav_test::TempFolder;
using gsnav_test::write_file;

namespace {

Outcome run(const TempFolder& folder, const std::string& arguments) {
  return run_command(GSNAV_NAVMESH, arguments, folder.path());
}

/// Two floors of 8 m by 5 m, the upper one 3 m up and 10 m along x; z up, in centimetres.
std::string two_floors_z_up() {
  return "v 0 0 0\nv 800 0 0\nv 800 500 0\nv 0 500 0\nv 1000 0 300\nv 1800 0 300\nv 1800 500 300\nv "
         "1000 500 300\n"
         "f 1 2 3 4\nf 5 6 7 8\n";
}

/// A GLB of one mesh, metres and y up: a floor of 8 m by 5 m at a height.
std::string floor_glb(float y) {
  const float v[] = {0, y, 0, 0, y, 5, 8, y, 5, 8, y, 0};
  const std::uint16_t triangles[] = {0, 1, 2, 0, 2, 3};
  std::string bin(reinterpret_cast<const char*>(v), sizeof v);
  bin.append(reinterpret_cast<const char*>(triangles), sizeof triangles);
  std::string json =
      R"({"asset":{"version":"2.0"},"buffers":[{"byteLength":60}],"bufferViews":[{"buffer":0,"byteLength":48},)"
      R"({"buffer":0,"byteOffset":48,"byteLength":12}],"accessors":[{"bufferView":0,"componentType":5126,"count":4,)"
      R"("type":"VEC3","min":[0,0,0],"max":[8,9,5]},{"bufferView":1,"componentType":5123,"count":6,"type":"SCALAR"}],)"
      R"("meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],"nodes":[{"mesh":0}],)"
      R"("scenes":[{"nodes":[0]}],"scene":0})";
  while (json.size() % 4 != 0) json += ' ';
  std::string out = "glTF";
  const auto put = [&](std::size_t n) {
    const auto word = static_cast<std::uint32_t>(n);
    out.append(reinterpret_cast<const char*>(&word), 4);
  };
  put(2);
  put(12 + 8 + json.size() + 8 + bin.size());
  put(json.size());
  out += "JSON" + json;
  put(bin.size());
  out += std::string("BIN\0", 4) + bin;
  return out;
}

const char* const kPlain = "--no-filter-ledge-spans --agent-radius 0";

}  // namespace

TEST_CASE("navmesh tool: builds, inspects, converts and draws") {
  const TempFolder folder("navmesh_tool");
  write_file(folder / "floors.obj", two_floors_z_up());
  const Outcome made =
      run(folder, quoted(folder / "floors.obj") + " --up z --scale 0.01 " + kPlain + " --out " +
                      quoted(folder / "a.navmesh") + " --obj " + quoted(folder / "a.obj") + " --png " +
                      quoted(folder / "a.png") + " --level 1");
  INFO(made.text);
  REQUIRE(made.ok);
  CHECK(made.says("4 triangles"));
  CHECK(made.says("island 1: 40"));
  CHECK(made.says("level 1: at 3.00 m, 40"));
  const NavMesh mesh = load_navmesh(folder / "a.navmesh").value();
  CHECK(mesh.navigable_area() == doctest::Approx(80).epsilon(0.01));
  CHECK(mesh.settings().agent_radius == 0);
  CHECK(mesh.is_navigable({1, 0, -1}));  // y of the file is -z
  CHECK(mesh.is_navigable({11, 3, -4}));
  CHECK(io::load_obj(folder / "a.obj")->triangles.size() == mesh.triangles().size());
  // The picture of the upper floor: coloured on the right, ground on the left.
  const io::PngImage png = io::load_png(folder / "a.png").value();
  const auto pixel = [&](double u, double v) {
    const auto x = static_cast<std::size_t>(u * png.width), y = static_cast<std::size_t>(v * png.height);
    const std::size_t at = 3 * (static_cast<std::size_t>(png.width) * y + x);
    return std::vector<std::uint16_t>(png.samples.begin() + static_cast<std::ptrdiff_t>(at),
                                      png.samples.begin() + static_cast<std::ptrdiff_t>(at + 3));
  };
  CHECK(png.width >= 1200);
  CHECK(pixel(0.2, 0.5) == pixel(0.5, 0.5));
  CHECK(pixel(0.8, 0.5) != pixel(0.5, 0.5));
  const Outcome again =
      run(folder, quoted(folder / "a.navmesh") + " --out " + quoted(folder / "b.navmesh"));
  INFO(again.text);
  REQUIRE(again.ok);
  CHECK(again.says("level 1"));
  CHECK(read_file(folder / "a.navmesh") == read_file(folder / "b.navmesh"));
  // Version 1 has no settings; all else is the same.
  const std::string old_form = " --mset-version 1 --out " + quoted(folder / "1.navmesh");
  const Outcome old = run(folder, quoted(folder / "a.navmesh") + old_form);
  INFO(old.text);
  REQUIRE(old.ok);
  std::string without = read_file(folder / "a.navmesh");
  without.erase(40, 56)[4] = 1;
  CHECK(read_file(folder / "1.navmesh") == without);
  CHECK_FALSE(run(folder, quoted(folder / "a.navmesh") + " --mset-version 3 --out " +
                              quoted(folder / "3.navmesh"))
                  .ok);
}

TEST_CASE("navmesh tool: a stage and objects from glTF") {
  const TempFolder folder("navmesh_tool_gltf");
  write_file(folder / "stage.glb", floor_glb(1));
  // A box of 1 m from the origin.
  write_file(folder / "box.obj",
             "v 0 0 0\nv 1 0 0\nv 1 0 1\nv 0 0 1\nv 0 1 0\nv 1 1 0\nv 1 1 1\nv 0 1 1\n"
             "f 1 5 6 2\nf 2 6 7 3\nf 3 7 8 4\nf 4 8 5 1\nf 5 8 7 6\n");
  const Outcome made =
      run(folder, quoted(folder / "stage.glb") + " --out " + quoted(folder / "a.navmesh"));
  INFO(made.text);
  REQUIRE(made.ok);
  CHECK(made.says("2 triangles"));
  const NavMesh empty = load_navmesh(folder / "a.navmesh").value();
  CHECK(empty.is_navigable({4, 1, 2.5}));
  CHECK(empty.bounds().low.y == doctest::Approx(1));
  CHECK_FALSE(empty.settings().include_static_objects);
  // Turned by a quarter about Y, x becomes -z: the box then stands from z = 2 to 3.
  const Outcome both =
      run(folder, quoted(folder / "stage.glb") + " --object " +
                      quoted(std::filesystem::path((folder / "box.obj").string() + "@4,1,3,90")) +
                      " --object " +
                      quoted(std::filesystem::path((folder / "box.obj").string() + "@1,1,1,0,0.5")) +
                      " --out " + quoted(folder / "b.navmesh"));
  INFO(both.text);
  REQUIRE(both.ok);
  const NavMesh full = load_navmesh(folder / "b.navmesh").value();
  CHECK(full.settings().include_static_objects);
  CHECK_FALSE(full.is_navigable({4.5, 1, 2.5}));
  CHECK(full.is_navigable({4.5, 1, 3.5}));
  CHECK_FALSE(full.is_navigable({1.25, 1, 1.25}));
  CHECK(full.is_navigable({1.8, 1, 1.8}));
  const std::string real = gsnav_test::data_file("nav/habitat/simple_room.glb");
  if (real.empty()) return;
  const Outcome room = run(folder, gsnav_test::quoted(std::filesystem::path(real)) + " --out " +
                                       quoted(folder / "room.navmesh"));
  INFO(room.text);
  CHECK(room.ok);
  CHECK(load_navmesh(folder / "room.navmesh")->navigable_area() > 1);
}

TEST_CASE("navmesh tool: settings of a file, which options change") {
  const TempFolder folder("navmesh_tool_settings");
  write_file(folder / "floors.obj", two_floors_z_up());
  write_file(
      folder / "a.json",
      R"({"cellSize": 0.1, "agentRadius": 0.0, "filterLedgeSpans": false, "agentHeight": 1.2345})");
  const std::string input = quoted(folder / "floors.obj") + " --up z --scale 0.01 ";
  const Outcome made =
      run(folder, input + "--agent-height 1 --settings " + quoted(folder / "a.json") + " --out " +
                      quoted(folder / "a.navmesh") + " --settings-out " + quoted(folder / "b.json"));
  INFO(made.text);
  REQUIRE(made.ok);
  NavMeshSettings wanted;
  wanted.cell_size = 0.1;
  wanted.agent_radius = 0;
  wanted.filter_ledge_spans = false;
  wanted.agent_height = 1;
  CHECK(load_navmesh(folder / "a.navmesh")->settings() == wanted);
  CHECK(io::load_navmesh_settings(folder / "b.json").value() == wanted);
  const Outcome again = run(folder, input + "--settings " + quoted(folder / "b.json") + " --out " +
                                        quoted(folder / "b.navmesh"));
  INFO(again.text);
  REQUIRE(again.ok);
  CHECK(read_file(folder / "a.navmesh") == read_file(folder / "b.navmesh"));
  const Outcome refused =
      run(folder, quoted(folder / "a.navmesh") + " --settings " + quoted(folder / "a.json"));
  CHECK_FALSE(refused.ok);
  CHECK(refused.says("--settings"));
}

TEST_CASE("settings file: read and written as Habitat does, equal after a round trip") {
  const TempFolder folder("navmesh_settings");
  NavMeshSettings s;
  s.cell_size = 1.0 / 3;
  s.agent_radius = 0.1 + 1e-13;
  s.region_merge_size = 23;
  s.filter_walkable_low_height_spans = false;
  s.include_static_objects = true;
  s.tile_size = 64;
  s.max_cells = 12345;
  io::save_navmesh_settings(s, folder / "s.json").throw_if_error();
  const NavMeshSettings back = io::load_navmesh_settings(folder / "s.json").value();
  CHECK(back == s);
  CHECK(back.cell_size == s.cell_size);
  CHECK(back.agent_radius == s.agent_radius);
  CHECK(back.tile_size == 64);
  CHECK(back.max_cells == 12345);
  // Every key of Habitat's is there once.
  const std::string text = read_file(folder / "s.json");
  for (const char* key :
       {"cellSize", "cellHeight", "agentHeight", "agentRadius", "agentMaxClimb", "agentMaxSlope",
        "regionMinSize", "regionMergeSize", "edgeMaxLen", "edgeMaxError", "vertsPerPoly",
        "detailSampleDist", "detailSampleMaxError", "filterLowHangingObstacles", "filterLedgeSpans",
        "filterWalkableLowHeightSpans", "includeStaticObjects"}) {
    CAPTURE(key);
    CHECK(text.find("\"" + std::string(key) + "\":") != std::string::npos);
  }
  // What is missing keeps its default, as in Habitat.
  write_file(folder / "one.json", "{\"agentMaxSlope\": 30}");
  NavMeshSettings one;
  one.agent_max_slope = 30;
  CHECK(io::load_navmesh_settings(folder / "one.json").value() == one);
  const auto message = [&](const char* content) {
    write_file(folder / "bad.json", content);
    const auto r = io::load_navmesh_settings(folder / "bad.json");
    CHECK(r.code() == Errc::invalid_file);
    CHECK(r.message().find("bad.json") != std::string::npos);
    return r.message();
  };
  CHECK(message("{\"cellSize\": \"0.1\"}").find("'cellSize' is") != std::string::npos);
  CHECK(message("{\"cellsize\": 0.1}").find("'cellsize' is no setting") != std::string::npos);
  CHECK(message("{\"vertsPerPoly\": 5.5}").find("whole number") != std::string::npos);
  CHECK(message("{\"maxCells\": 1e300}").find("whole number") != std::string::npos);
  CHECK(message("{\"filterLedgeSpans\": 1}").find("true or false") != std::string::npos);
  CHECK(message("[1]").find("object") != std::string::npos);
  CHECK(message("{").find("JSON") != std::string::npos);
  CHECK(io::load_navmesh_settings(folder / "none.json").code() == Errc::file_not_found);
  CHECK_FALSE(io::save_navmesh_settings(s, folder / "no" / "s.json").ok());
  s.cell_size = NAN;
  CHECK(io::save_navmesh_settings(s, folder / "s.json").code() == Errc::invalid_argument);
  CHECK(io::load_navmesh_settings(folder / "s.json").value() == back);  // what was there stays

  const std::string habitat = gsnav_test::data_file("nav/habitat/test_navmeshsettings.json");
  if (habitat.empty()) return;
  const NavMeshSettings theirs = io::load_navmesh_settings(habitat).value();
  CHECK(theirs.cell_size == 0.0123);
  CHECK(theirs.agent_height == 1.2345);
  CHECK(theirs.edge_max_error == 1.345);
  CHECK(theirs.verts_per_poly == 9);
  CHECK_FALSE(theirs.filter_low_hanging_obstacles);
  CHECK_FALSE(theirs.include_static_objects);
  CHECK_FALSE(theirs.validate().ok());  // Recast's mesh has at most 6
  io::save_navmesh_settings(theirs, folder / "h.json").throw_if_error();
  CHECK(io::load_navmesh_settings(folder / "h.json").value() == theirs);
}

TEST_CASE("navmesh tool: in tiles, whatever the number of threads") {
  const TempFolder folder("navmesh_tool_tiles");
  write_file(folder / "floors.obj", two_floors_z_up());
  const auto build = [&](const std::string& more, const char* out) {
    const Outcome made = run(folder, quoted(folder / "floors.obj") + " --up z --scale 0.01 " + kPlain +
                                         " " + more + " --out " + quoted(folder / out));
    INFO(made.text);
    REQUIRE(made.ok);
    CHECK(made.says("level 1: at 3.00 m, 40"));
    return made;
  };
  build("", "one.navmesh");
  CHECK(build("--tile-size 48 --threads 1", "a.navmesh").says("tiles of 48 x 48 cells"));
  build("--tile-size 48 --threads 3", "b.navmesh");
  CHECK(read_file(folder / "a.navmesh") == read_file(folder / "b.navmesh"));
  const NavMesh one = load_navmesh(folder / "one.navmesh").value(),
                tiled = load_navmesh(folder / "a.navmesh").value();
  CHECK(tiled.polygon_count() > one.polygon_count());
  CHECK(tiled.island_count() == one.island_count());
  CHECK(tiled.settings().tile_size == 48);
  const Outcome again =
      run(folder, quoted(folder / "a.navmesh") + " --out " + quoted(folder / "c.navmesh"));
  REQUIRE(again.ok);
  CHECK(read_file(folder / "a.navmesh") == read_file(folder / "c.navmesh"));
  const Outcome refused = run(folder, quoted(folder / "a.navmesh") + " --tile-size 48");
  CHECK_FALSE(refused.ok);
  CHECK(refused.says("--tile-size"));
}

TEST_CASE("navmesh tool: from Gaussians") {
  const TempFolder folder("navmesh_tool_gaussians");
  GaussianCloudBuilder builder(0);
  for (int i = 0; i < 60; ++i) {
    for (int k = 0; k < 40; ++k) {
      RawGaussian g;
      g.mean = {0.1 * i, 0, 0.1 * k};
      g.log_scales = {std::log(0.06), std::log(0.03), std::log(0.06)};
      g.opacity_logit = 6;
      builder.add(g);
    }
  }
  io::save_ply(folder / "floor.ply", builder.cloud()).throw_if_error();
  const Outcome made =
      run(folder, quoted(folder / "floor.ply") + " --up y --out " + quoted(folder / "g.navmesh"));
  INFO(made.text);
  REQUIRE(made.ok);
  CHECK(made.says("2400 Gaussians used"));
  const NavMesh mesh = load_navmesh(folder / "g.navmesh").value();
  CHECK(mesh.settings().cell_height == doctest::Approx(0.05));
  CHECK(mesh.navigable_area() > 0.8 * 6 * 4);
  // A box of triangles on it.
  write_file(folder / "box.obj",
             "v 2 0 1\nv 4 0 1\nv 4 0 3\nv 2 0 3\nv 2 1 1\nv 4 1 1\nv 4 1 3\nv 2 1 3\n"
             "f 1 5 6 2\nf 2 6 7 3\nf 3 7 8 4\nf 4 8 5 1\nf 5 8 7 6\n");
  const Outcome both =
      run(folder, quoted(folder / "floor.ply") + " --up y --mesh " + quoted(folder / "box.obj") +
                      " --out " + quoted(folder / "b.navmesh"));
  INFO(both.text);
  REQUIRE(both.ok);
  CHECK(both.says("10 triangles"));
  CHECK(mesh.is_navigable({3, 0, 2}));
  CHECK_FALSE(load_navmesh(folder / "b.navmesh")->is_navigable({3, 0, 2}));
  const Outcome wrong =
      run(folder, quoted(folder / "box.obj") + " --mesh " + quoted(folder / "box.obj"));
  CHECK_FALSE(wrong.ok);
  CHECK(wrong.says("has no Gaussians"));
}

TEST_CASE("navmesh tool: the embedded flat, of its triangles and of its Gaussians") {
  const TempFolder folder("navmesh_tool_default");
  const std::string out = " --out " + quoted(folder / "a.navmesh");
  const DefaultScene flat = make_default_scene().value();
  const NavMesh want = NavMesh::build({}, flat.vertices, flat.triangles).value();
  const Outcome made = run(folder, "default" + out);
  INFO(made.text);
  REQUIRE(made.ok);
  CHECK(load_navmesh(folder / "a.navmesh")->navigable_area() ==
        doctest::Approx(want.navigable_area()).epsilon(1e-6));
  const Outcome seen = run(folder, "--scene default --navmesh gaussians" + out);
  INFO(seen.text);
  REQUIRE(seen.ok);
  CHECK(seen.says("Gaussians used"));
  const NavMesh of_gaussians = load_navmesh(folder / "a.navmesh").value();
  CHECK(of_gaussians.navigable_area() == doctest::Approx(want.navigable_area()).epsilon(0.15));
}

TEST_CASE("navmesh tool: a Habitat data set's scene stands as the data set says") {
  const TempFolder folder("navmesh_tool_habitat");
  write_file(folder / "floors.obj", two_floors_z_up());
  write_file(folder / "a.stage_config.json",
             R"({"render_asset":"floors.obj","up":[0,0,1],"front":[0,1,0],"units_to_meters":0.01})");
  write_file(folder / "b.scene_dataset_config.json",
             R"({"stages":{"paths":{".json":["*.stage_config.json"]}}})");
  const std::string out = std::string(" ") + kPlain + " --out " + quoted(folder / "a.navmesh");
  for (const char* name :
       {"a.stage_config.json", "b.scene_dataset_config.json", "b.scene_dataset_config.json#a"}) {
    CAPTURE(name);
    const Outcome made = run(folder, quoted((folder / name)) + out);
    INFO(made.text);
    REQUIRE(made.ok);
    const NavMesh mesh = load_navmesh(folder / "a.navmesh").value();
    CHECK(mesh.navigable_area() == doctest::Approx(80).epsilon(0.01));
    CHECK(mesh.is_navigable({11, 3, -4}));
  }
  const std::string set = quoted(folder / "b.scene_dataset_config.json");
  const Outcome none = run(folder, set + "#kitchen");
  CHECK_FALSE(none.ok);
  CHECK(none.says("kitchen"));
  for (const char* option : {"--navmesh gaussians", "--crop 0 0 0 1 1 1", "--visible-sets seen.vis"}) {
    CAPTURE(option);
    const Outcome refused = run(folder, set + " " + option);
    CHECK_FALSE(refused.ok);
    CHECK(refused.says("has no Gaussians"));
  }
}

TEST_CASE("navmesh tool: what is wrong is said on one line") {
  const TempFolder folder("navmesh_tool_errors");
  write_file(folder / "wall.obj", "v 0 0 0\nv 4 0 0\nv 4 3 0\nv 0 3 0\nf 1 2 3 4\n");
  write_file(folder / "floor.obj", "v 0 0 0\nv 0 0 4\nv 4 0 4\nv 4 0 0\nf 1 2 3 4\n");
  write_file(folder / "bad.navmesh", "TESM and nothing else");
  const std::string floor = quoted(folder / "floor.obj");
  struct Case {
    std::string arguments;
    std::vector<const char*> parts;
  };
  const Case cases[] = {
      {quoted(folder / "none.obj"), {"none.obj"}},
      {quoted(folder / "none.navmesh"), {"none.navmesh"}},
      {quoted(folder / "bad.navmesh"), {"bad.navmesh", "size = 21"}},
      {quoted(folder / "bad.navmesh") + " --up z", {"--up", "is a NavMesh"}},
      {quoted(folder / "wall.obj"), {"no walkable cell", "agent_height 1.5", "agent_radius 0.1", "m2"}},
      {floor + " --agent-radius 3", {"no walkable cell", "agent_radius 3", "m2"}},
      {floor + " --region-min-size 1000", {"region_min_size"}},
      {floor + " --cell-size 0", {"--cell-size", "must be positive"}},
      {floor + " --up up", {"--up"}},
      {floor + " --object " + quoted(std::filesystem::path((folder / "floor.obj").string() + "@1,2")),
       {"--object", "X,Y,Z"}},
      {floor + " --object " + quoted(folder / "chair.glb"), {"chair.glb"}},
      {floor + " --settings " + quoted(folder / "none.json"), {"--settings", "none.json"}},
      {floor + " --png " + quoted(folder / "x.png") + " --height 50", {"height 50", "walkable"}},
      {floor + " --png " + quoted(folder / "x.png") + " --level 5", {"--level 5", "1 levels"}},
      {floor + " --out " + quoted(folder / "no" / "x.navmesh"), {"x.navmesh"}},
      {floor + " --obj " + quoted(folder / "no" / "x.obj"), {"x.obj"}},
      {floor + " --png " + quoted(folder / "no" / "x.png"), {"no"}},
  };
  for (const Case& c : cases) {
    const Outcome r = run(folder, c.arguments);
    INFO(c.arguments << "\n" << r.text);
    CHECK_FALSE(r.ok);
    for (const char* part : c.parts) CHECK(r.says(part));
  }
  CHECK(run(folder, "").says("level 0"));  // the embedded flat, as in all programs
  const Outcome help = run(folder, "--help");
  CHECK(help.ok);
  for (const char* part : {"--out", "--png", "--agent-radius", "--solid-alpha", "--up"})
    CHECK(help.says(part));
}

TEST_CASE(
    "navmesh tool: a full disk leaves the NavMesh, outline and picture of before; names are checked "
    "first") {
  const TempFolder folder("navmesh_full");
  write_file(folder / "floors.obj", two_floors_z_up());
  std::filesystem::create_directory(folder / "disk");
  const gsnav_test::SmallDisk disk(folder / "disk", 16);
  if (disk.mounted()) {
    for (const char* kind : {"--out disk/a.navmesh", "--obj disk/a.obj", "--png disk/a.png"}) {
      CAPTURE(kind);
      const std::filesystem::path file = folder / std::string(kind).substr(6);
      write_file(file, "before");
      write_file(folder / "disk/filler", std::string(12000, 'x'));
      const Outcome out = run(
          folder, std::string("floors.obj --up z --scale 0.01 --tile-size 16 ") + kPlain + " " + kind);
      CAPTURE(out.text);
      CHECK_FALSE(out.ok);
      CHECK(out.says("cannot be written: No space left on device"));
      CHECK(read_file(file) == "before");
      CHECK(std::distance(std::filesystem::directory_iterator(folder / "disk"), {}) == 2);
      std::filesystem::remove(file);
    }
  }
  for (const char* outputs : {"--out none/a.navmesh", "--out a.navmesh --settings-out none/s.json"}) {
    const Outcome out = run(folder, std::string("absent.obj ") + outputs);
    CAPTURE(outputs);
    CHECK_FALSE(out.ok);
    CHECK(out.says("none does not exist; make it first"));
    CHECK_FALSE(out.says("absent.obj"));
  }
}
