// SPDX-License-Identifier: Apache-2.0
#include "scene.hpp"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "gsnav/core/lower_case.hpp"
#include "gsnav/core/printable.hpp"
#include "gsnav/io/scene_file.hpp"
#include "gsnav/scene/prepare.hpp"

namespace gsnav_render {
namespace {

/// What was read and made so far.
struct Parts {
  GaussianCloud full;
  std::optional<PackedCloud> packed;   ///< in place of `full`
  std::optional<LodTree> tree;         ///< where the profile is lod
  std::optional<VisibleSets> visible;  ///< where some are given
  LoadReport report;
  SceneBands bands;
  std::vector<PlacedMeshes> meshes;
  std::vector<Camera> cameras;
};

Status read_cloud(const Options& o, Parts& parts) {
  io::LoadSceneOptions load;
  load.time = o.time;
  load.storage = o.storage == "compact" ? io::Storage::compact : io::Storage::full;
  if (o.profile == "lod" && o.storage == "packed") {
    return Status(Errc::invalid_argument,
                  "--profile lod: not with --storage packed; use full or compact");
  }
  if (o.profile == "lod" && o.lod_levels == "shipped") {
    auto set = io::load_shipped_levels(o.scene, load);
    if (!set) return set.status();
    if (*set) {
      parts.full = std::move((*set)->cloud);
      parts.report = std::move((*set)->report);
      parts.tree = std::move((*set)->tree);
    }
  }
  if (parts.tree) {
    std::printf("levels of detail: %zu, %.1f MB, shipped\n", parts.tree->levels(),
                static_cast<double>(parts.tree->bytes()) * 1e-6);
  } else if (o.storage == "packed") {
    auto read = io::load_packed_scene(o.scene, load);
    if (!read) return read.status();
    parts.packed = std::move(read->cloud);
    parts.report = std::move(read->report);
  } else {
    auto read = io::load_scene(o.scene, load);
    if (!read) return read.status();
    parts.full = std::move(read->cloud);
    parts.report = std::move(read->report);
  }
  std::fputs(io::report_text(parts.report).c_str(), stdout);
  return {};
}

Status read_meshes(const Options& o, Parts& parts) {
  for (const std::string& file : o.meshes) {
    auto surface = io::load_textured_scene(file);
    if (!surface) return surface.status();
    const std::string kind = lower_case(std::filesystem::path(file).extension().string());
    std::size_t triangles = 0;
    for (TexturedPart& part : surface->parts) {
      triangles += part.geometry.triangles.size();
      // What says nothing of its looks is grey.
      if (kind == ".obj" || kind == ".ply") part.material = {{0.5, 0.5, 0.5}, 0, -1, true, false};
    }
    auto placed = placed_meshes(std::move(*surface));
    if (!placed) return Status(placed.status().code(), file + ": " + placed.message());
    std::printf("%s: %zu triangles in %zu places\n", printable(file).c_str(), triangles,
                placed->instances.size());
    for (const std::string& w : placed->warnings)
      std::printf("%s: %s\n", printable(file).c_str(), printable(w).c_str());
    parts.meshes.push_back(std::move(*placed));
  }
  return {};
}

Status read_cameras(const Options& o, Parts& parts) {
  const auto orbit = [&]() -> Result<std::vector<Camera>> {
    const int w = o.width > 0 ? o.width : 640, h = o.height > 0 ? o.height : 480;
    if (parts.packed) return views_around(parts.report.bounds, parts.report.up, o.orbit, w, h);
    return views_around(parts.full, parts.report.up, o.orbit, w, h);
  };
  auto cameras = o.cameras.empty() ? orbit() : io::load_cameras(o.cameras, o.width, o.height);
  if (!cameras) return cameras.status();
  for (Camera& c : *cameras) c.near_plane = o.near_plane;
  parts.cameras = std::move(*cameras);
  return {};
}

/// The tree of a scene that has none of its own.
Status build_levels(const Options& o, Parts& parts) {
  if (o.profile != "lod" || parts.tree) return {};
  LodSettings settings;
  const bool terminal = isatty(fileno(stdout)) != 0;
  settings.progress = [terminal](double share) {
    if (terminal) std::printf("\rbuilding levels of detail: %.0f %%", 100 * share);
    if (terminal) std::fflush(stdout);
  };
  auto made = io::cached_lod(o.scene, parts.full, settings,
                             [&] { return build_lod(o.device, parts.full, settings); });
  if (!made) return made.status();
  std::printf("%slevels of detail: %zu, %.1f MB, %s\n", terminal && made->built ? "\r" : "",
              made->tree.levels(), static_cast<double>(made->tree.bytes()) * 1e-6,
              made->built ? "built" : "read");
  if (!made->warning.empty()) std::printf("%s\n", made->warning.c_str());
  parts.tree = std::move(made->tree);
  return {};
}

Status read_visible_sets(const Options& o, Parts& parts) {
  if (o.visible_sets.empty()) return {};
  if (o.profile == "exact")
    return {Errc::invalid_argument,
            "--visible-sets: sampled, so not for --profile exact; use fast or lod"};
  if (parts.packed)
    return {Errc::invalid_argument, "--visible-sets: not with --storage packed; use full or compact"};
  auto sets = io::load_visible_sets(o.visible_sets, parts.full);
  if (!sets) return sets.status();
  std::printf("%s: %zu cells, from %zu viewpoints\n", printable(o.visible_sets).c_str(), sets->cells(),
              sets->viewpoints);
  parts.visible = std::move(*sets);
  return {};
}

void fit_bands(const Options& o, Parts& parts) {
  // What cannot be seen is not held and not read; in exact, what is zero.
  const auto fit = [unseen = o.profile == "exact" ? 0 : kUnseenColor](auto& cloud) {
    SceneBands made = scene_bands(cloud, unseen);
    drop_bands(cloud, made);
    return made;
  };
  SceneBands& bands = parts.bands;
  bands = parts.packed ? fit(*parts.packed) : fit(parts.full);
  if (parts.tree) {
    const SceneBands merged = fit(parts.tree->merged);
    bands.bytes_let_go += merged.bytes_let_go;
    bands.color_error = std::max(bands.color_error, merged.color_error);
  }
  if (bands.sh_numbers != 0) {
    std::array<std::size_t, kMaxShDegree + 1> chunks{};
    for (const std::uint8_t degree : bands.chunk_sh_degrees) ++chunks[degree];
    std::printf(
        "SH: %zu, %zu, %zu, %zu chunks need degree 0 to 3; %llu bytes let go that none needs, %llu held "
        "that only others "
        "need\n",
        chunks[0], chunks[1], chunks[2], chunks[3], static_cast<unsigned long long>(bands.bytes_let_go),
        static_cast<unsigned long long>(bands.bytes_unneeded));
  }
}

/// As shared parts of a scene.
Scene assemble(Parts parts) {
  const auto shared = []<class T>(T& part) { return std::make_shared<const T>(std::move(part)); };
  SceneAsset asset;
  if (parts.packed) asset.packed = shared(*parts.packed);
  if (!parts.packed) asset.cloud = shared(parts.full);
  if (parts.tree) asset.lod = shared(*parts.tree);
  if (parts.visible) asset.visible = shared(*parts.visible);
  asset.bands = shared(parts.bands);
  SimulatorScene drawn;
  drawn.assets.push_back(std::move(asset));
  for (PlacedMeshes& surface : parts.meshes) drawn.meshes.push_back({shared(surface)});
  return {shared(drawn), std::move(parts.report), std::move(parts.cameras)};
}

}  // namespace

Result<Scene> load_scene(const Options& o) {
  Parts parts;
  Status s = read_cloud(o, parts);
  if (s.ok()) s = read_meshes(o, parts);
  if (s.ok()) s = read_cameras(o, parts);
  if (s.ok()) s = build_levels(o, parts);
  if (s.ok()) s = read_visible_sets(o, parts);
  if (!s.ok()) return s;
  fit_bands(o, parts);
  return assemble(std::move(parts));
}

}  // namespace gsnav_render
