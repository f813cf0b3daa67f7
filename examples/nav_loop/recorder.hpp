// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "../../tools/common/map.hpp"
#include "../../tools/common/strip.hpp"
#include "gsnav/sim.hpp"
#include "options.hpp"

namespace nav_loop {

/// Writes images of a run: sampled frames, and a strip and a map of one episode.
class Recorder {
 public:
  explicit Recorder(const Options& options) : options_(options) {}

  /// Makes the folders. Errors: file_not_found, with the folder.
  gsnav::Status open();
  void begin(const gsnav::World& world, int episode);
  gsnav::Status add(const gsnav::World& world, const gsnav::Observations& obs);
  /// Ends an episode, and keeps it if it is the best candidate for strip and map so far.
  void end(const gsnav::World& world, const std::vector<gsnav::AvatarActor>& avatars);
  /// Writes strip.png and map.png.
  gsnav::Status finish(const gsnav::SimulatorScene& scene);

 private:
  struct Take {  // one episode
    std::vector<gsnav_tools::Shot> shots;
    gsnav_tools::MapContent map;
    double interest = -1.0;
  };
  gsnav::Status write_strip() const;
  bool wanted() const { return options_.shown_episode < 0 || options_.shown_episode == episode_; }

  const Options& options_;
  int episode_ = -1;
  std::size_t step_ = 0, stride_ = 1;
  Take current_, best_;
};

}  // namespace nav_loop
