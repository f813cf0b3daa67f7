// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "jobs.hpp"
#include "scenes.hpp"

namespace gsnav_report {

/// The checked command line of gsnav-report.
struct Options {
  std::vector<std::string> scenes, flats;
  std::vector<std::string> visible_sets;  ///< SCENE=FILE
  bool default_scene = false;
  SceneFrame frame;
  int views = 4;
  std::vector<ImageSize> sizes{{256, 256}, {640, 480}};
  ImageSize knob_size{256, 256};
  double hfov = 90, near_plane = 0.2;
  std::vector<std::string> kinds{"render", "ledger", "skinning", "sweep", "kernel"};
  std::vector<std::string> sensors{"rgbd", "rgb", "depth"}, profiles{"exact", "fast", "lod"},
      backends{"openmp", "serial"}, knobs = knob_names(), knob_values;
  std::vector<Oracle> oracles{Oracle::contract, Oracle::contract_f64, Oracle::photo4,
                              Oracle::ray,      Oracle::ray_key,      Oracle::untruncated};
  int threads = 0, runs = 15;
  double max_seconds = 3;  ///< limit for timing one setting
  std::string out = "report", cache, docs, benchmarks, commit, machine;
  bool resume = false, no_html = false;
  bool acceptance = false;  ///< judge by the project's own budgets and targets

  bool wants(const std::string& kind) const;
};

/// Parses the command line. @return Nothing if the program has to end with `exit_code`, because help was
/// asked for or an error was printed.
std::optional<Options> parse_options(int argc, char** argv, int& exit_code);

}  // namespace gsnav_report
