// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "gsnav/scene/gaussian_cloud.hpp"

namespace gsnav {

/// One node of a level-of-detail tree: a chunk of Gaussians.
struct LodNode {
  /// How far what the node merged lies from where it shows it: root mean square over its mass, metres; 0
  /// for a leaf. A parent's is not below its children's.
  float error = 0;
  /// How large the cloud's own Gaussians below it are: root of the area (lod_area), geometric mean over their mass,
  /// metres; 0 where nothing has mass.
  float grain = 0;
  ChunkBounds reach;  ///< of its own Gaussians and of all below it
};

/// A cloud at every level of detail (docs/lod.md): a binary tree over the chunks of a cloud in spatial
/// order. Leaves are those chunks, as they are; a node above shows what its two children show in half as
/// many Gaussians, at most kProjectChunk. Any cut through the tree shows each Gaussian of the cloud
/// once.
struct LodTree {
  GaussianCloud merged;  ///< Gaussians of the nodes above leaves: kProjectChunk rows a node, the last
                         ///< ones transparent where it has fewer
  std::vector<LodNode> nodes;  ///< leaves (chunk c is node c), then level by level to the root
  std::vector<std::uint32_t>
      level_begin;  ///< first node of each level, and behind them the number of nodes

  std::size_t levels() const noexcept { return level_begin.empty() ? 0 : level_begin.size() - 1; }
  std::size_t leaves() const noexcept { return levels() == 0 ? 0 : level_begin[1]; }
  /// Bytes beside those of the cloud.
  std::size_t bytes() const noexcept { return merged.bytes() + nodes.size() * sizeof(LodNode); }
};

/// How build_lod works.
struct LodSettings {
  int sh_degree = kMaxShDegree;  ///< of merged Gaussians, at most the cloud's
  int neighbours = 8;            ///< nearest ones that a Gaussian is tried with, in [1, 16]
  /// Told the share of the work that is done, in [0, 1], some hundred times, by the calling thread.
  std::function<void(double)> progress;
};

}  // namespace gsnav
