// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <span>
#include <string>

#include "gsnav/core/status.hpp"
#include "gsnav/detail/io/read_or_build.hpp"
#include "gsnav/scene/visible_sets.hpp"

namespace gsnav::io {

/// Writes visible sets of a cloud (build_visible_sets), with the hash of the cloud but for its colours
/// and a checksum. Errors: those of writing a file. Never throws.
Status save_visible_sets(const std::filesystem::path& path, const VisibleSets& sets,
                         const GaussianCloud& cloud);

/// Reads what save_visible_sets wrote for `cloud`. Errors: file_not_found; invalid_argument (of another
/// cloud, or by another version); invalid_file (not such a file, truncated, too long, a checksum or a
/// value that cannot be; names it). Allocates no more than the file's size. Never throws.
Result<VisibleSets> load_visible_sets(const std::filesystem::path& path, const GaussianCloud& cloud);

/// Where the visible sets of a scene lie: beside the asset, under a name with the hash of all that they
/// are made of. `spec` as of load_scene (of tiles, the first one's place).
std::filesystem::path visible_sets_path(const std::string& spec, const GaussianCloud& cloud,
                                        std::span<const Vec3d> viewpoints,
                                        const VisibleSettings& settings = {},
                                        const Similarity& world_from_asset = {});

/// Visible sets, and what there is to say of where they came from.
struct CachedVisibleSets {
  VisibleSets sets;    ///< The visible sets.
  bool built = false;  ///< now; else read
  std::string
      warning;  ///< why a file that is there was not taken, or why none could be written; or empty
};

/// The visible sets of a scene: read where visible_sets_path() has them, else built by `build`, which
/// returns a Result<VisibleSets>, and written there; those of an earlier content of the scene's file,
/// older than it, are then removed. A file that cannot be taken, and a folder that cannot be written,
/// are warnings. Errors: those of `build`.
template <class Build>
Result<CachedVisibleSets> cached_visible_sets(const std::string& spec, const GaussianCloud& cloud,
                                              std::span<const Vec3d> viewpoints,
                                              const VisibleSettings& settings,
                                              const Similarity& world_from_asset, const Build& build) {
  return detail::read_or_build<CachedVisibleSets>(
      visible_sets_path(spec, cloud, viewpoints, settings, world_from_asset), &CachedVisibleSets::sets,
      [&](const std::filesystem::path& path) { return load_visible_sets(path, cloud); }, build,
      [&](const std::filesystem::path& path, const VisibleSets& sets) {
        return save_visible_sets(path, sets, cloud);
      });
}

}  // namespace gsnav::io
