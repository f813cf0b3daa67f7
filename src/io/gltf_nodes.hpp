// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "gltf_file.hpp"
#include "gsnav/math/mat.hpp"
#include "gsnav/math/similarity.hpp"

namespace gsnav::io::detail {

/// The transform of a node: translation, rotation and scale, or a matrix.
struct GltfNode {
  Vec3d translation{}, scale{1, 1, 1};
  std::array<double, 4> rotation{0, 0, 0, 1};  ///< x, y, z, w.
  bool has_matrix = false;
  Affine3<double> matrix{};

  Affine3<double> local() const;
};

/// All nodes of a file.
struct GltfNodes {
  std::vector<GltfNode> nodes;
  std::vector<std::int64_t> parents;  ///< Parent of each node; -1: none.
  std::vector<std::vector<std::size_t>> children;
  std::vector<std::size_t> order;  ///< Parents before their children.
  std::vector<std::string> names;
  double unit = 1.0;  ///< Metres for each unit of the file.

  /// For each node the transform to the scene, in metres.
  std::vector<Affine3<double>> globals() const;
};

/// Reads all nodes. Errors: invalid_file (a node with two parents or below itself, numbers that are not
/// finite).
Result<GltfNodes> read_nodes(const GltfFile& file);

/// One occurrence of a mesh in the scene.
struct GltfInstance {
  std::size_t node = 0, mesh = 0;
  Affine3<double> world_from_mesh;
};

/// All meshes of the scene that the file shows first, or of all nodes if it has no scene. A node's own
/// mesh comes before those below it. Errors: invalid_file.
Result<std::vector<GltfInstance>> read_instances(const GltfFile& file);

/// Splits `a` into rotation, scale and translation. Returns false if it is not a similarity.
bool as_similarity(const Affine3<double>& a, Similarity& out);

}  // namespace gsnav::io::detail
