// SPDX-License-Identifier: Apache-2.0
// Properties of the image that must hold bit for bit.
#include <doctest/doctest.h>

#include "gsnav/ops/skin.hpp"
#include "ops/backends.hpp"
#include "support/scenes.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

Camera wide_camera() { return Camera::look_at({0, 0, 0}, {0, 0, 4}, {0, -1, 0}, 150, 101, 75); }

template <class S>
bool same(const Frames<S>& a, const Frames<S>& b) {
  return a.rgb == b.rgb && a.alpha == b.alpha && a.median_depth == b.median_depth &&
         a.expected_depth == b.expected_depth && a.accumulated_depth == b.accumulated_depth &&
         a.first_hit_depth == b.first_hit_depth;
}

RenderConfig everything() {
  RenderConfig c;
  c.outputs = kRgb | kAlpha | kAnyDepth;
  return c;
}

}  // namespace

#if defined(_OPENMP)
TEST_CASE("threads do not change a bit, and lanes are the scalar kernels") {
  const GaussianCloud cloud = random_cloud(2, {.count = 20001, .scale = 0.03});
  SerialBackend serial;
  for (const Profile profile : {Profile::exact, Profile::fast}) {
    RenderConfig config = everything();
    config.profile = profile;
    const auto reference = render<float>(serial, {cloud.set()}, wide_camera(), config);
    for (const int threads : {1, 2, 3, 7}) {
      OpenMPBackend openmp(threads);
      CHECK(same(reference, render<float>(openmp, {cloud.set()}, wide_camera(), config)));
    }
  }
}

TEST_CASE("skinning in lanes is the scalar kernel, for any number of threads") {
  Rng rng(40);
  const GaussianCloud cloud = random_cloud(40, {.count = 5003});
  const GaussianView view = cloud.view();
  const std::size_t n = view.size;
  std::vector<Affine3<float>> joints(20);
  for (auto& j : joints) {
    Quatd q{rng.normal(), rng.normal(), rng.normal(), rng.normal()};
    normalize(q);
    j = {mat_cast<float>(rotation_matrix(q)), {static_cast<float>(rng.normal()), 0.5f, -1.0f}};
  }
  std::vector<std::uint16_t> indices(4 * n);
  std::vector<float> weights(4 * n);
  for (std::size_t i = 0; i < 4 * n; ++i) {
    indices[i] = static_cast<std::uint16_t>(rng.below(joints.size()));
    weights[i] = i % 4 == 0 ? 0.55f : 0.15f;
  }
  const auto skinned = [&](auto& backend) {
    std::vector<std::vector<float>> out(11, std::vector<float>(n));
    SkinningArgs<float> args;
    for (std::size_t k = 0; k < 3; ++k) {
      args.means[k] = view.means[k];
      args.means_out[k] = view_of(out[k]);
    }
    for (std::size_t k = 0; k < 4; ++k) {
      args.quats[k] = view.quats[k];
      args.quats_out[k] = view_of(out[3 + k]);
      args.rotations_out[k] = view_of(out[7 + k]);
    }
    args.joint_indices = view_of(std::as_const(indices));
    args.weights = view_of(std::as_const(weights));
    args.joints = view_of(std::as_const(joints));
    REQUIRE(skin_gaussians(backend, args).ok());
    return out;
  };
  SerialBackend serial;
  const auto reference = skinned(serial);
  for (const int threads : {1, 3}) {
    OpenMPBackend openmp(threads);
    CHECK(skinned(openmp) == reference);
  }
}

TEST_CASE("each combination of outputs gives the same images") {
  const GaussianCloud cloud = random_cloud(3, {.count = 2000});
  OpenMPBackend openmp(2);
  const auto all = render<float>(openmp, {cloud.set()}, wide_camera(), everything());
  RenderConfig config;
  config.outputs = kRgb;
  CHECK(render<float>(openmp, {cloud.set()}, wide_camera(), config).rgb == all.rgb);
  config.outputs = kMedianDepth;
  const auto depth = render<float>(openmp, {cloud.set()}, wide_camera(), config);
  CHECK(depth.median_depth == all.median_depth);
  CHECK(depth.rgb.empty());
  config.outputs = kAlpha;
  CHECK(render<float>(openmp, {cloud.set()}, wide_camera(), config).alpha == all.alpha);
  config.outputs = kRgb | kExpectedDepth;
  CHECK(render<float>(openmp, {cloud.set()}, wide_camera(), config).expected_depth == all.expected_depth);
}
#endif

TEST_CASE("a batch is its cameras one by one") {
  const GaussianCloud cloud = random_cloud(4, {.count = 1500});
  SerialBackend serial;
  std::vector<Camera> cameras;
  for (int i = 0; i < 5; ++i) {
    cameras.push_back(Camera::look_at({0.2 * i, 0, 0}, {0, 0, 4}, {0, -1, 0}, 64, 48, 70));
  }
  Renderer<float, SerialBackend> renderer(serial);
  const std::vector<GaussianSet> sets{cloud.set()};
  const auto batch = renderer.render(sets, cameras).value();
  const std::size_t pixels = 64 * 48;
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    const auto one = render<float>(serial, sets, cameras[c]);
    CHECK(std::equal(one.rgb.begin(), one.rgb.end(),
                     batch.rgb.begin() + static_cast<std::ptrdiff_t>(3 * pixels * c)));
    CHECK(std::equal(one.median_depth.begin(), one.median_depth.end(),
                     batch.median_depth.begin() + static_cast<std::ptrdiff_t>(pixels * c)));
  }
}

TEST_CASE("a scene and camera scaled by a power of two give the same image") {
  const GaussianCloud cloud = random_cloud(6, {.count = 1000, .needle = 0.4});
  GaussianCloud scaled = cloud;
  for (auto& plane : scaled.means) {
    for (float& v : plane) v *= 4;
  }
  for (auto& plane : scaled.scales) {
    for (float& v : plane) v *= 4;
  }
  Camera camera = wide_camera(), far = camera;
  camera.viewmat.translation = {0.125, -0.25, 0.5};
  far.viewmat.translation = camera.viewmat.translation * 4.0;
  far.near_plane = 4 * camera.near_plane;
  SerialBackend serial;
  const auto a = render<float>(serial, {cloud.set()}, camera);
  const auto b = render<float>(serial, {scaled.set()}, far);
  CHECK(a.rgb == b.rgb);
  CHECK(a.alpha == b.alpha);
}

TEST_CASE("an asset placed by a similarity looks as the same asset moved by hand") {
  const GaussianCloud cloud = random_cloud(7, {.count = 500, .sh_degree = 3});
  SerialBackend serial;
  const Camera camera = wide_camera();
  // Moving asset and camera together must leave the image (SH directions included) as it was.
  Similarity placement;
  placement.rotation = axis_angle(normalized(Vec3d{1, 2, 3}), 1.1);
  placement.translation = {100, -20, 7};
  placement.scale = 2.5;
  Camera moved = camera;
  const Affine3<double> world_from_camera = rigid_inverse(camera.viewmat);
  Affine3<double> placed;
  placed.linear = rotation_matrix(placement.rotation) * world_from_camera.linear;
  placed.translation = placement * world_from_camera.translation;
  moved.viewmat = rigid_inverse(placed);
  moved.near_plane = camera.near_plane * placement.scale;
  const auto a = render<double>(serial, {cloud.set()}, camera);
  const auto b = render<double>(serial, {cloud.set(placement)}, moved);
  CHECK(image_error(a.rgb, b.rgb, 3).psnr > 120);
  double worst = 0;
  for (std::size_t i = 0; i < a.median_depth.size(); ++i) {
    worst = std::max(worst, std::abs(a.median_depth[i] * placement.scale - b.median_depth[i]));
  }
  CHECK(worst < 1e-6);
}

TEST_CASE("a scene a thousand kilometres away renders as at the origin") {
  const GaussianCloud near = random_cloud(8, {.count = 500});
  const Vec3d shift{1e6, -640000.0, 64.0 * 15000};  // lattice points
  GaussianCloud far = near;
  far.origins = {shift};
  far.origin_ids.assign(far.size(), 0);
  REQUIRE(std::fmod(shift.x, kOriginLattice) == 0.0);
  Camera camera = wide_camera(), moved = camera;
  moved.viewmat.translation = -(camera.viewmat.linear * (camera.position() + shift));
  SerialBackend serial;
  const auto a = render<float>(serial, {near.set()}, camera);
  const auto b = render<float>(serial, {far.set()}, moved);
  CHECK(a.rgb == b.rgb);
  CHECK(a.median_depth == b.median_depth);
}

TEST_CASE("what lies behind a closed pixel changes nothing") {
  GaussianCloudBuilder builder(0);
  RawGaussian wall;
  wall.quat = {1, 0, 0, 0};
  wall.log_scales = {std::log(3.0), std::log(3.0), -20};
  wall.opacity_logit = 100;
  for (int i = 0; i < 9; ++i) {
    wall.mean = {0, 0, 2 + 0.1 * i};
    wall.sh0 = {static_cast<float>(i), 1, 0};
    builder.add(wall);
  }
  const GaussianCloud front = builder.cloud();
  const GaussianCloud behind = random_cloud(10, {.count = 500, .center = {0, 0, 6}});
  SerialBackend serial;
  const Camera camera = wide_camera();
  CHECK(same(render<float>(serial, {front.set()}, camera, everything()),
             render<float>(serial, {front.set(), behind.set()}, camera, everything())));
}
