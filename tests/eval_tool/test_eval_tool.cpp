// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "support/files.hpp"
#include "gsnav/io/episode_file.hpp"
#include "gsnav/io/image_file.hpp"
#include "gsnav/io/npz_file.hpp"
#include "support/command.hpp"
#include "support/process.hpp"

using namespace gsnav_test;

namespace {

// Programs make the flat anew each time: as few Gaussians as it may have.
const std::string kSparse = " --density 0.05 ";
const std::string kOptions = kSparse + "--avatars 2 --episodes 3 --max-steps 25 --width 32 --height 24 --out out ";

std::size_t lines(const std::string& text) { return static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n')); }

}  // namespace

TEST_CASE("an evaluation that was broken off goes on, to the same journal and page") {
  const TempFolder folder("eval");
  const auto eval = [&](const std::string& more) { return run_command(GSNAV_EVAL, kOptions + more, folder.path()); };
  const Outcome whole = eval("--pictures 1");
  CAPTURE(whole.text);
  REQUIRE(whole.ok);
  CHECK(whole.says("3 episodes: SR"));
  const std::string journal = read_file(folder / "out/journal.jsonl"), page = read_file(folder / "out/index.html");
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

  const Outcome other = eval("--seed 5");
  CHECK_FALSE(other.ok);
  CHECK(other.says("other options"));

  // What was recorded is played again: the agent's own camera, then one that stands.
  const auto replay = [&](const std::string& more) { return run_command(GSNAV_REPLAY, kOptions + more, folder.path()); };
  const Outcome own = replay("--episode 0 --frames own --every 5");
  CAPTURE(own.text);
  REQUIRE(own.ok);
  const auto track = gsnav::io::NpzFile::open(folder / "own/track.npz").value();
  const auto positions = track.read("positions").value();
  const auto episode = gsnav::io::load_episodes(folder / "out/episodes.json.gz")->episodes[0];
  CHECK(positions.values[0] == doctest::Approx(episode.start_position.x).epsilon(1e-6));
  CHECK(positions.values[2] == doctest::Approx(episode.start_position.z).epsilon(1e-6));
  // The first frame of the strip is what the agent saw at the start.
  const auto frame = gsnav::io::load_png(folder / "own/00000.png").value();
  const auto strip = gsnav::io::load_png(folder / "out/episodes/0_strip.png").value();
  bool same = true;
  for (std::size_t y = 0; y < 24; ++y) {
    for (std::size_t x = 0; x < 96; ++x) {
      same = same && frame.samples[y * 96 + x] == strip.samples[(y + 4) * 3 * static_cast<std::size_t>(strip.width) + 12 + x];
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
    const Outcome out = run_command(GSNAV_EVAL,
                                    kSparse + "--avatars 0 --max-steps 60 --pictures 0 --episode-file val.json.gz --out " +
                                        policy + " --policy " + policy,
                                    folder.path());
    CAPTURE(out.text);
    CHECK(out.ok);
    CHECK(out.says(policy == "greedy" ? "SR 1.000" : "1 episodes"));
  }
  CHECK(run_command(GSNAV_EVAL, "--episode-file none.json --out x", folder.path()).says("none.json"));
}

TEST_CASE("a replay becomes a video of any size, and says what is missing where there is no ffmpeg") {
  const TempFolder folder("video");
  const std::string options = kSparse + "--avatars 1 --episodes 1 --max-steps 12 --width 63 --height 47 --out out ";
  REQUIRE(run_command(GSNAV_EVAL, options + "--pictures 0", folder.path()).ok);
  const Outcome none = run_command("env", "PATH=/nowhere " + quoted(GSNAV_REPLAY) + " " + options + "--video none.mp4", folder.path());
  CHECK_FALSE(none.ok);
  CHECK(none.says("is it installed?"));
#if defined(GSNAV_FFMPEG)
  REQUIRE(run_command(GSNAV_REPLAY, options + "--frames still", folder.path()).ok);
  const Outcome made = run_command(GSNAV_REPLAY, options + "--video walk.mp4", folder.path());
  CAPTURE(made.text);
  REQUIRE(made.ok);
  REQUIRE(run_command(GSNAV_FFMPEG, "-loglevel error -i walk.mp4 again%02d.png", folder.path()).ok);
  CHECK(std::filesystem::exists(folder / "again13.png"));  // the start and twelve actions
  CHECK_FALSE(std::filesystem::exists(folder / "again14.png"));
  const auto still = gsnav::io::load_png(folder / "still/00012.png").value(), frame = gsnav::io::load_png(folder / "again13.png").value();
  REQUIRE(frame.width == 64);
  REQUIRE(frame.height == 48);
  double sum = 0;
  for (std::size_t y = 0; y < 47; ++y) {
    for (std::size_t x = 0; x < 63 * 3; ++x) {
      sum += std::abs(static_cast<double>(still.samples[y * 63 * 3 + x]) - frame.samples[y * 64 * 3 + x]);
    }
  }
  CHECK(sum / (47 * 63 * 3) < 8);  // of 255
#else
  MESSAGE("skipped: no ffmpeg here");
#endif
}

#if defined(GSNAV_NAV_LOOP)
TEST_CASE("the demo draws any episode that it plays, and refuses to draw one beyond the last before it plays") {
  const TempFolder folder("nav_loop");
  const auto demo = [&](const std::string& more) {
    return run_command(GSNAV_NAV_LOOP, "--avatars 0 --episodes 2 --max-steps 3 --width 32 --height 24 --frames-every 0 --out out " + more,
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
TEST_CASE("any number of ranks gives the same numbers, also where one was killed and the job begins again") {
  const TempFolder folder("eval");
  const auto ranks = [&](int n, const std::string& out, const std::string& more = "") {
    const std::string arguments = "--oversubscribe --allow-run-as-root -n " + std::to_string(n) + " " + quoted(GSNAV_EVAL_MPI) +
                                  kSparse + "--avatars 1 --episodes 7 --max-steps 30 --policy random --out " + out + more;
    const Outcome run = run_command(GSNAV_MPIEXEC, arguments, folder.path());
    CAPTURE(run.text);
    REQUIRE(run.ok);
    REQUIRE(run.says("7 episodes ("));
    return run.text.substr(run.text.find("): SR"), run.text.rfind('\n') - run.text.find("): SR"));
  };
  const std::string one = ranks(1, "one");
  CHECK(ranks(4, "four") == one);
  CHECK(ranks(2, "drawn", " --draw openmp --threads 1 --width 24 --height 16") == one);
  // As a rank that is killed leaves its journal: its last line cut, and all of it gone that was not yet on disk.
  const std::string second = read_file(folder / "four/journal.2.jsonl"), third = read_file(folder / "four/journal.3.jsonl");
  CHECK(lines(second) == 3);  // a header and episodes 2 and 6
  write_file(folder / "four/journal.2.jsonl", second.substr(0, second.size() - 10));
  write_file(folder / "four/journal.3.jsonl", third.substr(0, third.find('\n') + 1));
  CHECK(ranks(3, "four") == one);
  const std::string same = kSparse + "--avatars 1 --episodes 7 --max-steps 30 --policy random --pictures 0 --out four";
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
    if (std::filesystem::read_symlink(entry.path() / "exe", gone) != std::filesystem::path(GSNAV_EVAL_MPI)) continue;
    if (std::filesystem::read_symlink(entry.path() / "cwd", gone) != std::filesystem::canonical(folder)) continue;
    const std::string environment = '\0' + read_file(entry.path() / "environ");
    const std::string name = std::string(1, '\0') + "OMPI_COMM_WORLD_RANK=" + std::to_string(rank) + std::string(1, '\0');
    if (contains(environment, name)) return std::stoi(pid);
  }
  return 0;
}

}  // namespace

TEST_CASE("a rank is killed while it plays; the job, begun again with fewer ranks, has the numbers of one that was never stopped") {
  const TempFolder folder("killed");
  const std::string options = kSparse + "--avatars 1 --episodes 60 --max-steps 200 --policy random --out ";
  const std::vector<std::string> words{GSNAV_MPIEXEC, "--oversubscribe", "--allow-run-as-root", "-n", "3", GSNAV_EVAL_MPI,
                                       "--density", "0.05", "--avatars", "1", "--episodes", "60", "--max-steps", "200",
                                       "--policy", "random", "--out", "out"};
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
    const Outcome run = run_command(GSNAV_MPIEXEC, "--oversubscribe --allow-run-as-root -n " + std::to_string(n) + " " +
                                                       quoted(GSNAV_EVAL_MPI) + options + out, folder.path());
    CAPTURE(run.text);
    REQUIRE(run.ok);
    REQUIRE(run.says("60 episodes ("));
    if (out == "out") CHECK(run.says((std::to_string(60 - finished) + " played by 2 ranks").c_str()));
    return run.text.substr(run.text.find("): SR"), run.text.rfind('\n') - run.text.find("): SR"));
  };
  CHECK(numbers(2, "out") == numbers(1, "whole"));
}
#endif
