// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "gsnav/core/status.hpp"
#include "gsnav/detail/io/read_limits.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"
#include "gsnav/scene/lod_tree.hpp"

namespace gsnav::io {

/// How load_lod_set reads.
struct LoadLodOptions {
  int level = 0;            ///< 0 is the finest
  bool environment = true;  ///< add the far shell, where the set names one
  ReadLimits limits{};      ///< a tree of n levels is 2 n + 1 deep in JSON
};

/// Reads PlayCanvas' streamed LOD set: `lod-meta.json`, or its folder, with a tree of nodes each of
/// which names rows of SOG files for some levels. All nodes are read at one level and merged; where a
/// node has no such level, or its file is not there, the next coarser one is taken, else the next finer
/// one, and the report's warnings say so. Rows come by file, as the set lists them.
///
/// Errors: as load_sog; file_not_found (no level of a node is there); invalid_argument (a level that the
/// set does not have, named with those it has); unsupported (a tree deeper than `limits` allow);
/// invalid_file (files outside of the folder, rows that two nodes share or that end behind their file).
/// Never throws.
Result<LoadedCloud> load_lod_set(const std::filesystem::path& path, const LoadLodOptions& options = {});

/// A streamed set with its levels of detail, to be drawn by a LodCut.
struct LoadedLodSet {
  GaussianCloud cloud;  ///< the finest level that is there, in chunks of one node each; filled up with
                        ///< transparent rows
  LodTree tree;         ///< the levels above
  LoadReport report;    ///< of the finest level; kept has no rows that fill chunks
};

/// Reads all levels of a streamed set that are there, from `options.level` on: what load_lod_set gives
/// is the finest, and each node may be shown by any coarser one. `row_ids` are places in load_lod_set's
/// order. The environment is always shown whole. Errors: load_lod_set's; invalid_file (rows that two
/// levels share, but where a node names the same rows twice); unsupported (nodes of so few rows that
/// chunks would be mostly empty). Never throws.
Result<LoadedLodSet> load_lod_levels(const std::filesystem::path& path,
                                     const LoadLodOptions& options = {});

}  // namespace gsnav::io
