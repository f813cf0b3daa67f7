// SPDX-License-Identifier: Apache-2.0
// The program as people run it.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "gsnav/demo.hpp"
#include "gsnav/io.hpp"
#include "support/command.hpp"
#include "support/files.hpp"

using namespace gsnav;
using namespace gsnav_test;
namespace fs = std::filesystem;

namespace {

Outcome run(const TempFolder& folder, const std::string& arguments) {
  return run_command(GSNAV_SCENE, arguments, folder.path());
}

/// Whether the program ends with this status.
bool exits_with(const TempFolder& folder, const std::string& arguments, int status) {
  return run(folder, arguments + " > out 2>&1; test $? -eq " + std::to_string(status)).ok;
}

std::size_t files_in(const TempFolder& folder) {
  const auto all = fs::directory_iterator(folder.path());
  return static_cast<std::size_t>(std::count_if(begin(all), end(all), [](const fs::directory_entry& e) {
    return e.path().filename() != "log" && e.path().filename() != "out";
  }));
}

}  // namespace

TEST_CASE("scene: the flat in as many Gaussians as asked for, with its mesh and views inside it") {
  const TempFolder folder("scene");
  const Outcome out = run(folder,
                          "flat --gaussians 23456 --out flat.ply --mesh flat.obj --cameras cameras.json "
                          "--views 5 --width 320 --height 200");
  CAPTURE(out.text);
  REQUIRE(out.ok);
  CHECK(out.says("flat.ply: 23456 Gaussians"));
  CHECK(io::load_scene(folder / "flat.ply").value().cloud.size() == 23456);

  CHECK(io::load_scene(folder / "flat.ply").value().cloud.sh_degree == 3);
  REQUIRE(run(folder, "flat --gaussians 12345 --sh-degree 0 --out plain.ply").ok);
  CHECK(io::load_scene(folder / "plain.ply").value().cloud.sh_degree == 0);
  REQUIRE(run(folder, "rooms --rooms 2 --gaussians 30000 --sh-degree 2 --out rooms.ply").ok);
  CHECK(io::load_scene(folder / "rooms.ply").value().cloud.sh_degree == 2);

  const DefaultScene scene = make_default_scene(0.05).value();
  const TriangleMesh mesh = io::load_obj(folder / "flat.obj").value();
  REQUIRE(mesh.vertices.size() == scene.vertices.size());
  CHECK(mesh.triangles == scene.triangles);
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    for (int k = 0; k < 3; ++k) REQUIRE(mesh.vertices[i][k] == static_cast<float>(scene.vertices[i][k]));
  }

  const std::vector<Camera> cameras = io::load_cameras(folder / "cameras.json").value();
  REQUIRE(cameras.size() == 5);
  for (const Camera& c : cameras) {
    CHECK((c.width == 320 && c.height == 200));
    const Vec3d eye = c.position(), down = c.viewmat.linear.row[1];
    CHECK(eye.y == doctest::Approx(1.5));
    CHECK((eye.x > 0 && eye.x < 10 && eye.z > 0 && eye.z < 8));
    CHECK(down.y < -0.9);  // upright
  }
}

TEST_CASE("scene: the same options give the same files, another seed others") {
  const TempFolder folder("scene");
  const char* common = " --rooms 3 --density 0.05 --mesh ";
  REQUIRE(run(folder, std::string("rooms --seed 7 --out a.ply --cameras a.json") + common + "a.obj").ok);
  REQUIRE(run(folder, std::string("rooms --seed 7 --out b.ply --cameras b.json") + common + "b.obj").ok);
  const Outcome other = run(folder, std::string("rooms --seed 8 --out c.ply") + common + "c.obj");
  REQUIRE(other.ok);
  CHECK(other.says("3 rooms on "));
  for (const char* end : {".ply", ".obj", ".json"}) {
    CHECK(read_file((folder / (std::string("a") + end)).string()) ==
          read_file((folder / (std::string("b") + end)).string()));
  }
  CHECK(read_file((folder / "a.obj").string()) != read_file((folder / "c.obj").string()));
}

TEST_CASE("scene: rooms in an exact number of Gaussians and another format") {
  const TempFolder folder("scene");
  const Outcome out = run(folder, "rooms --rooms 2 --gaussians 30001 --out rooms.spz");
  CAPTURE(out.text);
  REQUIRE(out.ok);
  CHECK(io::load_scene(folder / "rooms.spz").value().cloud.size() == 30001);
}

TEST_CASE("scene: the embedded flat goes to a folder that is made, or to a file") {
  const TempFolder folder("scene");
  REQUIRE(run(folder, "default --out made/flat --views 2").ok);
  const DefaultScene scene = make_default_scene().value();
  CHECK(io::load_scene(folder / "made/flat/flat.ply").value().cloud.size() == scene.cloud.size());
  CHECK(io::load_obj(folder / "made/flat/flat.obj").value().triangles == scene.triangles);
  CHECK(io::load_cameras(folder / "made/flat/cameras.json").value().size() == 2);
  REQUIRE(run(folder, "default --out alone.splat").ok);
  CHECK(fs::exists(folder / "alone.splat"));
  CHECK_FALSE(fs::exists(folder / "alone.obj"));
}

TEST_CASE("scene: the person has the bits of the library's") {
  const TempFolder folder("scene");
  const Outcome out = run(folder, "humanoid --gaussians 3000 --out human.npz");
  CAPTURE(out.text);
  REQUIRE(out.ok);
  HumanoidOptions options;
  options.gaussians = 3000;
  const AvatarAsset made = make_humanoid(options);
  const AvatarAsset read = io::load_avatar(folder / "human.npz").value().asset;
  CHECK(read.size() == made.size());
  CHECK(read.skeleton.names == made.skeleton.names);
  CHECK(read.capsules.size() == made.capsules.size());
  CHECK(read.cloud.means == made.cloud.means);
  // Another seed is another person; a scene's name gives Gaussians alone.
  REQUIRE(run(folder, "humanoid --seed 5 --gaussians 3000 --out other.glb").ok);
  CHECK(io::load_scene(folder / "other.glb").value().cloud.size() > 2000);
}

TEST_CASE("scene: outputs that cannot be written are named before work, and nothing is left") {
  const TempFolder folder("scene");
  for (const char* arguments :
       {"flat --out none/flat.ply", "flat --out flat.ply --mesh none/flat.obj",
        "rooms --out flat.ply --cameras none/c.json", "humanoid --out none/human.npz",
        "rooms --rooms 12 --gaussians 10000 --out rooms.ply"}) {
    CAPTURE(arguments);
    CHECK(exits_with(folder, arguments, 1));
    CHECK(read_file((folder / "out").string()).find("gsnav-scene: ") != std::string::npos);
    CHECK(files_in(folder) == 0);
  }
  CHECK(run(folder, "flat --out none/flat.ply").says("the folder none does not exist"));
}

TEST_CASE("scene: options that cannot be used exit with 2, help and version with 0") {
  const TempFolder folder("scene");
  for (const char* arguments :
       {"", "castle --out a.ply", "flat", "flat --out a.ply --gaussians 10",
        "flat --out a.ply --views 0", "flat --out a.ply --gaussians 99999999999",
        "flat --out a.ply --gaussians -5", "flat --out a.ply --sh-degree 4",
        "rooms --out a.ply --rooms 13", "rooms --out a.ply --seed -1",
        "rooms --out a.ply --gaussians 20000 --density 1", "humanoid --gaussians 1 --out a.npz",
        "default --out a --mesh a/flat.ply"}) {
    CAPTURE(arguments);
    CHECK(exits_with(folder, arguments, 2));
  }
  CHECK(run(folder, "flat --out a.ply --gaussians 10").says("50000000"));
  CHECK(run(folder, "castle --out a.ply").says("there is no command castle"));
  CHECK(run(folder, "--version").says("gsnav-scene "));
  for (const char* command : {"", "flat", "rooms", "default", "humanoid"}) {
    const Outcome help = run(folder, std::string(command) + " --help");
    CHECK(help.ok);
    CHECK(help.says("--help"));
  }
  CHECK(files_in(folder) == 0);
}
