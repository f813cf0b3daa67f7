// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "gsnav/core/rng.hpp"
#include "gsnav/detail/core/field_check.hpp"
#include "gsnav/detail/demo/default_scene.hpp"
#include "gsnav/detail/image/field_of_view.hpp"
#include "gsnav/detail/image/validate_camera.hpp"
#include "gsnav/detail/open/open_scene.hpp"
#include "gsnav/detail/scene/placed_meshes.hpp"
#include "gsnav/detail/scene/views_around.hpp"
#include "gsnav/nav/navmesh.hpp"
#include "scene_source.hpp"

namespace gsnav {
namespace {

constexpr double kEyeHeight = 1.5;

/// The point, among random ones on the largest island, with the longest straight walk, and the end of
/// that walk.
std::pair<Vec3d, Vec3d> longest_view(const NavMesh& mesh) {
  constexpr std::size_t kPlaces = 48;
  Rng rng(1);
  std::vector<Vec3d> places;
  for (std::size_t i = 0; i < kPlaces; ++i) places.push_back(mesh.random_point(rng, 0).position);
  std::vector<std::pair<double, std::pair<std::size_t, std::size_t>>> pairs;
  for (std::size_t i = 0; i < kPlaces; ++i) {
    for (std::size_t k = 0; k < i; ++k) pairs.push_back({norm(places[i] - places[k]), {i, k}});
  }
  std::sort(pairs.rbegin(), pairs.rend());
  for (const auto& [distance, ends] : pairs) {
    const auto way = mesh.find_path(places[ends.first], places[ends.second]);
    if (way && way->length <= 1.001 * distance) return {places[ends.first], places[ends.second]};
  }
  return {places[0], places[0] + Vec3d{0, 0, -1}};
}

/// Box of a scene's meshes in the world.
Aabb<double> box_of(const std::vector<SceneMesh>& meshes) {
  Aabb<double> box;
  for (const SceneMesh& mesh : meshes) {
    for (const TexturedScene::Instance& i : mesh.surface->instances) {
      const Similarity placed = mesh.world_from_surface * i.world_from_part;
      for (const Vec3f& v : mesh.surface->meshes.mesh(i.part).geometry.vertices)
        box.add(placed * vec_cast<double>(v));
    }
  }
  return box;
}

Status validate(const OpenedScene& scene, int width, int height, double hfov) {
  const auto bad = [](const std::string& what) { return Status(Errc::invalid_argument, what); };
  if (width < 1 || height < 1 || width > kMaxImageSide || height > kMaxImageSide)
    return bad("an image of " + std::to_string(width) + " x " + std::to_string(height) +
               " pixels: sides must be in [1, 16384]");
  if (Status s = detail::validate_hfov("", hfov); !s) return s;
  const auto drawn = [](const SceneMesh& mesh) {
    return std::ranges::any_of(mesh.surface->instances, [&](const TexturedScene::Instance& i) {
      return !mesh.surface->meshes.mesh(i.part).geometry.vertices.empty();
    });
  };
  if (scene.scene == nullptr ||
      (scene.scene->assets.empty() && !std::ranges::any_of(scene.scene->meshes, drawn)))
    return bad("the scene has nothing to look at");
  return {};
}

}  // namespace

Result<std::vector<Camera>> views_around(const OpenedScene& scene, int count, int width, int height,
                                         double hfov) {
  if (Status s = validate(scene, width, height, hfov); !s) return s;
  detail::FieldCheck check("views_around: ");
  if (const Status s = check.in("count", count, 1, 100'000).status(); !s) return s;
  const Vec3d up = scene.up == "keep" ? scene.report.up : Vec3d{0, 1, 0};
  std::vector<Camera> out;
  if (scene.scene->assets.empty()) {
    out = views_around(box_of(scene.scene->meshes), up, count, width, height);
  } else {
    const SceneAsset& asset = scene.scene->assets.front();
    Similarity turn;
    turn.rotation = inverse(asset.world_from_asset).rotation;
    const Vec3d up_in_file = turn * up;
    out = asset.cloud != nullptr ? views_around(*asset.cloud, up_in_file, count, width, height)
                                 : views_around(scene.report.bounds, up_in_file, count, width, height);
    for (Camera& camera : out) {
      if (scene.up == "keep") break;  // they are in the world's frame already
      const Affine3<double> stands = rigid_inverse(camera.viewmat);
      const Vec3d ahead = stands.translation + stands.linear.column(2);
      camera = Camera::look_at(asset.world_from_asset * stands.translation,
                               asset.world_from_asset * ahead, up, width, height, hfov);
    }
  }
  for (Camera& camera : out) camera.set_hfov(width, height, hfov);
  return out;
}

Result<Camera> framing_camera(const OpenedScene& scene, int width, int height, double hfov) {
  if (Status s = validate(scene, width, height, hfov); !s) return s;
  if (scene.scene->navmesh != nullptr) {
    const auto [eye, target] = longest_view(*scene.scene->navmesh);
    const Vec3d raise{0, kEyeHeight, 0};
    return Camera::look_at(eye + raise, target + raise, {0, 1, 0}, width, height, hfov);
  }
  if (scene.name == detail::kEmbeddedFlat) {
    const DefaultView view = default_scene_views().front();
    return Camera::look_at(view.eye, view.target, {0, 1, 0}, width, height, hfov);
  }
  auto around = views_around(scene, 1, width, height, hfov);
  if (!around) return around.status();
  return around->front();
}

}  // namespace gsnav
