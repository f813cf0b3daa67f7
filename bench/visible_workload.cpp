// SPDX-License-Identifier: Apache-2.0
#include "visible_workload.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <span>
#include <vector>

#include "gsnav/detail/io/visible_file.hpp"
#include "gsnav/detail/nav/gaussian_navmesh.hpp"
#include "gsnav/detail/nav/viewpoints.hpp"
#include "gsnav/device/renderer.hpp"
#include "workload.hpp"

using namespace gsnav;

namespace gsnav_bench {

namespace {

/// Rotation that takes the axis that is most upwards in the images to Y.
Quatd upright(const std::vector<Camera>& cameras) {
  Vec3d up;
  for (const Camera& c : cameras) up = up - c.viewmat.linear.row[1];
  int axis = 0;
  for (int k = 1; k < 3; ++k) axis = std::abs(up[k]) > std::abs(up[axis]) ? k : axis;
  const bool down = up[axis] < 0;
  constexpr double kQuarter = 1.5707963267948966;
  if (axis == 1) return down ? Quatd{0, 1, 0, 0} : Quatd{};
  return axis == 2 ? axis_angle(Vec3d{1, 0, 0}, down ? kQuarter : -kQuarter)
                   : axis_angle(Vec3d{0, 0, 1}, down ? -kQuarter : kQuarter);
}

}  // namespace

VisibleWorkload visible_workload(double spacing) {
  const GaussianCloud& cloud = workload().cloud;
  const std::vector<Camera>& cameras = workload().cameras;
  VisibleWorkload out;
  out.placed = Similarity{upright(cameras), {}, 1.0};
  NavMeshSettings mesh = gaussian_navmesh_settings();
  mesh.agent_radius = 0.3;
  const GaussianSet set = cloud.set(out.placed);
  GaussianNavOptions how;
  if (std::getenv("GSNAV_BENCH_SCENE") == nullptr)
    how.solid_alpha = 0.2;  // the flat's surfaces are as thin as paper
  const NavMeshFromGaussians built = build_navmesh(mesh, std::span(&set, 1), how).value();
  std::vector<double> heights;  // above the floor, to the millimetre, each once
  for (const Camera& c : cameras) {
    heights.push_back(std::round(1000 * ((out.placed * c.position()).y - built.report.floor_y)) / 1000);
  }
  std::sort(heights.begin(), heights.end());
  heights.erase(std::unique(heights.begin(), heights.end()), heights.end());
  out.viewpoints = navmesh_viewpoints(built.mesh, heights, spacing).value();
  return out;
}

VisibleSets workload_visible_sets(VisibleSettings settings) {
  const GaussianCloud& cloud = workload().cloud;
  const std::vector<Camera> cameras = sized(256, 256);
  settings.serve(*std::max_element(cameras.begin(), cameras.end(), [](const Camera& x, const Camera& y) {
    return std::max(x.fx, x.fy) < std::max(y.fx, y.fy);
  }));
  const VisibleWorkload places = visible_workload(settings.spacing());
  const Similarity& placed = places.placed;
  const std::vector<Vec3d>& viewpoints = places.viewpoints;
  settings.most_share = 1;  // measured even if visible sets save nothing
  const Device device = Device::parse("best").value();
  const auto start = std::chrono::steady_clock::now();
  const char* scene = std::getenv("GSNAV_BENCH_SCENE");
  io::CachedVisibleSets found;
  const auto build = [&] { return build_visible_sets(device, cloud, viewpoints, settings, placed); };
  if (scene != nullptr) {
    found = io::cached_visible_sets(scene, cloud, viewpoints, settings, placed, build).value();
  } else {
    found.sets = build().value();
    found.built = true;
  }
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
  std::printf(
      "visible sets: %zu cells of %.2f m from %zu viewpoints, %s in %.1f s (%s), %.2f MB; a cell sees "
      "%.1f "
      "%% of %zu chunks, %.1f %% of the Gaussians\n",
      found.sets.cells(), found.sets.cell, viewpoints.size(), found.built ? "found" : "read",
      took.count(), device.name().c_str(), static_cast<double>(found.sets.bytes()) * 1e-6,
      100 * found.sets.mean_share(), found.sets.cloud_chunks,
      100 * found.sets.mean_row_share(cloud.size()));
  return std::move(found.sets);
}

}  // namespace gsnav_bench
