// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/io/visible_file.hpp"

#include <cmath>
#include <cstdint>
#include <string>

#include "cache_file.hpp"
#include "gsnav/core/replace_file.hpp"
#include "gsnav/detail/scene/seen_cells.hpp"
#include "gsnav/detail/scene/visible_settings.hpp"

namespace gsnav::io {
namespace {

namespace fs = std::filesystem;
using detail::invalid_file;

/// Version of the result of build_visible_sets: increase it with every change.
constexpr std::uint32_t kVisibleVersion = 2;

/// Start of the file. Keys, ends and bits follow.
struct VisibleHeader {
  detail::CacheFront front;
  double cell, focal, near_plane, near_sigma, min_weight;
  std::uint64_t viewpoints, cells, chunks;  ///< chunks: those of the cloud.
  std::uint64_t words;                      ///< Number of words of all cells.
  std::uint64_t checksum;                   ///< Checksum of the numbers above and of the arrays.
};
static_assert(sizeof(VisibleHeader) == 112);

/// Hash of the cloud without its colours, and of the version.
Hasher hash_of(const GaussianCloud& cloud) {
  Hasher h;
  h.value(kVisibleVersion);
  hash_shapes(h, cloud);
  return h;
}

detail::CacheFront front_of(const GaussianCloud& cloud) {
  return {"GSNAVVIS", kVisibleVersion, sizeof(VisibleHeader), hash_of(cloud)};
}

std::uint64_t checksum(const VisibleSets& v) {
  Hasher h;
  for (const double x : {v.cell, v.focal, v.near_plane, v.near_sigma, v.min_weight}) h.value(x);
  h.value(std::uint64_t{v.viewpoints});
  h.array(v.keys);
  h.array(v.ends);
  h.array(v.bits);
  return h.low();
}

/// Checks the words of a cell, for a cloud of `cloud_rows` Gaussians. Returns a description of the flaw,
/// or null.
const char* flaw_of(const VisibleSets& v, std::size_t cell, std::size_t cloud_rows) {
  const View<const std::uint32_t> seen = v.seen_from(cell);
  const std::size_t words = v.words();
  if (words == 0) return seen.size == 0 ? nullptr : "words of a scene that has no chunk";
  const std::uint32_t beyond = v.cloud_chunks % 32 == 0 ? 0 : ~0u << (v.cloud_chunks % 32);
  if (seen.size < words || (seen[words - 1] & beyond) != 0)
    return "a chunk that the scene does not have";
  if (seen.size == words) return nullptr;
  if (seen.size != 2 * words + kSeenRowWords * v.count_seen(cell)) return "not as many rows as chunks";
  std::size_t place = 0;
  for (std::size_t c = 0; c < v.cloud_chunks; ++c) {
    if (c % 32 == 0 && seen[words + c / 32] != place) return "chunks that are not counted right";
    if ((seen[c / 32] >> (c % 32) & 1u) == 0) continue;
    const gsnav::detail::RowBits there = gsnav::detail::all_rows(cloud_rows, c);
    for (std::size_t k = 0; k < kSeenRowWords; ++k) {
      if ((seen[2 * words + kSeenRowWords * place + k] & ~there[k]) != 0)
        return "a row that the scene does not have";
    }
    ++place;
  }
  return nullptr;
}

/// Checks the values that lookups and kernels rely on.
Status check(const fs::path& path, const VisibleSets& v, std::size_t cloud_rows) {
  if (!(v.cell > 0 && std::isfinite(v.cell)))
    return invalid_file(path, "cell = " + std::to_string(v.cell));
  if (!(v.focal > 0 && std::isfinite(v.focal)))
    return invalid_file(path, "focal = " + std::to_string(v.focal));
  if (!(v.near_plane > 0 && std::isfinite(v.near_plane))) {
    return invalid_file(path, "near_plane = " + std::to_string(v.near_plane));
  }
  if (!(v.near_sigma >= 0 && std::isfinite(v.near_sigma))) {
    return invalid_file(path, "near_sigma = " + std::to_string(v.near_sigma));
  }
  if (!(v.min_weight >= 0 && v.min_weight < 1))
    return invalid_file(path, "min_weight = " + std::to_string(v.min_weight));
  for (std::size_t c = 0; c < v.cells(); ++c) {
    const auto bad = [&path, c](const char* what) {
      return invalid_file(path, "cell " + std::to_string(c) + ": " + what);
    };
    if (c > 0 && !(v.keys[c - 1] < v.keys[c]))
      return bad("its key is not greater than that of the cell before");
    if (v.ends[c] < (c == 0 ? 0 : v.ends[c - 1]) || v.ends[c] > v.bits.size())
      return bad("its end is less than that of the cell before, or beyond the bits of the file");
    if (const char* flaw = flaw_of(v, c, cloud_rows)) return bad(flaw);
  }
  if (v.bits.size() != (v.ends.empty() ? 0 : v.ends.back()))
    return invalid_file(path, "words of no cell");
  return {};
}

}  // namespace

Status save_visible_sets(const fs::path& path, const VisibleSets& sets, const GaussianCloud& cloud) {
  return detail::guarded(path.string(), [&]() -> Status {
    VisibleHeader header{.front = front_of(cloud),
                         .cell = sets.cell,
                         .focal = sets.focal,
                         .near_plane = sets.near_plane,
                         .near_sigma = sets.near_sigma,
                         .min_weight = sets.min_weight,
                         .viewpoints = sets.viewpoints,
                         .cells = sets.cells(),
                         .chunks = sets.cloud_chunks,
                         .words = sets.bits.size(),
                         .checksum = checksum(sets)};
    return replace_file(path, [&](OutputFile& file) {
      file.write(&header, sizeof header);
      file.write(sets.keys.data(), sets.keys.size() * sizeof(VisibleSets::Key));
      file.write(sets.ends.data(), sets.ends.size() * sizeof(std::uint64_t));
      file.write(sets.bits.data(), sets.bits.size() * sizeof(std::uint32_t));
    });
  });
}

Result<VisibleSets> load_visible_sets(const fs::path& path, const GaussianCloud& cloud) {
  return detail::guarded(path.string(), [&]() -> Result<VisibleSets> {
    detail::RandomFile file;
    VisibleHeader header{};
    if (Status s = open_cache(path, front_of(cloud), "file of visible sets", file, header); !s) return s;
    // Allocate no more than the size of the file.
    VisibleSets v;
    v.cloud_chunks = cloud.view().chunk_count();
    constexpr std::uint64_t kCell = sizeof(VisibleSets::Key) + sizeof(std::uint64_t);
    const std::uint64_t room = file.size() - sizeof header;
    const bool fits = header.cells <= room / kCell && header.words <= room / sizeof(std::uint32_t) &&
                      header.cells * kCell + header.words * sizeof(std::uint32_t) == room;
    if (header.chunks != v.cloud_chunks || !fits) {
      return invalid_file(path, "has " + std::to_string(file.size()) + " bytes, not those of " +
                                    std::to_string(header.cells) + " cells, " +
                                    std::to_string(header.words) + " words and " +
                                    std::to_string(header.chunks) + " chunks");
    }
    v.cell = header.cell;
    v.focal = header.focal;
    v.near_plane = header.near_plane;
    v.near_sigma = header.near_sigma;
    v.min_weight = header.min_weight;
    v.viewpoints = header.viewpoints;
    v.keys.resize(header.cells);
    v.ends.resize(header.cells);
    v.bits.resize(header.words);
    detail::ArrayReader read(file, sizeof header);
    read(v.keys);
    read(v.ends);
    read(v.bits);
    if (!read.whole()) return detail::reading_failed(path.string());
    if (header.checksum != checksum(v)) return invalid_file(path, "its checksum is another: damaged");
    if (Status s = check(path, v, cloud.size()); !s) return s;
    return v;
  });
}

fs::path visible_sets_path(const std::string& spec, const GaussianCloud& cloud,
                           std::span<const Vec3d> viewpoints, const VisibleSettings& settings,
                           const Similarity& world_from_asset) {
  Hasher h = hash_of(cloud);
  for (const double x :
       {settings.cell, settings.margin, settings.min_weight, settings.near_plane, settings.near_sigma}) {
    h.value(x);
  }
  h.value(settings.face);
  h.value(settings.rows);
  const Quatd& q = world_from_asset.rotation;
  for (const double x : {q.w, q.x, q.y, q.z, world_from_asset.scale}) h.value(x);
  for (int k = 0; k < 3; ++k) h.value(world_from_asset.translation[k]);
  h.value(viewpoints.size());
  for (const Vec3d& v : viewpoints) {
    for (int k = 0; k < 3; ++k) h.value(v[k]);
  }
  return detail::path_beside(spec) + "." + h.hex().substr(0, 16) + ".vis";
}

fs::path visible_sets_path(const std::string& spec, const GaussianCloud& cloud,
                           std::span<const Vec3d> viewpoints) {
  return visible_sets_path(spec, cloud, viewpoints, VisibleSettings{});
}

}  // namespace gsnav::io
