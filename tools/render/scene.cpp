// SPDX-License-Identifier: Apache-2.0
#include "scene.hpp"

#include <cstdio>
#include <utility>

#include "gsnav/demo.hpp"
#include "gsnav/io.hpp"
#include "gsnav/io/scene_file.hpp"
#include "gsnav/scene/prepare.hpp"

namespace gsnav_render {
namespace {

/// Transforms a camera of a scene's file to the world.
Camera in_world(Camera camera, const Similarity& world_from_file) {
  Affine3<double> back;
  back.linear = rotation_matrix(inverse(world_from_file).rotation);
  camera.viewmat = camera.viewmat * back;
  return camera;
}

/// Views around a scene, or views of the rooms if it is the embedded flat and --orbit is not given.
Result<std::vector<Camera>> views_of(const Options& o, const OpenedScene& scene, int width, int height) {
  std::vector<Camera> out;
  if (o.scene == "default" && o.orbit == 0) {
    for (const DefaultView& v : default_scene_views())
      out.push_back(Camera::look_at(v.eye, v.target, {0, 1, 0}, width, height, o.hfov));
    return out;
  }
  return views_around(scene, o.orbit > 0 ? o.orbit : 4, width, height, o.hfov);
}

/// Cameras of the file, in the axes of the scene file. Empty if none is named.
Result<std::vector<Camera>> cameras_in_file(const Options& o) {
  if (o.cameras.empty()) return std::vector<Camera>{};
  auto cameras = io::load_cameras(o.cameras, o.width, o.height);
  if (cameras && cameras->empty()) return {Errc::invalid_file, o.cameras + ": has no cameras"};
  return cameras;
}

/// The cameras of the file, placed in the world, or those of the options.
Result<std::vector<Camera>> cameras_of(const Options& o, std::vector<Camera> cameras,
                                       const OpenedScene& scene) {
  if (!cameras.empty()) {
    if (scene.up == "keep") return cameras;
    const auto placed = upright(scene.up);
    if (!placed) return placed.status();
    for (Camera& camera : cameras) camera = in_world(camera, *placed);
    return cameras;
  }
  const int width = o.width > 0 ? o.width : 640, height = o.height > 0 ? o.height : 480;
  if (o.eye.empty()) return views_of(o, scene, width, height);
  const Vec3d up = scene.up == "keep" ? scene.report.up : Vec3d{0, 1, 0};
  const Vec3d eye{o.eye[0], o.eye[1], o.eye[2]}, target{o.target[0], o.target[1], o.target[2]};
  if (!(norm(cross(target - eye, up)) > 1e-9 * norm(target - eye))) {
    return {Errc::invalid_argument,
            "--eye and --target: the camera would look straight up or down, or nowhere"};
  }
  return std::vector<Camera>{Camera::look_at(eye, target, up, width, height, o.hfov)};
}

}  // namespace

Result<Scene> load_scene(const Options& o) {
  OpenOptions how = gsnav_tools::open_options(o);
  how.eye.set_hfov(o.width > 0 ? o.width : 640, o.height > 0 ? o.height : 480, o.hfov);
  how.eye.near_plane = o.near_plane;
  auto in_file = cameras_in_file(o);
  if (!in_file) return in_file.status();
  gsnav_tools::print_device(o.device, stdout);
  auto opened = gsnav_tools::open_scene(o, how, stdout);
  if (!opened) return opened.status();
  if (!opened->scene->assets.empty() && o.scene != "default")
    std::fputs(io::report_text(opened->report).c_str(), stdout);
  auto cameras = cameras_of(o, std::move(*in_file), *opened);
  if (!cameras) return cameras.status();
  for (Camera& c : *cameras) c.near_plane = o.near_plane;
  return Scene{std::move(*opened), std::move(*cameras)};
}

}  // namespace gsnav_render
