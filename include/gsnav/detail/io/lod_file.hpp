// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "gsnav/core/status.hpp"
#include "gsnav/detail/io/read_or_build.hpp"
#include "gsnav/scene/lod_tree.hpp"

namespace gsnav {
struct LodSettings;  // detail/scene/lod_settings.hpp
}  // namespace gsnav

// Functions without settings take the defaults of LodSettings.

namespace gsnav::io {

/// Writes a tree (build_lod), with a hash of the cloud and settings it was built from and a checksum.
/// Errors: those of writing a file. Never throws.
Status save_lod(const std::filesystem::path& path, const LodTree& tree, const GaussianCloud& cloud);
/// Writes a tree that was built with `settings`. Errors as above.
Status save_lod(const std::filesystem::path& path, const LodTree& tree, const GaussianCloud& cloud,
                const LodSettings& settings);

/// Reads a tree that was built from `cloud` with `settings`. The allocated memory depends on the cloud
/// only, never on the file. Never throws. Errors: file_not_found; invalid_argument (built from another
/// cloud, or with other settings or another version of the builder); invalid_file (not a tree file,
/// truncated, too long, wrong checksum, or a value out of range).
Result<LodTree> load_lod(const std::filesystem::path& path, const GaussianCloud& cloud,
                         const LodSettings& settings);
/// Reads a tree that was built with the default settings. Errors as above.
Result<LodTree> load_lod(const std::filesystem::path& path, const GaussianCloud& cloud);

/// Path of the cached tree of a scene: next to the asset, under a name with a hash of the content.
/// `spec` is that of load_scene; for several tiles the path is that of the first.
std::filesystem::path lod_path(const std::string& spec, const GaussianCloud& cloud,
                               const LodSettings& settings);
/// Path of the cached tree with the default settings.
std::filesystem::path lod_path(const std::string& spec, const GaussianCloud& cloud);

/// A tree, and how cached_lod got it.
struct CachedLod {
  LodTree tree;        ///< The tree.
  bool built = false;  ///< Whether it was built now, rather than read.
  std::string
      warning;  ///< Why an existing file was not used, or why the tree could not be written; or empty.
};

/// The tree of a scene. It is read from lod_path(), or else built by `build`, which returns a
/// Result<LodTree>, and written there. Writing removes trees of an earlier content of the scene's file,
/// if they are older than it. A file that cannot be used and a folder that cannot be written only give a
/// warning. Errors: those of `build`.
template <class Build>
Result<CachedLod> cached_lod(const std::string& spec, const GaussianCloud& cloud,
                             const LodSettings& settings, const Build& build) {
  return detail::read_or_build<CachedLod>(
      lod_path(spec, cloud, settings), &CachedLod::tree,
      [&](const std::filesystem::path& path) { return load_lod(path, cloud, settings); }, build,
      [&](const std::filesystem::path& path, const LodTree& tree) {
        return save_lod(path, tree, cloud, settings);
      });
}

}  // namespace gsnav::io
