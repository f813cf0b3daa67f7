// SPDX-License-Identifier: Apache-2.0
#include "scenes.hpp"

#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <utility>

#include "gsnav/backends/serial.hpp"
#include "gsnav/core/rng.hpp"
#include "gsnav/detail/demo/default_scene.hpp"
#include "gsnav/detail/demo/humanoid.hpp"
#include "gsnav/detail/scene/lod_build.hpp"
#include "gsnav/detail/scene/spatial_order.hpp"
#include "gsnav/scene/lod_cut.hpp"
#include "gsnav/scene/packed_cloud.hpp"
#include "gsnav/scene/visible_sets.hpp"
#include "hard_cases/cases.hpp"
#include "lod/level_support.hpp"
#include "support/compiled_frames.hpp"
#include "support/scenes.hpp"
#include "support/seen_rows.hpp"

using namespace gsnav;

namespace gsnav_test {
namespace {

using Configure = std::function<void(RenderConfig&)>;

std::shared_ptr<const GaussianCloud> shared(GaussianCloud cloud) {
  return std::make_shared<const GaussianCloud>(std::move(cloud));
}
std::shared_ptr<const GaussianCloud> in_chunks(GaussianCloud cloud) {
  return shared(sorted(std::move(cloud)));
}

Stored of(std::shared_ptr<const GaussianCloud> cloud) {
  Stored s;
  s.cloud = std::move(cloud);
  return s;
}
Stored of(PackedCloud packed) {
  Stored s;
  s.packed = std::make_shared<const PackedCloud>(std::move(packed));
  return s;
}

SurfaceMesh rectangle(const std::array<Vec3f, 4>& corners, const Vec3f& color, float alpha = 1) {
  SurfaceMesh m;
  m.geometry.vertices.assign(corners.begin(), corners.end());
  m.geometry.triangles = {{0, 1, 2}, {0, 2, 3}};
  m.base_color = color;
  m.base_alpha = alpha;
  m.alpha_mode = alpha < 1 ? MeshAlpha::blend : MeshAlpha::opaque;
  m.two_sided = true;
  return m;
}

Camera camera_in_flat(std::size_t view, int width, int height) {
  const DefaultView v = default_scene_views()[view];
  Camera c = Camera::look_at(v.eye, v.target, {0, 1, 0}, width, height, 90);
  c.near_plane = 0.01;
  c.near_sigma = 1;
  return c;
}

/// Random Gaussians that move and fade around the time 0; every fifth is always there.
TemporalCloud moving_cloud() {
  TemporalCloud scene;
  scene.cloud = random_cloud(71, {.count = 900, .sh_degree = 1});
  Rng rng(72);
  for (std::size_t i = 0; i < scene.size(); ++i) {
    scene.times.push_back(static_cast<float>(rng.normal()));
    scene.sigmas.push_back(i % 5 == 0 ? std::numeric_limits<float>::infinity()
                                      : static_cast<float>(rng.uniform(0, 1)));
    for (auto& plane : scene.motion) plane.push_back(static_cast<float>(0.2 * rng.normal()));
  }
  sort_spatially(scene);
  return scene;
}

class SceneList {
 public:
  std::vector<ImageScene> scenes;

  /// Adds a scene by the rules of `exact` and of `fast`.
  void add(ImageScene scene, const Configure& configure = {}) {
    scene.config.background = {0.25, 0.5, 0.75};
    if (configure) configure(scene.config);
    const std::string name = scene.name;
    scene.name = name + ", exact";
    scenes.push_back(scene);
    scene.name = name + ", fast";
    scene.config = lod_config(scene.config);  // the members in which Quality::fast() is another
    scenes.push_back(scene);
  }
};

const Configure kAllImages = [](RenderConfig& c) { c.outputs = all_outputs().outputs; };

Configure all_images_and(const Configure& more) {
  return [more](RenderConfig& c) {
    kAllImages(c);
    more(c);
  };
}

/// Two people who walk in the flat.
std::vector<AvatarActor> walkers() {
  const auto child =
      std::make_shared<const AvatarAsset>(make_humanoid({.gaussians = 2000, .sh_degree = 1}));
  const auto adult =
      std::make_shared<const AvatarAsset>(make_humanoid({.build = 1.1, .seed = 3, .gaussians = 2000}));
  return {make_walker(child, {{3.4, 0, 3.7}, {5.4, 0, 3.0}}).value(),
          make_walker(adult, {{5.3, 0, 1.6}, {3.6, 0, 2.9}, {4.6, 0, 4.0}}).value()};
}

void add_flat(SceneList& list, const std::shared_ptr<const GaussianCloud>& cloud,
              const std::vector<AvatarActor>& people) {
  MeshScene board, glass;
  board
      .add(rectangle({{{1.0f, 0.0f, 1.0f}, {3.4f, 0.0f, 2.4f}, {3.4f, 1.1f, 2.4f}, {1.0f, 1.1f, 1.0f}}},
                     {0.8f, 0.4f, 0.1f}))
      .value();
  glass = board;
  glass
      .add(rectangle({{{3.2f, 0.0f, 1.0f}, {4.6f, 0.0f, 3.4f}, {4.6f, 1.8f, 3.4f}, {3.2f, 1.8f, 1.0f}}},
                     {0.2f, 0.7f, 0.9f}, 0.4f))
      .value();
  const auto wall = std::make_shared<const MeshScene>(std::move(board));
  const auto pane = std::make_shared<const MeshScene>(std::move(glass));

  ImageScene flat;
  flat.sets = {of(cloud)};
  flat.camera = camera_in_flat(0, 50, 38);
  const auto named = [&](const std::string& name) {
    ImageScene s = flat;
    s.name = name;
    return s;
  };
  list.add(named("flat"));
  ImageScene s = named("flat, people");
  s.people = people;
  list.add(s);
  list.add(
      s =
          [&] {
            s.name = "flat, people, four slices";
            return s;
          }(),
      [](RenderConfig& c) { c.tuning.depth_slices = 4; });
  s.name = "flat, people, mesh";
  s.meshes = wall;
  list.add(s, kAllImages);
  s.in_batches = false;
  s.name = "flat, people, mesh, hard depth";
  list.add(s, all_images_and([](RenderConfig& c) { c.composite = Composite::hard_depth; }));
  s.name = "flat, people, mesh, rays";
  list.add(s, all_images_and([](RenderConfig& c) { c.response = Response::ray; }));
  s.name = "flat, people, glass";
  s.meshes = pane;
  list.add(s, kAllImages);
  for (const int tile : {8, 32}) {
    s = named("flat, tiles of " + std::to_string(tile));
    s.camera = camera_in_flat(3, 70, 44);
    list.add(s, [tile](RenderConfig& c) { c.tuning.tile_size = tile; });
  }
  list.add(named("flat, median depth alone"), [](RenderConfig& c) { c.outputs = kMedianDepth; });
  list.add(named("flat, first hit alone"), [](RenderConfig& c) {
    c.outputs = kFirstHitDepth;
    c.first_hit_tau = 0.2;
  });
}

/// Levels of detail and visible sets, of a tree and of a set that ships its levels.
void add_detailed_flat(SceneList& list, const std::shared_ptr<const GaussianCloud>& cloud,
                       const std::vector<AvatarActor>& people) {
  SerialBackend backend;
  const Camera camera = camera_in_flat(0, 50, 38);
  const auto detailed = [&](const std::string& name, std::shared_ptr<const GaussianCloud> of_cloud,
                            std::shared_ptr<const LodTree> tree) {
    SimulatorScene scene;
    scene.assets.push_back({std::move(of_cloud), {}, std::move(tree)});
    VisibleSettings cells;
    cells.serve(camera);
    cells.face = 64;
    const Vec3d eye = camera.position();
    scene.assets[0].visible = std::make_shared<const VisibleSets>(
        build_visible_sets(backend, *scene.assets[0].cloud, std::array{eye, eye + Vec3d{0.3, 0, 0.2}},
                           cells)
            .value());
    scene.avatars = people;
    const auto there = std::make_shared<const SimulatorScene>(std::move(scene));
    LodChoice coarse;
    coarse.pixels = 2;
    coarse.grain = 1e9;
    for (const int which : {1, 2, 3}) {
      ImageScene chosen;
      chosen.name = name + (which == 1 ? ", levels of detail" : which == 2 ? ", view cells" : ", both");
      chosen.detailed = there;
      chosen.camera = camera;
      if ((which & 1) != 0) chosen.choice.lod = coarse;
      chosen.choice.visible_sets = (which & 2) != 0;
      list.add(chosen);
    }
  };
  detailed("flat and its tree", cloud,
           std::make_shared<const LodTree>(build_lod(backend, *cloud).value()));
  auto shipped = join_levels(backend, shipped_levels(*cloud, 2), 16).value();
  detailed("flat in shipped levels", shared(std::move(shipped.cloud)),
           std::make_shared<const LodTree>(std::move(shipped.tree)));
}

void add_storages(SceneList& list) {
  const Camera ahead = Camera::look_at({0, 0, 0}, {0, 0, 4}, {0, -1, 0}, 49, 32, 70);
  Camera close = Camera::look_at({0.1, 0.1, 3.9}, {0.6, 0.2, 5}, {0, -1, 0}, 49, 32, 90);
  close.near_plane = 0.01;
  close.near_sigma = 1;
  const auto scene = [&](const std::string& name, std::vector<Stored> sets, const Camera& camera) {
    ImageScene s;
    s.name = name;
    s.sets = std::move(sets);
    s.camera = camera;
    return s;
  };
  const auto cloud = in_chunks(random_cloud(11, {.count = 1500, .needle = 0.3}));
  const auto mip =
      in_chunks(random_cloud(12, {.count = 800, .sh_degree = 1, .scale = 0.2, .mip = true}));
  const auto needles = in_chunks(needle_cloud(5, 800));
  GaussianCloud halves = *cloud;
  compact_sh(halves);
  Rng rng(73);

  list.add(scene("floats", {of(cloud)}, ahead), kAllImages);
  list.add(scene("floats, close", {of(cloud)}, close), kAllImages);
  list.add(scene("halves", {of(shared(halves))}, ahead));
  list.add(scene("packed", {of(pack_cloud(*cloud))}, ahead));
  list.add(scene("packed with coarse means", {of(pack_cloud(*cloud, {.mean = 0.05}))}, ahead));
  ImageScene s = scene("factors", {of(cloud)}, ahead);
  s.sets[0].as_factors = true;
  list.add(s, kAllImages);
  s = scene("moving", {Stored{}}, ahead);
  s.sets[0].moving = std::make_shared<const TemporalCloud>(moving_cloud());
  s.on_device = false;
  list.add(s);
  s = scene("seen rows", {of(cloud)}, ahead);
  s.sets[0].seen = seen_words(random_rows(rng, cloud->size()));
  list.add(s);

  Stored turned = of(needles);
  turned.place.translation = {0.4, -0.2, 0.3};
  turned.place.scale = 0.7;
  turned.place.rotation = {0.9, 0.1, -0.3, 0.2};
  normalize(turned.place.rotation);
  const std::vector<Stored> three{of(cloud), of(mip), turned};
  list.add(scene("three sets", three, ahead), kAllImages);
  list.add(scene("three sets by distance", three, ahead),
           all_images_and([](RenderConfig& c) { c.sort_order = SortOrder::camera_distance; }));
  list.add(scene("three sets, 24 bits of key", three, ahead),
           [](RenderConfig& c) { c.quality.key_bits = 24; });
  s = scene("three sets, linear", three, ahead);
  s.in_batches = false;
  list.add(s, [](RenderConfig& c) { c.blend_space = ColorSpace::linear; });

  list.add(scene("needles", {of(needles)}, axis_camera(33, 32)), kAllImages);
  list.add(scene("needles not in chunks", {of(shared(needle_cloud(6, 400)))}, axis_camera(33, 32)),
           kAllImages);
  for (const auto response : {Response::ray, Response::tangent_plane}) {
    list.add(scene("close, response " + std::to_string(static_cast<int>(response)), {of(cloud)}, close),
             all_images_and([response](RenderConfig& c) { c.response = response; }));
  }
  for (const auto compat : {Compat::inria, Compat::gsplat, Compat::habitat_gs}) {
    list.add(scene("compat " + std::to_string(static_cast<int>(compat)), {of(cloud), of(mip)}, ahead),
             all_images_and([compat](RenderConfig& c) { c.compat = compat; }));
  }
  const Vec3d far_away{600, -300, 576};
  list.add(scene("far from zero",
                 {of(in_chunks(random_cloud(
                     13, {.count = 600, .sh_degree = 2, .center = far_away + Vec3d{0, 0, 4}})))},
                 Camera::look_at(far_away, far_away + Vec3d{0, 0, 4}, {0, -1, 0}, 40, 30, 80)),
           kAllImages);
  list.add(scene("two origins",
                 {of(shared(random_cloud(
                     14, {.count = 600, .sh_degree = 0, .scale = 0.3, .center = {31.5, 0.5, 5}})))},
                 Camera::look_at({31.5, 0.5, 0.5}, {31.7, 0.4, 5}, {0, -1, 0}, 40, 30, 80)),
           kAllImages);
}

}  // namespace

const std::vector<ImageScene>& image_scenes() {
  static const std::vector<ImageScene> scenes = [] {
    SceneList list;
    const auto flat = in_chunks(make_default_scene(0.05).value().cloud);
    const std::vector<AvatarActor> people = walkers();
    add_flat(list, flat, people);
    add_detailed_flat(list, flat, people);
    add_storages(list);
    return std::move(list.scenes);
  }();
  return scenes;
}

}  // namespace gsnav_test
