// SPDX-License-Identifier: Apache-2.0
// Draws only the Gaussians that can be seen from the camera's cell. usage: view_cells [DEVICE]
#include <cmath>
#include <cstdio>
#include <exception>
#include <memory>

#include "gsnav/demo.hpp"
#include "gsnav/device/renderer.hpp"
#include "gsnav/nav.hpp"
#include "gsnav/scene/visible_sets.hpp"

int main(int argc, char** argv) try {
  auto device = gsnav::Device::parse(argc > 1 ? argv[1] : "best").value();
  auto flat = gsnav::default_simulator_scene(0, 1, 0.2).value();
  gsnav::SceneAsset& asset = flat.assets[0];
  const std::size_t rows = asset.cloud->size();
  // Once for each scene: look around from places all over the floor, and keep for each cell of 1.5 m
  // which Gaussians are seen from there. For files, gsnav-navmesh --visible-sets does it. These cells
  // are coarse, to be quick; the default settings are finer.
  gsnav::VisibleSettings settings{.cell = 1.5, .margin = 0.5, .min_weight = 1e-3};
  const double heights[] = {1.5};  // of the cameras, metres
  auto places = gsnav::navmesh_viewpoints(*flat.navmesh, heights, settings.spacing()).value();
  auto cells = std::make_shared<const gsnav::VisibleSets>(
      gsnav::build_visible_sets(device, *asset.cloud, places, settings).value());
  asset.visible = cells;
  auto scene = std::make_shared<const gsnav::SimulatorScene>(std::move(flat));
  gsnav::RenderOptions only_seen;
  only_seen.detail.visible_sets = true;
  auto all = gsnav::Renderer::create(device, scene).value();
  auto seen = gsnav::Renderer::create(device, scene, only_seen).value();
  for (const gsnav::DefaultView& view : gsnav::default_scene_views()) {
    auto camera = gsnav::Camera::look_at(view.eye, view.target, {0, 1, 0}, 96, 96, 90);
    auto want = all.render(camera).value().rgb, got = seen.render(camera).value().rgb;
    double squares = 0, pixels = static_cast<double>(want.size());
    for (std::size_t i = 0; i < want.size(); ++i) squares += std::pow(want[i] - got[i], 2);
    auto drawn = cells->count_seen_rows(cells->cell_of(camera).value(), rows);
    std::printf("%s: %.1f %% of the Gaussians drawn, PSNR %.1f dB against all\n", view.name,
                100 * static_cast<double>(drawn) / static_cast<double>(rows),
                -10 * std::log10(squares / pixels));
  }
} catch (const std::exception& e) {
  return std::fprintf(stderr, "%s\n", e.what()), 1;
}
