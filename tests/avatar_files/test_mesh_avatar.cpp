// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "avatar_files/bodies.hpp"
#include "avatar_files/zbuffer.hpp"
#include "gsnav/avatar/actor.hpp"
#include "gsnav/avatar/skinned_gaussians.hpp"
#include "gsnav/backends/openmp.hpp"
#include "gsnav/detail/rigging/mesh_avatar.hpp"
#include "gsnav/detail/rigging/mesh_surface.hpp"
#include "gsnav/scene/basic_renderer.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

/// A tapering tube of one colour a ring, on two joints.
SkinnedMesh tube() {
  SkinnedMesh m;
  m.name = "tube";
  m.skeleton.names = {"low", "high"};
  m.skeleton.parents = {-1, 0};
  m.skeleton.rest_local = {{Mat3d::identity(), {0, 0, 0}}, {Mat3d::identity(), {0, 0.5, 0}}};
  m.influences = 2;
  const int around = 24, rings = 20;
  for (int r = 0; r <= rings; ++r) {
    for (int k = 0; k < around; ++k) {
      const double a = 6.283185307179586 * k / around, radius = 0.15 - 0.003 * r,
                   h = static_cast<double>(r) / rings;
      m.positions.push_back({radius * std::cos(a), h, radius * std::sin(a)});
      m.joint_indices.insert(m.joint_indices.end(), {0, 1});
      const float w = static_cast<float>(std::clamp(5 * (h - 0.4), 0.0, 1.0));
      m.weights.insert(m.weights.end(), {1 - w, w});
      m.colors.push_back({h, 0.25, 1 - h});
      if (r == rings) continue;
      const auto v = [&](int ring, int at) {
        return static_cast<std::uint32_t>(ring * around + at % around);
      };
      m.triangles.push_back({v(r, k), v(r + 1, k), v(r, k + 1)});
      m.triangles.push_back({v(r, k + 1), v(r + 1, k), v(r + 1, k + 1)});
    }
  }
  m.materials.emplace_back();
  return m;
}

/// The mesh's vertices posed by joint matrices (joint to root frame times inverse bind, [J]).
std::vector<Vec3d> skinned_vertices(const SkinnedMesh& mesh,
                                    const std::vector<Affine3<double>>& joints) {
  std::vector<Vec3d> out(mesh.positions.size());
  for (std::size_t v = 0; v < out.size(); ++v) {
    for (std::size_t k = v * mesh.influences; k < (v + 1) * mesh.influences; ++k) {
      if (mesh.weights[k] > 0)
        out[v] +=
            (joints[mesh.joint_indices[k]] * mesh.positions[v]) * static_cast<double>(mesh.weights[k]);
    }
  }
  return out;
}

/// What a picture of the avatar is beside one of the mesh.
struct Comparison {
  double union_share = 0;  // of pixels that both cover, of those that one does
  double holes = 0;        // share of inner pixels of the mesh with alpha < 0.9
  double color = 0;        // mean absolute difference, inner pixels
  double depth_p99 = 0;    // metres, inner pixels
  std::size_t inner = 0;
};

Comparison compare(const SkinnedMesh& mesh, const AvatarAsset& asset, const LocalPose& pose,
                   const Camera& camera) {
  const auto shared = std::make_shared<const AvatarAsset>(asset);
  const AvatarActor actor = AvatarActor::create(shared, std::make_shared<const FixedPose>(pose)).value();
  OpenMPBackend backend;
  SkinnedGaussians<OpenMPBackend> skin(backend, shared);
  skin.pose(actor, 0).throw_if_error();
  RenderConfig config;
  config.outputs = kRgb | kAlpha | kMedianDepth;
  BasicRenderer<float, OpenMPBackend> renderer(backend, config);
  const auto frame = renderer.render(skin.set(), camera).value();
  auto vertices = skinned_vertices(mesh, times_binds(mesh.skeleton, joints_at(mesh.skeleton, pose)));
  for (Vec3d& v : vertices) v += pose.root;
  const MeshImage image = draw_mesh(mesh, vertices, camera);
  Comparison out;
  std::size_t both = 0, either = 0, open = 0;
  std::vector<double> depth;
  for (int j = 0; j < image.height; ++j) {
    for (int i = 0; i < image.width; ++i) {
      const std::size_t at = static_cast<std::size_t>(j * image.width + i);
      const bool a = image.depth[at] > 0, b = frame.alpha[at] > 0.5f;
      both += a && b ? 1 : 0;
      either += a || b ? 1 : 0;
      bool inner = a && i >= 3 && j >= 3 && i + 3 < image.width && j + 3 < image.height;
      for (int dj = -3; inner && dj <= 3; ++dj) {
        for (int di = -3; inner && di <= 3; ++di) {
          const double d = image.depth[static_cast<std::size_t>((j + dj) * image.width + i + di)];
          inner = d > 0 && std::abs(d - image.depth[at]) < 0.05;
        }
      }
      if (!inner) continue;
      ++out.inner;
      open += frame.alpha[at] < 0.9f ? 1 : 0;
      for (int c = 0; c < 3; ++c) {
        out.color += std::abs(static_cast<double>(frame.rgb[3 * at + static_cast<std::size_t>(c)]) -
                              image.rgb[at][c]) /
                     3;
      }
      depth.push_back(std::abs(static_cast<double>(frame.median_depth[at]) - image.depth[at]));
    }
  }
  out.union_share = static_cast<double>(both) / static_cast<double>(std::max<std::size_t>(1, either));
  out.holes = static_cast<double>(open) / static_cast<double>(std::max<std::size_t>(1, out.inner));
  out.color /= static_cast<double>(std::max<std::size_t>(1, out.inner));
  std::sort(depth.begin(), depth.end());
  if (!depth.empty()) out.depth_p99 = depth[depth.size() * 99 / 100];
  return out;
}

}  // namespace

TEST_CASE("mesh avatar: Gaussians lie on the surface, spread evenly, with its colours and weights") {
  const SkinnedMesh mesh = tube();
  MeshAvatarOptions options;
  options.gaussians = 20000;
  const MeshAvatar a = make_mesh_avatar(mesh, options).value();
  MESSAGE(a.asset.size() << " Gaussians for 20000 asked, " << 1e3 * a.spacing << " mm apart");
  CHECK(a.asset.size() > 18000);
  CHECK(a.asset.size() < 22000);
  CHECK(a.area == doctest::Approx(6.283185307 * 0.12 * 1.0).epsilon(0.02));
  CHECK(a.weights.most_weights == 2);
  double off = 0, turned = 1, wrong = 0, weight = 0;
  for (std::size_t i = 0; i < a.asset.size(); ++i) {
    const Vec3d p = a.asset.cloud.mean(i);
    const double radius = 0.15 - 0.06 * p.y;
    off = std::max(off, std::abs(std::hypot(p.x, p.z) - radius));
    const Quatd q{a.asset.cloud.quats[0][i], a.asset.cloud.quats[1][i], a.asset.cloud.quats[2][i],
                  a.asset.cloud.quats[3][i]};
    turned = std::min(turned, dot(rotate(q, Vec3d{0, 0, 1}), normalized(Vec3d{p.x, 0, p.z})));
    const double red = 0.5 + 0.28209479177387814 * static_cast<double>(a.asset.cloud.sh0[3 * i]);
    wrong = std::max(wrong, std::abs(linear_from_srgb(red) - p.y));
    double high = 0;
    for (std::size_t k = 4 * i; k < 4 * i + 4; ++k)
      high += a.asset.joint_indices[k] == 1 ? weight_of_parts(a.asset.skinning_weights[k]) : 0;
    weight = std::max(weight, std::abs(high - std::clamp(5 * (p.y - 0.4), 0.0, 1.0)));
  }
  CHECK(off < 0.15 * (1 - std::cos(3.1416 / 24)) + 1e-3);  // the tube has 24 flat sides
  CHECK(turned > 0.97);
  CHECK(wrong < 1e-5);
  CHECK(weight < 0.03);  // linear between rings, where the formula has corners
  // The same input, the same Gaussians; another seed, others.
  CHECK(make_mesh_avatar(mesh, options).value().asset.cloud.means[0] == a.asset.cloud.means[0]);
  options.seed = 2;
  CHECK(make_mesh_avatar(mesh, options).value().asset.cloud.means[0] != a.asset.cloud.means[0]);
}

TEST_CASE("mesh avatar: a bent tube looks like its mesh") {
  const SkinnedMesh mesh = tube();
  MeshAvatarOptions options;
  options.gaussians = 20000;
  const AvatarAsset asset = make_mesh_avatar(mesh, options).value().asset;
  for (const double degrees : {0.0, 60.0, 90.0}) {
    LocalPose pose = mesh.skeleton.rest_pose();
    pose.rotations[1] = axis_angle(Vec3d{0, 0, 1}, degrees * 0.017453292519943295);
    const Comparison c = compare(
        mesh, asset, pose, Camera::look_at({0.2, 1.2, -1.6}, {-0.1, 0.5, 0}, {0, 1, 0}, 400, 400, 50));
    MESSAGE(degrees << " degrees: outline " << c.union_share << ", holes " << c.holes << ", colour "
                    << c.color << ", depth p99 " << 1e3 * c.depth_p99 << " mm, " << c.inner
                    << " pixels");
    CHECK(c.inner > 10000);
    CHECK(c.union_share > 0.94);  // a Gaussian is drawn wider by half a pixel
    CHECK(c.holes < 1e-3);
    CHECK(c.color < 0.01);
    CHECK(c.depth_p99 < 0.01);
  }
}

TEST_CASE("mesh avatar: what cannot be is refused by name") {
  const auto says = [](const SkinnedMesh& mesh, const MeshAvatarOptions& options, const char* part) {
    const Status s = make_mesh_avatar(mesh, options).status();
    CAPTURE(s.message());
    CHECK(s.code() == Errc::invalid_argument);
    CHECK(s.message().find(part) != std::string::npos);
  };
  const SkinnedMesh good = tube();
  SkinnedMesh bad = good;
  bad.triangles[3][1] = 9999;
  says(bad, {}, "triangle 3 names vertex 9999");
  bad = good;
  bad.weights[7] = 0.9f;
  says(bad, {}, "weights of vertex 3 sum to");
  bad = good;
  bad.positions[5].y = std::nan("");
  says(bad, {}, "vertex 5 is not finite");
  bad = good;
  for (Vec3d& p : bad.positions) p = {};
  says(bad, {}, "no area");
  MeshAvatarOptions options;
  options.gaussians = 10;
  says(good, options, "gaussians");
  options = {};
  options.opacity = 1;
  says(good, options, "opacity");
  options = {};
  options.weights.poses = {{}};
  says(good, options, "a pose of 0 joints");
}

TEST_CASE("mesh avatar: real bodies beside their meshes") {
  struct Case {
    const char* name;
    TestBody body;
  };
  for (Case& c : std::vector<Case>{{"lumberjack", gltf_body("lumberjack.glb")},
                                   {"cesium man", gltf_body("cesium_man.gltf")},
                                   {"makehuman", makehuman_body("female")}}) {
    if (!c.body.ok) continue;
    const SkinnedMesh& mesh = c.body.loaded.mesh;
    MeshAvatarOptions options;
    options.gaussians = 100000;
    LocalPose pose = c.body.loaded.pose;
    if (!c.body.loaded.clips.empty()) {
      options.weights.poses = poses_of(mesh.skeleton, c.body.loaded.clips[0].clip, 4);
      c.body.loaded.clips[0].clip.pose({0.3}, pose);
    }
    const MeshAvatar a = make_mesh_avatar(mesh, options).value();
    const Vec3d middle = pose.root + Vec3d{0, 0.85, 0};
    for (const double side : {-1.0, 1.0}) {
      const Camera camera =
          Camera::look_at(middle + Vec3d{0.6 * side, 0.4, -2.0 * side}, middle, {0, 1, 0}, 480, 480, 55);
      const Comparison r = compare(mesh, a.asset, pose, camera);
      std::printf(
          "%s: %zu Gaussians %.1f mm apart, K = %d off by %.3f mm; outline %.3f, holes %.5f, colour "
          "%.4f, depth p99 "
          "%.1f mm\n",
          c.name, a.asset.size(), 1e3 * a.spacing, a.weights.influences, 1e3 * a.weights.position_error,
          r.union_share, r.holes, r.color, 1e3 * r.depth_p99);
      CHECK(r.inner > 8000);
      CHECK(r.union_share > 0.90);
      CHECK(r.holes < 2e-3);
      CHECK(r.color < 0.04);      // nearest texels against Gaussians of several
      CHECK(r.depth_p99 < 0.03);  // the lumberjack has few vertices: see make_mesh_avatar
    }
  }
}
