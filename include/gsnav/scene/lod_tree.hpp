// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
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
  /// How large the cloud's own Gaussians below it are: root of the area (lod_area), geometric mean over
  /// their mass, metres; 0 where nothing has mass.
  float grain = 0;
  ChunkBounds reach;  ///< of its own Gaussians and of all below it
};

/// A box of a set that ships its levels, at one of them (detail/scene/lod_levels.hpp).
struct LodBox {
  static constexpr std::uint32_t kNone = 0xffffffffu;  ///< No node.
  std::uint32_t first_chunk = 0, chunks = 0;  ///< of the cloud where nothing is finer, else of `merged`
  std::uint32_t finer = kNone;                ///< the node that shows the same in more Gaussians
  std::uint32_t rows = 0;   ///< Gaussians in its chunks, less those that fill the last one
  std::uint32_t shown = 0;  ///< Gaussians of the cloud that it stands for
};

/// A cloud at every level of detail (docs/lod.md): a binary tree over the chunks of a cloud in spatial
/// order. Leaves are those chunks, as they are; a node above shows what its two children show in half as
/// many Gaussians, at most kProjectChunk. Any cut through the tree shows each Gaussian of the cloud
/// once.
///
/// Or a forest of the levels that a set ships: `boxes` and `roots` are not empty then. Nodes are boxes
/// of the set, each at one level, and have as many chunks as they need; a cut takes one level of each
/// box.
struct LodTree {
  GaussianCloud merged;  ///< Gaussians of the nodes above leaves: kProjectChunk rows a node, the last
                         ///< ones transparent where it has fewer
  std::vector<LodNode> nodes;  ///< leaves (chunk c is node c), then level by level to the root
  std::vector<std::uint32_t>
      level_begin;  ///< first node of each level, and behind them the number of nodes

  std::vector<LodBox> boxes;         ///< of a forest, one a node
  std::vector<std::uint32_t> roots;  ///< of a forest: the coarsest node of each box

  /// Number of levels.
  std::size_t levels() const noexcept { return level_begin.empty() ? 0 : level_begin.size() - 1; }
  /// Number of leaves.
  std::size_t leaves() const noexcept { return levels() == 0 ? 0 : level_begin[1]; }
  /// Chunks of the cloud that it was made of.
  std::size_t cloud_chunks() const noexcept {
    if (boxes.empty()) return leaves();
    std::size_t sum = 0;
    for (std::size_t i = 0; i < leaves(); ++i) sum += boxes[i].chunks;
    return sum;
  }
  /// Bytes beside those of the cloud.
  std::size_t bytes() const noexcept {
    return merged.bytes() + nodes.size() * sizeof(LodNode) + boxes.size() * sizeof(LodBox);
  }
};

namespace detail {

/// Bounds of both.
inline ChunkBounds both(const ChunkBounds& a, const ChunkBounds& b) noexcept {
  ChunkBounds out;
  for (int k = 0; k < 3; ++k) {
    out.low[k] = std::min(a.low[k], b.low[k]);
    out.high[k] = std::max(a.high[k], b.high[k]);
  }
  out.scale_max = std::max(a.scale_max, b.scale_max);
  out.opacity_max = std::max(a.opacity_max, b.opacity_max);
  return out;
}

}  // namespace detail

/// How build_lod works.
struct LodSettings {
  int sh_degree = kMaxShDegree;  ///< of merged Gaussians, at most the cloud's
  int neighbours = 8;            ///< nearest ones that a Gaussian is tried with, in [1, 16]
  /// Told the share of the work that is done, in [0, 1], some hundred times, by the calling thread.
  std::function<void(double)> progress;
};

}  // namespace gsnav
