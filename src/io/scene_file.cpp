// SPDX-License-Identifier: Apache-2.0
#include "gsnav/io/scene_file.hpp"

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <utility>
#include <vector>

#include "described.hpp"
#include "file.hpp"
#include "gsnav/io/gltf.hpp"
#include "gsnav/io/ksplat.hpp"
#include "gsnav/io/lod_set.hpp"
#include "gsnav/io/ply.hpp"
#include "gsnav/io/sog.hpp"
#include "gsnav/io/splat.hpp"
#include "gsnav/io/spz.hpp"
#include "gsnav/io/temporal_file.hpp"
#include "gsnav/scene/spatial_order.hpp"
#include "ply_temporal.hpp"
#include "report_sum.hpp"
#include "threads.hpp"

namespace gsnav::io {
namespace {

namespace fs = std::filesystem;

constexpr const char* kSupported =
    "a .ply, .splat, .ksplat, .spz, .sog, .glb, .gltf or .4dgs.npz, a meta.json, a lod-meta.json or a folder "
    "with one of the two";

/// The moment of a scene that moves.
LoadedCloud moment_of(const TemporalCloud& scene, LoadReport report, double time) {
  LoadedCloud out{cloud_at(scene, time), std::move(report)};
  out.report.warnings.push_back("a moment of a moving scene: " + std::to_string(out.cloud.size()) + " of " +
                                std::to_string(scene.size()) + " Gaussians are there at " + std::to_string(time) + " s");
  return out;
}

/// A PLY, at the time of the options where it moves.
Result<LoadedCloud> load_ply_at(const fs::path& path, const LoadSceneOptions& options) {
  TemporalCloud moving;
  auto loaded = detail::load_ply(path, &moving);
  if (!loaded || moving.times.empty()) return loaded;
  moving.cloud = std::move(loaded->cloud);
  return moment_of(moving, std::move(loaded->report), options.time);
}

Result<LoadedCloud> load_npz_at(const fs::path& path, const LoadSceneOptions& options) {
  auto loaded = load_temporal(path);
  if (!loaded) return loaded.status();
  return moment_of(loaded->scene, std::move(loaded->report), options.time);
}

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
  if (extension == ".ply") return load_ply_at(path, options);
  if (extension == ".npz") return load_npz_at(path, options);
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

/// Keeps SH as the options say, and completes the report.
void store(GaussianCloud& cloud, LoadReport& report, const LoadSceneOptions& options) {
  const UpGuess up{report.up, report.up_seen};  // of each reader's own kind of file
  if (options.storage == Storage::compact) {
    report.sh_storage_error = half_sh_error(cloud);
    if (report.sh_storage_error <= options.most_sh_error) {
      compact_sh(cloud);
    } else {
      report.warnings.push_back("kept in float32: as binary16 a coefficient would differ by " +
                                std::to_string(report.sh_storage_error) + ", more than " +
                                std::to_string(options.most_sh_error));
    }
  }
  describe(cloud, report, norm(up.up) > 0 ? up.up : Vec3d{0, -1, 0});
}

}  // namespace

Result<LoadedCloud> load_scene(const std::string& spec, const LoadSceneOptions& options) {
  return detail::guarded(spec, [&]() -> Result<LoadedCloud> {
    if (!is_finite(options.time)) {
      return {Errc::invalid_argument, spec + ": LoadSceneOptions.time is " + std::to_string(options.time)};
    }
    auto scene = load_named(spec, options);
    if (!scene) return scene;
    if (options.sort) {
      PoolBackend backend(threads_for(scene->cloud.size()) == 1 ? 1 : detail::io_threads());
      try {
        sort_spatially(backend, scene->cloud);
      } catch (const Error& e) {  // no memory for a backend's arrays
        return {e.code(), spec + ": " + e.what()};
      }
    }
    store(scene->cloud, scene->report, options);
    return scene;
  });
}

Result<std::optional<LoadedLodSet>> load_shipped_levels(const std::string& spec, const LoadSceneOptions& options) {
  return detail::guarded(spec, [&]() -> Result<std::optional<LoadedLodSet>> {
    std::error_code ignored;
    const fs::path path(spec);
    const bool folder = fs::is_directory(path, ignored);
    const bool set = folder ? !fs::exists(path / "meta.json", ignored) && fs::exists(path / "lod-meta.json", ignored)
                            : path.filename() == "lod-meta.json" && fs::exists(path, ignored);
    if (!set) return std::optional<LoadedLodSet>();
    auto levels = load_lod_levels(path, {.level = options.level});
    if (levels.code() == Errc::unsupported) return std::optional<LoadedLodSet>();
    if (!levels) return levels.status();
    if (levels->tree.merged.size() == 0) return std::optional<LoadedLodSet>();
    const LoadReport before = levels->report;
    store(levels->cloud, levels->report, options);
    levels->report.kept = before.kept;
    return std::optional<LoadedLodSet>(std::move(*levels));
  });
}

Result<LoadedPackedCloud> load_packed_scene(const std::string& spec, const LoadSceneOptions& options) {
  return detail::guarded(spec, [&]() -> Result<LoadedPackedCloud> {
    if (options.storage != Storage::full) {
      return {Errc::invalid_argument, spec + ": LoadSceneOptions.storage must be full where a scene is to be packed"};
    }
    auto scene = load_scene(spec, options);
    if (!scene) return scene.status();
    LoadedPackedCloud out;
    out.report = std::move(scene->report);
    out.report.packed = true;
    out.cloud = pack_cloud(std::move(scene->cloud), options.pack, &out.report.packing);
    out.report.memory = out.cloud.bytes();
    return out;
  });
}

}  // namespace gsnav::io
