// SPDX-License-Identifier: Apache-2.0
// gsnav-eval: plays episodes with a policy, records each in a journal, and makes a page of the results.
#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <exception>
#include <nlohmann/json.hpp>

#include "../common/check_values.hpp"
#include "../common/parse_options.hpp"
#include "gsnav/core/replace_file.hpp"
#include "gsnav/core/text.hpp"
#include "gsnav/io.hpp"
#include "page.hpp"
#include "pictures.hpp"

namespace gsnav_eval {
namespace {

using gsnav::Status;
namespace fs = std::filesystem;

using Clock = std::chrono::steady_clock;
using Json = nlohmann::ordered_json;

double seconds_since(Clock::time_point t) {
  return std::chrono::duration<double>(Clock::now() - t).count();
}

constexpr const char *kStripEnding = "_strip.png", *kMapEnding = "_map.png";

/// Seconds of this run.
struct Timings {
  double load = 0, play = 0, pictures = 0;
  std::size_t played = 0;
};

/// Results. Equal runs give equal bytes, on any number of threads and after interruptions.
std::string metrics_json(const Options& o, const gsnav::MetricsSummary& means, const Journal& journal,
                         const Stage& stage) {
  Json j;
  for (const OptionValue& v : option_values(o)) {
    if (v.role != OptionRole::view) j["options"][v.flag.substr(2)] = v.value;
  }
  for (const auto& [name, hash] : contents_of(stage)) j["contents"][name] = hash;
  j["means"]["episodes"] = means.episodes;
  for_each_metric(means, [&](const char* name, const auto& value) { j["means"][name] = value; });
  j["episodes"] = Json::array();
  for (const auto& [number, record] : journal.records()) {
    Json e{{"episode", number}, {"id", record.id}, {"reward", record.reward}};
    for_each_metric(record.metrics, [&](const char* name, const auto& value) { e[name] = value; });
    j["episodes"].push_back(std::move(e));
  }
  return j.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string timings_json(const Options& o, const Timings& t) {
  return Json{{"load_s", t.load},
              {"play_s", t.play},
              {"pictures_s", t.pictures},
              {"episodes_played", t.played},
              {"device", o.device.description()}}
             .dump(2) +
         "\n";
}

Status run(const Options& o, int pictures, bool restart) {
  const fs::path out(o.out), episode_folder = out / "episodes";
  for (const fs::path& folder : {out, episode_folder}) {
    if (Status s = gsnav::make_output_folder(folder); !s) return s;
  }
  for (const char* name :
       {"journal.jsonl", "episodes.json.gz", "index.html", "metrics.json", "timings.json"}) {
    if (Status s = gsnav::check_output_path(out / name); !s) return s;
  }
  if (Status s = gsnav_tools::check_files_in(episode_folder, {kStripEnding, kMapEnding}); !s) return s;
  if (Status s = restart ? Status() : Journal::check_options(out, o); !s) return s;
  Timings timings;
  Clock::time_point from = Clock::now();
  const auto stage = prepare(o);
  if (!stage) return stage.status();
  if (Status s = restart ? Journal::restart(out) : Status(); !s) return s;
  auto journal = Journal::open(out, o, *stage);
  if (!journal) return journal.status();
  for (const std::string& note : journal->notes())
    std::fprintf(stderr, "%s\n", gsnav::printable(note).c_str());
  if (Status s = gsnav::io::save_episodes(out / "episodes.json.gz", stage->episodes); !s) return s;
  auto sim = make_simulator(o, *stage);
  if (!sim) return sim.status();
  timings.load = seconds_since(from);

  from = Clock::now();
  gsnav::World world = sim->world();
  for (std::size_t i = 0; i < stage->episodes.size(); ++i) {
    if (journal->records().contains(i)) continue;
    auto record = play(world, o, stage->episodes[i], i);
    if (!record) return record.status();
    std::fprintf(stderr, "episode %zu/%zu: %s, SPL %.2f, %zu actions\n", i + 1, stage->episodes.size(),
                 record->metrics.success ? "reached" : "not reached", record->metrics.spl,
                 record->metrics.steps);
    if (Status s = journal->add(std::move(*record)); !s) return s;
    ++timings.played;
  }
  timings.play = seconds_since(from);

  from = Clock::now();
  std::vector<gsnav::EpisodeMetrics> metrics;
  for (const auto& [number, record] : journal->records()) metrics.push_back(record.metrics);
  const gsnav::MetricsSummary s = gsnav::summarize(metrics);
  if (Status w = gsnav::replace_file(out / "metrics.json", metrics_json(o, s, *journal, *stage)); !w)
    return w;
  std::vector<Entry> entries;
  for (const auto& [number, record] : journal->records()) {
    Entry e{&record, {}, {}};
    if (pictures < 0 || static_cast<std::size_t>(pictures) > number) {
      const fs::path base = episode_folder / std::to_string(number);
      const fs::path strip = base.string() + kStripEnding, map = base.string() + kMapEnding;
      if (!fs::exists(strip) || !fs::exists(map)) {
        if (Status w = draw(*sim, *stage, record, strip, map); !w) return w;
      }
      for (const auto& [file, picture] : {std::pair{strip, &e.strip}, {map, &e.map}}) {
        auto read = page_picture(file.string());
        if (!read) return read.status();
        *picture = std::move(*read);
      }
    }
    entries.push_back(std::move(e));
  }
  timings.pictures = seconds_since(from);
  std::printf(
      "%zu episodes: SR %.3f  SPL %.3f  SoftSPL %.3f  STL %.3f  DTG %.2f m  CR %.4f  H-Coll %.4f  PSI "
      "%.4f  PSC %.4f\n",
      s.episodes, s.success_rate, s.spl, s.soft_spl, s.stl, s.distance_to_goal, s.collision_rate,
      s.human_collision_episode_rate, s.psi, s.psc);
  if (Status w = gsnav::replace_file(out / "timings.json", timings_json(o, timings)); !w) return w;
  return gsnav::replace_file(out / "index.html", page(o, s, entries));
}

}  // namespace
}  // namespace gsnav_eval

int main(int argc, char** argv) try {
  gsnav_eval::Options o;
  int pictures = -1;
  CLI::App app{
      "Plays PointNav episodes with a policy and measures it.\nWrites episodes.json.gz, journal.jsonl "
      "(one line per episode), metrics.json, timings.json and index.html (metrics, images and "
      "maps).\nRun again, it plays the episodes that are missing. It refuses to do so if an option has "
      "changed, or the content of the scene, the NavMesh, the people or the episodes.\nExample: "
      "gsnav-eval --scene apartment.ply --avatars 5 --episodes 100 --out eval"};
  gsnav_eval::add_world_options(app, o);
  app.add_option("--pictures", pictures, "number of episodes with images on the page; -1 shows all")
      ->capture_default_str()
      ->check(CLI::Range(-1, 1000000));
  bool restart = false;
  app.add_flag("--restart", restart, "remove the evaluation in --out and begin again");
  if (const auto status = gsnav_tools::parse_options(app, argc, argv)) return *status;
  const gsnav::Status s = gsnav_eval::run(o, pictures, restart);
  if (!s) std::fprintf(stderr, "gsnav-eval: %s\n", s.message().c_str());
  return s ? 0 : 1;
} catch (const std::exception& e) {
  std::fprintf(stderr, "gsnav-eval: %s\n", e.what());
  return 1;
}
