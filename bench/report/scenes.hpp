// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "gsnav/core/status.hpp"
#include "gsnav/image/camera.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"
#include "gsnav/scene/visible_sets.hpp"

namespace gsnav_report {

/// Where a camera stands; size and field of view are the report's.
struct ViewPoint {
  std::string name;
  gsnav::Affine3<double> viewmat{};  ///< world to camera, OpenCV axes
};

/// A scene to be measured, not yet loaded.
struct SceneSpec {
  std::string name;
  std::string path;     ///< what gsnav::open_scene takes
  std::string cameras;  ///< INRIA cameras.json; empty: `views`, or views made from the cloud
  std::vector<ViewPoint> views{};
  std::string visible_sets{};  ///< a file of them; empty: none
};

/// How scenes stand, and when.
struct SceneFrame {
  std::string up = "auto";  ///< axis of the file that points up, for views that are made; auto: guessed
  double time = 0;          ///< moment of a scene that moves, seconds
};

struct Scene {
  std::string name;
  gsnav::GaussianCloud cloud;
  std::string path;  ///< of its Gaussians, as io::load_scene takes it; empty: made by code
  std::optional<gsnav::VisibleSets> visible;
  std::string hash;  ///< content_hash of the cloud
  std::vector<ViewPoint> views;
};

/// The scene of `[NAME=]SCENE[:CAMERAS.json]`; without a name it gets that of its file. Errors:
/// invalid_argument naming option and value; file_not_found naming the cameras.
gsnav::Result<SceneSpec> parse_scene(const std::string& text);

/// The embedded flat from its own viewpoints.
SceneSpec default_flat();

/// The benchmark flat in `ply`, with the cameras.json that lies beside it. Errors: file_not_found.
gsnav::Result<SceneSpec> benchmark_flat(const std::string& ply);

/// The real scans that are there below `folder` (GSNAV_DATA_DIR), with viewpoints that show something.
std::vector<SceneSpec> data_scenes(const std::filesystem::path& folder);

/// Loads a scene and chooses at most `views` viewpoints, spread evenly over those it has.
/// Errors: those of gsnav::open_scene, and of the files of cameras and visible sets, naming the scene.
gsnav::Result<Scene> load(const SceneSpec& spec, int views, const SceneFrame& frame = {});

/// `view` through a pinhole with square pixels; a Gaussian is drawn beyond `near` metres.
gsnav::Camera camera_of(const ViewPoint& view, int width, int height, double hfov_degrees, double near);

}  // namespace gsnav_report
