// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "gsnav/core/lower_case.hpp"
#include "gsnav/nav.hpp"

// Where a program's NavMesh comes from: the same options in all of them.

namespace nav_loop {

struct NavMeshOptions {
  std::string navmesh = "auto";  ///< auto, mesh, gaussians, or a file (.navmesh, .bin)
  double cell_size = 0.05;       ///< voxel edge, metres
  std::vector<double> crop;      ///< x0 y0 z0 x1 y1 z1 in the world; empty: all of the scene

  /// Whether `navmesh` names a file.
  bool ready_made() const {
    const auto ends = [name = gsnav::lower_case(navmesh)](std::string_view end) {
      return name.ends_with(end);
    };
    return ends(".navmesh") || ends(".bin");
  }
};

/// Adds --cell-size and --crop.
inline void add_voxel_options(CLI::App& app, double& cell_size, std::vector<double>& crop) {
  app.add_option("--cell-size", cell_size,
                 "Voxel edge of the NavMesh, metres; from Gaussians its height too, if 0.05 or more")
      ->capture_default_str();
  app.add_option("--crop", crop,
                 "Build the NavMesh in this box only: X0 Y0 Z0 X1 Y1 Z1, metres in the world (Y up)")
      ->expected(6);
}

/// Adds --navmesh, --cell-size and --crop.
inline void add_navmesh_options(CLI::App& app, NavMeshOptions& o) {
  app.add_option("--navmesh", o.navmesh,
                 "Built from: gaussians, mesh (the flat only), auto (the mesh where there is one); or a "
                 "NavMesh's file "
                 "(.navmesh, .bin)")
      ->capture_default_str()
      ->check([](const std::string& v) {
        NavMeshOptions named;
        named.navmesh = v;
        if (named.ready_made() || v == "auto" || v == "mesh" || v == "gaussians") return std::string();
        return "--navmesh " + v + ": use auto, mesh, gaussians, or a file that ends in .navmesh or .bin";
      });
  add_voxel_options(app, o.cell_size, o.crop);
}

/// Prints on stderr what a build is at, from its third second on: a line that is written over on a
/// terminal, a line every ten seconds elsewhere. `name` says which NavMesh it is: a program may build
/// several.
inline std::function<void(const char*, double)> navmesh_progress(const std::string& name = "NavMesh") {
  using Clock = std::chrono::steady_clock;
  return [name, begin = Clock::now(), shown = Clock::time_point{}, any = false](const char* stage,
                                                                                double share) mutable {
    const auto now = Clock::now();
    const bool terminal = isatty(fileno(stderr)) != 0;
    const auto since = [&](Clock::time_point t) {
      return std::chrono::duration<double>(now - t).count();
    };
    const bool last = share >= 1 && std::string_view(stage) == "polygons";
    if (since(begin) < 2 || (since(shown) < (terminal ? 0.2 : 10.0) && !(last && any && terminal)))
      return;
    shown = now;
    any = true;
    std::fprintf(stderr, "%s%s: %s %3.0f %%%s", terminal ? "\r\x1b[K" : "", name.c_str(), stage,
                 100 * share, terminal && !last ? "" : "\n");
    std::fflush(stderr);
  };
}

/// Prints on stderr how far visible sets are and how long the rest will take, from the third second on:
/// as navmesh_progress does.
inline std::function<void(double)> visible_progress() {
  using Clock = std::chrono::steady_clock;
  return [begin = Clock::now(), shown = Clock::time_point{}](double share) mutable {
    const auto now = Clock::now();
    const bool terminal = isatty(fileno(stderr)) != 0, last = share >= 1;
    const double spent = std::chrono::duration<double>(now - begin).count();
    const double since = std::chrono::duration<double>(now - shown).count();
    if (spent < 2 || share <= 0 || (since < (terminal ? 0.2 : 10.0) && !(last && terminal))) return;
    shown = now;
    std::fprintf(stderr,
                 terminal ? "\rvisible sets: %3.0f %%, about %.0f s left %s"
                          : "visible sets: %3.0f %%, about %.0f s left%s",
                 100 * share, spent * (1 - share) / share, terminal && !last ? "" : "\n");
    std::fflush(stderr);
  };
}

/// Puts cell size, crop and progress, under `name`, into what a NavMesh is built with.
inline void apply(double cell_size, const std::vector<double>& crop, gsnav::NavMeshSettings& settings,
                  gsnav::GaussianNavOptions& how, const std::string& name = "NavMesh") {
  settings.cell_size = cell_size;
  settings.cell_height = std::max(gsnav::gaussian_navmesh_settings().cell_height, cell_size);
  if (crop.size() == 6) {
    how.crop = gsnav::Aabb<double>{
        {std::min(crop[0], crop[3]), std::min(crop[1], crop[4]), std::min(crop[2], crop[5])},
        {std::max(crop[0], crop[3]), std::max(crop[1], crop[4]), std::max(crop[2], crop[5])}};
  }
  how.progress = navmesh_progress(name);
}

}  // namespace nav_loop
