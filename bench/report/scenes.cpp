// SPDX-License-Identifier: Apache-2.0
#include "scenes.hpp"

#include <algorithm>
#include <filesystem>
#include <system_error>
#include <utility>

#include "cache.hpp"
#include "gsnav/demo.hpp"
#include "gsnav/io.hpp"
#include "gsnav/open.hpp"
#include "gsnav/scene/prepare.hpp"

namespace gsnav_report {

using namespace gsnav;

namespace {

ViewPoint look(std::string name, const Vec3d& eye, const Vec3d& target, const Vec3d& up) {
  return {std::move(name), Camera::look_at(eye, target, up, 1, 1, 90).viewmat};
}

bool is_there(const std::filesystem::path& p) {
  std::error_code error;
  return std::filesystem::exists(p, error);
}

/// Four upright views from outside, a quarter turn apart, for scenes without cameras. `up`: the option
/// --up.
Result<std::vector<ViewPoint>> orbit(const OpenedScene& scene, const GaussianCloud& cloud,
                                     const std::string& up) {
  Vec3d axis = scene.report.up;
  if (up != "auto" && up != "keep") {
    const auto turned = upright(up);
    if (!turned) return Status(turned.code(), "--up: " + turned.message());
    axis = inverse(*turned) * Vec3d{0, 1, 0};
  }
  std::vector<ViewPoint> out;
  for (const Camera& c : views_around(cloud, axis, 4, 640, 480))
    out.push_back({std::string("orbit") + std::to_string(out.size()), c.viewmat});
  return out;
}

/// A name for a scene: the name of its file, without extension, or of the Habitat scene.
std::string name_of(const std::string& scene) {
  const std::size_t hash = scene.rfind('#');
  if (hash != scene.npos && hash + 1 < scene.size()) return scene.substr(hash + 1);
  std::filesystem::path path(scene);
  if (!path.has_filename()) path = path.parent_path();
  const std::string name = path.filename().string();
  return name.substr(0, name.find('.', 1));
}

}  // namespace

Result<SceneSpec> parse_scene(const std::string& text) {
  std::size_t equals = text.find('=');
  if (is_there(text) || text.find('/') < equals) equals = text.npos;  // of the path
  if (text.empty() || equals == 0 || equals + 1 == text.size()) {
    return {Errc::invalid_argument, "--scene " + text + ": use [NAME=]SCENE[:CAMERAS.json]"};
  }
  SceneSpec spec;
  if (equals != text.npos) spec.name = text.substr(0, equals);
  spec.path = equals != text.npos ? text.substr(equals + 1) : text;
  const std::size_t colon = spec.path.rfind(':');
  if (colon != spec.path.npos && spec.path.size() > 5 &&
      spec.path.substr(spec.path.size() - 5) == ".json") {
    spec.cameras = spec.path.substr(colon + 1);
    spec.path.resize(colon);
    if (!is_there(spec.cameras)) {
      return {Errc::file_not_found, "--scene " + text + ": " + spec.cameras + " does not exist"};
    }
  }
  if (spec.path == "default") {
    SceneSpec flat = default_flat();
    if (!spec.name.empty()) flat.name = spec.name;
    flat.cameras = spec.cameras;
    return flat;
  }
  if (spec.name.empty()) spec.name = name_of(spec.path);
  return spec;
}

SceneSpec default_flat() {
  SceneSpec spec{"embedded_flat", "default", {}};
  for (const DefaultView& v : default_scene_views())
    spec.views.push_back(look(v.name, v.eye, v.target, {0, 1, 0}));
  return spec;
}

Result<SceneSpec> benchmark_flat(const std::string& ply) {
  const std::filesystem::path path(ply), cameras = path.parent_path() / "cameras.json";
  for (const auto& p : {path, cameras}) {
    if (!is_there(p))
      return {Errc::file_not_found, "--flat " + ply + ": " + p.string() + " does not exist"};
  }
  return SceneSpec{path.stem().string(), ply, cameras.string()};
}

Result<Scene> load(const SceneSpec& spec, int views, const SceneFrame& frame) {
  Scene scene;
  scene.name = spec.name;
  const auto bad = [&spec](const Status& s) {
    return Status(s.code(), "scene " + spec.name + ": " + s.message());
  };
  std::vector<ViewPoint> all;
  if (!spec.cameras.empty()) {  // before the scene, which may take long
    const Result<std::vector<Camera>> cameras = io::load_cameras(spec.cameras);
    if (!cameras) return bad(cameras.status());
    if (cameras->empty()) return bad({Errc::invalid_file, spec.cameras + " holds no camera"});
    for (const Camera& c : *cameras) {
      all.push_back({std::string("camera") + std::to_string(all.size()), c.viewmat});
    }
  } else {
    all = spec.views;
  }
  OpenOptions how;
  how.up = "keep";  // cameras stand in the axes of the file
  how.time = frame.time;
  how.density = frame.density;
  how.navmesh = "none";
  auto opened = open_scene(spec.path, how);
  if (!opened) return bad(opened.status());
  if (opened->scene->assets.empty())
    return bad({Errc::invalid_argument, spec.path + ": has no Gaussians"});
  scene.cloud = *opened->scene->assets.front().cloud;
  if (all.empty()) {
    auto around = orbit(*opened, scene.cloud, frame.up);
    if (!around) return bad(around.status());
    all = std::move(*around);
  }
  if (spec.path != "default") scene.path = opened->report.source;
  if (!spec.visible_sets.empty()) {
    Result<VisibleSets> sets = io::load_visible_sets(spec.visible_sets, scene.cloud);
    if (!sets)
      return Status(sets.code(),
                    "--visible-sets " + spec.name + "=" + spec.visible_sets + ": " + sets.message());
    scene.visible = std::move(*sets);
  }
  scene.hash = content_hash(scene.cloud);
  const std::size_t wanted = std::min(all.size(), static_cast<std::size_t>(std::max(views, 1)));
  for (std::size_t i = 0; i < wanted; ++i) scene.views.push_back(all[i * all.size() / wanted]);
  return scene;
}

Camera camera_of(const ViewPoint& view, int width, int height, double hfov_degrees, double near) {
  Camera camera;
  camera.set_hfov(width, height, hfov_degrees);
  camera.viewmat = view.viewmat;
  camera.near_plane = near;
  return camera;
}

}  // namespace gsnav_report
