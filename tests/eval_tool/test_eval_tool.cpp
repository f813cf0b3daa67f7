// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>
#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "gsnav/detail/io/episode_file.hpp"
#include "gsnav/detail/io/npz_file.hpp"
#include "gsnav/io/image_file.hpp"
#include "gsnav/nav.hpp"
#include "gsnav/sim/metrics.hpp"
#include "support/command.hpp"
#include "support/files.hpp"
#include "support/process.hpp"
#include "support/small_disk.hpp"

using namespace gsnav_test;

namespace {

// Programs make the flat anew each time: as few Gaussians as it may have.
const std::string kSparse = " --density 0.05 ";
const std::string kOptions =
    kSparse + "--avatars 2 --episodes 3 --max-steps 25 --width 32 --height 24 --out out ";

std::size_t lines(const std::string& text) {
  return static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
}

}  // namespace

TEST_CASE("an evaluation that was broken off goes on, to the same journal and page") {
  const TempFolder folder("eval");
  const auto eval = [&](const std::string& more) {
    return run_command(GSNAV_EVAL, kOptions + more, folder.path());
  };
  const Outcome whole = eval("--pictures 1");
  CAPTURE(whole.text);
  REQUIRE(whole.ok);
  CHECK(whole.says("3 episodes: SR"));
  const std::string journal = read_file(folder / "out/journal.jsonl"),
                    page = read_file(folder / "out/index.html");
  CHECK(lines(journal) == 4);
  CHECK(contains(page, "data:image/"));
  CHECK(contains(page, "personal space intrusion"));
  CHECK_FALSE(contains(page, "src=\"http"));
  CHECK(gsnav::io::load_episodes(folder / "out/episodes.json.gz")->episodes.size() == 3);
  CHECK(gsnav::io::load_png(folder / "out/episodes/0_strip.png")->width == 4 * 36 + 4);

  // Broken off in the middle of the second episode's line.
  const std::size_t second = journal.find('\n', journal.find('\n') + 1) + 1;
  write_file(folder / "out/journal.jsonl", journal.substr(0, second + 20));
  const Outcome again = eval("--pictures 1");
  CAPTURE(again.text);
  REQUIRE(again.ok);
  CHECK_FALSE(again.says("episode 1/3"));
  CHECK(again.says("episode 2/3"));
  CHECK(read_file(folder / "out/journal.jsonl") == journal);
  CHECK(read_file(folder / "out/index.html") == page);

  CHECK(again.says("journal.jsonl: line 3 has no end, as after a kill: 20 bytes are dropped"));

  {
    // Two processes that write one journal would read and cut off each other's lines.
    const int held = ::open((folder / "out/journal.jsonl").c_str(), O_RDONLY | O_CLOEXEC);
    REQUIRE(::flock(held, LOCK_EX | LOCK_NB) == 0);
    const Outcome second_process = eval("");
    CHECK_FALSE(second_process.ok);
    CHECK(second_process.says("journal.jsonl: another process writes it"));
    CHECK(read_file(folder / "out/journal.jsonl") == journal);
    ::close(held);
  }
  const Outcome other = eval("--seed 5");
  CHECK_FALSE(other.ok);
  CHECK(other.says("was recorded with --seed 1, but this run has --seed 5"));
  CHECK(other.says("--restart"));

  // What was recorded is played again: the agent's own camera, then one that stands.
  // Its options are in the journal.
  const auto replay = [&](const std::string& more) {
    return run_command(GSNAV_REPLAY, "--out out " + more, folder.path());
  };
  const Outcome differs = replay("--episode 0 --policy random");
  CHECK_FALSE(differs.ok);
  CHECK(differs.says("was recorded with --policy follower, but this run has --policy random"));
  const Outcome own = replay("--episode 0 --frames own --every 5");
  CAPTURE(own.text);
  REQUIRE(own.ok);
  const auto track = gsnav::io::NpzFile::open(folder / "own/track.npz").value();
  const auto positions = track.read("positions").value();
  const auto episode = gsnav::io::load_episodes(folder / "out/episodes.json.gz")->episodes[0];
  CHECK(positions.values[0] == doctest::Approx(episode.start_position.x).epsilon(1e-6));
  CHECK(positions.values[2] == doctest::Approx(episode.start_position.z).epsilon(1e-6));
  // The first frame of the strip, below the line of times, is what the agent saw at the start.
  const auto frame = gsnav::io::load_png(folder / "own/00000.png").value();
  const auto strip = gsnav::io::load_png(folder / "out/episodes/0_strip.png").value();
  bool same = true;
  for (std::size_t y = 0; y < 24; ++y) {
    for (std::size_t x = 0; x < 96; ++x) {
      same = same && frame.samples[y * 96 + x] ==
                         strip.samples[(y + 18) * 3 * static_cast<std::size_t>(strip.width) + 12 + x];
    }
  }
  CHECK(same);
  CHECK(replay("--episode 0 --frames above --every 10 --eye 5 2.5 4 --target 5 0 4").ok);
  CHECK(std::filesystem::exists(folder / "above/00010.png"));
  const Outcome none = replay("--episode 9");
  CHECK_FALSE(none.ok);
  CHECK(none.says("--episode 9"));
}

TEST_CASE("episodes of a file are played by any policy") {
  const TempFolder folder("eval");
  std::vector<gsnav::PointNavEpisode> episodes(1);
  episodes[0].id = "kitchen";
  episodes[0].start_position = {4.6, 0, 3.6};
  episodes[0].goal_position = {5.2, 0, 3.2};
  REQUIRE(gsnav::io::save_episodes(folder / "val.json.gz", episodes).ok());
  for (const std::string policy : {"greedy", "random"}) {
    const Outcome out = run_command(
        GSNAV_EVAL,
        kSparse + "--avatars 0 --max-steps 60 --pictures 0 --episode-file val.json.gz --out " + policy +
            " --policy " + policy,
        folder.path());
    CAPTURE(out.text);
    CHECK(out.ok);
    CHECK(out.says(policy == "greedy" ? "SR 1.000" : "1 episodes"));
  }
  CHECK(run_command(GSNAV_EVAL, "--episode-file none.json --out x", folder.path()).says("none.json"));
  // A name in a file that would clear the terminal.
  write_file(folder / "odd.json",
             R"({"episodes":[{"episode_id":"0","scene_id":"","start_position":[4.6,0,3.6],)"
             R"("start_rotation":[0,0,0,1],"goals":[{"position":[5.2,0,3.2]}],"\u001b[2J":1}]})");
  const Outcome odd = run_command(
      GSNAV_EVAL, kSparse + "--avatars 0 --max-steps 1 --pictures 0 --episode-file odd.json --out odd",
      folder.path());
  CAPTURE(odd.text);
  CHECK(odd.ok);
  CHECK(odd.says("'\\x1B[2J' is left out"));
  CHECK(odd.text.find('\x1b') == std::string::npos);
}

TEST_CASE(
    "an evaluation whose episodes, scene or NavMesh changed is refused by name, and begun anew on "
    "request") {
  const TempFolder folder("eval");
  std::vector<gsnav::PointNavEpisode> episodes(1);
  episodes[0].id = "kitchen";
  episodes[0].start_position = {4.6, 0, 3.6};
  episodes[0].goal_position = {5.2, 0, 3.2};
  REQUIRE(gsnav::io::save_episodes(folder / "val.json.gz", episodes).ok());
  const auto eval = [&](const std::string& more = "", const std::string& file = "val.json.gz") {
    return run_command(
        GSNAV_EVAL, kSparse + "--avatars 0 --pictures 0 --out out --episode-file " + file + " " + more,
        folder.path());
  };
  REQUIRE(eval().ok);
  CHECK(eval().says("SR 1.000"));
  // The same content under another name is the same evaluation.
  std::filesystem::copy_file(folder / "val.json.gz", folder / "moved.json.gz");
  CHECK(eval("", "moved.json.gz").says("SR 1.000"));
  // The same name with another goal is not.
  episodes[0].goal_position = {5.3, 0, 3.2};
  REQUIRE(gsnav::io::save_episodes(folder / "val.json.gz", episodes).ok());
  const std::string before = read_file(folder / "out/metrics.json");
  const Outcome stale = eval();
  CAPTURE(stale.text);
  CHECK_FALSE(stale.ok);
  CHECK(stale.says("the episodes in val.json.gz have changed"));
  CHECK(stale.says("--restart"));
  CHECK(read_file(folder / "out/metrics.json") == before);
  const Outcome replay = run_command(GSNAV_REPLAY, "--out out", folder.path());
  CHECK_FALSE(replay.ok);
  CHECK(replay.says("the episodes in val.json.gz have changed"));
  // Options that change the world.
  for (const std::string more :
       {"--cell-size 0.1", "--crop 0 0 0 9 2 9", "--max-steps 61", "--width 48", "--hfov 60.5"}) {
    const Outcome differs = eval(more);
    CAPTURE(differs.text);
    CHECK_FALSE(differs.ok);
    CHECK(differs.says(("this run has " + more).c_str()));
  }
  const Outcome anew = eval("--restart");
  CAPTURE(anew.text);
  CHECK(anew.ok);
  CHECK(anew.says("episode 1/1"));
  CHECK(read_file(folder / "out/metrics.json") != before);
  // A scene whose hash is another: as recorded by somebody else's.
  const std::string journal = read_file(folder / "out/journal.jsonl");
  for (const std::string name : {"scene", "navmesh", "people"}) {
    std::string changed = journal;
    const std::size_t at =
        changed.find("\"" + name + "\":\"", changed.find("\"contents\"")) + name.size() + 4;
    changed[at] = changed[at] == '0' ? '1' : '0';
    write_file(folder / "out/journal.jsonl", changed);
    const Outcome out = eval();
    CAPTURE(out.text);
    CHECK_FALSE(out.ok);
    CHECK(out.says(("the " + name + " that gsnav made ha").c_str()));
  }
  // A hash of arrays inside each other: more than a stack holds.
  const std::string deep = std::string(200000, '[') + std::string(200000, ']');
  const std::size_t hash = journal.find("\"scene\":\"", journal.find("\"contents\"")) + 8;
  write_file(folder / "out/journal.jsonl",
             journal.substr(0, hash) + deep + ",\"was\":" + journal.substr(hash));
  const Outcome nested = eval();
  CHECK_FALSE(nested.ok);
  CHECK(nested.says("line 1: is not the header of a journal"));
  // The header that gsnav wrote before.
  write_file(folder / "out/journal.jsonl",
             "{\"avatars\":0,\"scene\":\"\"}\n" + journal.substr(journal.find('\n') + 1));
  const Outcome old = eval();
  CHECK_FALSE(old.ok);
  CHECK(old.says("line 1: is of an earlier gsnav"));
}

TEST_CASE("a ready NavMesh is walked on, and another one in its file is refused by name") {
  const TempFolder folder("eval");
  const auto save_floor = [&](double length) {
    const std::vector<gsnav::Vec3d> corners{
        {1, 0, 1}, {1, 0, 4}, {1 + length, 0, 4}, {1 + length, 0, 1}};
    const std::vector<gsnav::NavMesh::Triangle> triangles{{0, 1, 2}, {0, 2, 3}};
    const auto mesh = gsnav::NavMesh::build({}, corners, triangles).value();
    REQUIRE(gsnav::save_navmesh(mesh, folder / "floor.navmesh").ok());
  };
  const auto eval = [&](const std::string& more) {
    return run_command(GSNAV_EVAL,
                       kSparse + "--avatars 0 --episodes 2 --max-steps 5 --pictures 0 --out out " + more,
                       folder.path());
  };
  save_floor(8);
  const Outcome made = eval("--navmesh floor.navmesh");
  CAPTURE(made.text);
  CHECK(made.ok);
  const auto drawn = gsnav::io::load_episodes(folder / "out/episodes.json.gz").value();
  for (const auto& e : drawn.episodes) {
    CHECK(e.start_position.x < 9);
    CHECK(e.start_position.z < 4);
  }
  save_floor(7);
  const Outcome other = eval("--navmesh floor.navmesh");
  CHECK_FALSE(other.ok);
  CHECK(other.says("the navmesh in floor.navmesh has changed"));
  CHECK(eval("--navmesh none.navmesh").says("none.navmesh"));
}

TEST_CASE("a record that is none of the evaluation is named by file, line, field and value") {
  const TempFolder folder("eval");
  const std::string options = kSparse + "--avatars 0 --episodes 2 --max-steps 20 --pictures 0 --out out";
  REQUIRE(run_command(GSNAV_EVAL, options, folder.path()).ok);
  const std::string journal = read_file(folder / "out/journal.jsonl");
  const std::string header = journal.substr(0, journal.find('\n') + 1);
  const std::string first =
      journal.substr(header.size(), journal.find('\n', header.size()) + 1 - header.size());
  const auto with = [&](const std::string& field,
                        const std::string& value) {  // in place of what the first record has
    std::string line = first;
    const std::size_t at = line.find("\"" + field + "\":");
    REQUIRE(at != std::string::npos);
    const std::size_t begin = at + field.size() + 3, end = line.find_first_of(",}", begin);
    return line.replace(begin, end - begin, value);
  };
  struct Bad {
    std::string line, says;
  };
  std::string short_metrics = first;
  short_metrics.erase(short_metrics.find("\"spl\":"),
                      short_metrics.find("\"soft_spl\":") - short_metrics.find("\"spl\":"));
  const std::size_t from = first.find("\"metrics\":{") + 11, to = first.find('}', from);
  std::string empty = first;
  empty.erase(from, to - from);
  // A success far from the goal, and half the way to it: their metrics fit each other.
  const auto fitted = [&](double l, double p, bool success) {
    auto j = nlohmann::ordered_json::parse(first);
    auto& m = j["metrics"];
    m["start_distance"] = l;
    m["stop_called"] = m["success"] = success;
    const double g = success ? 7 : m["distance_to_goal"].get<double>();
    m["distance_to_goal"] = g;
    m["spl"] = gsnav::success_weighted_by_path_length(success, l, p);
    m["soft_spl"] = gsnav::soft_success_weighted_by_path_length(g, l, p);
    m["stl"] = gsnav::success_weighted_by_time(success, l, 0.25, m["steps"].get<std::size_t>());
    return j.dump() + "\n";
  };
  const auto whole = nlohmann::ordered_json::parse(first);
  REQUIRE_FALSE(whole["metrics"]["stop_called"].get<bool>());
  const std::string actions = whole["actions"];
  const double l = whole["metrics"]["start_distance"], p = whole["metrics"]["path_length"];
  const std::string deep = std::string(200000, '[') + std::string(200000, ']');
  const std::vector<Bad> cases{
      {with("episode", "99"), "episode = 99"},
      {with("episode", "-1"), "episode = -1"},
      {with("id", "\"other\""), "id = \"other\""},
      {with("spl", "1.7"), "metrics.spl = 1.7: the recorded actions lead to 0.0"},
      {with("spl", "null"), "metrics.spl = null"},
      {with("path_length", "-3"), "metrics.path_length = -3"},
      {with("path_length", "1e300"), "metrics.path_length = 1e+300"},
      {with("steps", "21"), "metrics.steps = 21"},
      {with("success", "3"), "metrics.success = 3"},
      {with("collision_rate", "0.5"), "metrics.collision_rate = 0.5"},
      {with("reward", "null"), "reward = null"},
      {with("actions", "\"19\""), "actions = \"19\""},
      {short_metrics, "metrics.spl is missing"},
      {empty, "metrics.success is missing"},
      {with("reward", "7") + first, "differs from out/journal.jsonl: line 2"},
      {fitted(l, p, true), "metrics.success = true: the recorded actions lead to false"},
      {fitted(0.5 * l, p, false), "metrics.soft_spl = "},
      {with("start_distance", "1.5"), "metrics.start_distance = 1.5: the recorded actions lead to"},
      {with("stl", "0.9"), "metrics.stl = 0.9: the recorded actions lead to 0.0"},
      // Nobody is there.
      {with("psi", "0.25"), "metrics.psi = 0.25: the recorded actions lead to 0.0"},
      {with("psc", "0.5"), "metrics.psc = 0.5: the recorded actions lead to 1.0"},
      {with("min_clearance", "1.5"), "metrics.min_clearance = 1.5: the recorded actions lead to null"},
      {with("reward", "1e8"), "reward = 100000000.0: the recorded actions lead to"},
      {with("actions", '"' + actions + "1\""), "actions: step after the end"},
      {with("actions", '"' + actions.substr(1) + '"'), "the episode goes on after the last one"},
      {"{\"episode\":" + deep + ",\"id\":0}\n", "is JSON nested more than 4 deep"},
      {"[]\n", "is not an object"},
      {"{\n", "is not JSON"}};
  for (const Bad& bad : cases) {
    write_file(folder / "out/journal.jsonl", header + bad.line);
    const Outcome out = run_command(GSNAV_EVAL, options, folder.path());
    CAPTURE(bad.line);
    CAPTURE(out.text);
    CHECK_FALSE(out.ok);
    CHECK(out.says("out/journal.jsonl: line "));
    CHECK(out.says(bad.says.c_str()));
    CHECK(out.says("--restart"));
  }
  // The same record twice is one.
  write_file(folder / "out/journal.jsonl", journal + first);
  const Outcome twice = run_command(GSNAV_EVAL, options, folder.path());
  CHECK(twice.says("2 episodes: SR"));
}

TEST_CASE("equal evaluations write equal bytes, on any number of threads") {
  const TempFolder folder("eval");
  const std::string options =
      kSparse + "--avatars 2 --episodes 3 --max-steps 25 --pictures 0 --policy random ";
  REQUIRE(run_command(GSNAV_EVAL, options + "--device cpu:1 --out one", folder.path()).ok);
  REQUIRE(run_command(GSNAV_EVAL, options + "--device cpu:3 --out three", folder.path()).ok);
  const std::string one = read_file(folder / "one/metrics.json");
  CHECK(one == read_file(folder / "three/metrics.json"));
  for (const char* name : {"\"psc\":", "\"human_collision_episode_rate\":",
                           "\"human_blocked_episode_rate\":", "\"means\":"}) {
    CHECK(contains(one, name));
  }
  CHECK_FALSE(contains(one, "_s\""));
  CHECK(contains(read_file(folder / "one/timings.json"), "play_s"));
}

TEST_CASE("an evaluation that is killed while it plays goes on to the bytes of one that never was") {
  const TempFolder folder("eval");
  const std::vector<std::string> common{"--density",   "0.05", "--avatars", "1",      "--episodes", "12",
                                        "--max-steps", "150",  "--policy",  "random", "--pictures", "0",
                                        "--out"};
  const auto words = [&](const std::string& out) {
    std::vector<std::string> all{GSNAV_EVAL};
    all.insert(all.end(), common.begin(), common.end());
    all.push_back(out);
    return all;
  };
  std::size_t kills = 0;
  for (std::size_t until = 2; until < 8; until += 2) {  // lines
    Process run(words("killed"), folder.path());
    while (run.runs() && lines(read_file(folder / "killed/journal.jsonl")) < until) usleep(500);
    run.signal(SIGKILL);
    kills += run.wait(60) == -1 ? 1 : 0;
    CHECK(lines(read_file(folder / "killed/journal.jsonl")) >= until);
  }
  CHECK(kills > 0);
  CHECK(Process(words("killed"), folder.path()).wait(120) == 0);
  CHECK(Process(words("whole"), folder.path()).wait(120) == 0);
  for (const char* name : {"journal.jsonl", "metrics.json", "index.html", "episodes.json.gz"}) {
    CAPTURE(name);
    CHECK(read_file(folder / ("killed/" + std::string(name))) ==
          read_file(folder / ("whole/" + std::string(name))));
  }
  for (const auto& entry : std::filesystem::directory_iterator(folder / "killed")) {
    CHECK(entry.path().extension() != ".part");
  }
}

TEST_CASE("a full disk leaves the journal whole and nothing half written") {
  const TempFolder folder("eval");
  std::filesystem::create_directories(folder / "disk");
  const SmallDisk disk(folder / "disk", 24);
  if (!disk.mounted()) return;
  const std::string options =
      kSparse + "--avatars 0 --episodes 40 --max-steps 200 --policy random --pictures 0 --out ";
  const Outcome out = run_command(GSNAV_EVAL, options + "disk", folder.path());
  CAPTURE(out.text);
  CHECK_FALSE(out.ok);
  CHECK(out.says("cannot be written: No space left on device"));
  const std::string journal = read_file(folder / "disk/journal.jsonl");
  REQUIRE(lines(journal) > 1);
  CHECK(journal.back() == '\n');
  for (const char* name : {"metrics.json", "index.html", "timings.json"})
    CHECK_FALSE(std::filesystem::exists(folder / "disk" / name));
  for (const auto& entry : std::filesystem::directory_iterator(folder / "disk"))
    CHECK(entry.path().extension() != ".part");
  // With room it goes on to what a run that was never stopped has.
  std::filesystem::create_directories(folder / "room");
  write_file(folder / "room/journal.jsonl", journal);
  REQUIRE(run_command(GSNAV_EVAL, options + "room", folder.path()).ok);
  REQUIRE(run_command(GSNAV_EVAL, options + "whole", folder.path()).ok);
  CHECK(read_file(folder / "room/metrics.json") == read_file(folder / "whole/metrics.json"));
}

TEST_CASE("output names that cannot be written are refused before anything is loaded") {
  const TempFolder folder("eval");
  write_file(folder / "file", "x");
  std::filesystem::create_directories(folder / "taken/metrics.json");
  const auto eval = [&](const std::string& out) {
    return run_command(GSNAV_EVAL, "--scene none.ply --out " + out, folder.path());
  };
  CHECK(eval("file").says("file"));
  CHECK_FALSE(eval("file").says("none.ply"));
  CHECK(eval("taken").says("taken/metrics.json: cannot be written: it is a folder"));
}

TEST_CASE("a replay becomes a video of any size, and says what is missing where there is no ffmpeg") {
  const TempFolder folder("video");
  const std::string options =
      kSparse + "--avatars 1 --episodes 1 --max-steps 12 --width 63 --height 47 --out out ";
  REQUIRE(run_command(GSNAV_EVAL, options + "--pictures 0", folder.path()).ok);
  const Outcome none =
      run_command("env", "PATH=/nowhere " + quoted(GSNAV_REPLAY) + " " + options + "--video none.mp4",
                  folder.path());
  CHECK_FALSE(none.ok);
  CHECK(none.says("--video none.mp4: ffmpeg is not installed; install it, or use .webp"));
  CHECK_FALSE(none.says("NavMesh"));  // before any work
  // One that fails in the middle of its file leaves the video that was there.
  std::filesystem::create_directories(folder / "bin");
  const auto program = [&](const char* end) {
    write_file(
        folder / "bin/ffmpeg",
        std::string("#!/bin/sh\nfor out; do :; done\ncat > /dev/null\nprintf made > \"$out\"\n") + end);
    std::filesystem::permissions(folder / "bin/ffmpeg", std::filesystem::perms::owner_all);
    return run_command(
        "env", "PATH=bin:/usr/bin:/bin " + quoted(GSNAV_REPLAY) + " " + options + "--video kept.mp4",
        folder.path());
  };
  write_file(folder / "kept.mp4", "before");
  CHECK(program("exit 1").says("ffmpeg failed"));
  CHECK(read_file(folder / "kept.mp4") == "before");
  CHECK(program("exit 0").ok);
  CHECK(read_file(folder / "kept.mp4") == "made");
  for (const auto& entry : std::filesystem::directory_iterator(folder.path()))
    CHECK_FALSE(contains(entry.path().filename().string(), ".part"));
#if defined(GSNAV_FFMPEG)
  CHECK_FALSE(run_command(GSNAV_REPLAY, options + "--video nowhere/walk.mp4", folder.path()).ok);
  REQUIRE(run_command(GSNAV_REPLAY, options + "--frames still", folder.path()).ok);
  const Outcome made = run_command(GSNAV_REPLAY, options + "--video walk.mp4", folder.path());
  CAPTURE(made.text);
  REQUIRE(made.ok);
  REQUIRE(run_command(GSNAV_FFMPEG, "-loglevel error -i walk.mp4 again%02d.png", folder.path()).ok);
  CHECK(std::filesystem::exists(folder / "again13.png"));  // the start and twelve actions
  CHECK_FALSE(std::filesystem::exists(folder / "again14.png"));
  const auto still = gsnav::io::load_png(folder / "still/00012.png").value(),
             frame = gsnav::io::load_png(folder / "again13.png").value();
  REQUIRE(frame.width == 64);
  REQUIRE(frame.height == 48);
  double sum = 0;
  for (std::size_t y = 0; y < 47; ++y) {
    for (std::size_t x = 0; x < 63 * 3; ++x) {
      sum +=
          std::abs(static_cast<double>(still.samples[y * 63 * 3 + x]) - frame.samples[y * 64 * 3 + x]);
    }
  }
  CHECK(sum / (47 * 63 * 3) < 8);  // of 255
#else
  MESSAGE("skipped: no ffmpeg here");
#endif
}

#if defined(GSNAV_NAV_LOOP)
TEST_CASE(
    "the demo draws any episode that it plays, and refuses to draw one beyond the last before it "
    "plays") {
  const TempFolder folder("nav_loop");
  const auto demo = [&](const std::string& more) {
    return run_command(
        GSNAV_NAV_LOOP,
        "--avatars 0 --episodes 2 --max-steps 3 --width 32 --height 24 --frames-every 0 --out out " +
            more,
        folder.path());
  };
  const Outcome beyond = demo("--show 2");
  CAPTURE(beyond.text);
  CHECK_FALSE(beyond.ok);
  CHECK(beyond.says("--show 2: of 2 episodes the last is 1"));
  CHECK_FALSE(std::filesystem::exists(folder / "out"));
  const Outcome last = demo("--show 1");
  CAPTURE(last.text);
  CHECK(last.ok);
  CHECK(std::filesystem::exists(folder / "out/map.png"));
}
#endif

#if defined(GSNAV_EVAL_MPI)
TEST_CASE(
    "any number of ranks gives the same numbers, also where one was killed and the job begins again") {
  const TempFolder folder("eval");
  const auto ranks = [&](int n, const std::string& out, const std::string& more = "") {
    const std::string arguments =
        "--oversubscribe --allow-run-as-root -n " + std::to_string(n) + " " + quoted(GSNAV_EVAL_MPI) +
        kSparse + "--avatars 1 --episodes 7 --max-steps 30 --policy random --out " + out + more;
    const Outcome run = run_command(GSNAV_MPIEXEC, arguments, folder.path());
    CAPTURE(run.text);
    REQUIRE(run.ok);
    REQUIRE(run.says("7 episodes ("));
    // What other ranks say on stderr may come after it.
    const std::size_t metrics = run.text.find("): SR");
    return run.text.substr(metrics, run.text.find('\n', metrics) - metrics);
  };
  const std::string one = ranks(1, "one");
  CHECK(ranks(4, "four") == one);
  CHECK(ranks(2, "drawn", " --draw --device cpu:1 --width 24 --height 16") == one);
  // As a rank that is killed leaves its journal: its last line cut, and all of it gone that was not yet
  // on disk.
  const std::string second = read_file(folder / "four/journal.2.jsonl"),
                    third = read_file(folder / "four/journal.3.jsonl");
  CHECK(lines(second) == 3);  // a header and episodes 2 and 6
  write_file(folder / "four/journal.2.jsonl", second.substr(0, second.size() - 10));
  write_file(folder / "four/journal.3.jsonl", third.substr(0, third.find('\n') + 1));
  CHECK(ranks(3, "four") == one);
  const std::string same =
      kSparse + "--avatars 1 --episodes 7 --max-steps 30 --policy random --pictures 0 --out four";
  const Outcome again = run_command(GSNAV_EVAL, same, folder.path());
  CHECK(again.says("7 episodes: SR"));
  CHECK_FALSE(again.says("episode 1/7"));  // none is missing
}

namespace {

/// The process of a rank of the job that runs in `folder`; 0 where there is none.
pid_t process_of_rank(int rank, const std::filesystem::path& folder) {
  for (const auto& entry : std::filesystem::directory_iterator("/proc")) {
    const std::string pid = entry.path().filename().string();
    if (pid.find_first_not_of("0123456789") != std::string::npos) continue;
    std::error_code gone;
    if (std::filesystem::read_symlink(entry.path() / "exe", gone) !=
        std::filesystem::path(GSNAV_EVAL_MPI))
      continue;
    if (std::filesystem::read_symlink(entry.path() / "cwd", gone) != std::filesystem::canonical(folder))
      continue;
    const std::string environment = '\0' + read_file(entry.path() / "environ");
    const std::string name =
        std::string(1, '\0') + "OMPI_COMM_WORLD_RANK=" + std::to_string(rank) + std::string(1, '\0');
    if (contains(environment, name)) return std::stoi(pid);
  }
  return 0;
}

}  // namespace

TEST_CASE(
    "a rank is killed while it plays; the job, begun again with fewer ranks, has the numbers of one "
    "that was never stopped") {
  const TempFolder folder("killed");
  const std::string options =
      kSparse + "--avatars 1 --episodes 60 --max-steps 200 --policy random --out ";
  const std::vector<std::string> words{GSNAV_MPIEXEC,
                                       "--oversubscribe",
                                       "--allow-run-as-root",
                                       "-n",
                                       "3",
                                       GSNAV_EVAL_MPI,
                                       "--density",
                                       "0.05",
                                       "--avatars",
                                       "1",
                                       "--episodes",
                                       "60",
                                       "--max-steps",
                                       "200",
                                       "--policy",
                                       "random",
                                       "--out",
                                       "out"};
  Process job(words, folder.path());
  pid_t victim = 0;
  while (job.runs() && lines(read_file(folder / "out/journal.1.jsonl")) < 4) usleep(1000);
  victim = process_of_rank(1, folder.path());
  if (victim == 0) {
    MESSAGE("skipped: this MPI's ranks are not found by OMPI_COMM_WORLD_RANK");
    return;
  }
  kill(victim, SIGKILL);
  CHECK(job.wait(60) != 0);
  std::size_t finished = 0;
  for (const char* name : {"out/journal.jsonl", "out/journal.1.jsonl", "out/journal.2.jsonl"}) {
    const std::size_t n = lines(read_file(folder / name));
    finished += n > 0 ? n - 1 : 0;
  }
  CHECK(finished >= 3);
  REQUIRE(finished < 60);
  const auto numbers = [&](int n, const std::string& out) {
    const Outcome run = run_command(GSNAV_MPIEXEC,
                                    "--oversubscribe --allow-run-as-root -n " + std::to_string(n) + " " +
                                        quoted(GSNAV_EVAL_MPI) + options + out,
                                    folder.path());
    CAPTURE(run.text);
    REQUIRE(run.ok);
    REQUIRE(run.says("60 episodes ("));
    if (out == "out") CHECK(run.says((std::to_string(60 - finished) + " played by 2 ranks").c_str()));
    return run.text.substr(run.text.find("): SR"), run.text.rfind('\n') - run.text.find("): SR"));
  };
  CHECK(numbers(2, "out") == numbers(1, "whole"));
}
#endif
