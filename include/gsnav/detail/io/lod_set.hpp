// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>

#include "gsnav/core/status.hpp"
#include "gsnav/detail/io/read_limits.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"
#include "gsnav/scene/lod_tree.hpp"

namespace gsnav::io {

/// Options of load_lod_set.
struct LoadLodOptions {
  int level = 0;            ///< Level to read; 0 is the finest.
  bool environment = true;  ///< Whether to add the far shell, if the set has one.
  ReadLimits limits{};      ///< A tree of n levels is nested 2 n + 1 deep in JSON.
};

/// Reads PlayCanvas' streamed LOD set: `lod-meta.json` or its folder. The file has a tree of nodes, each
/// of which names rows of SOG files for some of its levels. All nodes are read at one level and merged.
/// Where a node lacks the level or its file is missing, the next coarser level is used, else the next
/// finer one, with a warning in the report. Rows are ordered by file, as the set lists the files.
///
/// Errors: those of load_sog; file_not_found (no level of a node exists); invalid_argument (a level that
/// the set does not have, with those it has); unsupported (a tree deeper than `limits` allow). A set is
/// invalid_file if it names files outside of its folder, or rows that two nodes share or that lie beyond
/// the end of their file. Never throws.
Result<LoadedCloud> load_lod_set(const std::filesystem::path& path, const LoadLodOptions& options = {});

/// A streamed set with its levels of detail, to be drawn with a LodCut.
struct LoadedLodSet {
  /// The finest available level. Each chunk belongs to one node; chunks are filled up with transparent
  /// rows.
  GaussianCloud cloud;
  LodTree tree;       ///< The coarser levels.
  LoadReport report;  ///< Report of the finest level. `kept` does not count rows that fill chunks.
};

/// Reads all available levels of a streamed set, from `options.level` on. The finest is what
/// load_lod_set reads; each node may be drawn at any coarser level. `row_ids` are places in the order of
/// load_lod_set. The environment is always drawn whole. Returns nothing if nodes have so few rows that
/// chunks would be mostly empty. Errors: those of load_lod_set; invalid_file (rows that two levels
/// share, unless one node names the same rows twice). Never throws.
Result<std::optional<LoadedLodSet>> load_lod_levels(const std::filesystem::path& path,
                                                    const LoadLodOptions& options = {});

}  // namespace gsnav::io
