// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "gsnav/scene/gaussian_cloud.hpp"

namespace gsnav {

/// One node of a level-of-detail tree: a chunk of Gaussians and how far it is from the cloud.
struct LodNode {
  /// Distance between the merged Gaussians and those of the cloud that they stand for, metres (root mean
  /// square over mass). 0 for a leaf. A parent's error is at least that of its children.
  float error = 0;
  /// Size of the cloud's own Gaussians below the node: square root of their area (lod_area), geometric
  /// mean over their mass, metres. 0 where no Gaussian has mass.
  float grain = 0;
  ChunkBounds reach;  ///< Bounds of the node's own Gaussians and of all below it.
};

/// One box of a streamed set, at one of its levels (detail/scene/lod_levels.hpp).
struct LodBox {
  /// Value of `finer` where there is no finer node.
  static constexpr std::uint32_t kNone = 0xffffffffu;
  std::uint32_t first_chunk = 0, chunks = 0;  ///< First chunk and number of chunks. In the cloud where
                                              ///< `finer` is kNone, otherwise in LodTree::merged.
  std::uint32_t finer = kNone;                ///< Node that shows the same box at the next finer level,
                                              ///< or kNone.
  std::uint32_t rows = 0;   ///< Gaussians in the chunks, without the transparent ones that fill the last
                            ///< chunk.
  std::uint32_t shown = 0;  ///< Gaussians of the cloud that the node stands for.
};

/// A cloud at every level of detail (docs/concepts/scene.md). There are two forms.
///
/// A tree: a binary tree over the chunks of a cloud in spatial order. Leaves are the chunks of the
/// cloud. A node above them shows what its two children show with half the Gaussians, at most
/// kProjectChunk. Any cut through the tree shows each Gaussian of the cloud once.
///
/// A forest, of the levels that a streamed set ships: `boxes` and `roots` are not empty. A node is a box
/// of the set at one level and has any number of chunks. A cut takes one level of each box.
struct LodTree {
  /// Gaussians of the nodes above the leaves. In a tree each node has kProjectChunk rows, the last ones
  /// transparent where it has fewer Gaussians.
  GaussianCloud merged;
  std::vector<LodNode> nodes;  ///< Leaves first (node c is chunk c of the cloud in a tree), then level
                               ///< by level up to the root.
  std::vector<std::uint32_t>
      level_begin;  ///< First node of each level, followed by the number of nodes.

  std::vector<LodBox> boxes;         ///< In a forest, the box of each node. Otherwise empty.
  std::vector<std::uint32_t> roots;  ///< In a forest, the coarsest node of each box.

  /// Number of levels, leaves included; 0 for an empty tree.
  std::size_t levels() const noexcept { return level_begin.empty() ? 0 : level_begin.size() - 1; }
  /// Number of leaves.
  std::size_t leaves() const noexcept { return levels() == 0 ? 0 : level_begin[1]; }
  /// Number of chunks of the cloud from which the tree was made.
  std::size_t cloud_chunks() const noexcept {
    if (boxes.empty()) return leaves();
    std::size_t sum = 0;
    for (std::size_t i = 0; i < leaves(); ++i) sum += boxes[i].chunks;
    return sum;
  }
  /// Bytes of the tree, without the cloud.
  std::size_t bytes() const noexcept {
    return merged.bytes() + nodes.size() * sizeof(LodNode) + boxes.size() * sizeof(LodBox);
  }
};

namespace detail {

/// Bounds of the union of two chunks.
inline ChunkBounds both(const ChunkBounds& a, const ChunkBounds& b) noexcept {
  ChunkBounds out;
  for (int k = 0; k < 3; ++k) {
    out.low[k] = min(a.low[k], b.low[k]);
    out.high[k] = max(a.high[k], b.high[k]);
  }
  out.scale_max = max(a.scale_max, b.scale_max);
  out.opacity_max = max(a.opacity_max, b.opacity_max);
  return out;
}

}  // namespace detail

}  // namespace gsnav
