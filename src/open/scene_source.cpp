// SPDX-License-Identifier: Apache-2.0
#include "scene_source.hpp"

#include <system_error>
#include <utility>

#include "gsnav/core/text.hpp"
#include "gsnav/detail/io/gltf.hpp"
#include "gsnav/detail/io/habitat_dataset.hpp"

namespace gsnav::detail {
namespace {

namespace fs = std::filesystem;

constexpr const char* kDataset = ".scene_dataset_config.json";
constexpr const char* kStage = ".stage_config.json";

/// The NavMesh next to a scene's file or folder: `flat.navmesh` for `flat.ply`, `flat.compressed.ply`
/// and the folder `flat`. Empty for several tiles.
std::string navmesh_beside(const std::string& name) {
  fs::path path = name;
  if (!path.has_filename()) path = path.parent_path();
  const std::string file = lower_case(path.filename().string());
  if (file == "meta.json" || file == "lod-meta.json") path = path.parent_path();
  if (path.empty()) return {};
  std::error_code error;
  for (fs::path stem = path;; stem = stem.stem()) {
    const fs::path beside = path.parent_path() / (stem.filename().string() + ".navmesh");
    if (fs::is_regular_file(beside, error)) return beside.string();
    if (!stem.has_extension()) return {};
  }
}

bool holds_triangles(const std::string& file) {
  const std::string kind = lower_case(fs::path(file).extension().string());
  if (kind == ".obj") return true;
  return (kind == ".glb" || kind == ".gltf") && !io::gltf_holds_gaussians(file);
}

SceneSource of_stage(const io::StageConfig& stage) {
  SceneSource out;
  const std::string asset = stage.render_asset.string();
  (holds_triangles(asset) ? out.stage_mesh : out.gaussians) = asset;
  if (stage.collision_asset != stage.render_asset) out.collision_mesh = stage.collision_asset.string();
  out.has_frame = true;
  out.world_from_mesh = stage.world_from_asset();
  out.navmesh = navmesh_beside(asset);
  return out;
}

Result<SceneSource> of_dataset(const std::string& file, const std::string& wanted) {
  auto dataset = io::load_habitat_dataset(file);
  if (!dataset) return dataset.status();
  const io::HabitatScene* scene = nullptr;
  if (!wanted.empty()) {
    scene = dataset->find(wanted);
  } else if (dataset->scenes.size() == 1) {
    scene = &dataset->scenes.front();
  }
  if (scene == nullptr) {
    std::string list;
    for (std::size_t i = 0; i < dataset->scenes.size() && i < 20; ++i)
      list += (i == 0 ? "" : ", ") + dataset->scenes[i].name;
    if (dataset->scenes.size() > 20) list += ", ...";
    return {Errc::invalid_argument, file +
                                        (wanted.empty() ? ": name one of its scenes, " + file + "#NAME"
                                                        : ": has no scene '" + wanted + "'") +
                                        "; it has " + std::to_string(dataset->scenes.size()) +
                                        (list.empty() ? "" : ": " + list)};
  }
  SceneSource out = of_stage(scene->stage);
  if (!scene->navmesh.empty()) out.navmesh = scene->navmesh.string();
  out.avatars = scene->avatars;
  out.avatars.warnings.insert(out.avatars.warnings.begin(), dataset->warnings.begin(),
                              dataset->warnings.end());
  return out;
}

}  // namespace

Result<SceneSource> scene_source(const std::string& name) {
  SceneSource out;
  const std::size_t dataset = name.find(kDataset);
  if (name.empty()) {
    return {Errc::invalid_argument, "a scene's name is empty: give a file, a folder, or \"default\""};
  }
  if (name == "default") {
    out.embedded = true;
  } else if (dataset != std::string::npos) {
    const std::size_t end = dataset + std::string(kDataset).size();
    if (end < name.size() && name[end] != '#')
      return {Errc::invalid_argument, name + ": after the data set's file comes #NAME, or nothing"};
    auto found =
        of_dataset(name.substr(0, end), end < name.size() ? name.substr(end + 1) : std::string());
    if (!found) return found.status();
    out = std::move(*found);
  } else if (name.ends_with(kStage)) {
    auto stage = io::load_stage_config(name);
    if (!stage) return stage.status();
    out = of_stage(*stage);
  } else {
    (holds_triangles(name) ? out.stage_mesh : out.gaussians) = name;
    out.navmesh = navmesh_beside(name);
  }
  out.name = out.embedded ? kEmbeddedFlat : name;
  return out;
}

}  // namespace gsnav::detail
