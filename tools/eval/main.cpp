// SPDX-License-Identifier: Apache-2.0
// gsnav-eval: plays episodes by a policy, journals each as it ends, and makes a page of them.
#include <cstdio>
#include <exception>
#include <fstream>

#include "gsnav/io/episode_file.hpp"
#include "page.hpp"
#include "pictures.hpp"

namespace gsnav_eval {
namespace {

using gsnav::Status;
namespace fs = std::filesystem;

Status write(const fs::path& path, const std::string& text) {
  std::ofstream out(path, std::ios::binary);
  out << text;
  if (!out.flush()) return {gsnav::Errc::file_not_found, path.string() + ": cannot be written"};
  return {};
}

Status run(const Options& o, int pictures) {
  const auto stage = prepare(o);
  if (!stage) return stage.status();
  auto journal = Journal::open(o.out, o);
  if (!journal) return journal.status();
  if (Status s = gsnav::io::save_episodes(fs::path(o.out) / "episodes.json.gz", stage->episodes); !s) return s;
  gsnav::OpenMPBackend backend(o.threads);
  auto sim = Simulator::create(backend, stage->scene, stage->config);
  if (!sim) return sim.status();

  gsnav::World world = sim->world();
  for (std::size_t i = 0; i < stage->episodes.size(); ++i) {
    if (journal->records().contains(i)) continue;
    auto record = play(world, o, stage->episodes[i], i);
    if (!record) return record.status();
    std::fprintf(stderr, "episode %zu/%zu: %s, SPL %.2f, %zu actions\n", i + 1, stage->episodes.size(),
                 record->metrics.success ? "reached" : "not reached", record->metrics.spl, record->metrics.steps);
    if (Status s = journal->add(std::move(*record)); !s) return s;
  }

  std::vector<gsnav::EpisodeMetrics> metrics;
  std::vector<Entry> entries;
  std::error_code error;
  fs::create_directories(fs::path(o.out) / "episodes", error);
  if (error) return {gsnav::Errc::file_not_found, "--out " + o.out + ": " + error.message()};
  for (const auto& [number, record] : journal->records()) {
    metrics.push_back(record.metrics);
    Entry e{&record, {}, {}};
    if (pictures < 0 || static_cast<std::size_t>(pictures) > number) {
      const fs::path base = fs::path(o.out) / "episodes" / std::to_string(number);
      const fs::path strip = base.string() + "_strip.png", map = base.string() + "_map.png";
      if (!fs::exists(strip) || !fs::exists(map)) {
        if (Status s = draw(*sim, *stage, record, strip, map); !s) return s;
      }
      for (const auto& [file, picture] : {std::pair{strip, &e.strip}, {map, &e.map}}) {
        auto read = page_picture(file.string());
        if (!read) return read.status();
        *picture = std::move(*read);
      }
    }
    entries.push_back(std::move(e));
  }
  const gsnav::MetricsSummary s = gsnav::summarize(metrics);
  std::printf("%zu episodes: SR %.3f  SPL %.3f  SoftSPL %.3f  STL %.3f  DTG %.2f m  CR %.4f  PSI %.4f\n", s.episodes,
              s.success_rate, s.spl, s.soft_spl, s.stl, s.distance_to_goal, s.collision_rate, s.psi);
  return write(fs::path(o.out) / "index.html", page(o, s, entries));
}

}  // namespace
}  // namespace gsnav_eval

int main(int argc, char** argv) try {
  gsnav_eval::Options o;
  int pictures = -1;
  CLI::App app{
      "Evaluates a policy: episodes.json.gz, journal.jsonl (a line for each episode as it ends, its actions with it) and\n"
      "index.html, one page with metrics, pictures and maps. Started again it plays what is missing."};
  gsnav_eval::add_world_options(app, o);
  app.add_option("--pictures", pictures, "so many episodes have pictures on the page; -1: all")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  const gsnav::Status s = gsnav_eval::run(o, pictures);
  if (!s) std::fprintf(stderr, "gsnav-eval: %s\n", s.message().c_str());
  return s ? 0 : 1;
} catch (const std::exception& e) {
  std::fprintf(stderr, "gsnav-eval: %s\n", e.what());
  return 1;
}
