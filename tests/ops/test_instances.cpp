// SPDX-License-Identifier: Apache-2.0
// Things that move as a whole among others, and ids of what a pixel shows.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <vector>

#include "eval/oracle_support.hpp"
#include "gsnav/detail/scene/edit_cloud.hpp"
#include "ops/mesh_images.hpp"
#include "support/compiled_frames.hpp"
#include "support/scenes.hpp"
#include "support/semantic_labels.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

Camera small_camera() { return Camera::look_at({0, 0, 0}, {0, 0, 1}, {0, 1, 0}, 64, 48, 60); }

GaussianCloud one_disk(double z, double opacity) {
  GaussianCloudBuilder builder(0);
  RawGaussian g;
  g.mean = {0, 0, z};
  g.quat = {1, 0, 0, 0};
  g.log_scales = {std::log(8.0), std::log(8.0), std::log(1e-4)};
  g.opacity_logit = std::log(opacity / (1 - opacity));
  builder.add(g);
  return builder.cloud();
}

Similarity random_place(Rng& rng) {
  Quatd q{rng.normal(), rng.normal(), rng.normal(), rng.normal()};
  normalize(q);
  return {q, {rng.uniform(-0.3, 0.3), rng.uniform(-0.3, 0.3), rng.uniform(3, 4)}, rng.uniform(0.7, 1.4)};
}

template <class F>
void for_each_host(const F& f) {
  SerialBackend serial;
  f(serial, float{}, "serial<float>");
  f(serial, double{}, "serial<double>");
#if defined(_OPENMP)
  OpenMPBackend openmp(2);
  f(openmp, float{}, "openmp");
#endif
}

template <class S, class B>
Frames<S> render_with_meshes(B& backend, const std::vector<GaussianSet>& sets,
                             const std::vector<MeshInstance>& meshes, const Camera& camera) {
  BasicRenderer<S, B> renderer(backend, {});
  renderer.set_meshes(meshes);
  return renderer.render(sets, std::vector<Camera>{camera}).value();
}

template <class S, class B>
SemanticLabels labels_of(B& backend, const std::vector<GaussianSet>& sets,
                         const std::vector<MeshInstance>& meshes) {
  return semantic_labels<S>(backend, std::span(sets), meshes, small_camera());
}

}  // namespace

TEST_CASE("a moved object of SH degree 3 looks as the same cloud with its coefficients turned") {
  // transform() turns coefficients by each band's matrix; a placed set turns the view direction.
  const GaussianCloud object =
      random_cloud(3, {.count = 400, .sh_degree = 3, .scale = 0.04, .center = {}, .extent = 0.5});
  const GaussianCloud room = random_cloud(4, {.count = 300, .sh_degree = 1, .center = {0, 0, 5}});
  Rng rng(9);
  for (int k = 0; k < 4; ++k) {
    const Similarity first = random_place(rng), second = random_place(rng);
    GaussianCloud a = object, b = object;
    transform(a, first);
    transform(b, second);
    for_each_host([&](auto& backend, auto scalar, const char* name) {
      using S = decltype(scalar);
      CAPTURE(name);
      // The same arrays twice in one frame, at two places.
      std::vector<GaussianSet> placed{room.set(), object.set(), object.set()};
      placed[1].world_from_asset = first;
      placed[2].world_from_asset = second;
      const std::vector<GaussianSet> baked{room.set(), a.set(), b.set()};
      const Frames<S> f = render<S>(backend, placed, small_camera()),
                      g = render<S>(backend, baked, small_camera());
      // The baked cloud's means, axes and coefficients were rounded to float: a splat in a few thousand
      // pixels is drawn a little otherwise at its edge, where alpha is 1/255.
      const ImageError e = image_error(f.rgb, g.rgb, 3);
      CHECK(e.p999 < 1e-4);
      CHECK(e.max < 0.02);
      CHECK(e.psnr > 75);
    });
  }
}

TEST_CASE("a moved mesh among Gaussians is where its vertices would have been moved to") {
  const GaussianCloud room =
      random_cloud(5, {.count = 600, .sh_degree = 1, .center = {0, 0, 4}, .extent = 1});
  SurfaceMesh ball = sphere(0.5, 24, 12);
  ball.base_color = {0.7f, 0.2f, 0.1f};
  Rng rng(10);
  for (int k = 0; k < 4; ++k) {
    const Similarity first = random_place(rng), second = random_place(rng);
    SurfaceMesh moved[2] = {ball, ball};
    for (Vec3f& v : moved[0].geometry.vertices) v = vec_cast<float>(first * vec_cast<double>(v));
    for (Vec3f& v : moved[1].geometry.vertices) v = vec_cast<float>(second * vec_cast<double>(v));
    MeshScene once, twice;
    once.add(ball).value();
    twice.add(moved[0]).value();
    twice.add(moved[1]).value();
    for_each_host([&](auto& backend, auto scalar, const char* name) {
      using S = decltype(scalar);
      CAPTURE(name);
      const Frames<S> f = render_with_meshes<S>(
          backend, {room.set()}, {once.instance(0, first, 1), once.instance(0, second, 2)},
          small_camera());
      const Frames<S> g = render_with_meshes<S>(
          backend, {room.set()}, {twice.instance(0, {}, 1), twice.instance(1, {}, 2)}, small_camera());
      // Corners rounded to float may leave a pixel centre on the other side of an edge.
      const ImageError e = image_error(f.rgb, g.rgb, 3);
      CHECK(e.p999 < 5e-3);
      std::size_t other = 0;
      for (std::size_t p = 0; p < f.median_depth.size(); ++p)
        other += std::abs(static_cast<double>(f.median_depth[p] - g.median_depth[p])) > 1e-3 ? 1 : 0;
      CHECK(other <= 3);
    });
  }
}

TEST_CASE("semantic ids are of what has most of a pixel, by hand") {
  // Layers at 2 and 2.5 m before a mesh at 3 m; the first has a, the second (1 - a) b, the mesh what is
  // left.
  SurfaceMesh wall = quad({-9, -9, 3}, {9, -9, 3}, {9, 9, 3}, {-9, 9, 3});
  wall.base_color = {1, 0.5f, 0.2f};
  const OneMesh mesh(wall, {}, 123);
  struct Case {
    double a, b;
    std::uint32_t with_mesh, without;
    double weight;
  };
  for (const Case& c : {Case{0.45, 0.4, 1, 1, 0.45}, Case{0.3, 0.6, 2, 2, 0.42},
                        Case{0.3, 0.35, 3, 1, 0.455}, Case{0.2, 0.25, 3, 0, 0.6}}) {
    const GaussianCloud front = one_disk(2, c.a), back = one_disk(2.5, c.b), behind = one_disk(4, 0.9);
    for_each_host([&](auto& backend, auto scalar, const char* name) {
      using S = decltype(scalar);
      CAPTURE(name);
      CAPTURE(c.a);
      const std::size_t p = 24 * 64 + 32;
      const SemanticLabels f = labels_of<S>(backend, {front.set(), back.set()}, mesh.instances);
      CHECK(f.labels[p] == static_cast<float>(c.with_mesh));
      CHECK(static_cast<double>(f.weights[p]) ==
            doctest::Approx(c.weight).epsilon(2e-3));  // a disk is 8 m wide
      CHECK(labels_of<S>(backend, {front.set(), back.set()}, {}).labels[p] ==
            static_cast<float>(c.without));
      // What the mesh hides has no part, whatever its opacity; two more sets make a second pass.
      const SemanticLabels more = labels_of<S>(
          backend, {behind.set(), behind.set(), behind.set(), front.set(), back.set()}, mesh.instances);
      CHECK(more.labels[p] == static_cast<float>(c.with_mesh + 3));
    });
  }
  SerialBackend serial;
  const SemanticLabels alone = labels_of<float>(serial, {}, mesh.instances);
  CHECK(alone.labels[24 * 64 + 32] == 1);
  CHECK(std::abs(alone.weights[24 * 64 + 32] - 1.0f) < 2e-7f);
}

TEST_CASE(
    "semantic ids and weights are those of float64 blending, five clouds and two meshes through one "
    "another") {
  std::vector<GaussianCloud> clouds;
  for (std::uint64_t k = 0; k < 5; ++k) {
    clouds.push_back(random_cloud(20 + k, {.count = 250,
                                           .sh_degree = 2,
                                           .center = {0.5 * static_cast<double>(k) - 1, 0, 3.5},
                                           .extent = 0.8}));
  }
  SurfaceMesh ball = sphere(0.6, 32, 16);
  ball.base_color = {0.8f, 0.1f, 0.05f};
  MeshScene scene;
  scene.add(ball).value();
  const std::vector<MeshInstance> meshes{scene.instance(0, {{}, {-0.5, 0.1, 2.9}, 1}, 5),
                                         scene.instance(0, {{}, {0.7, -0.1, 2.9}, 0.8}, 5)};
  std::vector<GaussianSet> sets;
  for (const GaussianCloud& c : clouds) sets.push_back(c.set());

  // The oracle, once a set, which alone is white before black ones and a black mesh.
  SerialBackend serial;
  std::vector<MeshInstance> told_apart = meshes;
  told_apart[1].id = 6;
  const auto drawn = draw<double>(serial, told_apart, small_camera());
  eval::OracleMesh planes{drawn.depth, std::vector<double>(drawn.color.size(), 0.0)};
  eval::OracleConfig config;
  config.mesh = &planes;
  const std::size_t pixels = drawn.depth.size();
  std::vector<std::vector<double>> weights;
  std::vector<bool> undecided(pixels, false);
  for (std::size_t k = 0; k < clouds.size(); ++k) {
    std::vector<GaussianCloud> painted = clouds;
    std::vector<GaussianSet> painted_sets;
    for (std::size_t i = 0; i < painted.size(); ++i) {
      painted[i].sh_degree = 0;
      painted[i].shN.clear();
      painted[i].sh0.assign(painted[i].sh0.size(), (i == k ? 0.5f : -0.5f) / 0.28209479177387814f);
      painted_sets.push_back(painted[i].set());
    }
    const eval::OracleFrames truth = oracle(painted_sets, small_camera(), config);
    auto& w = weights.emplace_back();
    for (std::size_t p = 0; p < pixels; ++p) {
      w.push_back(truth.rgb[3 * p]);
      if (truth.undecided[p] != 0) undecided[p] = true;
    }
  }
  for_each_host([&](auto& backend, auto scalar, const char* name) {
    using S = decltype(scalar);
    CAPTURE(name);
    const SemanticLabels f = labels_of<S>(backend, sets, meshes);
    double largest = 0;
    std::size_t wrong = 0, checked = 0;
    std::array<std::size_t, 8> seen{};
    for (std::size_t p = 0; p < pixels; ++p) {
      if (undecided[p]) continue;
      std::vector<double> w{0};
      double sum = 0;
      for (const auto& of : weights) w.push_back(of[p]), sum += of[p];
      w.push_back(0), w.push_back(0);
      if (drawn.instance[p] != kNoInstance)
        w[1 + clouds.size() + drawn.instance[p] - 5] = 1 - sum, sum = 1;
      std::size_t best = 0;
      for (std::size_t i = 1; i < w.size(); ++i) best = w[i] > w[best] ? i : best;
      double next = 0;
      for (std::size_t i = 1; i < w.size(); ++i) next = i != best ? std::max(next, w[i]) : next;
      if (w[best] - next < 1e-3 || std::abs(sum - 0.5) < 1e-3) continue;  // a matter of rounding
      const std::size_t want = sum < 0.5 ? 0 : best;
      ++checked;
      ++seen[want];
      wrong += f.labels[p] == static_cast<float>(want) ? 0 : 1;
      if (want > 0) largest = std::max(largest, std::abs(static_cast<double>(f.weights[p]) - w[want]));
    }
    std::printf("%s: %zu pixels, %zu wrong labels, weights off by %.1e at most\n", name, checked, wrong,
                largest);
    CHECK(checked > 2000);
    CHECK(wrong == 0);
    CHECK(largest < (sizeof(S) == 4 ? 1.0 / 510 : 1e-6));
    for (std::size_t label = 1; label < seen.size(); ++label) CHECK(seen[label] > 0);
  });
}
