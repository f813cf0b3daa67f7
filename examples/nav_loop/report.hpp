// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "gsnav/sim.hpp"
#include "gsnav/sim/metrics.hpp"
#include "options.hpp"

namespace nav_loop {

/// Wall-clock time of the parts of a run, seconds.
struct Timings {
  double load = 0, navmesh = 0;                ///< once
  double physics = 0, render = 0, policy = 0;  ///< summed over steps
  std::size_t steps = 0, renders = 0;
};

/// Facts about the scene for the report.
struct SceneFacts {
  std::string name;
  std::string navmesh_source;
  std::size_t gaussians = 0, avatars = 0, avatar_gaussians = 0;
  std::size_t navmesh_polygons = 0, islands = 0;
  double area = 0, island_area = 0;  ///< walkable area: all islands, and the largest; square metres
};

struct EpisodeRecord {
  gsnav::PointNavEpisode episode;
  gsnav::EpisodeMetrics metrics;
  bool pushed = false;  ///< an avatar walked into the agent
};

/// Prints progress: one line that is rewritten on a terminal, else one line per episode.
class Progress {
 public:
  explicit Progress(int episodes);
  void step(int episode, std::size_t step, double distance);
  void episode(int episode, const EpisodeRecord& record);

 private:
  int episodes_;
  bool terminal_;
};

void print_table(const Options& options, const SceneFacts& facts,
                 const std::vector<EpisodeRecord>& records, const Timings& timings);

/// Writes metrics.json. Equal runs write equal bytes, on any number of threads. Errors: file_not_found,
/// with the path.
gsnav::Status write_json(const std::string& path, const Options& options, const SceneFacts& facts,
                         const std::vector<EpisodeRecord>& records);
/// Writes timings.json: the device, and the times of this run. Errors: as write_json.
gsnav::Status write_timings(const std::string& path, const gsnav::Device& device,
                            const Timings& timings);

}  // namespace nav_loop
