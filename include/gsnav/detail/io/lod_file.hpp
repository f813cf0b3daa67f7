// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "gsnav/core/status.hpp"
#include "gsnav/detail/io/read_or_build.hpp"
#include "gsnav/scene/lod_tree.hpp"

namespace gsnav::io {

/// Writes a tree (build_lod) with the hash of the cloud and of the settings that it was built of, and a
/// checksum. Errors: those of writing a file. Never throws.
Status save_lod(const std::filesystem::path& path, const LodTree& tree, const GaussianCloud& cloud,
                const LodSettings& settings = {});

/// Reads a tree that was built of `cloud` with `settings`.
/// Errors: file_not_found; invalid_argument (it was built of another cloud, or by other settings or
/// another version of the builder); invalid_file (not such a file, truncated, too long, a checksum or a
/// value that cannot be). What it allocates follows from the cloud, never from the file. Never throws.
Result<LodTree> load_lod(const std::filesystem::path& path, const GaussianCloud& cloud,
                         const LodSettings& settings = {});

/// Where the tree of a scene lies: beside the asset, under a name with the hash of its content.
/// `spec` as of load_scene (of tiles, the first one's place).
std::filesystem::path lod_path(const std::string& spec, const GaussianCloud& cloud,
                               const LodSettings& settings = {});

/// A tree, and what there is to say of where it came from.
struct CachedLod {
  LodTree tree;        ///< The levels of detail.
  bool built = false;  ///< now; else read
  std::string
      warning;  ///< why a file that is there was not taken, or why none could be written; or empty
};

/// The tree of a scene: read where lod_path() has it, else built by `build`, which returns a
/// Result<LodTree>, and written there; trees of an earlier content of the scene's file, older than it,
/// are then removed. A file that cannot be taken, and a folder that cannot be written, are warnings.
/// Errors: those of `build`.
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
