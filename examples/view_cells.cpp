// SPDX-License-Identifier: Apache-2.0
// Renders only the Gaussians that can be seen from the camera's cell, and measures the difference.
// usage: view_cells [DEVICE]
#include <cmath>
#include <cstdio>
#include <memory>

#include "gsnav/demo.hpp"
#include "gsnav/device/renderer.hpp"
#include "gsnav/nav.hpp"
#include "gsnav/scene/visible_sets.hpp"

int main(int argc, char** argv) {
  auto device = gsnav::Device::parse(argc > 1 ? argv[1] : "best").value();
  auto flat = gsnav::default_simulator_scene(0, 1, 0.1).value();
  auto view = gsnav::default_scene_views()[0];
  auto camera = gsnav::Camera::look_at(view.eye, view.target, {0, 1, 0}, 96, 96, 90);

  // Done once per scene: find the Gaussians that are seen from each place at the camera's height. For
  // scenes in files, gsnav-navmesh --visible-sets does the same.
  gsnav::VisibleSettings settings{.cell = 1.0, .margin = 0.5};
  settings.serve(camera);
  const double heights[] = {view.eye.y};
  auto places = gsnav::navmesh_viewpoints(*flat.navmesh, heights, settings.spacing()).value();
  gsnav::SceneAsset& asset = flat.assets[0];
  auto sets = gsnav::build_visible_sets(device, *asset.cloud, places, settings).value();
  const std::size_t here = sets.cell_of(camera).value(), rows = asset.cloud->size();
  std::printf("%zu viewpoints, %zu cells; from here %zu of %zu Gaussians are seen\n", places.size(),
              sets.cells(), sets.count_seen_rows(here, rows), rows);
  asset.visible = std::make_shared<const gsnav::VisibleSets>(std::move(sets));

  auto scene = std::make_shared<const gsnav::SimulatorScene>(std::move(flat));
  auto all = gsnav::Renderer::create(device, scene).value().render(camera).value();
  gsnav::RenderOptions options;
  options.detail.visible_sets = true;
  auto seen = gsnav::Renderer::create(device, scene, options).value().render(camera).value();
  double sum = 0;
  for (std::size_t i = 0; i < all.rgb.size(); ++i) sum += std::abs(all.rgb[i] - seen.rgb[i]);
  const double mean = sum / static_cast<double>(all.rgb.size());
  std::printf("colours differ by %.5f on average\n", mean);
  return mean < 0.005 ? 0 : 1;
}
