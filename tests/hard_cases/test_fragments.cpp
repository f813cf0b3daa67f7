// SPDX-License-Identifier: Apache-2.0
// Surfaces that are seen through, and holes in others, among Gaussians: docs/reference/composition.md.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "backends.hpp"
#include "cases.hpp"
#include "eval/oracle_support.hpp"
#include "gsnav/detail/render/draw_fragments.hpp"
#include "support/fragment_truth.hpp"
#include "support/image_hashes.hpp"
#include "support/scenes.hpp"
#include "support/semantic_labels.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

/// Meshes at their places, kept alive.
struct Panes {
  std::size_t add(SurfaceMesh mesh, const Similarity& place = {}) {
    scene.push_back(std::make_unique<MeshScene>());
    scene.back()->add(std::move(mesh)).value();
    instances.push_back(scene.back()->instance(0, place, static_cast<std::uint32_t>(instances.size())));
    return instances.size() - 1;
  }
  std::vector<std::unique_ptr<MeshScene>> scene;
  std::vector<MeshInstance> instances;
};

SurfaceMesh wall(float z, float half, const Vec3f& linear) {
  SurfaceMesh m = quad({-half, -half, z}, {half, -half, z}, {half, half, z}, {-half, half, z});
  m.base_color = linear;
  return m;
}
SurfaceMesh pane(float z, float half, const Vec3f& linear, float alpha) {
  SurfaceMesh m = wall(z, half, linear);
  m.alpha_mode = MeshAlpha::blend;
  m.base_alpha = alpha;
  return m;
}

std::array<double, 3> display(const Vec3f& linear) {
  return {encoded_truth(static_cast<double>(linear.x)), encoded_truth(static_cast<double>(linear.y)),
          encoded_truth(static_cast<double>(linear.z))};
}

/// What is met along one ray, near to far; blended by the definition, in double.
struct Layer {
  double z, alpha;
  std::array<double, 3> rgb;
};
struct Blend {
  std::array<double, 3> rgb{};
  double t = 1, accumulated = 0, median = 0, first = 0;
};
Blend blended(const std::vector<Layer>& layers) {
  Blend b;
  for (const Layer& l : layers) {
    const double w = b.t * l.alpha;
    for (std::size_t c = 0; c < 3; ++c) b.rgb[c] += w * l.rgb[c];
    b.accumulated += w * l.z;
    if (b.t > 0.5 && b.t - w <= 0.5) b.median = b.first = l.z;
    b.t -= w;
  }
  return b;
}

template <class F>
void check_centre(const F& f, const std::vector<Layer>& layers, double tolerance = 2e-6) {
  const std::size_t p = f.width / 2 * f.width + f.width / 2;
  const Blend b = blended(layers);
  for (std::size_t c = 0; c < 3; ++c) {
    CHECK(std::abs(static_cast<double>(f.rgb[3 * p + c]) - b.rgb[c]) < tolerance);
  }
  CHECK(std::abs(static_cast<double>(f.alpha[p]) - (1 - b.t)) < tolerance);
  CHECK(std::abs(static_cast<double>(f.accumulated_depth[p]) - b.accumulated) < 10 * tolerance);
  CHECK(std::abs(static_cast<double>(f.expected_depth[p]) - b.accumulated / (1 - b.t)) < 10 * tolerance);
  CHECK(std::abs(static_cast<double>(f.median_depth[p]) - b.median) < tolerance);
  CHECK(std::abs(static_cast<double>(f.first_hit_depth[p]) - b.first) < tolerance);
}

template <class S>
void check_same(const Frames<S>& a, const Frames<S>& b) {
  for_each_image(a, b, [](const auto& x, const auto& y) { CHECK(x == y); });
}

/// Holds the frames of every backend against the float64 oracle with fragments of traced rays.
void check_against_oracle(const GaussianCloud& cloud, const std::vector<MeshInstance>& meshes,
                          const Camera& camera, std::size_t most, double sure_share) {
  const FragmentTruth traced = fragment_truth(meshes, camera);
  CHECK(traced.most >= most);
  eval::OracleConfig config;
  config.rules = all_outputs();
  config.mesh = &traced.mesh;
  eval::OracleFrames truth = oracle({cloud.set()}, camera, config);
  std::size_t sure = 0;
  for (std::size_t p = 0; p < truth.undecided.size(); ++p) {
    if (traced.undecided[p] != 0) truth.undecided[p] = 1;
    sure += truth.undecided[p] == 0 ? 1 : 0;
  }
  CHECK(static_cast<double>(sure) > sure_share * static_cast<double>(truth.undecided.size()));
  render_everywhere(
      {&cloud}, camera, all_outputs(),
      [&](const auto& f, const auto& renderer) {
        double color = 0, alpha = 0, depth = 0;
        for (std::size_t p = 0; p < truth.alpha.size(); ++p) {
          if (truth.undecided[p] != 0) continue;
          for (std::size_t c = 3 * p; c < 3 * p + 3; ++c) {
            color = std::max(color, std::abs(static_cast<double>(f.rgb[c]) - truth.rgb[c]));
          }
          alpha = std::max(alpha, std::abs(static_cast<double>(f.alpha[p]) - truth.alpha[p]));
          if (truth.undecided_depth[p] != 0) continue;
          const auto off = [&](const auto& image, const std::vector<double>& true_image) {
            depth = std::max(depth, std::abs(static_cast<double>(image[p]) - true_image[p]) /
                                        std::max(1.0, true_image[p]));
          };
          off(f.median_depth, truth.median_depth);
          off(f.first_hit_depth, truth.first_hit_depth);
          off(f.accumulated_depth, truth.accumulated_depth);
        }
        CHECK(color < renderer.bound(1.0 / 510, 1e-9));
        CHECK(alpha < renderer.bound(1e-4, 1e-9));
        CHECK(depth < renderer.bound(1e-3, 1e-7));
      },
      meshes);
}

}  // namespace

TEST_CASE(
    "N71_panes_between_layers: in closed form, before, between and behind Gaussians and an opaque "
    "wall") {
  const Vec3f blue{0, 0.1f, 0.8f}, green{0.2f, 0.9f, 0}, grey{0.5f, 0.5f, 0.5f};
  const auto color = [](float sh0) { return 0.5 + 0.28209479177387814 * static_cast<double>(sh0); };
  const std::array<double, 3> front{color(0.9f), color(-0.7f), color(0.4f)},
      middle{color(-1), color(0.3f), color(1.2f)};
  const GaussianCloud cloud = cloud_of({gaussian({0, 0, 2}, {0.4, 0.4, 1e-4}, 0.3, {0.9f, -0.7f, 0.4f}),
                                        gaussian({0, 0, 3}, {4, 4, 1e-4}, 0.6, {-1, 0.3f, 1.2f}),
                                        gaussian({0, 0, 5}, {4, 4, 1e-4}, 0.9, {1.5f, 1.5f, 1.5f})});
  const Layer near{2, 0.3, front}, far{3, 0.6, middle};
  const auto glass = [](double z, double alpha, const Vec3f& c) { return Layer{z, alpha, display(c)}; };
  Panes panes;
  panes.add(pane(3.5f, 9, green, 0.75f));
  panes.add(wall(4, 9, grey));
  panes.add(pane(2.5f, 9, blue, 0.25f));
  panes.add(pane(4.5f, 9, blue, 0.5f));  // behind the wall
  panes.add(pane(1, 9, green, 0.125f));
  render_everywhere(
      {&cloud}, axis_camera(), all_outputs(),
      [&](const auto& f, const auto&) {
        check_centre(f, {glass(1, 0.125, green),
                         near,
                         glass(2.5, 0.25, blue),
                         far,
                         glass(3.5, 0.75, green),
                         {4, 1, display(grey)}});
        CHECK(f.alpha[f.width / 2 * f.width + f.width / 2] == 1);
        if (!f.stats.empty()) CHECK(f.stats[0].meshes.fragments == 3 * f.width * f.width);
      },
      panes.instances);
  // Nothing is opaque: the last Gaussian and the background are seen too.
  Panes open;
  open.add(pane(2.5f, 9, blue, 0.25f));
  render_everywhere(
      {&cloud}, axis_camera(), all_outputs(),
      [&](const auto& f, const auto&) {
        check_centre(
            f, {near, glass(2.5, 0.25, blue), far, {5, 0.9, {color(1.5f), color(1.5f), color(1.5f)}}});
      },
      open.instances);
}

TEST_CASE("N72_pane_alpha_0_and_1: nothing, and a wall, bit for bit, by every rule") {
  const GaussianCloud cloud = random_cloud(
      72,
      {.count = 4000, .sh_degree = 1, .needle = 0.2, .scale = 0.05, .center = {0, 0, 3}, .extent = 2});
  SurfaceMesh clear = sphere(0.8, 32, 16);
  clear.base_color = {0.8f, 0.3f, 0.1f};
  const Similarity place{{}, {0.2, 0.1, 3}, 1};
  Panes glass, solid, none;
  solid.add(clear, place);
  clear.alpha_mode = MeshAlpha::blend;
  glass.add(clear, place);
  clear.base_alpha = 0;
  none.add(clear, place);
  for (int rules = 0; rules < 5; ++rules) {
    RenderConfig config = all_outputs();
    config.background = {0.1, 0.2, 0.3};
    if (rules == 1) config.response = Response::ray;
    if (rules == 2) config.compat = Compat::inria;
    if (rules == 3) config.tuning.tile_size = 32;
    if (rules == 4) config.blend_space = ColorSpace::linear;
    CAPTURE(rules);
    for_each_renderer([&](auto& renderer) {
      const std::vector<Camera> camera{axis_camera(75)};
      check_same(renderer.render({&cloud}, camera, config, glass.instances),
                 renderer.render({&cloud}, camera, config, solid.instances));
      check_same(renderer.render({&cloud}, camera, config, none.instances),
                 renderer.render({&cloud}, camera, config));
    });
  }
}

TEST_CASE(
    "N73_pane_cuts_splats: large splats are before a pane at one pixel and behind it at the next") {
  // Slanted disks of half a metre through a pane, at alphas up to one: as a wall would cut them.
  Rng rng(73);
  std::vector<RawGaussian> disks;
  for (int i = 0; i < 300; ++i) {
    RawGaussian g =
        gaussian({rng.uniform(-1, 1), rng.uniform(-1, 1), rng.uniform(2.5, 3.5)}, {0.4, 0.3, 0.004},
                 rng.uniform(0.2, 0.9), {static_cast<float>(rng.uniform(-1, 1)), 0.5f, 0});
    g.quat = random_rotation(rng);
    disks.push_back(g);
  }
  const GaussianCloud cloud = cloud_of(disks);
  for (const float alpha : {0.02f, 0.5f, 0.9375f}) {
    Panes panes;
    panes.add(pane(3, 9, {0.1f, 0.6f, 0.2f}, alpha));
    check_against_oracle(cloud, panes.instances, axis_camera(), 1, 0.9);
  }
}

TEST_CASE("N74_panes_any: random surfaces, through one another, the near plane and behind the camera") {
  const GaussianCloud cloud = random_cloud(
      74,
      {.count = 3000, .sh_degree = 1, .needle = 0.1, .scale = 0.04, .center = {0, 0, 3}, .extent = 1.5});
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    Rng rng(seed);
    Panes panes;
    for (int k = 0; k < 2; ++k) {
      SurfaceMesh m = random_triangles(100 * seed + static_cast<std::uint64_t>(k), 60);
      m.alpha_mode = MeshAlpha::blend;
      m.two_sided = k == 0;
      m.base_alpha = k == 0 ? 1.0f : 0.6f;
      for (std::size_t v = 0; v < m.geometry.vertices.size(); ++v)
        m.alphas.push_back(static_cast<float>(rng.uniform()));
      panes.add(m, {{}, {0, 0, 0.3 * k}, 1});
    }
    SurfaceMesh mask = random_triangles(100 * seed + 7, 12);
    mask.alpha_mode = MeshAlpha::mask;
    mask.alpha_cutoff = 0.4f;
    for (std::size_t v = 0; v < mask.geometry.vertices.size(); ++v)
      mask.alphas.push_back(static_cast<float>(rng.uniform()));
    panes.add(mask);
    SurfaceMesh ball = sphere(0.6, 24, 12);
    panes.add(ball, {{}, {0.3, 0, 3.2}, 1});
    Camera camera = axis_camera();
    camera.near_plane = 0.2;
    check_against_oracle(cloud, panes.instances, camera, 5, 0.85);
  }
}

TEST_CASE(
    "N75_coplanar_panes: the first is before the next, both before an opaque surface in their plane") {
  const Vec3f red{0.9f, 0, 0}, green{0, 0.9f, 0}, grey{0.4f, 0.4f, 0.4f};
  Panes panes;
  panes.add(wall(2, 3, grey));
  panes.add(pane(2, 3, red, 0.25f));
  panes.add(pane(2, 3, green, 0.5f));
  const GaussianCloud empty = cloud_of({gaussian({0, 0, 9}, {0.1, 0.1, 0.1}, 0.5)});
  render_everywhere(
      {&empty}, axis_camera(), all_outputs(),
      [&](const auto& f, const auto&) {
        check_centre(f, {{2, 0.25, display(red)}, {2, 0.5, display(green)}, {2, 1, display(grey)}});
        // No pixel of the pane's diagonal is passed twice.
        for (std::size_t p = 1; p < f.width * f.width; ++p) {
          if (f.alpha[p] != 1) continue;
          REQUIRE(std::abs(static_cast<double>(
                      f.rgb[3 * p] - f.rgb[3 * (f.width / 2 * f.width + f.width / 2)])) < 1e-6);
        }
      },
      panes.instances);
}

TEST_CASE("N76_many_panes: as many as there are, none is dropped") {
  const GaussianCloud cloud = cloud_of({gaussian({0, 0, 5}, {4, 4, 1e-4}, 0.5, {1, 1, 1})});
  for (const int count : {300, 3000}) {
    Panes panes;
    const float alpha = 0.5f / static_cast<float>(count);
    SurfaceMesh stack = pane(1, 9, {0.2f, 0.4f, 0.6f}, alpha);
    std::vector<Layer> layers;
    Rng rng(76);
    stack.geometry = {};
    std::vector<double> depths;
    for (int i = 0; i < count; ++i)
      depths.push_back(static_cast<double>(static_cast<float>(rng.uniform(1, 4.5))));
    for (const double z : depths) {  // in any order
      const SurfaceMesh one = wall(static_cast<float>(z), 9, {});
      const auto first = static_cast<std::uint32_t>(stack.geometry.vertices.size());
      for (const Vec3f& v : one.geometry.vertices) stack.geometry.vertices.push_back(v);
      for (const auto& [a, b, c] : one.geometry.triangles)
        stack.geometry.triangles.push_back({first + a, first + b, first + c});
      layers.push_back({z, static_cast<double>(alpha), display({0.2f, 0.4f, 0.6f})});
    }
    std::sort(layers.begin(), layers.end(), [](const Layer& a, const Layer& b) { return a.z < b.z; });
    const double white = 0.5 + 0.28209479177387814;
    layers.push_back({5, 0.5, {white, white, white}});
    panes.add(stack);
    render_everywhere(
        {&cloud}, axis_camera(9, 8), all_outputs(),
        [&](const auto& f, const auto& renderer) {
          check_centre(f, layers, renderer.bound(1e-4, 1e-7));
          if (!f.stats.empty())
            CHECK(f.stats[0].meshes.fragments == static_cast<std::uint64_t>(count) * 81);
        },
        panes.instances);
  }
}

TEST_CASE("panes: every output alone, batches, and what the frame does not have costs nothing") {
  const GaussianCloud cloud = random_cloud(
      77,
      {.count = 3000, .sh_degree = 1, .needle = 0.2, .scale = 0.05, .center = {0, 0, 3}, .extent = 2});
  SurfaceMesh ball = sphere(0.8, 32, 16);
  ball.alpha_mode = MeshAlpha::blend;
  ball.two_sided = true;
  ball.base_alpha = 0.4f;
  Panes panes;
  panes.add(ball, {{}, {0.2, 0.1, 3}, 1});
  for (const Response response : {Response::ewa, Response::tangent_plane}) {
    RenderConfig config = all_outputs();
    config.response = response;
    render_everywhere(
        {&cloud}, axis_camera(83), config,
        [&](const auto& all, auto& renderer) {
          for (const unsigned output :
               {kRgb, kAlpha, kMedianDepth, kExpectedDepth, kAccumulatedDepth, kFirstHitDepth}) {
            RenderConfig alone = config;
            alone.outputs = output;
            const auto f = renderer.render({&cloud}, {axis_camera(83)}, alone, panes.instances);
            for_each_image(f, all, [](const auto& a, const auto& b) { CHECK((a.empty() || a == b)); });
          }
          std::vector<Camera> batch(5, axis_camera(83));
          for (std::size_t i = 0; i < batch.size(); ++i) batch[i].cx += static_cast<double>(i) - 2;
          const auto many = renderer.render({&cloud}, batch, config, panes.instances);
          CHECK(std::equal(all.rgb.begin(), all.rgb.end(), many.rgb.begin() + 2 * 3 * 83 * 83));
        },
        panes.instances);
  }
  // An opaque mesh alone makes no list.
  SerialBackend serial;
  RenderWorkspace<float, SerialBackend> ws(serial);
  Panes solid;
  solid.add(sphere(0.8, 32, 16), {{}, {0.2, 0.1, 3}, 1});
  std::vector<float> alpha(83 * 83);
  FrameImages<float> images;
  images.alpha = alpha.data();
  RenderConfig config;
  config.outputs = kAlpha;
  const GaussianSet set = cloud.set();
  REQUIRE(draw_frame<float>(serial, ws, std::span(&set, 1), {solid.instances, {}}, axis_camera(83),
                            config, images)
              .ok());
  Frames<float> frame;
  frame.alpha = alpha;
  record_hashes(frame, "serial float");
  CHECK(ws.fragments.capacity_bytes() == 0);
  // Habitat-GS's rule has one layer per pixel.
  config.composite = Composite::hard_depth;
  const Status refused = draw_frame<float>(serial, ws, std::span(&set, 1), {panes.instances, {}},
                                           axis_camera(83), config, images);
  CHECK(refused.code() == Errc::unsupported);
  CHECK(refused.message().find("MeshAlpha::blend") != std::string::npos);
}

TEST_CASE("holes that a mask cuts: what is behind is seen, by texel and by vertex") {
  // A chequered wall, a texel a pixel, before an opaque one and after a Gaussian.
  std::vector<std::uint8_t> rgba;
  for (int y = 0; y < 8; ++y) {
    for (int x = 0; x < 8; ++x) {
      for (const int c : {200, 100, 50, (x + y) % 2 == 0 ? 255 : 60})
        rgba.push_back(static_cast<std::uint8_t>(c));
    }
  }
  SurfaceMesh lattice = wall(1, 1, {1, 1, 1});
  lattice.texture = std::make_shared<const MeshTexture>(MeshTexture::make(8, 8, rgba).value());
  lattice.uvs = {{0, 0}, {2, 0}, {2, 2}, {0, 2}};
  lattice.alpha_mode = MeshAlpha::mask;
  lattice.alpha_cutoff = 0.5f;
  const GaussianCloud cloud = cloud_of({gaussian({0, 0, 1.5}, {900, 900, 1e-4}, 0.4, {1, 1, 1})});
  Panes panes;
  panes.add(lattice);
  panes.add(wall(2, 9, {0.3f, 0.3f, 0.3f}));
  Camera camera = axis_camera(16, 8);  // a texel a pixel
  render_everywhere(
      {&cloud}, camera, all_outputs(),
      [&](const auto& f, const auto&) {
        for (std::size_t p = 0; p < 256; ++p) {
          const bool hole = (p % 16 + p / 16) % 2 != 0;
          const double behind =
              0.4 * (0.5 + 0.28209479177387814) + 0.6 * encoded_truth(static_cast<double>(0.3f));
          REQUIRE(std::abs(static_cast<double>(f.rgb[3 * p]) - (hole ? behind : 200.0 / 255)) < 1e-4);
          REQUIRE(std::abs(static_cast<double>(f.median_depth[p]) - (hole ? 2 : 1)) < 1e-5);
          REQUIRE(f.alpha[p] == 1);
        }
      },
      panes.instances);
  // The same seen through: as much as each texel says. All of it is surface at a cut-off of 0, nothing
  // above 1.
  lattice.alpha_mode = MeshAlpha::blend;
  lattice.base_alpha = 0.5f;
  Panes glass;
  glass.add(lattice);
  render_everywhere(
      {}, camera, all_outputs(),
      [&](const auto& f, const auto&) {
        for (std::size_t p = 0; p < 256; ++p) {
          const double alpha = 0.5 * ((p % 16 + p / 16) % 2 != 0 ? 60.0 / 255 : 1.0);
          REQUIRE(std::abs(static_cast<double>(f.alpha[p]) - alpha) < 1e-5);
          REQUIRE(std::abs(static_cast<double>(f.rgb[3 * p]) - alpha * 200 / 255) < 1e-4);
        }
      },
      glass.instances);
  lattice.alpha_mode = MeshAlpha::mask;
  lattice.base_alpha = 1;
  for (const auto& [cutoff, covered] :
       {std::pair{0.0f, 256}, std::pair{1.0f, 128}, std::pair{1.01f, 0}}) {
    lattice.alpha_cutoff = cutoff;
    Panes cut;
    cut.add(lattice);
    SerialBackend serial;
    BasicRenderer<double, SerialBackend> renderer(serial, all_outputs());
    renderer.set_meshes(cut.instances);
    const auto f = renderer.render({}, std::vector<Camera>{camera}).value();
    record_hashes(f, "serial double");
    CHECK(std::count(f.alpha.begin(), f.alpha.end(), 1.0) == covered);
  }
}

TEST_CASE("semantic ids by weight: a pane is who covers most of a pixel, or nobody") {
  const GaussianCloud cloud = cloud_of({gaussian({0, 0, 3}, {9, 9, 1e-4}, 0.9)});
  SerialBackend serial;
  const GaussianSet set = cloud.set();
  for (const float alpha : {0.2f, 0.4f, 0.7f}) {
    Panes panes;
    panes.add(wall(4, 9, {1, 1, 1}));
    panes.add(pane(2, 9, {1, 1, 1}, alpha));
    const SemanticLabels out =
        semantic_labels<double>(serial, std::span(&set, 1), panes.instances, axis_camera(9));
    const double of_pane = static_cast<double>(alpha), of_cloud = 0.9 * (1 - of_pane);
    record_hashes<float>({{"labels", &out.labels}, {"weights", &out.weights}}, "serial double");
    CHECK(out.labels[40] == (of_pane > of_cloud ? 3.0f : 1.0f));
    CHECK(std::abs(static_cast<double>(out.weights[40]) - std::max(of_pane, of_cloud)) < 1e-6);
  }
}
