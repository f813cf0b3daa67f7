// SPDX-License-Identifier: Apache-2.0
// Impossible configurations are refused with the field's name.
#include <doctest/doctest.h>

#include <limits>

#include "ops/backends.hpp"
#include "support/scenes.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

std::string error_of(const GaussianSet& set, const Camera& camera, const RenderConfig& config) {
  SerialBackend serial;
  Renderer<float, SerialBackend> renderer(serial, config);
  const auto r = renderer.render(set, camera);
  CHECK(r.code() == (r.ok() ? Errc::ok : Errc::invalid_argument));
  return r.message();
}
bool names(const std::string& message, const char* field) {
  INFO(message);
  return message.find(field) != std::string::npos;
}

}  // namespace

TEST_CASE("bad render configurations name their field") {
  const GaussianCloud cloud = random_cloud(1, {.count = 10});
  const auto message = [&](auto change) {
    RenderConfig config;
    change(config);
    return error_of(cloud.set(), Camera{}, config);
  };
  CHECK(names(message([](RenderConfig& c) { c.tile_size = 12; }), "tile_size"));
  CHECK(names(message([](RenderConfig& c) { c.outputs = 0; }), "outputs"));
  CHECK(names(message([](RenderConfig& c) { c.outputs = 1u << 20; }), "outputs"));
  CHECK(names(message([](RenderConfig& c) { c.max_alpha = 0; }), "max_alpha"));
  CHECK(names(message([](RenderConfig& c) { c.transmittance_min = 1; }), "transmittance_min"));
  CHECK(names(message([](RenderConfig& c) { c.first_hit_tau = std::nan(""); }), "first_hit_tau"));
  CHECK(names(message([](RenderConfig& c) { c.background.y = std::nan(""); }), "background"));
  CHECK(message([](RenderConfig&) {}).empty());
}

TEST_CASE("bad cameras name their field") {
  const GaussianCloud cloud = random_cloud(1, {.count = 10});
  const auto message = [&](auto change) {
    Camera camera;
    change(camera);
    return error_of(cloud.set(), camera, {});
  };
  CHECK(names(message([](Camera& c) { c.width = 0; }), "width"));
  CHECK(names(message([](Camera& c) { c.height = 100000; }), "height"));
  CHECK(names(message([](Camera& c) { c.fx = -1; }), "fx"));
  CHECK(names(message([](Camera& c) { c.fy = std::numeric_limits<double>::infinity(); }), "fy"));
  CHECK(names(message([](Camera& c) { c.near_plane = 0; }), "near_plane"));
  CHECK(names(message([](Camera& c) { c.viewmat.translation.x = std::nan(""); }), "viewmat"));
  CHECK(names(message([](Camera& c) { c.viewmat.linear(0, 0) = 2; }), "viewmat"));
  CHECK(names(message([](Camera& c) { c.viewmat.linear(1, 2) = std::nan(""); }), "viewmat"));
}

TEST_CASE("bad sets name their array") {
  const GaussianCloud cloud = random_cloud(1, {.count = 10});
  const auto message = [&](auto change) {
    GaussianSet set = cloud.set();
    change(set);
    return error_of(set, Camera{}, {});
  };
  CHECK(names(message([](GaussianSet& s) { s.gaussians.means[1].size = 3; }), "means"));
  CHECK(names(message([](GaussianSet& s) { s.gaussians.quats[3] = {}; }), "quats"));
  CHECK(names(message([](GaussianSet& s) { s.gaussians.sh_degree = 4; }), "sh_degree"));
  CHECK(names(message([](GaussianSet& s) { s.gaussians.sh_degree = 1; }), "shN"));
  CHECK(names(message([](GaussianSet& s) { s.eps2d = 0; }), "eps2d"));
  CHECK(names(message([](GaussianSet& s) { s.world_from_asset.scale = -1; }), "world_from_asset"));
}

TEST_CASE("an empty scene shows the background") {
  SerialBackend serial;
  RenderConfig config;
  config.background = {0.25, 0.5, 0.75};
  Renderer<float, SerialBackend> renderer(serial, config);
  Camera camera;
  camera.set_hfov(33, 17, 90);
  const std::vector<Camera> cameras{camera};
  const auto f = renderer.render(std::span<const GaussianSet>{}, cameras).value();
  for (std::size_t p = 0; p < 33 * 17; ++p) {
    CHECK(f.rgb[3 * p] == 0.25f);
    CHECK(f.rgb[3 * p + 2] == 0.75f);
    CHECK(f.alpha[p] == 0.0f);
    CHECK(f.median_depth[p] == 0.0f);
  }
}
