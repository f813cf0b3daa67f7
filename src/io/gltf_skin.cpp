// SPDX-License-Identifier: Apache-2.0
#include "gltf_skin.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "file.hpp"
#include "gsnav/skin/lbs.hpp"

namespace gsnav::io {
namespace detail {
namespace {

/// A rotation times a scale; `off` is how far the linear part is from that, relative.
struct ScaledLinear {
  Mat3d rotation;
  double scale = 0.0, off = 1.0;
};

ScaledLinear scaled_rotation_of(const Mat3d& m) {
  ScaledLinear out;
  const double det = determinant(m);
  if (!(det > 0) || !std::isfinite(det)) return out;
  out.scale = std::cbrt(det);
  const Mat3d unit = m * (1.0 / out.scale);
  out.rotation = polar_rotation(unit);
  const Mat3d stretch = transpose(out.rotation) * unit;
  out.off = 0.0;
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k)
      out.off = std::max(out.off, std::fabs(stretch(i, k) - (i == k ? 1.0 : 0.0)));
  }
  return out;
}

/// The rotation of multiples of 90 degrees that is within 30 degrees of `m`, else `m`. Meshes are bound
/// upright, whatever the pose that the file shows.
Mat3d squared(const Mat3d& m) {
  Mat3d out;
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) out(i, k) = std::round(m(i, k));
  }
  const Mat3d between = transpose(out) * m;
  const double trace = between(0, 0) + between(1, 1) + between(2, 2);
  return determinant(out) > 0.5 && trace > 1 + 2 * std::cos(30 * 3.14159265358979323846 / 180) ? out : m;
}

/// One of the file's skins as it stands there.
struct FileSkin {
  std::size_t index = 0, vertices = 0;
  std::string name;
  std::vector<std::size_t> nodes;  // in the order of its list, as the rest
  std::vector<Affine3<double>> binds;
  std::vector<double> loads;  // how much weight each joint has
};

/// The skin that a node's mesh is moved by, or kNoNode.
std::size_t skin_of(const Json& node, std::size_t skins) {
  const Json* which = member(node, "skin");
  if (which == nullptr || !which->is_number() || member(node, "mesh") == nullptr) return kNoNode;
  const double k = which->get<double>();
  return k >= 0 && k < static_cast<double>(skins) && k == std::floor(k) ? static_cast<std::size_t>(k)
                                                                        : kNoNode;
}

/// Fills in loads and numbers of vertices. What is wrong with the arrays is found by read_surface.
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

/// `"name" (skins[2], 538 vertices)`
std::string described_skin(const FileSkin& s) {
  return (s.name.empty() ? "" : "\"" + s.name + "\" ") + "(skins[" + std::to_string(s.index) + "], " +
         std::to_string(s.vertices) + " vertices)";
}

/// The indices that `wanted` stands for; all that move a mesh where it is empty, or the first.
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

Affine3<double> inverse_of(const Affine3<double>& m) {
  const Mat3d& a = m.linear;
  const Vec3d c0 = cross(a.row[1], a.row[2]), c1 = cross(a.row[2], a.row[0]),
              c2 = cross(a.row[0], a.row[1]);
  const Mat3d inverse = transpose(Mat3d{{c0, c1, c2}}) * (1.0 / dot(a.row[0], c0));
  return {inverse, -(inverse * m.translation)};
}

/// Equal but for rounding of float32 numbers on the way.
bool nearly(const Affine3<double>& a, const Affine3<double>& b, double tolerance) {
  double size = 0.0, off = 0.0;
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) {
      size = std::max(size, std::fabs(a.linear(i, k)));
      off = std::max(off, std::fabs(a.linear(i, k) - b.linear(i, k)));
    }
  }
  const double far = norm(a.translation);
  return off <= tolerance * size && norm(a.translation - b.translation) <= tolerance * (far + size);
}

/// Joints of several skins by node, with the first skin's inverse binds.
class SharedRig {
 public:
  explicit SharedRig(std::size_t nodes) : binds(nodes), loads(nodes, 0.0), there(nodes, false) {}

  /// Adds a skin where it fits; `rig_from_mesh` takes its vertices to the first skin's space.
  bool join(const FileSkin& s, Affine3<double>& rig_from_mesh) {
    std::vector<std::size_t> both, any;
    for (std::size_t j = 0; j < s.nodes.size(); ++j) {
      if (!there[s.nodes[j]]) continue;
      any.push_back(j);
      if (s.loads[j] > 0 && loads[s.nodes[j]] > 0) both.push_back(j);
    }
    if (!empty_ && any.empty()) return false;
    const std::vector<std::size_t>& shared = both.empty() ? any : both;
    rig_from_mesh = {};
    const auto fits = [&](const Affine3<double>& m, double tolerance) {
      for (const std::size_t j : shared) {
        if (!nearly(s.binds[j], binds[s.nodes[j]] * m, tolerance)) return false;
      }
      return true;
    };
    if (!fits(rig_from_mesh, 1e-6)) {
      std::size_t most = shared[0];
      for (const std::size_t j : shared) most = s.loads[j] > s.loads[most] ? j : most;
      const Affine3<double>& bind = binds[s.nodes[most]];
      if (!(determinant(bind.linear) > 0) || !(determinant(s.binds[most].linear) > 0)) return false;
      rig_from_mesh = inverse_of(bind) * s.binds[most];
      if (!both.empty() && !fits(rig_from_mesh, 1e-4)) return false;
    }
    const Affine3<double> mesh_from_rig = inverse_of(rig_from_mesh);
    for (std::size_t j = 0; j < s.nodes.size(); ++j) {
      const std::size_t n = s.nodes[j];
      // What moves nothing may have any bind; the one that moves something counts.
      if (!there[n] || (!(loads[n] > 0) && s.loads[j] > 0)) binds[n] = s.binds[j] * mesh_from_rig;
      there[n] = true;
      loads[n] += s.loads[j];
    }
    empty_ = false;
    return true;
  }

  std::vector<Affine3<double>> binds;  // [nodes], as the next two
  std::vector<double> loads;
  std::vector<bool> there;

 private:
  bool empty_ = true;
};

std::vector<std::string> joint_names(const GltfNodes& nodes, const std::vector<std::size_t>& joints) {
  std::set<std::string> taken;
  std::vector<std::string> out;
  for (const std::size_t node : joints) {
    std::string name = nodes.names[node].empty() ? "node" + std::to_string(node) : nodes.names[node];
    const std::string base = name;
    for (int n = 2; !taken.insert(name).second; ++n) name = base + "#" + std::to_string(n);
    out.push_back(name);
  }
  return out;
}

/// Compares the file's own skinning with that by rigid joints.
class RigidError final : public PoseObserver {
 public:
  RigidError(const GltfSkin& skin, const SkinnedMesh& mesh) : skin_(skin), mesh_(mesh) {
    const Mat3d& m = skin.canonical_from_mesh.linear;
    const double scale = std::cbrt(determinant(m));
    const Mat3d back = transpose(m) * (1.0 / (scale * scale));
    for (const Vec3d& p : mesh.positions)
      raw_.push_back(back * (p - skin.canonical_from_mesh.translation));
    turn_ = rotation_matrix(skin.canonical_from_scene);
  }
  void look(const std::vector<Affine3<double>>& globals) override {
    const std::size_t joints = skin_.nodes.size();
    std::vector<Affine3<double>> rigid = rigid_joints(skin_, globals), full(joints);
    for (std::size_t j = 0; j < joints; ++j) {
      rigid[j] = rigid[j] * mesh_.skeleton.inverse_binds[j];
      full[j] = Affine3<double>{turn_, {}} * (globals[skin_.nodes[j]] * skin_.inverse_binds[j]);
    }
    const std::size_t k = mesh_.influences;
    for (std::size_t v = 0; v < raw_.size(); ++v) {
      Vec3d a{}, b{};
      for (std::size_t i = v * k; i < (v + 1) * k; ++i) {
        const double w = static_cast<double>(mesh_.weights[i]);
        a += (full[mesh_.joint_indices[i]] * raw_[v]) * w;
        b += (rigid[mesh_.joint_indices[i]] * mesh_.positions[v]) * w;
      }
      worst = std::max(worst, norm(a - b));
    }
  }
  double worst = 0.0;

 private:
  const GltfSkin& skin_;
  const SkinnedMesh& mesh_;
  std::vector<Vec3d> raw_;
  Mat3d turn_;
};

struct NoObserver final : PoseObserver {
  void look(const std::vector<Affine3<double>>&) override {}
};

/// The node of a joint's name, which joint_names may have given a number; or kNoNode.
std::size_t node_called(const std::map<std::string, std::vector<std::size_t>>& by_name,
                        const std::string& joint) {
  if (const auto exact = by_name.find(joint); exact != by_name.end()) return exact->second[0];
  const std::size_t mark = joint.rfind('#');
  if (mark == joint.npos || joint.size() - mark < 2 || joint.size() - mark > 7 ||
      joint.find_first_not_of("0123456789", mark + 1) != joint.npos) {
    return kNoNode;
  }
  const auto base = by_name.find(joint.substr(0, mark));
  const std::size_t number = std::stoul(joint.substr(mark + 1));
  return base == by_name.end() || number < 2 || number > base->second.size() ? kNoNode
                                                                             : base->second[number - 1];
}

Status check_options(const std::filesystem::path& path, const GltfOptions& options) {
  if (!(options.frame_rate >= 0) || !std::isfinite(options.frame_rate)) {
    return {Errc::invalid_argument, path.string() + ": GltfOptions.frame_rate must not be negative"};
  }
  if (!(options.scale > 0) || !std::isfinite(options.scale)) {
    return {Errc::invalid_argument, path.string() + ": GltfOptions.scale is " +
                                        std::to_string(options.scale) + ", must be above 0"};
  }
  return {};
}

}  // namespace

std::vector<Affine3<double>> rigid_joints(const GltfSkin& skin,
                                          const std::vector<Affine3<double>>& globals) {
  const Affine3<double> turn{rotation_matrix(skin.canonical_from_scene), {}};
  std::vector<Affine3<double>> out;
  for (std::size_t j = 0; j < skin.nodes.size(); ++j) {
    if (skin.nodes[j] == kNoNode) {  // never a root
      const auto parent = static_cast<std::size_t>(skin.skeleton.parents[j]);
      out.push_back(out[parent] * skin.skeleton.rest_local[j]);
      continue;
    }
    const Affine3<double>& g = globals[skin.nodes[j]];
    out.push_back(turn * Affine3<double>{scaled_rotation_of(g.linear).rotation, g.translation});
  }
  return out;
}

Result<GltfSkin> read_skin(const GltfFile& file, const GltfNodes& nodes,
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
  SharedRig rig(nodes.nodes.size());
  std::vector<std::optional<Affine3<double>>> placed_by_skin(skins.size());
  for (bool more = true; more;) {
    more = false;
    for (std::size_t k = 0; k < skins.size(); ++k) {
      Affine3<double> to_rig;
      if (placed_by_skin[k] || !rig.join(skins[k], to_rig)) continue;
      placed_by_skin[k] = to_rig;
      more = true;
    }
  }
  std::string inside, outside;
  for (std::size_t k = 0; k < skins.size(); ++k) {
    std::string& list = placed_by_skin[k] ? inside : outside;
    if (list.size() < 1000) list += (list.empty() ? "" : ", ") + described_skin(skins[k]);
  }
  if (!outside.empty()) {
    return {Errc::unsupported, file.source() + ": its skins have more than one rig: " + inside +
                                   " on one; " + outside +
                                   " on others. Choose skins of one rig (GltfOptions::skins, --skin)"};
  }
  GltfSkin out;
  std::vector<std::size_t> place(nodes.nodes.size(), 0);  // joint of each node
  std::vector<double> load;
  for (const std::size_t node : nodes.order) {
    if (!rig.there[node]) continue;
    place[node] = out.nodes.size();
    out.nodes.push_back(node);
    out.inverse_binds.push_back(rig.binds[node]);
    load.push_back(rig.loads[node]);
  }
  for (std::size_t k = 0; k < skins.size(); ++k) {
    GltfSkinPart& part = out.parts.emplace_back();
    part.index = skins[k].index;
    part.rig_from_mesh = *placed_by_skin[k];
    for (const std::size_t node : skins[k].nodes) part.joint_of.push_back(place[node]);
  }
  const std::string at = file.where("skins", out.parts[0].index);
  // What the mesh is bound to is what the joint that moves most of it says.
  const auto most = static_cast<std::size_t>(std::max_element(load.begin(), load.end()) - load.begin());
  const std::vector<Affine3<double>> globals = nodes.globals();
  const Affine3<double> placed_by = globals[out.nodes[most]] * out.inverse_binds[most];
  const ScaledLinear placed = scaled_rotation_of(placed_by.linear);
  constexpr double kShear = 0.02;
  if (placed.off > kShear)
    return {Errc::invalid_file,
            at + ": the bind of joint " + std::to_string(most) + " is not rigid times a scale"};
  const Mat3d upright = rotation_matrix(out.canonical_from_scene) * squared(placed.rotation),
              back = transpose(upright);
  out.canonical_from_mesh = {upright * placed.scale, {}};
  Skeleton& skeleton = out.skeleton;
  skeleton.names = joint_names(nodes, out.nodes);
  for (std::size_t j = 0; j < out.nodes.size(); ++j) {
    std::int64_t up = nodes.parents[out.nodes[j]];
    while (up >= 0 && !rig.there[static_cast<std::size_t>(up)])
      up = nodes.parents[static_cast<std::size_t>(up)];
    skeleton.parents.push_back(up < 0 ? -1
                                      : static_cast<std::int32_t>(place[static_cast<std::size_t>(up)]));
    const ScaledLinear b = scaled_rotation_of(out.inverse_binds[j].linear);
    if (load[j] > 0 && (b.off > kShear || !is_finite(out.inverse_binds[j].translation))) {
      return {Errc::invalid_file, at + ": the inverse bind of joint \"" + skeleton.names[j] +
                                      "\" is not rigid times a scale"};
    }
    skeleton.inverse_binds.push_back({b.rotation * back, out.inverse_binds[j].translation *
                                                             (placed.scale / std::max(b.scale, 1e-12))});
  }
  // Joints that move nothing may have any bind: they keep the place that the file shows them in beside
  // one that does.
  const std::vector<Affine3<double>> shown_at = rigid_joints(out, globals);
  for (std::size_t j = 0; j < out.nodes.size(); ++j) {
    if (load[j] > 0) continue;
    std::size_t beside = most;
    for (std::int32_t up = skeleton.parents[j]; up >= 0;
         up = skeleton.parents[static_cast<std::size_t>(up)]) {
      if (load[static_cast<std::size_t>(up)] > 0) {
        beside = static_cast<std::size_t>(up);
        break;
      }
    }
    skeleton.inverse_binds[j] =
        rigid_inverse(shown_at[j]) * shown_at[beside] * skeleton.inverse_binds[beside];
  }
  for (std::size_t j = 0; j < out.nodes.size(); ++j) {
    const Affine3<double> global = rigid_inverse(skeleton.inverse_binds[j]);
    const std::int32_t parent = skeleton.parents[j];
    skeleton.rest_local.push_back(
        parent < 0 ? global : skeleton.inverse_binds[static_cast<std::size_t>(parent)] * global);
  }
  if (Status s = skeleton.validate(); !s) return {Errc::invalid_file, at + ": " + s.message()};
  return out;
}

}  // namespace detail

Result<LoadedSkinnedMesh> load_gltf_skin(const std::filesystem::path& path, const GltfOptions& options) {
  using namespace detail;
  return guarded(path.string(), [&]() -> Result<LoadedSkinnedMesh> {
    if (Status s = check_options(path, options); !s) return s;
    auto file = GltfFile::open(path, options.limits);
    if (!file) return file.status();
    auto nodes = read_nodes(*file);
    if (!nodes) return nodes.status();
    nodes->unit = options.scale;
    const auto skin = read_skin(*file, *nodes, options.skins);
    if (!skin) return skin.status();
    LoadedSkinnedMesh out;
    out.mesh.name = path.stem().string();
    out.mesh.skeleton = skin->skeleton;
    if (Status s = read_surface(*file, *skin, out); !s) return s;
    if (Status s = out.mesh.validate(); !s) return detail::invalid_file(path, s.message());
    const auto still =
        clip_from_matrices(skin->skeleton, 1.0, rigid_joints(*skin, nodes->globals()), false);
    if (!still) return detail::invalid_file(path, still.message());
    still->pose({}, out.pose);
    RigidError error(*skin, out.mesh);
    error.look(nodes->globals());
    if (Status s =
            read_clips(*file, *skin, *nodes, options.frame_rate, error, out.clips, out.report.warnings);
        !s) {
      return s;
    }
    out.report.rigid_error = error.worst;
    if (error.worst > 1e-3) {
      out.report.warnings.push_back(
          "joints change their scale, which is left out: vertices are off by up to " +
          std::to_string(1000 * error.worst) + " mm");
    }
    return out;
  });
}

Result<LoadedClips> load_gltf_clips(const std::filesystem::path& path, const Skeleton& skeleton,
                                    const GltfOptions& options) {
  using namespace detail;
  return guarded(path.string(), [&]() -> Result<LoadedClips> {
    if (Status s = check_options(path, options); !s) return s;
    if (Status s = skeleton.validate(); !s) return s;
    auto file = GltfFile::open(path, options.limits);
    if (!file) return file.status();
    auto nodes = read_nodes(*file);
    if (!nodes) return nodes.status();
    nodes->unit = options.scale;
    if (file->count("animations") == 0) return detail::invalid_file(path, "there is no animation in it");
    std::map<std::string, std::vector<std::size_t>> by_name;
    for (const std::size_t n : nodes->order) by_name[nodes->names[n]].push_back(n);
    GltfSkin rig;
    rig.skeleton = skeleton;
    std::string missing;
    std::size_t missing_count = 0;
    bool root_missing = false;
    for (std::size_t j = 0; j < skeleton.size(); ++j) {
      rig.nodes.push_back(node_called(by_name, skeleton.names[j]));
      if (rig.nodes[j] != kNoNode) continue;
      if (++missing_count <= 8) missing += (missing.empty() ? "\"" : ", \"") + skeleton.names[j] + "\"";
      root_missing = root_missing || skeleton.parents[j] < 0;
    }
    if (missing_count > 8) missing += " and " + std::to_string(missing_count - 8) + " more";
    if (root_missing || 2 * missing_count > skeleton.size()) {
      return {Errc::invalid_argument,
              path.string() + ": its nodes have not the names of the skeleton's joints: there is no " +
                  missing};
    }
    LoadedClips out;
    if (missing_count != 0)
      out.warnings.push_back("joints without a node keep their rest pose: " + missing);
    NoObserver none;
    if (Status s = read_clips(*file, rig, *nodes, options.frame_rate, none, out.clips, out.warnings); !s)
      return s;
    return out;
  });
}

}  // namespace gsnav::io
