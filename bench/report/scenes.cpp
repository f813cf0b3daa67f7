// SPDX-License-Identifier: Apache-2.0
#include "scenes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <system_error>
#include <utility>

#include "cache.hpp"
#include "gsnav/demo.hpp"
#include "gsnav/io.hpp"
#include "gsnav/io/scene_file.hpp"

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

/// Four views from outside, a quarter turn apart, for scenes without cameras. They look at the median of
/// the means, from 1.5 times the radius that holds nine tenths of them. Y is up.
std::vector<ViewPoint> orbit(const GaussianCloud& cloud) {
  Vec3d center;
  std::vector<double> values(cloud.size());
  if (values.empty()) return {look("orbit0", {0, 0, -1}, {}, {0, 1, 0})};
  const auto quantile = [&](double q) {
    const auto at =
        values.begin() + static_cast<std::ptrdiff_t>(q * static_cast<double>(values.size() - 1));
    std::nth_element(values.begin(), at, values.end());
    return *at;
  };
  for (int k = 0; k < 3; ++k) {
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = cloud.mean(i)[k];
    center[k] = quantile(0.5);
  }
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = norm(cloud.mean(i) - center);
  const double away = 1.5 * std::max(quantile(0.9), 0.1);
  std::vector<ViewPoint> out;
  for (int k = 0; k < 4; ++k) {
    const double a = (k + 0.5) * std::numbers::pi / 2;
    const Vec3d eye = center + Vec3d{std::cos(a), 0.3, std::sin(a)} * away;
    out.push_back(look(std::string("orbit") + std::to_string(k), eye, center, {0, 1, 0}));
  }
  return out;
}

}  // namespace

Result<SceneSpec> parse_scene(const std::string& text) {
  const std::size_t equals = text.find('=');
  if (equals == text.npos || equals == 0 || equals + 1 == text.size()) {
    return {Errc::invalid_argument, "--scene " + text + ": use NAME=PATH or NAME=PATH:CAMERAS.json"};
  }
  SceneSpec spec{text.substr(0, equals), text.substr(equals + 1), {}};
  const std::size_t colon = spec.path.rfind(':');
  if (colon != spec.path.npos && spec.path.size() > 5 &&
      spec.path.substr(spec.path.size() - 5) == ".json") {
    spec.cameras = spec.path.substr(colon + 1);
    spec.path.resize(colon);
    if (!is_there(spec.cameras)) {
      return {Errc::file_not_found, "--scene " + text + ": " + spec.cameras + " does not exist"};
    }
  }
  return spec;
}

SceneSpec default_flat() {
  SceneSpec spec{"embedded_flat", {}, {}};
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

std::vector<SceneSpec> data_scenes(const std::filesystem::path& folder) {
  std::vector<SceneSpec> out;
  const std::filesystem::path showroom = folder / "splats/lacadiere_showroom",
                              cameras = folder / "cameras/lacadiere_eye_level.json";
  std::string tiles;
  for (const char* tile : {"2_0", "2_1", "2_2"}) {
    if (is_there(showroom / tile)) tiles.append(tiles.empty() ? "" : ",").append(tile);
  }
  if (!tiles.empty() && is_there(cameras)) {
    out.push_back({"lacadiere", (showroom / tiles).string(), cameras.string()});
  }
  const std::filesystem::path ruin = folder / "splats/fyoxy_ruin_300k_sh3";
  if (is_there(ruin)) {
    SceneSpec spec{"fyoxy_ruin", ruin.string(), {}};
    const Vec3d up{0, -1, 0};  // the scan is y down, about one unit per metre
    spec.views = {
        look("wall", {0, -1, -2.5}, {2, -1.2, 0}, up), look("yard", {2.2, -1.5, -5}, {0.5, -1, 0}, up),
        look("corner", {-3, -1.5, -5}, {0, -1, 0}, up), look("fence", {0, -1.4, -3}, {-3, -1.2, 0}, up)};
    out.push_back(std::move(spec));
  }
  return out;
}

Result<Scene> load(const SceneSpec& spec, int views) {
  Scene scene;
  scene.name = spec.name;
  std::vector<ViewPoint> all = spec.views;
  if (!spec.cameras.empty()) {  // before the scene, which may take long to load
    const Result<std::vector<Camera>> cameras = io::load_cameras(spec.cameras);
    if (!cameras) return Status(cameras.code(), "scene " + spec.name + ": " + cameras.message());
    if (cameras->empty())
      return {Errc::invalid_file, "scene " + spec.name + ": " + spec.cameras + " holds no camera"};
    for (const Camera& c : *cameras) {
      all.push_back({std::string("camera") + std::to_string(all.size()), c.viewmat});
    }
  }
  if (spec.path.empty()) {
    Result<DefaultScene> flat = make_default_scene();
    if (!flat) return flat.status();
    scene.cloud = std::move(flat->cloud);
  } else {
    Result<LoadedCloud> loaded = io::load_scene(spec.path);
    if (!loaded) return Status(loaded.code(), "scene " + spec.name + ": " + loaded.message());
    scene.cloud = std::move(loaded->cloud);
  }
  scene.path = spec.path;
  if (!spec.visible_sets.empty()) {
    Result<VisibleSets> sets = io::load_visible_sets(spec.visible_sets, scene.cloud);
    if (!sets)
      return Status(sets.code(),
                    "--visible-sets " + spec.name + "=" + spec.visible_sets + ": " + sets.message());
    scene.visible = std::move(*sets);
  }
  scene.hash = content_hash(scene.cloud);
  if (all.empty()) all = orbit(scene.cloud);
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
