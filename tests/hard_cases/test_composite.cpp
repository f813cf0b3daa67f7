// SPDX-License-Identifier: Apache-2.0
// Meshes among Gaussians: docs/reference/composition.md.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <type_traits>
#include <utility>
#include <vector>

#include "backends.hpp"
#include "cases.hpp"
#include "eval/oracle_support.hpp"
#include "ops/mesh_images.hpp"
#include "support/image_hashes.hpp"
#include "support/scenes.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

/// The mesh's planes in float64, as an oracle takes them.
eval::OracleMesh planes(const std::vector<MeshInstance>& meshes, const Camera& camera) {
  SerialBackend serial;
  const auto drawn = draw<double>(serial, meshes, camera);
  return {drawn.depth, drawn.color};
}

eval::OracleFrames merged_truth(const std::vector<Placed>& scene, const Camera& camera,
                                const RenderConfig& rules, const eval::OracleMesh& mesh) {
  eval::OracleConfig config;
  config.rules = rules;
  config.mesh = mesh.depth.empty() ? nullptr : &mesh;
  std::vector<GaussianSet> sets;
  for (const Placed& p : scene) {
    sets.push_back(p.cloud->set());
    sets.back().world_from_asset = p.place;
  }
  return oracle(sets, camera, config);
}

/// Of colours, over pixels where the oracle is sure.
struct Difference {
  double largest = 0, psnr = 0, wrong = 0;  ///< wrong: share of pixels off by more than 0.1
};
template <class S>
Difference difference(const Frames<S>& f, const eval::OracleFrames& truth) {
  Difference d;
  double squares = 0, values = 0, wrong = 0;
  for (std::size_t p = 0; p < truth.alpha.size(); ++p) {
    if (truth.undecided[p] != 0) continue;
    bool off = false;
    for (std::size_t c = 3 * p; c < 3 * p + 3; ++c) {
      const double e = std::abs(static_cast<double>(f.rgb[c]) - truth.rgb[c]);
      d.largest = std::max(d.largest, e);
      off = off || e > 0.1;
      squares += e * e;
      values += 1;
    }
    wrong += off ? 1 : 0;
  }
  d.psnr = 10 * std::log10(values / std::max(squares, 1e-30));
  d.wrong = wrong / (values / 3);
  return d;
}

template <class S>
double largest_depth_error(const std::vector<S>& depth, const std::vector<double>& truth,
                           const eval::OracleFrames& f) {
  double largest = 0;
  for (std::size_t p = 0; p < truth.size(); ++p) {
    if (f.undecided[p] != 0 || f.undecided_depth[p] != 0) continue;
    largest = std::max(largest, std::abs(static_cast<double>(depth[p]) - truth[p]));
  }
  return largest;
}

template <class S>
std::array<std::vector<S> Frames<S>::*, 6> every_image(const Frames<S>&) {
  using F = Frames<S>;
  return {&F::rgb,
          &F::alpha,
          &F::median_depth,
          &F::expected_depth,
          &F::accumulated_depth,
          &F::first_hit_depth};
}

/// Shells of Gaussians about a point, each flat on its sphere.
GaussianCloud shell(std::uint64_t seed, const Vec3d& center, double radius, int count) {
  Rng rng(seed);
  std::vector<RawGaussian> gaussians;
  for (int i = 0; i < count; ++i) {
    const Vec3d n = normalized(Vec3d{rng.normal(), rng.normal(), rng.normal()});
    RawGaussian g = gaussian(
        center + n * radius, {0.05, 0.05, 0.004}, rng.uniform(0.3, 0.95),
        {static_cast<float>(rng.uniform(0, 1.5)), 0.8f, static_cast<float>(rng.uniform(-1, 0.5))});
    // z onto n.
    const Vec3d axis = cross(Vec3d{0, 0, 1}, n);
    g.quat = {1 + n.z, axis.x, axis.y, axis.z};
    normalize(g.quat);
    gaussians.push_back(g);
  }
  return cloud_of(gaussians);
}

GaussianCloud wall_of_disks(std::uint64_t seed, double z, double half, int count) {
  Rng rng(seed);
  std::vector<RawGaussian> disks;
  for (int i = 0; i < count; ++i) {
    disks.push_back(
        gaussian({rng.uniform(-half, half), rng.uniform(-half, half), z + 0.003 * rng.normal()},
                 {0.12, 0.12, 0.003}, 0.9, {-0.5f, static_cast<float>(rng.uniform(0, 1)), 1.0f}));
  }
  return cloud_of(disks);
}

/// Colour of a Gaussian of degree 0 in one channel.
double color(float sh0) { return 0.5 + 0.28209479177387814 * static_cast<double>(sh0); }

OneMesh wall_mesh(float z, float half, const Vec3f& linear) {
  SurfaceMesh m = quad({-half, -half, z}, {half, -half, z}, {half, half, z}, {-half, half, z});
  m.base_color = linear;
  return OneMesh(m);
}

}  // namespace

TEST_CASE("N49_mesh_between_layers") {
  const OneMesh mesh = wall_mesh(3, 5, {1, 0.5f, 0});
  const std::array<double, 3> k{1, static_cast<double>(srgb_encoded(0.5)), 0};
  for (const double opacity : {0.4, 0.5, 0.6}) {
    const GaussianCloud cloud =
        cloud_of({gaussian({0, 0, 2}, {0.4, 0.4, 1e-4}, opacity, {0.9f, -0.7f, 0.4f}),
                  gaussian({0, 0, 4}, {4, 4, 1e-4}, 0.9, {1.5f, 1.5f, 1.5f})});
    const std::array<double, 3> front{color(0.9f), color(-0.7f), color(0.4f)};
    render_everywhere(
        {&cloud}, axis_camera(), all_outputs(),
        [&](const auto& f, const auto&) {
          const std::size_t p = kAxisPixel;
          for (std::size_t c = 0; c < 3; ++c) {
            CHECK(std::abs(static_cast<double>(f.rgb[3 * p + c]) -
                           (opacity * front[c] + (1 - opacity) * k[c])) < 1e-6);
          }
          CHECK(f.alpha[p] == 1);
          const double mean = opacity * 2 + (1 - opacity) * 3;
          CHECK(std::abs(static_cast<double>(f.accumulated_depth[p]) - mean) < 2e-6);
          CHECK(std::abs(static_cast<double>(f.expected_depth[p]) - mean) < 2e-6);
          if (opacity != 0.5) {  // there T = 1/2 is a matter of rounding
            const double half = opacity > 0.5 ? 2 : 3;
            CHECK(std::abs(static_cast<double>(f.median_depth[p]) - half) < 2e-6);
            CHECK(std::abs(static_cast<double>(f.first_hit_depth[p]) - half) < 2e-6);
          }
        },
        mesh.instances);
  }
}

TEST_CASE("hard_depth shows Gaussians where their expected depth is not beyond the mesh") {
  // On the axis: two Gaussians with alpha 0.5 and 0.9, together 0.95, whose expected depth is 2.8 /
  // 0.95. Or one with alpha 0.008: Habitat-GS drops pixels of up to 0.01.
  const std::array<double, 3> background{0.1, 0.2, 0.3},
      wall{1, static_cast<double>(srgb_encoded(0.5)), 0};
  const std::array<float, 3> near_color{0.9f, -0.7f, 0.4f}, far_color{-0.2f, 0.3f, 1.0f};
  const GaussianCloud two = cloud_of({gaussian({0, 0, 2}, {0.4, 0.4, 1e-4}, 0.5, near_color),
                                      gaussian({0, 0, 4}, {4, 4, 1e-4}, 0.9, far_color)}),
                      faint = cloud_of({gaussian({0, 0, 2}, {0.4, 0.4, 1e-4}, 0.008, near_color)});
  RenderConfig config = all_outputs();
  config.composite = Composite::hard_depth;
  config.background = {0.1, 0.2, 0.3};
  // A wall behind the camera leaves the pixel without a mesh.
  for (const float z : {2.94f, 2.95f, -1.0f}) {
    const OneMesh mesh = wall_mesh(z, 5, {1, 0.5f, 0});
    const bool covered = z > 0;
    const std::array<double, 3>& under = covered ? wall : background;
    for (const bool dropped : {false, true}) {
      const bool shown = !dropped && (!covered || static_cast<double>(z) > 2.8 / 0.95);
      const double depth = shown ? 2.8 / 0.95 : covered ? static_cast<double>(z) : 0.0;
      render_everywhere(
          {dropped ? &faint : &two}, axis_camera(), config,
          [&](const auto& f, const auto&) {
            const std::size_t p = kAxisPixel;
            for (std::size_t c = 0; c < 3; ++c) {
              const double over = 0.5 * color(near_color[c]) + 0.45 * color(far_color[c]);
              const double want = shown ? over + 0.05 * under[c] : under[c];
              CHECK(std::abs(static_cast<double>(f.rgb[3 * p + c]) - want) < 1e-6);
            }
            const double alpha = covered ? 1.0 : shown ? 0.95 : 0.0;
            CHECK(std::abs(static_cast<double>(f.alpha[p]) - alpha) < 1e-6);
            for (const auto* image :
                 {&f.median_depth, &f.expected_depth, &f.accumulated_depth, &f.first_hit_depth})
              CHECK(std::abs(static_cast<double>((*image)[p]) - depth) < 2e-6);
          },
          mesh.instances);
    }
  }
}

TEST_CASE("N50_mesh_straddle_cloud") {
  const GaussianCloud cloud = random_cloud(50, {.count = 10000,
                                                .sh_degree = 1,
                                                .needle = 0.1,
                                                .scale = 0.03,
                                                .center = {0, 0, 3},
                                                .extent = 1.2});
  SurfaceMesh ball = sphere(0.7, 48, 24);
  ball.base_color = {0.8f, 0.1f, 0.05f};
  const OneMesh mesh(ball, {{}, {0.1, 0, 3}, 1});
  Camera camera = axis_camera(129, 110);
  camera.near_plane = 0.2;
  const eval::OracleMesh truth_mesh = planes(mesh.instances, camera);
  const eval::OracleFrames truth = merged_truth({&cloud}, camera, all_outputs(), truth_mesh);
  std::size_t sure = 0;
  for (const std::uint8_t u : truth.undecided) sure += u == 0 ? 1 : 0;
  CHECK(sure > truth.undecided.size() * 97 / 100);
  render_everywhere(
      {&cloud}, camera, all_outputs(),
      [&](const auto& f, const auto& renderer) {
        CHECK(difference(f, truth).largest < renderer.bound(1.0 / 510, 1e-9));
        CHECK(largest_depth_error(f.median_depth, truth.median_depth, truth) <
              renderer.bound(1e-3, 1e-9));
        CHECK(largest_depth_error(f.expected_depth, truth.expected_depth, truth) <
              renderer.bound(1e-3, 1e-9));
        CHECK(largest_depth_error(f.first_hit_depth, truth.first_hit_depth, truth) <
              renderer.bound(1e-3, 1e-9));
      },
      mesh.instances);
  // Habitat-GS's rule on the same scene.
  RenderConfig hard = all_outputs();
  hard.composite = Composite::hard_depth;
  render_everywhere(
      {&cloud}, camera, hard,
      [&](const auto& f, const auto& renderer) {
        const Difference d = difference(f, truth);
        if (renderer.name() == "serial double") {
          MESSAGE("hard_depth: " << d.psnr << " dB, largest " << d.largest
                                 << ", wrong by more than 0.1: " << 100 * d.wrong << " %");
        }
        CHECK(d.psnr < 35);
        CHECK(d.largest > 0.1);
      },
      mesh.instances);
}

TEST_CASE("N51_avatar_touching_wall") {
  // A shell that a wall cuts: of Gaussians, in one sorted list; and of a mesh.
  const GaussianCloud body = shell(51, {0, 0, 2.8}, 0.6, 3000), wall = wall_of_disks(52, 3, 1.6, 2500);
  const Camera camera = axis_camera(97, 80);
  const OneMesh mesh = wall_mesh(2.4f, 1.6f, {0.1f, 0.3f, 0.9f});
  const eval::OracleMesh none, cut = planes(mesh.instances, camera);
  const auto check = [&](const std::vector<Placed>& scene, const eval::OracleMesh& truth_mesh,
                         const std::vector<MeshInstance>& meshes) {
    const eval::OracleFrames truth = merged_truth(scene, camera, all_outputs(), truth_mesh);
    render_everywhere(
        scene, camera, all_outputs(),
        [&](const auto& f, const auto& renderer) {
          CHECK(difference(f, truth).largest < renderer.bound(1.0 / 510, 1e-9));
          CHECK(largest_depth_error(f.median_depth, truth.median_depth, truth) <
                renderer.bound(1e-3, 1e-9));
        },
        meshes);
    if (meshes.empty()) return;
    RenderConfig hard = all_outputs();
    hard.composite = Composite::hard_depth;
    CaseRenderer<double, SerialBackend> renderer("serial double");
    const Difference d = difference(renderer.render(scene, {camera}, hard, meshes), truth);
    MESSAGE("hard_depth: " << d.psnr << " dB, largest " << d.largest
                           << ", wrong by more than 0.1: " << 100 * d.wrong << " %");
    CHECK(d.largest > 1.0 / 510);
  };
  check({&wall, &body}, none, {});
  check({&body}, cut, mesh.instances);
}

TEST_CASE("N53_tile_max_mesh_cull") {
  const GaussianCloud cloud = random_cloud(
      53,
      {.count = 6000, .sh_degree = 0, .needle = 0.2, .scale = 0.04, .center = {0, 0, 3}, .extent = 2});
  const OneMesh mesh = wall_mesh(2.6f, 0.8f, {0.5f, 0.5f, 0.5f});
  const Camera camera = axis_camera(120, 90);
  for_each_backend([&](auto& renderer) {
    using R = std::remove_reference_t<decltype(renderer)>;
    using S = typename R::scalar;
    auto& backend = renderer.backend();
    using B = std::remove_reference_t<decltype(backend)>;
    const GaussianArrays<B> arrays(backend, cloud);
    const MeshArrays<B> mesh_arrays(backend, mesh.instances[0].mesh);
    const MeshInstance instance = mesh_arrays.instance();
    const GaussianSet set = arrays.set();
    RenderWorkspace<S, B> ws(backend);
    REQUIRE(draw_meshes<S>(backend, ws.mesh, {&instance, 1}, camera, {}, 16, true).ok());
    const std::vector<S> nothing(ws.mesh.tile_far.size(), std::numeric_limits<S>::infinity());
    Buffer<S, B> no_cull(backend), image(backend);
    no_cull.upload(nothing.data(), nothing.size());
    const std::size_t pixels = 120 * 120;
    std::array<std::vector<S>, 2> images;
    std::array<RenderStats, 2> stats;
    for (std::size_t i = 0; i < 2; ++i) {
      image.resize_discard(8 * pixels);
      S* const p = image.data();
      const FrameImages<S> out{
          p, p + 3 * pixels, p + 4 * pixels, p + 5 * pixels, p + 6 * pixels, p + 7 * pixels};
      const MeshLayer<S> layer{
          ws.mesh.depth.data(), ws.mesh.color.data(),
          i == 0 ? std::as_const(ws.mesh.tile_far).view() : std::as_const(no_cull).view()};
      REQUIRE(
          detail::render_frame<S>(backend, ws, {&set, 1}, camera, all_outputs(), layer, out, stats[i])
              .ok());
      images[i].resize(8 * pixels);
      image.download(images[i].data(), 8 * pixels);
      REQUIRE(backend.synchronize().ok());
    }
    record_hashes<S>({{"all planes", &images[0]}}, renderer.name());
    CHECK(images[0] == images[1]);
    CHECK(stats[0].tile_intersections < stats[1].tile_intersections * 9 / 10);
  });
}

TEST_CASE("N53_tile_max_mesh_cull of chunks, before they are projected") {
  // Rooms behind a wall with a window, sorted in space, some placed; small and large Gaussians.
  const GaussianCloud rooms = sorted(random_cloud(
      531,
      {.count = 30000, .sh_degree = 1, .needle = 0, .scale = 0.02, .center = {0, 0, 9}, .extent = 5}));
  const GaussianCloud large = sorted(random_cloud(
      532, {.count = 1500, .sh_degree = 1, .scale = 0.3, .center = {0, 0, 6}, .extent = 4}));
  const GaussianCloud placed = sorted(random_cloud(533, {.count = 4000, .sh_degree = 0, .scale = 0.05}));
  const Similarity place{{0.8, 0.2, -0.5, 0.26457513110645907}, {0.3, -0.2, 4}, 1.5};
  // Chunks beside the window that the wall cuts: none of them is hidden.
  const GaussianCloud cut = sorted(random_cloud(
      534, {.count = 1500, .sh_degree = 0, .scale = 0.04, .center = {-2.2, 0, 2.9}, .extent = 0.4}));
  SurfaceMesh wall;
  wall.two_sided = true;
  for (const auto& [x0, x1] : {std::pair{-9.0f, 0.4f}, std::pair{0.9f, 9.0f}}) {
    const auto first = static_cast<std::uint32_t>(wall.geometry.vertices.size());
    for (const Vec3f& v : {Vec3f{x0, -9, 3}, Vec3f{x1, -9, 3}, Vec3f{x1, 9, 3}, Vec3f{x0, 9, 3}})
      wall.geometry.vertices.push_back(v);
    wall.geometry.triangles.push_back({first, first + 1, first + 2});
    wall.geometry.triangles.push_back({first, first + 2, first + 3});
  }
  const OneMesh mesh(wall);
  RenderConfig config = all_outputs();
  config.tuning.tile_size = 16;  // every renderer counts the same tiles
  for (const double f : {30.0, 64.0, 200.0}) {
    const Camera camera = axis_camera(90, f);
    CaseRenderer<float, SerialBackend> reference("serial float");
    const std::vector<Placed> scene{&rooms, &large, {&placed, place}, &cut};
    const auto all =
        reference.render(scene, {camera}, config, mesh.instances);  // which projects every chunk
    for_each_renderer([&](auto& renderer) {
      using R = std::remove_reference_t<decltype(renderer)>;
      if constexpr (R::is_float) {
        const auto some = renderer.render(scene, {camera}, config, mesh.instances);
        CHECK(some.rgb == all.rgb);
        CHECK(some.median_depth == all.median_depth);
        CHECK(some.expected_depth == all.expected_depth);
        if (!some.stats.empty())
          CHECK(some.stats[0].tile_intersections == all.stats[0].tile_intersections);
        if (renderer.name().find("openmp") == 0)
          CHECK(some.stats[0].visible < all.stats[0].visible * 9 / 10);
      }
    });
  }
}

TEST_CASE("a mesh out of view changes no bit, whatever is asked for") {
  const GaussianCloud cloud = random_cloud(
      54,
      {.count = 3000, .sh_degree = 1, .needle = 0.2, .scale = 0.05, .center = {0, 0, 3}, .extent = 2});
  const OneMesh mesh = wall_mesh(-2, 1, {1, 1, 1});
  int turn = 0;
  for (const unsigned outputs : {unsigned{kRgb}, unsigned{kAlpha}, unsigned{kMedianDepth},
                                 kRgb | kMedianDepth, kRgb | kAlpha | kAnyDepth}) {
    ++turn;
    for (int rules = 0; rules < 4; ++rules) {
      if (kSanitized && rules % 2 == turn % 2) continue;  // device code is emulated there
      RenderConfig config;
      config.outputs = outputs;
      config.background = {0.1, 0.2, 0.3};
      if (rules == 1) config.response = Response::ray;
      if (rules == 2) config.compat = Compat::inria;
      if (rules == 3) config.tuning.tile_size = 32;
      for_each_renderer([&](auto& renderer) {
        const auto with = renderer.render({&cloud}, {axis_camera(75)}, config, mesh.instances);
        const auto without = renderer.render({&cloud}, {axis_camera(75)}, config);
        for (const auto image : every_image(with)) CHECK(with.*image == without.*image);
      });
    }
  }
}

TEST_CASE("frames with a mesh: every output alone, every rule, batches and threads") {
  const GaussianCloud cloud =
      random_cloud(55,
                   {.count = kSanitized ? 2500 : 5000,  // device code is emulated there
                    .sh_degree = 1,
                    .needle = 0.2,
                    .scale = 0.05,
                    .center = {0, 0, 3},
                    .extent = 2});
  constexpr int kSize = kSanitized ? 67 : 83;  // more than lists of regions draw
  SurfaceMesh ball = sphere(0.8, 32, 16);
  const OneMesh mesh(ball, {{}, {0.2, 0.1, 3}, 1});
  for (int rules = 0; rules < 4; ++rules) {
    RenderConfig config = all_outputs();
    if (rules == 1) config.response = Response::tangent_plane;
    if (rules == 2) config.compat = Compat::habitat_gs;
    if (rules == 3) config.composite = Composite::hard_depth;
    render_everywhere(
        {&cloud}, axis_camera(kSize), config,
        [&](const auto& all, auto& renderer) {
          for (const unsigned output :
               {kRgb, kAlpha, kMedianDepth, kExpectedDepth, kAccumulatedDepth, kFirstHitDepth}) {
            RenderConfig alone = config;
            alone.outputs = output;
            const auto f = renderer.render({&cloud}, {axis_camera(kSize)}, alone, mesh.instances);
            for (const auto image : every_image(f))
              CHECK(((f.*image).empty() || f.*image == all.*image));
          }
          std::vector<Camera> batch(7, axis_camera(kSize));
          for (std::size_t i = 0; i < batch.size(); ++i) batch[i].cx += static_cast<double>(i) - 3;
          const auto many = renderer.render({&cloud}, batch, config, mesh.instances);
          CHECK(std::equal(all.rgb.begin(), all.rgb.end(), many.rgb.begin() + 3 * 3 * kSize * kSize));
        },
        mesh.instances);
  }
}

TEST_CASE("moved instances, no Gaussians, and a backend with a form of its own of one stage") {
  SerialBackend serial;
  MeshScene scene;
  scene.add(sphere(0.5, 64, 32)).value();
  BasicRenderer<float, SerialBackend> renderer(serial);
  for (const double x : {-0.4, 0.0, 0.7}) {
    const MeshInstance instance = scene.instance(0, {{}, {x, 0, 3}, 1});
    renderer.set_meshes({&instance, 1});
    const auto f = renderer.render({}, std::vector<Camera>{axis_camera()}).value();
    record_hashes(f, "serial float");
    const std::size_t at =
        kAxisMiddle * kAxisSize + static_cast<std::size_t>(std::lround(kAxisMiddle + 64 * x / 3));
    CHECK(f.alpha[at] == 1);
    const double z = 3 * (1 - 0.5 / std::sqrt(9 + x * x));  // where the ray through its centre meets it
    CHECK(static_cast<double>(f.median_depth[at]) == doctest::Approx(z).epsilon(0.003));
    CHECK(f.alpha[kAxisMiddle * kAxisSize] == 0);
    CHECK(f.stats[0].meshes.triangles == scene.mesh(0).geometry.triangles.size());
  }
  // Blending with meshes is another stage than blending without: its generic form runs.
  struct OwnBlending : SerialBackend {
    void run(stage::Blend, const RasterArgs<float>&) {}
  } own;
  BasicRenderer<float, OwnBlending> other(own);
  const MeshInstance instance = scene.instance(0, {{}, {0, 0, 3}, 1});
  renderer.set_meshes({&instance, 1});
  other.set_meshes({&instance, 1});
  const std::vector<Camera> cameras{axis_camera()};
  const auto expected = renderer.render({}, cameras).value();
  const auto frames = other.render({}, cameras).value();
  record_hashes(expected, "serial float");
  CHECK(expected.alpha[kAxisPixel] == 1);
  CHECK(frames.rgb == expected.rgb);
  CHECK(frames.alpha == expected.alpha);
  CHECK(frames.median_depth == expected.median_depth);
}
