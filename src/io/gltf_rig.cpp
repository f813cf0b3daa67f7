// SPDX-License-Identifier: Apache-2.0 The rig that the skins of a glTF file share, and the rigid
// skeleton made from it.
#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <string>

#include "gltf_file_skins.hpp"
#include "gsnav/detail/math/angles.hpp"
#include "gsnav/skin/lbs.hpp"

namespace gsnav::io::detail {
namespace {

/// A linear map split into a rotation and a scale. `off` is the relative distance of the map from that
/// product.
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

/// The rotation by multiples of 90 degrees that is within 30 degrees of `m`, or else `m`. Meshes are
/// bound upright, whatever pose the file shows.
Mat3d squared(const Mat3d& m) {
  Mat3d out;
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) out(i, k) = std::round(m(i, k));
  }
  const Mat3d between = transpose(out) * m;
  const double trace = between(0, 0) + between(1, 1) + between(2, 2);
  return determinant(out) > 0.5 && trace > 1 + 2 * std::cos(radians(30)) ? out : m;
}

Affine3<double> inverse_of(const Affine3<double>& m) {
  const Mat3d linear = inverse(m.linear);
  return {linear, -(linear * m.translation)};
}

/// Whether two maps are equal up to float32 rounding in the file.
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

/// The joints of several skins, indexed by node, with inverse binds in the space of the first skin.
class SharedRig {
 public:
  explicit SharedRig(std::size_t nodes)
      : binds(nodes), loads(nodes, 0.0), there(nodes, false), joint(nodes, 0) {}

  /// Adds a skin if it fits. `rig_from_mesh` gets the map from its vertices to the space of the first
  /// skin.
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
      // A joint that moves nothing may have any bind, so prefer the bind of a skin in which it moves
      // something.
      if (!there[n] || (!(loads[n] > 0) && s.loads[j] > 0)) binds[n] = s.binds[j] * mesh_from_rig;
      there[n] = true;
      loads[n] += s.loads[j];
    }
    empty_ = false;
    return true;
  }

  std::vector<Affine3<double>> binds;  // [nodes], as are the next three
  std::vector<double> loads;
  std::vector<bool> there;
  std::vector<std::size_t> joint;  // index in the skeleton

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

/// Makes the skeleton of the rig's joints, and the pose in which its mesh is bound. `load` is the total
/// weight of each joint.
Status bind_skeleton(const GltfNodes& nodes, const SharedRig& rig, const std::vector<double>& load,
                     const std::string& at, GltfSkin& out) {
  // The frame of the mesh follows from the joint that moves most of it.
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
    skeleton.parents.push_back(
        up < 0 ? -1 : static_cast<std::int32_t>(rig.joint[static_cast<std::size_t>(up)]));
    const ScaledLinear b = scaled_rotation_of(out.inverse_binds[j].linear);
    if (load[j] > 0 && (b.off > kShear || !is_finite(out.inverse_binds[j].translation))) {
      return {Errc::invalid_file, at + ": the inverse bind of joint \"" + skeleton.names[j] +
                                      "\" is not rigid times a scale"};
    }
    skeleton.inverse_binds.push_back({b.rotation * back, out.inverse_binds[j].translation *
                                                             (placed.scale / std::max(b.scale, 1e-12))});
  }
  // Joints that move nothing may have any bind. Bind them where the file shows them, relative to a joint
  // that moves something.
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
  const auto found = read_file_skins(file, nodes, wanted);
  if (!found) return found.status();
  const std::vector<FileSkin>& skins = *found;
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
  std::vector<double> load;
  for (const std::size_t node : nodes.order) {
    if (!rig.there[node]) continue;
    rig.joint[node] = out.nodes.size();
    out.nodes.push_back(node);
    out.inverse_binds.push_back(rig.binds[node]);
    load.push_back(rig.loads[node]);
  }
  for (std::size_t k = 0; k < skins.size(); ++k) {
    GltfSkinPart& part = out.parts.emplace_back();
    part.index = skins[k].index;
    part.rig_from_mesh = *placed_by_skin[k];
    for (const std::size_t node : skins[k].nodes) part.joint_of.push_back(rig.joint[node]);
  }
  const std::string at = file.where("skins", out.parts[0].index);
  if (Status s = bind_skeleton(nodes, rig, load, at, out); !s.ok()) return s;
  return out;
}

}  // namespace gsnav::io::detail
