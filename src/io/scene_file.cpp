// SPDX-License-Identifier: Apache-2.0
#include "gsnav/io/scene_file.hpp"

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <vector>

#include "file.hpp"
#include "gsnav/io/gltf.hpp"
#include "gsnav/io/ksplat.hpp"
#include "gsnav/io/lod_set.hpp"
#include "gsnav/io/ply.hpp"
#include "gsnav/io/sog.hpp"
#include "gsnav/io/splat.hpp"
#include "gsnav/io/spz.hpp"
#include "gsnav/scene/spatial_order.hpp"
#include "report_sum.hpp"

namespace gsnav::io {
namespace {

namespace fs = std::filesystem;

constexpr const char* kSupported =
    "a .ply, .splat, .ksplat, .spz, .sog, .glb or .gltf, a meta.json, a lod-meta.json or a folder with "
    "one of the two";

Result<LoadedCloud> load_one(const fs::path& path, const LoadSceneOptions& options) {
  std::error_code ignored;
  const std::string name = path.string();
  if (fs::is_directory(path, ignored)) {
    if (fs::exists(path / "meta.json", ignored)) return load_sog(path);
    if (fs::exists(path / "lod-meta.json", ignored)) return load_lod_set(path, {.level = options.level});
    return {Errc::file_not_found, name + ": the folder has no meta.json and no lod-meta.json"};
  }
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (extension == ".ply") return load_ply(path);
  if (extension == ".sog") return load_sog(path);
  if (extension == ".splat") return load_splat(path);
  if (extension == ".ksplat") return load_ksplat(path);
  if (extension == ".spz") return load_spz(path);
  if (extension == ".glb" || extension == ".gltf") return load_gltf(path);
  if (path.filename() == "meta.json") return load_sog(path);
  if (path.filename() == "lod-meta.json") return load_lod_set(path, {.level = options.level});
  if (!fs::exists(path, ignored))
    return {Errc::file_not_found, name + ": no such file or folder; supported: " + kSupported};
  return {Errc::unsupported, name + ": not a scene that is read here; supported: " + kSupported};
}

/// `folder/a,b` as folder/a and folder/b.
Result<std::vector<fs::path>> tiles_of(const std::string& spec) {
  std::vector<fs::path> out;
  for (std::size_t at = 0; at <= spec.size();) {
    const std::size_t end = std::min(spec.find(',', at), spec.size());
    std::string name = spec.substr(at, end - at);
    while (name.size() > 1 && name.back() == '/') name.pop_back();
    if (name.empty()) {
      return {Errc::invalid_argument,
              "scene " + detail::in_quotes(spec) + ": an empty name; give " + kSupported};
    }
    fs::path path = out.empty() ? fs::path(name) : out.front().parent_path() / name;
    if (std::find(out.begin(), out.end(), path) != out.end()) {
      return {Errc::invalid_argument,
              "scene " + detail::in_quotes(spec) + ": names " + path.string() + " twice"};
    }
    out.push_back(std::move(path));
    at = end + 1;
  }
  return out;
}

/// What `spec` names, its rows as they were read.
Result<LoadedCloud> load_named(const std::string& spec, const LoadSceneOptions& options) {
  std::error_code ignored;
  // A file's own name may hold a comma.
  if (fs::exists(spec, ignored)) return load_one(spec, options);
  const auto tiles = tiles_of(spec);
  if (!tiles) return tiles.status();
  if (tiles->size() == 1) return load_one(tiles->front(), options);
  LoadedCloud scene;
  scene.report.source = spec;
  for (const fs::path& path : *tiles) {
    if (Status s = detail::merge_loaded(scene, load_one(path, options), path.string()); !s) return s;
  }
  return scene;
}

}  // namespace

Result<LoadedCloud> load_scene(const std::string& spec, const LoadSceneOptions& options) {
  return detail::guarded(spec, [&] {
    auto scene = load_named(spec, options);
    if (scene && options.sort) sort_spatially(scene->cloud);
    return scene;
  });
}

}  // namespace gsnav::io
