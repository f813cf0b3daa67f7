// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "gsnav/detail/open/open_scene.hpp"
#include "gsnav/nav/navmesh.hpp"
#include "scene_source.hpp"

// The steps of open_scene. Each adds its part to `scene` and `out`.

namespace gsnav::detail {

/// A scene that is being opened.
struct OpeningScene {
  const OpenOptions& options;
  SceneSource source;
  OpenedScene out;
  SimulatorScene scene;
  Similarity world_from_file{};  ///< Turns the file's up axis to +y.
  NavMeshTriangles triangles;    ///< World frame. A NavMesh may be built from them.

  void note(std::string text) { out.notes.push_back(std::move(text)); }
  void warn(std::string text) { out.warnings.push_back(std::move(text)); }
  /// Reports the start of a task, or a share of it.
  void tell(const std::string& task, double share = 0) const {
    if (options.progress) options.progress(task, share);
  }
  /// Whether the triangles that a NavMesh may be built of are needed.
  bool wants_obstacles() const {
    return options.keep_triangles || (!options.navmesh.empty() && options.navmesh != "none");
  }
};

/// Reads or makes the Gaussians, decides which axis is up, reads or builds levels of detail.
Status open_gaussians(OpeningScene& s);
/// Reads the triangles that are drawn, and those from which a NavMesh may be built.
Status open_triangles(OpeningScene& s);
/// Reads or builds the NavMesh, and adds the people who walk on it.
Status open_navmesh(OpeningScene& s);
/// Reads or computes the visible sets.
Status open_visible_sets(OpeningScene& s);

}  // namespace gsnav::detail
