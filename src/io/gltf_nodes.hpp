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

/// Translation, rotation and scale of a node, or its matrix.
struct GltfNode {
  Vec3d translation{}, scale{1, 1, 1};
  std::array<double, 4> rotation{0, 0, 0, 1};  ///< x, y, z, w
  bool has_matrix = false;
  Affine3<double> matrix{};

  Affine3<double> local() const;
};

/// All nodes of a file as a forest.
struct GltfNodes {
  std::vector<GltfNode> nodes;
  std::vector<std::int64_t> parents;  ///< -1: none
  std::vector<std::vector<std::size_t>> children;
  std::vector<std::size_t> order;  ///< parents before their children
  std::vector<std::string> names;
  double unit = 1.0;  ///< metres a unit of the file

  /// Node to scene, whose unit is the metre, for each node.
  std::vector<Affine3<double>> globals() const;
};

/// Errors: invalid_file (a node with two parents or below itself, numbers that are not finite).
Result<GltfNodes> read_nodes(const GltfFile& file);

/// Where a mesh of a glTF stands.
struct GltfInstance {
  std::size_t node = 0, mesh = 0;
  Affine3<double> world_from_mesh;
};

/// All meshes of the scene that the file shows first, or of all nodes where it has no scene; a node's
/// own mesh before those below it. Errors: invalid_file.
Result<std::vector<GltfInstance>> read_instances(const GltfFile& file);

/// The rotation, scale and translation that `a` consists of; false where it is more than these.
bool as_similarity(const Affine3<double>& a, Similarity& out);

}  // namespace gsnav::io::detail
