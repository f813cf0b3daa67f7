// SPDX-License-Identifier: Apache-2.0
#include "gsnav/io/scene_file.hpp"

#include <algorithm>
#include <filesystem>
#include <utility>
#include <vector>

#include "cloud_fill.hpp"
#include "file.hpp"
#include "gsnav/core/text.hpp"
#include "gsnav/detail/io/gltf.hpp"
#include "gsnav/detail/io/ksplat.hpp"
#include "gsnav/detail/io/lod_set.hpp"
#include "gsnav/detail/io/ply.hpp"
#include "gsnav/detail/io/sog.hpp"
#include "gsnav/detail/io/splat.hpp"
#include "gsnav/detail/io/spz.hpp"
#include "gsnav/detail/io/temporal_file.hpp"
#include "gsnav/detail/scene/describe_cloud.hpp"
#include "gsnav/detail/scene/drop_bands.hpp"
#include "gsnav/detail/scene/scene_bands.hpp"
#include "gsnav/detail/scene/spatial_order.hpp"
#include "gsnav/scene/packed_cloud.hpp"
#include "packed_file.hpp"
#include "ply_temporal.hpp"
#include "report_sum.hpp"
#include "threads.hpp"

namespace gsnav::io {
namespace {

namespace fs = std::filesystem;

constexpr const char* kSupported =
    "a .ply, .splat, .ksplat, .spz, .sog, .glb, .gltf or .4dgs.npz, a meta.json, a lod-meta.json or a "
    "folder "
    "with one of the two";

/// The moment `time` of a scene that moves.
LoadedCloud moment_of(const TemporalCloud& scene, LoadReport report, double time) {
  LoadedCloud out{cloud_at(scene, time), std::move(report)};
  out.report.warnings.push_back("a moment of a moving scene: " + std::to_string(out.cloud.size()) +
                                " of " + std::to_string(scene.size()) + " Gaussians are there at " +
                                std::to_string(time) + " s");
  return out;
}

/// Reads a PLY, at the time of the options if it moves.
Result<LoadedCloud> load_ply_at(const fs::path& path, const LoadSceneOptions& options,
                                detail::BandsApart* apart) {
  TemporalCloud moving;
  auto loaded = detail::load_ply(path, &moving, apart);
  if (!loaded || moving.times.empty()) return loaded;
  moving.cloud = std::move(loaded->cloud);
  return moment_of(moving, std::move(loaded->report), options.time);
}

Result<LoadedCloud> load_npz_at(const fs::path& path, const LoadSceneOptions& options) {
  auto loaded = load_temporal(path);
  if (!loaded) return loaded.status();
  return moment_of(loaded->scene, std::move(loaded->report), options.time);
}

Result<LoadedCloud> load_one(const fs::path& path, const LoadSceneOptions& options,
                             detail::BandsApart* apart = nullptr) {
  std::error_code ignored;
  const std::string name = path.string();
  const LoadLodOptions lod{.level = options.level, .limits = options.limits};
  if (fs::is_directory(path, ignored)) {
    if (fs::exists(path / "meta.json", ignored)) return load_sog(path);
    if (fs::exists(path / "lod-meta.json", ignored)) return load_lod_set(path, lod);
    return {Errc::file_not_found,
            name + ": the folder has no meta.json and no lod-meta.json; name a file in it"};
  }
  const std::string extension = lower_case(path.extension().string());
  if (extension == ".ply") return load_ply_at(path, options, apart);
  if (extension == ".npz") return load_npz_at(path, options);
  if (extension == ".sog") return load_sog(path);
  if (extension == ".splat") return load_splat(path);
  if (extension == ".ksplat") return load_ksplat(path);
  if (extension == ".spz") return load_spz(path);
  if (extension == ".glb" || extension == ".gltf") return load_gltf(path, {.limits = options.limits});
  if (path.filename() == "meta.json") return load_sog(path);
  if (path.filename() == "lod-meta.json") return load_lod_set(path, lod);
  if (!fs::exists(path, ignored))
    return {Errc::file_not_found, name + ": no such file or folder; supported: " + kSupported};
  return {Errc::unsupported, name + ": not a scene that is read here; supported: " + kSupported};
}

/// Splits `folder/a,b` into folder/a and folder/b.
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

/// Reads what `spec` names, with rows in file order. `apart` is that of detail::load_ply.
Result<LoadedCloud> load_named(const std::string& spec, const LoadSceneOptions& options,
                               detail::BandsApart* apart) {
  std::error_code ignored;
  // A file's own name may contain a comma.
  if (fs::exists(spec, ignored)) return load_one(spec, options, apart);
  const auto tiles = tiles_of(spec);
  if (!tiles) return tiles.status();
  if (tiles->size() == 1) return load_one(tiles->front(), options, apart);
  LoadedCloud scene;
  scene.report.source = spec;
  for (const fs::path& path : *tiles) {
    if (Status s = detail::merge_loaded(scene, load_one(path, options), path.string()); !s) return s;
  }
  return scene;
}

/// Stores SH as the options say, and completes the report.
void store(GaussianCloud& cloud, LoadReport& report, const LoadSceneOptions& options) {
  const UpGuess up{report.up, report.up_seen};  // the reader's guess, which depends on the kind of file
  if (!options.keep_zero_bands)
    report.sh_bytes_let_go += limit_sh_degree(cloud, sh_degree_in_use(cloud));
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

/// For each row of a file, its row in the cloud that was made from the file.
std::vector<std::uint32_t> places_of(const GaussianCloud& cloud,
                                     const std::vector<std::uint32_t>& left_out) {
  const std::size_t n = cloud.size();
  std::vector<std::uint32_t> kept(n);
  for (std::size_t i = 0; i < n; ++i)
    kept[cloud.row_ids.empty() ? i : cloud.row_ids[i]] = static_cast<std::uint32_t>(i);
  if (left_out.empty()) return kept;
  std::vector<std::uint32_t> out(n + left_out.size(), detail::BandsApart::kNowhere);
  std::size_t row = 0, next = 0;
  for (const std::uint32_t place : kept) {
    for (; next < left_out.size() && left_out[next] == row; ++next) ++row;
    out[row++] = place;
  }
  return out;
}

Result<LoadedCloud> load_sorted(const std::string& spec, const LoadSceneOptions& options,
                                detail::BandsApart* apart) {
  return detail::guarded(spec, [&]() -> Result<LoadedCloud> {
    if (!is_finite(options.time)) {
      return {Errc::invalid_argument,
              spec + ": LoadSceneOptions.time is " + std::to_string(options.time)};
    }
    auto scene = load_named(spec, options, apart);
    if (!scene) return scene;
    if (options.sort) {
      PoolBackend backend(threads_for(scene->cloud.size()) == 1 ? 1 : detail::io_threads());
      try {
        sort_spatially(backend, scene->cloud);
      } catch (const Error& e) {  // no memory for the backend's arrays
        return {e.code(), spec + ": " + e.what()};
      }
    }
    store(scene->cloud, scene->report, options);
    return scene;
  });
}

/// Packs a cloud whose bands were not read yet. They are read a quarter at a time and packed at once, so
/// that never more than a quarter of them is in memory as floats. Returns nothing if 8 bits are not
/// enough for them.
Result<std::optional<LoadedPackedCloud>> pack_apart(const std::string& spec, LoadedCloud scene,
                                                    detail::BandsApart& apart,
                                                    const LoadSceneOptions& options) {
  constexpr std::size_t kReadings = 4;
  apart.places = places_of(scene.cloud, apart.left_out);
  LoadedPackedCloud out{{}, std::move(scene.report)};
  out.cloud = gsnav::detail::pack_rows(scene.cloud, options.pack, out.report.packing);
  gsnav::detail::BandPacker packer(out.cloud, apart.degree);
  const std::size_t chunks = out.cloud.chunks.size(), each = (chunks + kReadings - 1) / kReadings;
  std::vector<float> bands =
      huge_vector<float>(apart.numbers() * std::min(each * kProjectChunk, out.cloud.size()));
  apart.out = bands.data();
  for (std::size_t chunk = 0; chunk < chunks; chunk += each) {
    apart.first = chunk * kProjectChunk;
    apart.last = std::min(out.cloud.size(), (chunk + each) * kProjectChunk);
    if (auto read = detail::load_ply(spec, nullptr, &apart); !read) return read.status();
    packer.add(bands.data(), std::min(each, chunks - chunk));
  }
  int used = 0;
  for (const std::uint8_t degree : scene_bands(out.cloud).chunk_sh_degrees)
    used = std::max(used, int{degree});
  const int kept = options.keep_zero_bands ? apart.degree : used;
  packer.give(out.report.packing, kept);
  if (out.report.packing.sh_rms > options.pack.sh) return std::optional<LoadedPackedCloud>();
  limit_sh_degree(out.cloud, kept);
  out.report.sh_degree_used = used;
  out.report.sh_bytes_let_go =
      sizeof(float) * (apart.numbers() - sh_band_numbers(kept)) * out.cloud.size();
  return std::optional<LoadedPackedCloud>(std::move(out));
}

}  // namespace

Result<LoadedCloud> load_scene(const std::string& spec, const LoadSceneOptions& options) {
  return load_sorted(spec, options, nullptr);
}

Result<std::optional<LoadedLodSet>> load_shipped_levels(const std::string& spec,
                                                        const LoadSceneOptions& options) {
  return detail::guarded(spec, [&]() -> Result<std::optional<LoadedLodSet>> {
    std::error_code ignored;
    const fs::path path(spec);
    const bool folder = fs::is_directory(path, ignored);
    const bool set =
        folder ? !fs::exists(path / "meta.json", ignored) && fs::exists(path / "lod-meta.json", ignored)
               : path.filename() == "lod-meta.json" && fs::exists(path, ignored);
    if (!set) return std::optional<LoadedLodSet>();
    auto read = load_lod_levels(path, {.level = options.level});
    if (!read) return read.status();
    std::optional<LoadedLodSet>& levels = *read;
    if (!levels || levels->tree.merged.size() == 0) return std::optional<LoadedLodSet>();
    const auto kept = levels->report.kept;
    GaussianCloud& merged = levels->tree.merged;
    if (!options.keep_zero_bands)
      levels->report.sh_bytes_let_go += limit_sh_degree(merged, sh_degree_in_use(merged));
    store(levels->cloud, levels->report, options);
    levels->report.kept = kept;
    return read;
  });
}

Result<LoadedPackedCloud> detail::load_packed(const std::string& spec, const LoadSceneOptions& options,
                                              std::size_t least_apart) {
  return guarded(spec, [&]() -> Result<LoadedPackedCloud> {
    if (options.storage != Storage::full) {
      return {Errc::invalid_argument,
              spec + ": LoadSceneOptions.storage must be full where a scene is to be packed"};
    }
    detail::BandsApart apart;
    apart.least_rows = least_apart;
    auto scene = load_sorted(spec, options, &apart);
    if (!scene) return scene.status();
    std::optional<LoadedPackedCloud> out;
    if (apart.degree != 0) {
      auto packed = pack_apart(spec, std::move(*scene), apart, options);
      if (!packed) return packed.status();
      out = std::move(*packed);
      if (!out) scene = load_sorted(spec, options, nullptr);
      if (!scene) return scene.status();
    }
    if (!out) {
      out.emplace();
      out->report = std::move(scene->report);
      out->cloud = pack_cloud(std::move(scene->cloud), options.pack, &out->report.packing);
    }
    out->report.packed = true;
    out->report.memory = out->cloud.bytes();
    return std::move(*out);
  });
}

Result<LoadedPackedCloud> load_packed_scene(const std::string& spec, const LoadSceneOptions& options) {
  return detail::load_packed(spec, options, detail::BandsApart{}.least_rows);
}

}  // namespace gsnav::io
