// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "gsnav/core/status.hpp"
#include "gsnav/image/camera.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"
#include "gsnav/scene/visible_sets.hpp"

namespace gsnav_report {

/// Pose of a camera; the report sets size and field of view.
struct ViewPoint {
  std::string name;
  gsnav::Affine3<double> viewmat{};  ///< world to camera, OpenCV axes
};

/// Names and files of a scene to be measured, before it is loaded.
struct SceneSpec {
  std::string name;
  std::string path;     ///< a scene's name for gsnav::open_scene
  std::string cameras;  ///< INRIA cameras.json; empty: use `views`, or make views from the cloud
  std::vector<ViewPoint> views{};
  std::string visible_sets{};  ///< a file of visible sets; empty: none
};

/// How scenes stand, and when.
struct SceneFrame {
  std::string up = "auto";  ///< axis of the file that points up, for views that are made; auto: guessed
  double time = 0;          ///< moment of a scene that moves, seconds
  double density = 1;       ///< of the Gaussians of the embedded flat, relative to the default
};

struct Scene {
  std::string name;
  gsnav::GaussianCloud cloud;
  std::string path;  ///< path of the Gaussians for io::load_scene; empty: made by code
  std::optional<gsnav::VisibleSets> visible;
  std::string hash;  ///< content_hash of the cloud
  std::vector<ViewPoint> views;
};

/// The scene of `[NAME=]SCENE[:CAMERAS.json]`; without a name it gets that of its file. Errors:
/// invalid_argument naming option and value; file_not_found naming the cameras.
gsnav::Result<SceneSpec> parse_scene(const std::string& text);

/// The embedded flat with its own viewpoints.
SceneSpec default_flat();

/// The benchmark flat of the file `ply`, with the cameras.json beside it. Errors: file_not_found.
gsnav::Result<SceneSpec> benchmark_flat(const std::string& ply);

/// Loads a scene and chooses at most `views` of its viewpoints, evenly spread.
/// @return the errors of gsnav::open_scene, and those of the files of cameras and visible sets. The
///   message names the scene.
gsnav::Result<Scene> load(const SceneSpec& spec, int views, const SceneFrame& frame = {});

/// A pinhole camera with square pixels at `view`. Gaussians nearer than `near` metres are not drawn.
gsnav::Camera camera_of(const ViewPoint& view, int width, int height, double hfov_degrees, double near);

}  // namespace gsnav_report
