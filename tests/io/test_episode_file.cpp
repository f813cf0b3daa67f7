// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cmath>
#include <string>

#include "gsnav/detail/io/episode_file.hpp"
#include "support/files.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

/// One episode, compressed by Python's gzip module.
const std::string kByPython(
    "\037\213\010\000\000\000\000\000\002\003\115\116\321\016\202\060\014\374\225\145\317\163\101\021"
    "\061\376"
    "\212\061\144\262\001\115\346\112\266\362\104\370\167\127\343\010\057\155\356\172\275\273\125\272"
    "\031\022"
    "\132\227\344\103\074\327\202\072\260\031\313\126\052\041\123\357\102\041\006\157\110\217\376\375"
    "\343\311"
    "\104\352\146\114\100\200\201\337\317\112\134\164\243\304\251\176\355\367\210\144\312\275\122\242"
    "\322\267"
    "\074\170\337\131\063\242\361\377\344\243\321\265\030\235\131\024\215\205\205\125\141\361\176\143"
    "\006\302"
    "\200\031\257\162\164\134\035\372\316\102\216\013\275\313\154\255\333\146\343\374\011\043\271\224"
    "\053\032"
    "\232\312\373\241\027\176\166\313\355\013\043\273\044\057\007\001\000\000",
    174);

// As Habitat-Lab's generator writes them: quaternions are x, y, z, w.
const std::string kOne =
    R"({"episode_id":"7","scene_id":"hm3d/flat.basis.glb","start_position":[1,2.5,-3],"start_rotation":[0,0.6,0,0.8],)"
    R"("goals":[{"position":[4,2.5,-1],"radius":0.36}],"info":{"geodesic_distance":3.75,"difficulty":"easy"},)"
    R"("shortest_paths":null,"start_room":null})";

Result<io::EpisodeFile> parse_episodes(const std::string& text) {
  TempFolder folder("episodes");
  write_file(folder / "val.json", text);
  return io::load_episodes(folder / "val.json");
}

void check_first(const PointNavEpisode& e, double radius) {
  CHECK(e.id == "7");
  CHECK(e.start_position == Vec3d{1, 2.5, -3});
  CHECK(e.start_rotation.w == 0.8);
  CHECK(e.start_rotation.x == 0.0);
  CHECK(e.start_rotation.y == 0.6);
  CHECK(e.goal_position == Vec3d{4, 2.5, -1});
  CHECK(e.goal_radius == radius);
  CHECK(e.geodesic_distance == 3.75);
  CHECK(e.start_time == 0.0);
}

}  // namespace

TEST_CASE("episodes of Habitat-Lab are read, their quaternions turned round") {
  const auto file = parse_episodes("{\"episodes\":[" + kOne + "]}").value();
  REQUIRE(file.episodes.size() == 1);
  check_first(file.episodes[0], 0.36);
  CHECK(file.episodes[0].scene_id == "hm3d/flat.basis.glb");
  CHECK(file.warnings.empty());
}

TEST_CASE("gzip is known by its first bytes") {
  TempFolder folder("episodes");
  write_file(folder / "val.json.gz", kByPython);
  check_first(io::load_episodes(folder / "val.json.gz")->episodes.at(0), 0.2);
  write_file(folder / "cut.json.gz", kByPython.substr(0, kByPython.size() - 9));
  const auto cut = io::load_episodes(folder / "cut.json.gz");
  CHECK(cut.code() == Errc::invalid_file);
  CHECK(contains(cut.message(), "cut.json.gz"));
}

TEST_CASE("a file without episodes stands for those in content beside it") {
  TempFolder folder("episodes");
  std::filesystem::create_directories(folder / "content");
  write_file(folder / "train.json",
             R"({"episodes":[],"content_scenes_path":"{data_path}/content/{scene}.json.gz"})");
  std::string second = kOne;
  second.replace(second.find("\"7\""), 3, "8");  // numbers are names, too
  write_file(folder / "content/b.json", "{\"episodes\":[" + second + "]}");
  write_file(folder / "content/a.json.gz", kByPython);
  write_file(folder / "content/notes.txt", "?");
  const auto file = io::load_episodes(folder / "train.json").value();
  REQUIRE(file.episodes.size() == 2);
  CHECK(file.episodes[0].id == "7");
  CHECK(file.episodes[1].id == "8");
}

TEST_CASE("what is written reads back the same, bit for bit, compressed or not") {
  std::vector<PointNavEpisode> out(2);
  out[0].id = "a \"quoted\" name";
  out[0].scene_id = "flat";
  out[0].start_position = {0.1, 1.0 / 3.0, -1e-17};
  out[0].start_rotation = {std::cos(0.3), 0, std::sin(0.3), 0};
  out[0].goal_position = {1e9 / 7, 2, 3};
  out[0].geodesic_distance = std::sqrt(2.0);
  out[0].start_time = 12.5;
  out[0].goal_radius = 0.36;
  out[1].id = "b";
  TempFolder folder("episodes");
  for (const char* name : {"val.json", "val.json.gz"}) {
    REQUIRE(io::save_episodes(folder / name, out).ok());
    const auto in = io::load_episodes(folder / name).value();
    REQUIRE(in.episodes.size() == 2);
    CHECK(in.warnings.empty());
    for (std::size_t i = 0; i < 2; ++i) {
      const PointNavEpisode &a = in.episodes[i], &b = out[i];
      CHECK(a.id == b.id);
      CHECK(a.scene_id == b.scene_id);
      CHECK(a.start_position == b.start_position);
      CHECK(a.goal_position == b.goal_position);
      CHECK(a.start_rotation.w == b.start_rotation.w);
      CHECK(a.start_rotation.y == b.start_rotation.y);
      CHECK(a.geodesic_distance == b.geodesic_distance);
      CHECK(a.start_time == b.start_time);
      CHECK(a.goal_radius == b.goal_radius);
    }
  }
  const std::string packed = read_file(folder / "val.json.gz");
  CHECK(packed.substr(0, 2) == "\x1f\x8b");
  REQUIRE(io::save_episodes(folder / "again.json.gz", out).ok());
  CHECK(read_file(folder / "again.json.gz") == packed);
}

TEST_CASE("keys that change nothing are reported once") {
  std::string more = kOne;
  more.replace(more.find("\"start_room\""), 12, "\"weather\":\"rain\",\"start_room\"");
  const std::string two = "[" + more + "," + more + "]";
  const auto file = parse_episodes("{\"episodes\":" + two + "}").value();
  REQUIRE(file.warnings.size() == 1);
  CHECK(contains(file.warnings[0], "weather"));
}

TEST_CASE("bad episodes are named with file, episode and key") {
  const auto check_fails = [](const std::string& from, const std::string& to, const std::string& part) {
    std::string bad = kOne;
    REQUIRE(contains(bad, from));
    bad.replace(bad.find(from), from.size(), to);
    const auto result = parse_episodes("{\"episodes\":[" + kOne + "," + bad + "]}");
    CAPTURE(result.message());
    CHECK(result.code() == Errc::invalid_file);
    CHECK(contains(result.message(), "val.json: episodes[1]"));
    CHECK(contains(result.message(), part));
  };
  check_fails("[1,2.5,-3]", "[1,2.5]", "start_position");
  check_fails("[1,2.5,-3]", "[1,null,-3]", "start_position");
  check_fails("[0,0.6,0,0.8]", "[0,0.6,0]", "start_rotation");
  check_fails("\"start_rotation\"", "\"rotation\"", "start_rotation");
  check_fails("[{\"position\":[4,2.5,-1],\"radius\":0.36}]", "[]", "goals");
  check_fails("\"radius\":0.36", "\"radius\":\"big\"", "radius");
  check_fails("3.75", "\"far\"", "geodesic_distance");
  check_fails("\"7\"", "[7]", "episode_id");
  CHECK(contains(parse_episodes("{}").message(), "'episodes' is missing"));
  CHECK(contains(parse_episodes("[]").message(), "must be an object"));
  CHECK(contains(parse_episodes("{\"episodes\":7}").message(), "must be an array"));
  CHECK(contains(parse_episodes("{\"episodes\":[").message(), "not valid JSON"));
  CHECK(io::load_episodes("nowhere.json").code() == Errc::file_not_found);
  CHECK(io::save_episodes("no/such/folder/x.json", {}).code() == Errc::file_not_found);
}

TEST_CASE("episodes: what JSON has no number for is not written") {
  const TempFolder folder("episodes_finite");
  const auto refused = [&](auto change, const char* field) {
    std::vector<PointNavEpisode> list(2);
    list[1].id = "second";
    change(list[1]);
    const Status s = io::save_episodes(folder / "e.json", list);
    CAPTURE(s.message());
    CHECK(s.code() == Errc::invalid_argument);
    CHECK(contains(s.message(), "e.json: episode \"second\": " + std::string(field)));
    CHECK_FALSE(std::filesystem::exists(folder / "e.json"));
  };
  refused([](auto& e) { e.start_position.y = NAN; }, "start_position");
  refused([](auto& e) { e.start_rotation.w = INFINITY; }, "start_rotation");
  refused([](auto& e) { e.goal_position.z = -INFINITY; }, "goal_position");
  refused([](auto& e) { e.goal_radius = NAN; }, "goal_radius");
  refused([](auto& e) { e.geodesic_distance = INFINITY; }, "geodesic_distance");
  refused([](auto& e) { e.start_time = NAN; }, "start_time");
}
