// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <string>

#include "gsnav/detail/io/habitat_dataset.hpp"
#include "support/files.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

/// A dataset as Habitat-GS lays one out.
struct Dataset {
  Dataset() : folder("dataset") {
    for (const char* sub : {"configs/stages/old", "configs/scenes", "navmeshes"}) {
      std::filesystem::create_directories(folder / sub);
    }
    write_file(
        folder / "gs.scene_dataset_config.json",
        R"({"stages":{"paths":{".json":["configs/stages"]},"default_attributes":{"norm_quaternion":false}},)"
        R"("scene_instances":{"paths":{".json":["configs/scene*"]}},)"
        R"("navmesh_instances":{"playroom_nav":"navmeshes/playroom.navmesh"},)"
        R"("light_setups":{"paths":{".json":["lighting"]}}})");
    write_file(
        folder / "configs/stages/playroom.stage_config.json",
        R"({"render_asset":"../../assets/playroom.gs.ply","collision_asset":"../../assets/playroom.glb",)"
        R"("up":[0,0,1],"front":[0,1,0],"friction_coefficient":0.4})");
    write_file(folder / "configs/stages/attic.stage_config.json", R"({"render_asset":"attic.gs.ply"})");
    write_file(folder / "configs/stages/readme.json", "not one");
    write_file(
        folder / "configs/scenes/playroom_people.scene_instance.json",
        R"({"stage_instance":{"template_name":"stages/playroom"},"navmesh_instance":"playroom_nav",)"
        R"("object_instances":[],"default_lighting":"","time_max":20.0,"time_loop":true,)"
        R"("gaussian_avatars":[{"name":"anna","canonical_gaussians":"anna.npz","driver":"walk.npz","offset_y":1.0}]})");
    write_file(folder / "configs/scenes/attic.scene_instance.json",
               R"({"stage_instance":{"template_name":"attic.stage_config.json"}})");
  }
  Result<io::HabitatDataset> load() const {
    return io::load_habitat_dataset(folder / "gs.scene_dataset_config.json");
  }
  void write(const std::string& name, const std::string& text) const { write_file(folder / name, text); }
  TempFolder folder;
};

}  // namespace

TEST_CASE("a dataset leads to its scenes, their stages, NavMeshes and people") {
  const Dataset d;
  const auto data = d.load().value();
  REQUIRE(data.scenes.size() == 2);
  const io::HabitatScene* attic = data.find("attic");
  const io::HabitatScene* playroom = data.find("playroom_people");
  REQUIRE(attic != nullptr);
  REQUIRE(playroom != nullptr);
  CHECK(attic->stage.render_asset == d.folder / "configs/stages/attic.gs.ply");
  CHECK(attic->navmesh.empty());
  CHECK_FALSE(attic->stage.norm_quaternion);  // the dataset's default
  CHECK(playroom->stage.render_asset == d.folder / "assets/playroom.gs.ply");
  CHECK(playroom->stage.collision_asset == d.folder / "assets/playroom.glb");
  CHECK(playroom->navmesh == d.folder / "navmeshes/playroom.navmesh");
  CHECK(playroom->avatars.time_max == 20.0);
  REQUIRE(playroom->avatars.avatars.size() == 1);
  CHECK(playroom->avatars.avatars[0].name == "anna");
  CHECK(playroom->avatars.avatars[0].canonical == d.folder / "configs/scenes/anna.npz");
  // Episodes name scenes by their asset, too.
  CHECK(data.find("data/gs/playroom.gs.ply") == playroom);
  CHECK(data.find("elsewhere") == nullptr);
}

TEST_CASE("a dataset names the files outside of its folder that it uses") {
  const Dataset d;
  CHECK(d.load()->warnings.size() == 4);  // keys that are left out; ../../assets is inside
  const std::string outside = (d.folder.path().parent_path() / "elsewhere.ply").string();
  d.write("configs/stages/attic.stage_config.json", R"({"render_asset":")" + outside + R"("})");
  d.write("configs/stages/playroom.stage_config.json", R"({"render_asset":"../../../beside.ply"})");
  const auto data = d.load().value();
  std::size_t said = 0;
  for (const std::string& w : data.warnings) {
    if (!contains(w, "outside of the dataset's folder")) continue;
    ++said;
    CHECK((contains(w, "attic uses " + outside) || contains(w, "beside.ply")));
  }
  CHECK(said == 2);
  CHECK(data.find("attic")->stage.render_asset == outside);  // it is read: Habitat's own datasets do so
}

TEST_CASE("a stage's frame by hand: z up and y ahead becomes y up and -z ahead") {
  const Dataset d;
  d.write("configs/stages/playroom.stage_config.json",
          R"({"render_asset":"a.ply","up":[0,0,1],"front":[0,1,0],"origin":[1,2,3],
"units_to_meters":0.5,"scale":[4,4,4]})");
  const Similarity s =
      io::load_stage_config(d.folder / "configs/stages/playroom.stage_config.json")->world_from_asset();
  const auto near = [](const Vec3d& a, const Vec3d& b) { return norm(a - b) < 1e-12; };
  CHECK(near(s * Vec3d{1, 2, 3}, {0, 0, 0}));
  CHECK(near(s * Vec3d{1, 2, 4}, {0, 2, 0}));
  CHECK(near(s * Vec3d{1, 3, 3}, {0, 0, -2}));
  CHECK(near(s * Vec3d{2, 2, 3}, {2, 0, 0}));
  // And Habitat's own frame is the world's.
  const Similarity same = io::StageConfig{}.world_from_asset();
  CHECK(near(same * Vec3d{1, 2, 3}, {1, 2, 3}));
}

TEST_CASE("a dataset of stages alone has a scene for each") {
  const Dataset d;
  d.write(
      "gs.scene_dataset_config.json",
      R"({"stages":{"paths":{".json":["configs/stages/*"]}},"navmesh_instances":{"attic":"navmeshes/attic.navmesh"}})");
  const auto data = d.load().value();
  REQUIRE(data.scenes.size() == 2);
  CHECK(data.scenes[0].name == "attic");
  CHECK(data.scenes[0].navmesh == d.folder / "navmeshes/attic.navmesh");
  CHECK(data.scenes[1].name == "playroom");
}

TEST_CASE("what is left out is reported once, with the first file that has it") {
  const Dataset d;
  const auto data = d.load().value();
  const auto mentions = [&](const std::string& key) {
    int n = 0;
    for (const std::string& w : data.warnings) n += contains(w, "'" + key + "'") ? 1 : 0;
    return n;
  };
  CHECK(mentions("light_setups") == 1);
  CHECK(mentions("friction_coefficient") == 1);
  CHECK(mentions("object_instances") == 1);
  CHECK(mentions("render_asset") == 0);
}

TEST_CASE("patterns stand for what they match and are not long about what they do not") {
  const Dataset d;
  const auto scenes = [&](const std::string& pattern) {
    d.write("gs.scene_dataset_config.json", R"({"stages":{"paths":{".json":[")" + pattern + R"("]}}})");
    return d.load()->scenes.size();
  };
  CHECK(scenes("configs/stages") == 2);
  CHECK(scenes("configs/stages/p*.stage_config.json") == 1);
  CHECK(scenes("*/stages/*room*") == 1);
  CHECK(scenes("configs/*/*.json") == 2);
  CHECK(scenes("nothing/*") == 0);
  std::string long_one = "configs/stages/";
  for (int i = 0; i < 40; ++i) long_one += "*a";
  CHECK(scenes(long_one) == 0);
}

TEST_CASE("mutated datasets and episodes are read or refused") {
  const Dataset d;
  std::uint64_t state = 7;
  const auto next = [&](std::size_t n) {
    state = state * 6364136223846793005ull + 1442695040888963407ull;
    return static_cast<std::size_t>(state >> 33) % n;
  };
  const std::string scene = "configs/scenes/playroom_people.scene_instance.json",
                    set = "gs.scene_dataset_config.json";
  int refused = 0;
  for (const std::string& name :
       {scene, set, std::string("configs/stages/playroom.stage_config.json")}) {
    const std::string whole = read_file(d.folder / name);
    for (int i = 0; i < 400; ++i) {
      std::string text = whole;
      for (std::size_t k = 0; k <= next(3); ++k) text[next(text.size())] = "0{}[]\":,*a.-\\"[next(14)];
      d.write(name, text);
      refused += d.load().ok() ? 0 : 1;
    }
    d.write(name, whole);
  }
  CHECK(refused > 300);
  CHECK(d.load().ok());
}

TEST_CASE("bad datasets are named with file and key") {
  const auto message = [](const std::string& file, const std::string& text, Errc code) {
    const Dataset d;
    d.write(file, text);
    const auto data = d.load();
    CAPTURE(data.message());
    CHECK(data.code() == code);
    CHECK(contains(data.message(), std::filesystem::path(file).filename().string()));
    return data.message();
  };
  const std::string stage = "configs/stages/attic.stage_config.json",
                    scene = "configs/scenes/attic.scene_instance.json",
                    set = "gs.scene_dataset_config.json";
  CHECK(contains(message(stage, "{}", Errc::invalid_file), "render_asset"));
  CHECK(contains(message(stage, R"({"render_asset":7})", Errc::invalid_file), "render_asset"));
  CHECK(contains(message(stage, R"({"render_asset":"a","up":[0,0,0]})", Errc::invalid_file), "up"));
  CHECK(contains(
      message(stage, R"({"render_asset":"a","up":[0,0,1],"front":[0,0,1]})", Errc::invalid_file),
      "right angles"));
  CHECK(contains(message(stage, R"({"render_asset":"a","scale":[1,2,1]})", Errc::unsupported), "scale"));
  CHECK(contains(message(stage, R"({"render_asset":"a","scale":[0]})", Errc::invalid_file), "scale"));
  CHECK(contains(message(stage, R"({"render_asset":"a","units_to_meters":-1})", Errc::invalid_file),
                 "units_to_meters"));
  CHECK(contains(message(stage, "[]", Errc::invalid_file), "object"));
  CHECK(contains(message(scene, "{}", Errc::invalid_file), "stage_instance"));
  CHECK(
      contains(message(scene, R"({"stage_instance":{"template_name":"cellar"}})", Errc::file_not_found),
               "cellar"));
  CHECK(
      contains(message(scene, R"({"stage_instance":{"template_name":"attic"},"navmesh_instance":"nix"})",
                       Errc::file_not_found),
               "navmesh_instance"));
  CHECK(contains(message(set, R"({"stages":[]})", Errc::invalid_file), "stages"));
  CHECK(contains(message(set, R"({"stages":{"paths":{".json":"x"}}})", Errc::invalid_file), ".json"));
  CHECK(contains(message(set, R"({"navmesh_instances":{"a":7}})", Errc::invalid_file),
                 "navmesh_instances"));
  CHECK(io::load_habitat_dataset("nowhere.json").code() == Errc::file_not_found);
}
