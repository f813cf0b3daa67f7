// SPDX-License-Identifier: Apache-2.0
#include <vector>

#include "gltf_file.hpp"
#include "gsnav/math/quat.hpp"

namespace gsnav::io::detail {

Result<Affine3<double>> GltfFile::local_transform(const Json& node, const std::string& where) const {
  Affine3<double> out;
  if (member(node, "matrix") != nullptr) {
    const auto m = get_numbers(node, "matrix", 16, where);
    if (!m) return m.status();
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) out.linear(i, j) = (*m)[static_cast<std::size_t>(4 * j + i)];
      out.translation[i] = (*m)[static_cast<std::size_t>(12 + i)];
    }
    return out;
  }
  const auto numbers = [&](const char* key, std::vector<double> absent) -> Result<std::vector<double>> {
    if (member(node, key) == nullptr) return absent;
    return get_numbers(node, key, absent.size(), where);
  };
  const auto t = numbers("translation", {0, 0, 0}), r = numbers("rotation", {0, 0, 0, 1}),
             s = numbers("scale", {1, 1, 1});
  for (const Status& status : {t.status(), r.status(), s.status()}) {
    if (!status) return status;
  }
  Quatd q{(*r)[3], (*r)[0], (*r)[1], (*r)[2]};
  if (!normalize(q)) return {Errc::invalid_file, where + ": 'rotation' is no quaternion"};
  out.linear = rotation_matrix(q);
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) out.linear(i, j) *= (*s)[static_cast<std::size_t>(j)];
    out.translation[i] = (*t)[static_cast<std::size_t>(i)];
  }
  return out;
}

Result<std::vector<GltfInstance>> GltfFile::instances() const {
  const Json* nodes = member(json_, "nodes");
  const std::size_t n = nodes != nullptr && nodes->is_array() ? nodes->size() : 0;
  struct Visit {
    std::size_t node;
    Affine3<double> parent;
  };
  std::vector<Visit> open;
  // A node may hang in one place only, which also ends a ring.
  std::vector<bool> seen(n, false);
  const auto push = [&](const Json* list, const Affine3<double>& parent) -> Status {
    if (list == nullptr) return {};
    if (!list->is_array()) return fail("a list of nodes is " + shown(*list));
    for (auto child = list->rbegin(); child != list->rend(); ++child) {
      if (!child->is_number_unsigned() || child->get<std::uint64_t>() >= n) {
        return fail("node " + shown(*child) + " is named, there are " + std::to_string(n));
      }
      const auto index = child->get<std::size_t>();
      if (seen[index]) return fail("node " + std::to_string(index) + " is named twice");
      seen[index] = true;
      open.push_back({index, parent});
    }
    return {};
  };
  const auto scene = get_index(json_, "scene", 0, source_);
  if (!scene) return scene.status();
  const Json* scenes = member(json_, "scenes");
  if (scenes != nullptr && !(scenes->is_array() && scenes->empty())) {
    const auto shown_first = item("scenes", *scene);
    if (!shown_first) return shown_first.status();
    if (Status s = push(member(**shown_first, "nodes"), {}); !s) return s;
  } else {
    std::vector<bool> child_of(n, false);
    for (std::size_t k = 0; k < n; ++k) {
      const Json* list = member((*nodes)[k], "children");
      for (std::size_t c = 0; list != nullptr && list->is_array() && c < list->size(); ++c) {
        const Json& child = (*list)[c];
        if (child.is_number_unsigned() && child.get<std::uint64_t>() < n)
          child_of[child.get<std::size_t>()] = true;
      }
    }
    Json roots = Json::array();
    for (std::size_t k = 0; k < n; ++k) {
      if (!child_of[k]) roots.push_back(k);
    }
    if (Status s = push(&roots, {}); !s) return s;
  }
  std::vector<GltfInstance> out;
  while (!open.empty()) {
    const Visit visit = open.back();
    open.pop_back();
    const auto node = item("nodes", visit.node);
    if (!node) return node.status();
    const std::string where = source_ + ": node " + std::to_string(visit.node);
    const auto local = local_transform(**node, where);
    if (!local) return local.status();
    const Affine3<double> world = visit.parent * *local;
    const auto mesh = get_index(**node, "mesh", kNoIndex, where);
    if (!mesh) return mesh.status();
    if (*mesh != kNoIndex) out.push_back({visit.node, *mesh, world});
    if (Status s = push(member(**node, "children"), world); !s) return s;
  }
  return out;
}

}  // namespace gsnav::io::detail
