// SPDX-License-Identifier: Apache-2.0
#include "workload.hpp"

#include <algorithm>
#include <cstdlib>

#include "gsnav/detail/demo/default_scene.hpp"
#include "gsnav/detail/io/cameras_file.hpp"
#include "gsnav/io/scene_file.hpp"

using namespace gsnav;

namespace gsnav_bench {

const Workload& workload() {
  static const Workload w = [] {
    Workload made;
    const char* scene = std::getenv("GSNAV_BENCH_SCENE");
    const char* cameras = std::getenv("GSNAV_BENCH_CAMERAS");
    if (scene != nullptr && cameras != nullptr) {
      made.cloud = io::load_scene(scene).value().cloud;
      made.cameras = io::load_cameras(cameras).value();
    } else {
      made.cloud = make_default_scene().value().cloud;
      for (const DefaultView& v : default_scene_views()) {
        made.cameras.push_back(Camera::look_at(v.eye, v.target, {0, 1, 0}, 256, 256, 90));
      }
    }
    return made;
  }();
  return w;
}

const GaussianCloud& base_color_cloud() {
  static const GaussianCloud cloud = [] {
    GaussianCloud c = workload().cloud;
    c.sh_degree = 0;
    c.shN.clear();
    c.shN.shrink_to_fit();
    return c;
  }();
  return cloud;
}

std::vector<Camera> sized(int width, int height) {
  std::vector<Camera> cameras = workload().cameras;
  for (Camera& c : cameras) {
    const double scale = static_cast<double>(width) / c.width;
    c.fx *= scale;
    c.fy *= scale;
    c.width = width;
    c.height = height;
    c.cx = 0.5 * width;
    c.cy = 0.5 * height;
  }
  return cameras;
}

std::vector<Camera> judged_views(const std::vector<Camera>& cameras) {
  const std::size_t n = std::min(kJudgedViews, cameras.size());
  std::vector<Camera> out;
  for (std::size_t i = 0; i < n; ++i) out.push_back(cameras[i * cameras.size() / n]);
  return out;
}

}  // namespace gsnav_bench
