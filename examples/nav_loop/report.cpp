// SPDX-License-Identifier: Apache-2.0
#include "report.hpp"

#include <unistd.h>

#include <cstdio>
#include <nlohmann/json.hpp>

#include "gsnav/core/replace_file.hpp"
#include "gsnav/version.hpp"

namespace nav_loop {
namespace {

double per(double sum, std::size_t n) { return n == 0 ? 0.0 : sum / static_cast<double>(n); }

std::vector<gsnav::EpisodeMetrics> metrics_of(const std::vector<EpisodeRecord>& records) {
  std::vector<gsnav::EpisodeMetrics> m;
  for (const EpisodeRecord& r : records) m.push_back(r.metrics);
  return m;
}

nlohmann::json point(const gsnav::Vec3d& p) { return {p.x, p.y, p.z}; }

}  // namespace

Progress::Progress(int episodes) : episodes_(episodes), terminal_(isatty(fileno(stderr)) != 0) {}

void Progress::step(int episode, std::size_t step, double distance) {
  if (!terminal_ || step % 4 != 0) return;
  std::fprintf(stderr, "\r\x1b[Kepisode %d/%d  step %zu  %.2f m to go", episode + 1, episodes_, step,
               distance);
  std::fflush(stderr);
}

void Progress::episode(int episode, const EpisodeRecord& r) {
  const gsnav::EpisodeMetrics& m = r.metrics;
  std::fprintf(stderr,
               "%sepisode %3d/%d  %-7s  %3zu steps  l %5.2f m  p %5.2f m  SPL %.2f  DTG %5.2f m  "
               "contact steps %zu\n",
               terminal_ ? "\r\x1b[K" : "", episode + 1, episodes_,
               m.success ? "reached" : (m.stop_called ? "missed" : "timeout"), m.steps, m.start_distance,
               m.path_length, m.spl, m.distance_to_goal, m.collision_steps);
}

void print_table(const Options& options, const SceneFacts& facts,
                 const std::vector<EpisodeRecord>& records, const Timings& t) {
  const auto metrics = metrics_of(records);
  const gsnav::MetricsSummary s = gsnav::summarize(metrics);
  std::size_t pushed = 0;
  for (const EpisodeRecord& r : records) pushed += r.pushed ? 1 : 0;
  std::printf("\n%s: %zu Gaussians, %zu avatars (%zu Gaussians each), NavMesh %.1f m2 (%s), on %s\n\n",
              facts.name.c_str(), facts.gaussians, facts.avatars, facts.avatar_gaussians, facts.area,
              facts.navmesh_source.c_str(), options.device.name().c_str());
  std::printf("  %-34s %10zu\n", "episodes", s.episodes);
  const auto row = [](const char* name, double v, const char* format = "%10.3f") {
    std::printf("  %-34s ", name);
    std::printf(format, v);
    std::printf("\n");
  };
  row("SR", s.success_rate);
  row("SPL", s.spl);
  row("SoftSPL", s.soft_spl);
  row("DTG (geodesic, m)", s.distance_to_goal);
  row("CR (steps with avatar contact)", s.collision_rate);
  row("PSI", s.psi);
  row("PSC", s.psc);
  row("H-Coll (episodes with a touch)", s.human_collision_episode_rate);
  row("episodes with avatar contact", s.disturbed_episode_rate);
  row("wall collisions per episode", s.collisions, "%10.1f");
  row("least clearance to an avatar (m)", s.min_clearance);
  row("episodes with a push by an avatar", static_cast<double>(pushed), "%10.0f");
  row("steps/s (physics + RGB-D)",
      t.physics + t.render > 0 ? static_cast<double>(t.steps) / (t.physics + t.render) : 0.0, "%10.1f");
  row("render (ms, RGB-D in one pass)", 1e3 * per(t.render, t.renders), "%10.2f");
  row("physics (ms per step)", 1e3 * per(t.physics, t.steps), "%10.3f");
  row("policy (ms per step)", 1e3 * per(t.policy, t.steps), "%10.2f");
  std::printf("\n");
}

gsnav::Status write_json(const std::string& path, const Options& o, const SceneFacts& f,
                         const std::vector<EpisodeRecord>& records) {
  const auto metrics = metrics_of(records);
  const gsnav::MetricsSummary s = gsnav::summarize(metrics);
  nlohmann::ordered_json j;
  j["gsnav"] = std::to_string(GSNAV_VERSION_MAJOR) + "." + std::to_string(GSNAV_VERSION_MINOR) + "." +
               std::to_string(GSNAV_VERSION_PATCH);
  j["config"] = {{"scene", f.name},
                 {"up", o.up},
                 {"avatars", o.avatars},
                 {"episodes", o.episodes},
                 {"seed", o.seed},
                 {"width", o.width},
                 {"height", o.height},
                 {"hfov", o.hfov},
                 {"eye_height", o.eye_height},
                 {"profile", o.profile},
                 {"max_steps", o.max_steps}};
  j["scene"] = {{"gaussians", f.gaussians},
                {"avatar_gaussians", f.avatar_gaussians},
                {"navmesh", f.navmesh_source},
                {"navmesh_polygons", f.navmesh_polygons},
                {"navmesh_islands", f.islands},
                {"navmesh_area", f.area},
                {"largest_island_area", f.island_area}};
  for_each_metric(s, [&](const char* name, const auto& value) { j["means"][name] = value; });
  nlohmann::ordered_json episodes = nlohmann::ordered_json::array();
  for (const EpisodeRecord& r : records) {
    const gsnav::EpisodeMetrics& m = r.metrics;
    episodes.push_back({{"id", r.episode.id},
                        {"start", point(r.episode.start_position)},
                        {"goal", point(r.episode.goal_position)},
                        {"start_time", r.episode.start_time}});
    for_each_metric(m, [&](const char* name, const auto& value) { episodes.back()[name] = value; });
    episodes.back()["pushed_into"] = r.pushed;
  }
  j["episodes"] = std::move(episodes);
  return gsnav::replace_file(path, j.dump(2) + "\n");
}

gsnav::Status write_timings(const std::string& path, const gsnav::Device& device, const Timings& t) {
  const nlohmann::ordered_json j{{"device", device.description()},
                                 {"load_s", t.load},
                                 {"navmesh_s", t.navmesh},
                                 {"physics_ms_per_step", 1e3 * per(t.physics, t.steps)},
                                 {"render_ms", 1e3 * per(t.render, t.renders)},
                                 {"policy_ms_per_step", 1e3 * per(t.policy, t.steps)},
                                 {"steps", t.steps}};
  return gsnav::replace_file(path, j.dump(2) + "\n");
}

}  // namespace nav_loop
