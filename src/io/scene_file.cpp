// SPDX-License-Identifier: Apache-2.0
#include "gsnav/io/scene_file.hpp"

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <vector>

#include "file.hpp"
#include "gsnav/io/ksplat.hpp"
#include "gsnav/io/ply.hpp"
#include "gsnav/io/sog.hpp"
#include "gsnav/io/splat.hpp"
#include "gsnav/io/spz.hpp"
#include "gsnav/scene/spatial_order.hpp"

namespace gsnav::io {
namespace {

namespace fs = std::filesystem;

constexpr const char* kSupported =
    "a .ply, .splat, .ksplat, .spz or .sog, a meta.json or a folder with a meta.json";

Result<LoadedCloud> load_one(const fs::path& path) {
  std::error_code ignored;
  const std::string name = path.string();
  if (fs::is_directory(path, ignored)) {
    if (fs::exists(path / "meta.json", ignored)) return load_sog(path);
    std::string hint;
    if (fs::exists(path / "lod-meta.json", ignored)) {
      hint = "; it is a streamed set: name its tiles instead, as in " + (path / "2_0,2_1").string();
    }
    return {Errc::file_not_found, name + ": the folder has no meta.json" + hint};
  }
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (extension == ".ply") return load_ply(path);
  if (extension == ".sog") return load_sog(path);
  if (extension == ".splat") return load_splat(path);
  if (extension == ".ksplat") return load_ksplat(path);
  if (extension == ".spz") return load_spz(path);
  if (path.filename() == "meta.json") return load_sog(path);
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

Result<LoadedCloud> sorted(Result<LoadedCloud> scene) {
  if (scene) sort_spatially(scene->cloud);
  return scene;
}

void add_report(LoadReport& sum, const LoadReport& tile, const std::string& name) {
  sum.read += tile.read;
  sum.kept += tile.kept;
  sum.dropped_non_finite += tile.dropped_non_finite;
  sum.dropped_zero_quat += tile.dropped_zero_quat;
  sum.dropped_transparent += tile.dropped_transparent;
  sum.clamped_scales += tile.clamped_scales;
  sum.sh_degree = std::max(sum.sh_degree, tile.sh_degree);
  sum.bounds.add(tile.bounds);
  for (const std::string& w : tile.warnings) sum.warnings.push_back(name + ": " + w);
}

}  // namespace

Result<LoadedCloud> load_scene(const std::string& spec) {
  return detail::guarded(spec, [&]() -> Result<LoadedCloud> {
    std::error_code ignored;
    // A file's own name may hold a comma.
    if (fs::exists(spec, ignored)) return sorted(load_one(spec));
    const auto tiles = tiles_of(spec);
    if (!tiles) return tiles.status();
    if (tiles->size() == 1) return sorted(load_one(tiles->front()));
    LoadedCloud scene;
    scene.report.source = spec;
    for (const fs::path& path : *tiles) {
      auto tile = load_one(path);
      if (!tile) return tile.status();
      add_report(scene.report, tile->report, path.string());
      if (Status s = append(scene.cloud, tile->cloud); !s) {
        return {s.code(), path.string() + ": " + s.message()};
      }
    }
    return sorted(std::move(scene));
  });
}

}  // namespace gsnav::io
