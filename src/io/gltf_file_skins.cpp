// SPDX-License-Identifier: Apache-2.0
#include "gltf_file_skins.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

namespace gsnav::io::detail {
namespace {

/// The skin that moves a node's mesh, or kNoNode.
std::size_t skin_of(const Json& node, std::size_t skins) {
  const Json* which = member(node, "skin");
  if (which == nullptr || !which->is_number() || member(node, "mesh") == nullptr) return kNoNode;
  const double k = which->get<double>();
  return k >= 0 && k < static_cast<double>(skins) && k == std::floor(k) ? static_cast<std::size_t>(k)
                                                                        : kNoNode;
}

/// Fills in loads and numbers of vertices. Bad arrays are ignored here; read_surface reports them.
void weigh_joints(const GltfFile& file, std::vector<FileSkin>& skins) {
  std::vector<FileSkin*> of(file.count("skins"), nullptr);
  for (FileSkin& s : skins) of[s.index] = &s;
  for (std::size_t n = 0; n < file.count("nodes"); ++n) {
    const Json& node = **file.item("nodes", n);
    const std::size_t which = skin_of(node, of.size());
    if (which == kNoNode || of[which] == nullptr) continue;
    FileSkin& skin = *of[which];
    const auto m = file.index(node, "mesh", "meshes", "");
    const auto entry = m ? file.item("meshes", *m) : Result<const Json*>(m.status());
    const Json* primitives = entry ? member(**entry, "primitives") : nullptr;
    if (primitives == nullptr || !primitives->is_array()) continue;
    for (const Json& p : *primitives) {
      const Json* attributes = member(p, "attributes");
      const auto j = attributes == nullptr ? Result<std::size_t>(Errc::invalid_file, "")
                                           : file.index(*attributes, "JOINTS_0", "accessors", "");
      const auto w = attributes == nullptr ? Result<std::size_t>(Errc::invalid_file, "")
                                           : file.index(*attributes, "WEIGHTS_0", "accessors", "");
      if (!j || !w) continue;
      const auto indices = file.numbers(*j, "VEC4"), weights = file.numbers(*w, "VEC4");
      if (!indices || !weights) continue;
      skin.vertices += weights->count;
      for (std::size_t i = 0; i < std::min(indices->values.size(), weights->values.size()); ++i) {
        const double joint = indices->values[i];
        if (joint >= 0 && joint < static_cast<double>(skin.loads.size()))
          skin.loads[static_cast<std::size_t>(joint)] += std::max(0.0, weights->values[i]);
      }
    }
  }
}

Result<FileSkin> read_file_skin(const GltfFile& file, const GltfNodes& nodes, std::size_t index) {
  const auto entry = file.item("skins", index);
  if (!entry) return entry.status();
  const std::string at = file.where("skins", index);
  FileSkin out;
  out.index = index;
  const Json* name = member(**entry, "name");
  if (name != nullptr && name->is_string()) out.name = name->get<std::string>();
  const Json* list = member(**entry, "joints");
  if (list == nullptr || !list->is_array() || list->empty() || list->size() > nodes.nodes.size()) {
    return {Errc::invalid_file, at + ": 'joints' is no list of nodes"};
  }
  const std::size_t count = list->size();
  std::set<std::size_t> seen;
  for (std::size_t j = 0; j < count; ++j) {
    const double n = (*list)[j].is_number() ? (*list)[j].get<double>() : -1.0;
    if (!(n >= 0 && n < static_cast<double>(nodes.nodes.size())) || n != std::floor(n) ||
        !seen.insert(static_cast<std::size_t>(n)).second) {
      return {Errc::invalid_file, at + ": 'joints[" + std::to_string(j) + "]' is " + shown((*list)[j]) +
                                      ": no node, or one twice"};
    }
    out.nodes.push_back(static_cast<std::size_t>(n));
  }
  out.binds.resize(count);
  out.loads.assign(count, 0.0);
  if (member(**entry, "inverseBindMatrices") == nullptr) return out;
  const auto a = file.index(**entry, "inverseBindMatrices", "accessors", at);
  if (!a) return a.status();
  const auto m = file.numbers(*a, "MAT4");
  if (!m) return m.status();
  if (m->count < count)
    return {Errc::invalid_file, at + ": " + std::to_string(m->count) + " inverse binds for " +
                                    std::to_string(count) + " joints"};
  for (std::size_t j = 0; j < count; ++j) {
    for (int i = 0; i < 3; ++i) {
      for (int k = 0; k < 3; ++k) out.binds[j].linear(i, k) = m->row(j)[4 * k + i];
      out.binds[j].translation[i] = m->row(j)[12 + i];
    }
  }
  return out;
}

/// Indices of the skins in `wanted`. If it is empty: all skins that move a mesh, or else the first skin.
Result<std::vector<std::size_t>> wanted_skins(const GltfFile& file,
                                              const std::vector<std::string>& wanted) {
  const std::size_t count = file.count("skins");
  std::set<std::size_t> out;
  for (const std::string& want : wanted) {
    std::vector<std::size_t> named;
    std::string all;
    for (std::size_t k = 0; k < count; ++k) {
      const auto entry = file.item("skins", k);
      const Json* name = entry ? member(**entry, "name") : nullptr;
      if (name != nullptr && *name == want) named.push_back(k);
      if (k < 100)
        all += (k == 0 ? "" : ", ") + std::to_string(k) + (name == nullptr ? "" : " " + shown(*name));
    }
    const bool digits =
        !want.empty() && want.size() < 10 && want.find_first_not_of("0123456789") == want.npos;
    if (named.empty() && digits && std::stoul(want) < count) named.push_back(std::stoul(want));
    if (named.size() != 1) {
      return {Errc::invalid_argument, file.source() + ": " +
                                          (named.empty() ? "no skin" : "more than one skin") + " is \"" +
                                          want + "\"; there are " + all + (count > 100 ? ", ..." : "")};
    }
    out.insert(named[0]);
  }
  for (std::size_t n = 0; wanted.empty() && n < file.count("nodes"); ++n) {
    if (const std::size_t k = skin_of(**file.item("nodes", n), count); k != kNoNode) out.insert(k);
  }
  if (out.empty()) out.insert(0);
  return std::vector<std::size_t>(out.begin(), out.end());
}

}  // namespace

std::string described_skin(const FileSkin& s) {
  return (s.name.empty() ? "" : "\"" + s.name + "\" ") + "(skins[" + std::to_string(s.index) + "], " +
         std::to_string(s.vertices) + " vertices)";
}

Result<std::vector<FileSkin>> read_file_skins(const GltfFile& file, const GltfNodes& nodes,
                                              const std::vector<std::string>& wanted) {
  if (file.count("skins") == 0) return {Errc::unsupported, file.source() + ": there is no skin in it"};
  const auto indices = wanted_skins(file, wanted);
  if (!indices) return indices.status();
  std::vector<FileSkin> skins;
  for (const std::size_t index : *indices) {
    auto s = read_file_skin(file, nodes, index);
    if (!s) return s.status();
    skins.push_back(std::move(*s));
  }
  weigh_joints(file, skins);
  return skins;
}

}  // namespace gsnav::io::detail
