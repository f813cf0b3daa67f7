// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <span>
#include <string>

#include "gsnav/core/status.hpp"
#include "gsnav/detail/io/read_or_build.hpp"
#include "gsnav/detail/scene/view_cells.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"

namespace gsnav {
struct VisibleSettings;  // detail/scene/visible_settings.hpp
}  // namespace gsnav

namespace gsnav::io {

/// Writes the visible sets of a cloud (build_visible_sets), with a checksum and a hash of the cloud
/// without its colours. Errors: those of writing a file. Never throws.
Status save_visible_sets(const std::filesystem::path& path, const VisibleSets& sets,
                         const GaussianCloud& cloud);

/// Reads what save_visible_sets wrote for `cloud`. Allocates no more than the file's size. Never throws.
/// Errors: file_not_found; invalid_argument (of another cloud or another version); invalid_file (not
/// such a file, truncated, too long, wrong checksum, or a value out of range).
Result<VisibleSets> load_visible_sets(const std::filesystem::path& path, const GaussianCloud& cloud);

/// Path of the cached visible sets of a scene: next to the asset, under a name with a hash of everything
/// that determines them. `spec` is that of load_scene; for several tiles the path is that of the first.
std::filesystem::path visible_sets_path(const std::string& spec, const GaussianCloud& cloud,
                                        std::span<const Vec3d> viewpoints,
                                        const VisibleSettings& settings,
                                        const Similarity& world_from_asset = {});
/// Path of the cached visible sets with the default settings, for a cloud that stands as in its file.
std::filesystem::path visible_sets_path(const std::string& spec, const GaussianCloud& cloud,
                                        std::span<const Vec3d> viewpoints);

/// Visible sets, and how cached_visible_sets got them.
struct CachedVisibleSets {
  VisibleSets sets;    ///< The sets.
  bool built = false;  ///< Whether they were built now, rather than read.
  std::string
      warning;  ///< Why an existing file was not used, or why the sets could not be written; or empty.
};

/// The visible sets of a scene. They are read from visible_sets_path(), or else built by `build`, which
/// returns a Result<VisibleSets>, and written there unless they would gain nothing. Writing removes
/// those of an earlier content of the scene's file, if they are older than it. A file that cannot be
/// used and a folder that cannot be written only give a warning. Errors: those of `build`.
template <class Build>
Result<CachedVisibleSets> cached_visible_sets(const std::string& spec, const GaussianCloud& cloud,
                                              std::span<const Vec3d> viewpoints,
                                              const VisibleSettings& settings,
                                              const Similarity& world_from_asset, const Build& build) {
  return detail::read_or_build<CachedVisibleSets>(
      visible_sets_path(spec, cloud, viewpoints, settings, world_from_asset), &CachedVisibleSets::sets,
      [&](const std::filesystem::path& path) { return load_visible_sets(path, cloud); }, build,
      [&](const std::filesystem::path& path, const VisibleSets& sets) {
        return sets.refused_share > 0 ? Status() : save_visible_sets(path, sets, cloud);
      });
}

}  // namespace gsnav::io
