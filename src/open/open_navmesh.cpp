// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <functional>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "gsnav/core/text.hpp"
#include "gsnav/detail/core/guarded.hpp"
#include "gsnav/detail/core/pool_backend.hpp"
#include "gsnav/detail/demo/people.hpp"
#include "gsnav/detail/io/visible_file.hpp"
#include "gsnav/detail/nav/gaussian_navmesh.hpp"
#include "gsnav/detail/nav/navmesh_file.hpp"
#include "gsnav/detail/nav/viewpoints.hpp"
#include "gsnav/detail/rigging/body_levels.hpp"
#include "gsnav/detail/scene/visible_settings.hpp"
#include "gsnav/device/renderer.hpp"
#include "gsnav/scene/prepare.hpp"
#include "parts.hpp"

namespace gsnav::detail {
namespace {

/// Source of a NavMesh.
struct NavMeshChoice {
  std::string file;        ///< Read this file. Empty: build it.
  bool triangles = false;  ///< Build from triangles only, instead of from Gaussians and triangles.
};

bool names_file(const std::string& navmesh) {
  const std::string name = lower_case(navmesh);
  return name.ends_with(".navmesh") || name.ends_with(".bin");
}

/// Chooses the source of the NavMesh. Empty if there is none or none is wanted.
Result<std::optional<NavMeshChoice>> choose(const OpeningScene& s) {
  const std::string& asked = s.options.navmesh;
  using Choice = std::optional<NavMeshChoice>;
  if (asked == "none") return Choice();
  if (names_file(asked)) return Choice({asked, false});
  if ((asked.empty() || asked == "auto") && !s.source.navmesh.empty())
    return Choice({s.source.navmesh, false});
  if (asked.empty()) return Choice();
  const bool gaussians = !s.scene.assets.empty(), triangles = !s.triangles.triangles.empty();
  const auto bad = [&](const std::string& what) {
    return Status(Errc::invalid_argument, "OpenOptions.navmesh = " + asked + ": " + what);
  };
  if (asked == "mesh") {
    if (!triangles) return bad(s.source.name + " has no triangles; use gaussians or a file");
    return Choice({"", true});
  }
  if (asked == "gaussians" || asked == "auto" || asked == "build") {
    if (asked == "gaussians" && !gaussians) return bad(s.source.name + " has no Gaussians; use mesh");
    // The triangles of a stage are the whole scene. Those of OpenOptions::meshes stand among Gaussians.
    const bool whole =
        s.source.embedded || !s.source.stage_mesh.empty() || !s.source.collision_mesh.empty();
    if (asked != "gaussians" && (whole || !gaussians)) return Choice({"", true});
    if (s.scene.assets.front().packed != nullptr)
      return bad("not of packed Gaussians; use storage full or compact, or a file");
    return Choice({"", false});
  }
  return bad("use auto, none, build, mesh, gaussians, or a file that ends in .navmesh or .bin");
}

/// Settings of the NavMesh for the agent.
NavMeshSettings settings_of(const OpenOptions& o) {
  if (o.navmesh_settings) return *o.navmesh_settings;
  NavMeshSettings settings{
      .cell_size = o.cell_size, .agent_height = o.agent_height, .agent_radius = o.agent_radius};
  return settings;
}

/// Builds a NavMesh. `what` names it in progress.
Result<NavMesh> build(OpeningScene& s, const NavMeshChoice& choice, NavMeshSettings settings,
                      const std::string& what) {
  const OpenOptions& o = s.options;
  if (choice.triangles) {
    std::function<void(double)> progress;
    if (o.progress) progress = [&](double share) { o.progress(what + ": triangles", share); };
    return NavMesh::build(settings, s.triangles.vertices, s.triangles.triangles, 0, progress);
  }
  settings.cell_height = std::max(
      std::min(settings.cell_height, gaussian_navmesh_settings().cell_height), settings.cell_size);
  GaussianNavOptions how;
  how.crop = o.crop;
  if (o.progress) {
    how.progress = [&o, what](const char* stage, double share) {
      o.progress(what + ": " + stage, share);
    };
  }
  if (s.source.embedded) how.solid_alpha = 0.2;  // the flat's surfaces are as thin as paper
  const SceneAsset& asset = s.scene.assets.front();
  const GaussianSet set = asset.cloud->set(asset.world_from_asset);
  const bool beside = !s.source.embedded;  // the flat's triangles are the same surfaces as its Gaussians
  auto built =
      build_navmesh(settings, std::span(&set, 1),
                    beside ? std::span<const Vec3d>(s.triangles.vertices) : std::span<const Vec3d>(),
                    beside ? std::span<const NavMesh::Triangle>(s.triangles.triangles)
                           : std::span<const NavMesh::Triangle>(),
                    how);
  if (!built) return {built.code(), s.source.name + ": " + built.message()};
  return std::move(built->mesh);
}

/// Builds levels of detail of the people's bodies that have none, if levels were asked for. Bodies with
/// stretched skinning stay without.
Status add_body_levels(OpeningScene& s) {
  if (s.options.levels == SceneLevels::none) return {};
  struct Body {
    std::shared_ptr<const AvatarAsset> asset;
    Status status;
  };
  std::map<std::shared_ptr<const AvatarAsset>, std::size_t> places;
  std::vector<Body> bodies;
  for (const AvatarActor& a : s.scene.avatars) {
    const auto& asset = a.asset();
    if (!asset->levels.empty() || asset->skinning == Skinning::linear_stretched) continue;
    if (places.emplace(asset, bodies.size()).second) bodies.push_back({asset, {}});
  }
  PoolBackend().parallel_for(bodies.size(), [&](std::size_t i) {
    bodies[i].status = detail::guarded([&]() -> Status {
      auto levels = body_levels(*bodies[i].asset);
      if (!levels) return levels.status();
      auto with_levels = std::make_shared<AvatarAsset>(*bodies[i].asset);
      with_levels->levels = std::move(*levels);
      bodies[i].asset = std::move(with_levels);
      return {};
    });
  });
  for (AvatarActor& a : s.scene.avatars) {
    const auto at = places.find(a.asset());
    if (at == places.end()) continue;
    const Body& body = bodies[at->second];
    if (!body.status) return body.status;
    auto actor = a.with_body(body.asset);
    if (!actor) return actor.status();
    a = std::move(*actor);
  }
  return {};
}

/// Adds the people that were asked for, or else those that belong to the scene.
Status add_people(OpeningScene& s, const std::optional<NavMeshChoice>& choice) {
  const OpenOptions& o = s.options;
  if (o.people == 0) {
    for (const std::string& w : s.source.avatars.warnings) s.warn(w);
    if (s.source.avatars.avatars.empty()) return {};
    auto actors = io::load_scene_actors(s.source.avatars);
    if (!actors) return actors.status();
    s.scene.avatars = std::move(*actors);
    return add_body_levels(s);
  }
  if (s.scene.navmesh == nullptr) {
    return {Errc::invalid_argument, "OpenOptions.people = " + std::to_string(o.people) +
                                        ": they walk on a NavMesh, and there is none; "
                                        "OpenOptions.navmesh = auto builds it"};
  }
  // Use a body wider than that of the agent, so that people keep their shoulders clear of furniture.
  std::optional<NavMesh> wide;
  if (choice->file.empty()) {
    NavMeshSettings body = settings_of(o);
    body.agent_radius = 0.3;
    body.agent_height = 1.8;
    if (auto made = build(s, *choice, body, "NavMesh of people")) wide = std::move(*made);
  }
  auto people = walking_people(wide ? *wide : *s.scene.navmesh, o.people, o.seed, o.density,
                               [&s](double share) { s.tell("people", share); });
  if (!people) return people.status();
  s.scene.avatars = std::move(*people);
  return add_body_levels(s);
}

}  // namespace

Status open_navmesh(OpeningScene& s) {
  const auto from = std::chrono::steady_clock::now();
  const OpenOptions& o = s.options;
  const auto choice = choose(s);
  if (!choice) return choice.status();
  s.tell("NavMesh");
  if (o.crop && (!*choice || !(*choice)->file.empty() || (*choice)->triangles))
    s.warn("crop: no NavMesh is built from Gaussians, which alone are cropped");
  if (*choice) {
    const NavMeshChoice& c = **choice;
    auto mesh = c.file.empty() ? build(s, c, settings_of(o), "NavMesh") : load_navmesh(c.file);
    if (!mesh) return mesh.status();
    s.out.navmesh_source = !c.file.empty() ? "from " + c.file
                           : c.triangles   ? "from the mesh"
                                           : "from the Gaussians";
    char text[160];
    std::snprintf(text, sizeof text, ": %zu polygons, %.1f m2, %zu island%s", mesh->polygon_count(),
                  mesh->navigable_area(), mesh->island_count(), mesh->island_count() == 1 ? "" : "s");
    s.note("NavMesh " + s.out.navmesh_source + text);
    s.scene.navmesh = std::make_shared<const NavMesh>(std::move(*mesh));
  }
  s.out.navmesh_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - from).count();
  return add_people(s, *choice);
}

Status open_visible_sets(OpeningScene& s) {
  const OpenOptions& o = s.options;
  if (o.visible_sets.empty()) return {};
  const auto bad = [&](const std::string& what) {
    return Status(Errc::invalid_argument, "OpenOptions.visible_sets = " + o.visible_sets + ": " + what);
  };
  if (s.scene.assets.empty()) return bad(s.source.name + " has no Gaussians");
  SceneAsset& asset = s.scene.assets.front();
  if (asset.cloud == nullptr) return bad("not of packed Gaussians; use storage full or compact");
  const auto take = [&](VisibleSets&& sets, const std::string& from) {
    char text[200];
    std::snprintf(text, sizeof text,
                  "visible sets%s: %zu cells, from %zu viewpoints; a cell sees %.1f %% of %zu chunks, "
                  "%.1f %% of the Gaussians",
                  from.c_str(), sets.cells(), sets.viewpoints, 100 * sets.mean_share(),
                  sets.cloud_chunks, 100 * sets.mean_row_share(asset.cloud->size()));
    s.note(text);
    asset.visible = std::make_shared<const VisibleSets>(std::move(sets));
    return Status();
  };
  if (o.visible_sets != "auto") {
    auto sets = io::load_visible_sets(o.visible_sets, *asset.cloud);
    if (!sets) return sets.status();
    return take(std::move(*sets), "");
  }
  if (s.scene.navmesh == nullptr) return bad("they are found from a NavMesh, and there is none");
  VisibleSettings settings;
  settings.serve(o.eye);
  if (o.progress) settings.progress = [&o](double share) { o.progress("visible sets", share); };
  const double heights[] = {o.eye.position().y};
  const auto viewpoints = navmesh_viewpoints(*s.scene.navmesh, heights, settings.spacing());
  if (!viewpoints) return viewpoints.status();
  const auto find = [&] {
    return build_visible_sets(o.device, *asset.cloud, *viewpoints, settings, asset.world_from_asset);
  };
  const auto use = [&](VisibleSets&& sets) {
    if (sets.refused_share == 0) return take(std::move(sets), "");
    s.warn("visible sets gain nothing here, because a cell sees " +
           std::to_string(std::lround(100 * sets.refused_share)) +
           " % of the Gaussians on average: drawn without them");
    return Status();
  };
  if (s.source.embedded) {
    auto found = find();
    return found ? use(std::move(*found)) : found.status();
  }
  auto made = io::cached_visible_sets(s.source.gaussians, *asset.cloud, *viewpoints, settings,
                                      asset.world_from_asset, find);
  if (!made) return made.status();
  if (!made->warning.empty()) s.warn(made->warning);
  return use(std::move(made->sets));
}

}  // namespace gsnav::detail
