// SPDX-License-Identifier: Apache-2.0
#include "gltf_nodes.hpp"

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "gsnav/math/quat.hpp"

namespace gsnav::io::detail {
namespace {

Status read_node(const Json& node, const std::string& at, GltfNode& out) {
  const auto take = [&](const char* key, std::size_t size, std::vector<double>& values) -> Status {
    values.clear();
    if (member(node, key) == nullptr) return {};
    auto v = get_numbers(node, key, size, at);
    if (!v) return v.status();
    values = std::move(*v);
    return {};
  };
  std::vector<double> v;
  if (Status s = take("matrix", 16, v); !s) return s;
  if (!v.empty()) {
    out.has_matrix = true;
    for (int i = 0; i < 3; ++i) {
      for (int k = 0; k < 3; ++k) out.matrix.linear(i, k) = v[static_cast<std::size_t>(4 * k + i)];
      out.matrix.translation[i] = v[static_cast<std::size_t>(12 + i)];
    }
    return {};
  }
  if (Status s = take("translation", 3, v); !s) return s;
  if (!v.empty()) out.translation = {v[0], v[1], v[2]};
  if (Status s = take("scale", 3, v); !s) return s;
  if (!v.empty()) out.scale = {v[0], v[1], v[2]};
  if (Status s = take("rotation", 4, v); !s) return s;
  if (!v.empty()) {
    Quatd q{v[3], v[0], v[1], v[2]};
    if (!normalize(q)) return {Errc::invalid_file, at + ": 'rotation' is zero"};
    out.rotation = {q.x, q.y, q.z, q.w};
  }
  return {};
}

Result<std::size_t> read_node_index(const Json& value, std::size_t nodes, const std::string& where) {
  const double k = value.is_number() ? value.get<double>() : -1.0;
  if (!(k >= 0 && k < static_cast<double>(nodes)) || k != std::floor(k)) {
    return {Errc::invalid_file,
            where + " has " + shown(value) + " of " + std::to_string(nodes) + " nodes"};
  }
  return static_cast<std::size_t>(k);
}

/// The root nodes of the file's scene, or of all nodes if there is no scene.
Result<std::vector<std::size_t>> scene_roots(const GltfFile& file, const GltfNodes& tree) {
  std::vector<std::size_t> out;
  if (file.count("scenes") == 0) {
    for (std::size_t k = 0; k < tree.parents.size(); ++k) {
      if (tree.parents[k] < 0) out.push_back(k);
    }
    return out;
  }
  const auto scene = get_index(file.json(), "scene", 0, file.source());
  if (!scene) return scene.status();
  const auto entry = file.item("scenes", *scene);
  if (!entry) return entry.status();
  const Json* list = member(**entry, "nodes");
  if (list == nullptr) return out;
  const std::string at = file.where("scenes", *scene) + ": 'nodes'";
  if (!list->is_array()) return {Errc::invalid_file, at + " is " + shown(*list)};
  for (const Json& value : *list) {
    const auto root = read_node_index(value, tree.nodes.size(), at);
    if (!root) return root.status();
    out.push_back(*root);
  }
  return out;
}

}  // namespace

Affine3<double> GltfNode::local() const {
  if (has_matrix) return matrix;
  Quatd q{rotation[3], rotation[0], rotation[1], rotation[2]};
  normalize(q);
  const Mat3d r = rotation_matrix(q);
  Affine3<double> out{{}, translation};
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) out.linear(i, k) = r(i, k) * scale[k];
  }
  return out;
}

std::vector<Affine3<double>> GltfNodes::globals() const {
  std::vector<Affine3<double>> out(nodes.size());
  const Affine3<double> metres{Mat3d::identity() * unit, {}};
  for (const std::size_t i : order) {
    out[i] = parents[i] < 0 ? metres * nodes[i].local()
                            : out[static_cast<std::size_t>(parents[i])] * nodes[i].local();
  }
  return out;
}

Result<GltfNodes> read_nodes(const GltfFile& file) {
  const std::size_t n = file.count("nodes");
  GltfNodes out;
  out.nodes.resize(n);
  out.parents.assign(n, -1);
  out.children.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    const auto e = file.item("nodes", i);
    if (!e) return e.status();
    const std::string at = file.where("nodes", i);
    if (Status s = read_node(**e, at, out.nodes[i]); !s) return s;
    const Json* name = member(**e, "name");
    out.names.push_back(name != nullptr && name->is_string() ? name->get<std::string>() : std::string());
    const Json* list = member(**e, "children");
    if (list == nullptr) continue;
    if (!list->is_array()) return {Errc::invalid_file, at + ": 'children' is " + shown(*list)};
    for (const Json& c : *list) {
      const auto named = read_node_index(c, n, at + ": 'children'");
      if (!named) return named.status();
      const std::size_t child = *named;
      if (out.parents[child] >= 0)
        return {Errc::invalid_file, file.where("nodes", child) + " hangs on two nodes"};
      out.parents[child] = static_cast<std::int64_t>(i);
      out.children[i].push_back(child);
    }
  }
  for (std::size_t i = 0; i < n; ++i) {
    if (out.parents[i] < 0) out.order.push_back(i);
  }
  for (std::size_t at = 0; at < out.order.size(); ++at) {
    const std::vector<std::size_t>& below = out.children[out.order[at]];
    out.order.insert(out.order.end(), below.begin(), below.end());
  }
  if (out.order.size() != n) return {Errc::invalid_file, file.source() + ": a node is its own ancestor"};
  return out;
}

Result<std::vector<GltfInstance>> read_instances(const GltfFile& file) {
  const auto tree = read_nodes(file);
  if (!tree) return tree.status();
  const auto roots = scene_roots(file, *tree);
  if (!roots) return roots.status();
  struct Visit {
    std::size_t node;
    Affine3<double> parent;
  };
  std::vector<Visit> open;
  const auto push = [&open](const std::vector<std::size_t>& list, const Affine3<double>& parent) {
    for (auto node = list.rbegin(); node != list.rend(); ++node) open.push_back({*node, parent});
  };
  push(*roots, {});
  std::vector<bool> seen(tree->nodes.size(), false);
  std::vector<GltfInstance> out;
  while (!open.empty()) {
    const Visit visit = open.back();
    open.pop_back();
    const std::string at = file.where("nodes", visit.node);
    if (seen[visit.node]) return {Errc::invalid_file, at + " comes twice in the scene"};
    seen[visit.node] = true;
    const Affine3<double> world = visit.parent * tree->nodes[visit.node].local();
    const Json& node = **file.item("nodes", visit.node);
    if (member(node, "mesh") != nullptr) {
      const auto mesh = file.index(node, "mesh", "meshes", at);
      if (!mesh) return mesh.status();
      out.push_back({visit.node, *mesh, world});
    }
    push(tree->children[visit.node], world);
  }
  return out;
}

bool as_similarity(const Affine3<double>& a, Similarity& out) {
  const double scale = std::cbrt(determinant(a.linear));
  if (!(scale > 0) || !std::isfinite(scale)) return false;
  const Mat3<double> rotation = a.linear * (1 / scale);
  if (!(distance_from_orthogonal(rotation) < 1e-4)) return false;
  out.rotation = quat_from_matrix(rotation);
  out.scale = scale;
  out.translation = a.translation;
  return normalize(out.rotation) && is_finite(out.translation);
}

}  // namespace gsnav::io::detail
