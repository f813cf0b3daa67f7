// SPDX-License-Identifier: Apache-2.0
#include "gltf_skin.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <utility>

#include "file.hpp"
#include "gsnav/kernels/lbs.hpp"

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
    for (int k = 0; k < 3; ++k) out.off = std::max(out.off, std::fabs(stretch(i, k) - (i == k ? 1.0 : 0.0)));
  }
  return out;
}

/// The rotation of multiples of 90 degrees that is within 30 degrees of `m`, else `m`. Meshes are bound upright,
/// whatever the pose that the file shows.
Mat3d squared(const Mat3d& m) {
  Mat3d out;
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) out(i, k) = std::round(m(i, k));
  }
  const Mat3d between = transpose(out) * m;
  const double trace = between(0, 0) + between(1, 1) + between(2, 2);
  return determinant(out) > 0.5 && trace > 1 + 2 * std::cos(30 * 3.14159265358979323846 / 180) ? out : m;
}

/// How much weight each joint of the skin's list has. What is wrong with the arrays is found by read_surface.
std::vector<double> joint_loads(const GltfFile& file, std::size_t skin, std::size_t joints) {
  std::vector<double> out(joints, 0.0);
  for (std::size_t n = 0; n < file.count("nodes"); ++n) {
    const Json& node = **file.item("nodes", n);
    const Json *which = member(node, "skin"), *mesh = member(node, "mesh");
    if (mesh == nullptr || which == nullptr || !which->is_number() || which->get<double>() != static_cast<double>(skin))
      continue;
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
      for (std::size_t i = 0; i < std::min(indices->values.size(), weights->values.size()); ++i) {
        const double joint = indices->values[i];
        if (joint >= 0 && joint < static_cast<double>(joints))
          out[static_cast<std::size_t>(joint)] += std::max(0.0, weights->values[i]);
      }
    }
  }
  return out;
}

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
    for (const Vec3d& p : mesh.positions) raw_.push_back(back * (p - skin.canonical_from_mesh.translation));
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

}  // namespace

std::vector<Affine3<double>> rigid_joints(const GltfSkin& skin, const std::vector<Affine3<double>>& globals) {
  const Affine3<double> turn{rotation_matrix(skin.canonical_from_scene), {}};
  std::vector<Affine3<double>> out;
  for (const std::size_t node : skin.nodes) {
    const Affine3<double>& g = globals[node];
    out.push_back(turn * Affine3<double>{scaled_rotation_of(g.linear).rotation, g.translation});
  }
  return out;
}

Result<GltfSkin> read_skin(const GltfFile& file, const GltfNodes& nodes, std::size_t index) {
  if (file.count("skins") == 0) return {Errc::unsupported, file.source() + ": there is no skin in it"};
  const auto entry = file.item("skins", index);
  if (!entry) return {Errc::invalid_argument, entry.message()};
  const std::string at = file.where("skins", index);
  const Json* list = member(**entry, "joints");
  if (list == nullptr || !list->is_array() || list->empty() || list->size() > nodes.nodes.size()) {
    return {Errc::invalid_file, at + ": 'joints' is no list of nodes"};
  }
  const std::size_t count = list->size();
  constexpr std::size_t none = static_cast<std::size_t>(-1);
  std::vector<std::size_t> place(nodes.nodes.size(), none);  // in the file's list
  for (std::size_t j = 0; j < count; ++j) {
    const double n = (*list)[j].is_number() ? (*list)[j].get<double>() : -1.0;
    if (!(n >= 0 && n < static_cast<double>(nodes.nodes.size())) || n != std::floor(n) ||
        place[static_cast<std::size_t>(n)] != none) {
      return {Errc::invalid_file,
              at + ": 'joints[" + std::to_string(j) + "]' is " + shown((*list)[j]) + ": no node, or one twice"};
    }
    place[static_cast<std::size_t>(n)] = j;
  }
  std::vector<Affine3<double>> binds(count);
  if (member(**entry, "inverseBindMatrices") != nullptr) {
    const auto a = file.index(**entry, "inverseBindMatrices", "accessors", at);
    if (!a) return a.status();
    const auto m = file.numbers(*a, "MAT4");
    if (!m) return m.status();
    if (m->count < count)
      return {Errc::invalid_file,
              at + ": " + std::to_string(m->count) + " inverse binds for " + std::to_string(count) + " joints"};
    for (std::size_t j = 0; j < count; ++j) {
      for (int i = 0; i < 3; ++i) {
        for (int k = 0; k < 3; ++k) binds[j].linear(i, k) = m->row(j)[4 * k + i];
        binds[j].translation[i] = m->row(j)[12 + i];
      }
    }
  }
  GltfSkin out;
  out.joint_of.assign(count, 0);
  for (const std::size_t node : nodes.order) {
    if (place[node] == none) continue;
    out.joint_of[place[node]] = out.nodes.size();
    out.nodes.push_back(node);
    out.inverse_binds.push_back(binds[place[node]]);
  }
  const std::vector<double> loads = joint_loads(file, index, count);
  std::vector<double> load;
  for (const std::size_t node : out.nodes) load.push_back(loads[place[node]]);
  // What the mesh is bound to is what the joint that moves most of it says.
  const auto most = static_cast<std::size_t>(std::max_element(load.begin(), load.end()) - load.begin());
  const std::vector<Affine3<double>> globals = nodes.globals();
  const Affine3<double> placed_by = globals[out.nodes[most]] * out.inverse_binds[most];
  const ScaledLinear placed = scaled_rotation_of(placed_by.linear);
  constexpr double kShear = 0.02;
  if (placed.off > kShear)
    return {Errc::invalid_file, at + ": the bind of joint " + std::to_string(most) + " is not rigid times a scale"};
  const Mat3d upright = rotation_matrix(out.canonical_from_scene) * squared(placed.rotation), back = transpose(upright);
  out.canonical_from_mesh = {upright * placed.scale, {}};
  Skeleton& skeleton = out.skeleton;
  skeleton.names = joint_names(nodes, out.nodes);
  for (std::size_t j = 0; j < out.nodes.size(); ++j) {
    std::int64_t up = nodes.parents[out.nodes[j]];
    while (up >= 0 && place[static_cast<std::size_t>(up)] == none) up = nodes.parents[static_cast<std::size_t>(up)];
    skeleton.parents.push_back(up < 0 ? -1
                                      : static_cast<std::int32_t>(out.joint_of[place[static_cast<std::size_t>(up)]]));
    const ScaledLinear b = scaled_rotation_of(out.inverse_binds[j].linear);
    if (load[j] > 0 && (b.off > kShear || !is_finite(out.inverse_binds[j].translation))) {
      return {Errc::invalid_file,
              at + ": the inverse bind of joint \"" + skeleton.names[j] + "\" is not rigid times a scale"};
    }
    skeleton.inverse_binds.push_back(
        {b.rotation * back, out.inverse_binds[j].translation * (placed.scale / std::max(b.scale, 1e-12))});
  }
  // Joints that move nothing may have any bind: they keep the place that the file shows them in beside one that does.
  const std::vector<Affine3<double>> shown_at = rigid_joints(out, globals);
  for (std::size_t j = 0; j < out.nodes.size(); ++j) {
    if (load[j] > 0) continue;
    std::size_t beside = most;
    for (std::int32_t up = skeleton.parents[j]; up >= 0; up = skeleton.parents[static_cast<std::size_t>(up)]) {
      if (load[static_cast<std::size_t>(up)] > 0) {
        beside = static_cast<std::size_t>(up);
        break;
      }
    }
    skeleton.inverse_binds[j] = rigid_inverse(shown_at[j]) * shown_at[beside] * skeleton.inverse_binds[beside];
  }
  for (std::size_t j = 0; j < out.nodes.size(); ++j) {
    const Affine3<double> global = rigid_inverse(skeleton.inverse_binds[j]);
    const std::int32_t parent = skeleton.parents[j];
    skeleton.rest_local.push_back(parent < 0 ? global
                                             : skeleton.inverse_binds[static_cast<std::size_t>(parent)] * global);
  }
  if (Status s = skeleton.validate(); !s) return {Errc::invalid_file, at + ": " + s.message()};
  return out;
}

}  // namespace detail

Result<LoadedSkinnedMesh> load_gltf_skin(const std::filesystem::path& path, const GltfOptions& options) {
  using namespace detail;
  return guarded(path.string(), [&]() -> Result<LoadedSkinnedMesh> {
    if (!(options.frame_rate >= 0) || !std::isfinite(options.frame_rate)) {
      return {Errc::invalid_argument, path.string() + ": GltfOptions.frame_rate must not be negative"};
    }
    auto file = GltfFile::open(path, options.limits);
    if (!file) return file.status();
    const auto nodes = read_nodes(*file);
    if (!nodes) return nodes.status();
    const auto skin = read_skin(*file, *nodes, options.skin);
    if (!skin) return skin.status();
    LoadedSkinnedMesh out;
    out.mesh.name = path.stem().string();
    out.mesh.skeleton = skin->skeleton;
    if (Status s = read_surface(*file, *skin, options.skin, out); !s) return s;
    if (Status s = out.mesh.validate(); !s) return detail::invalid_file(path, s.message());
    const auto still = clip_from_matrices(skin->skeleton, 1.0, rigid_joints(*skin, nodes->globals()), false);
    if (!still) return detail::invalid_file(path, still.message());
    still->pose({}, out.pose);
    RigidError error(*skin, out.mesh);
    error.look(nodes->globals());
    if (Status s = read_clips(*file, *skin, *nodes, options.frame_rate, error, out); !s) return s;
    out.report.rigid_error = error.worst;
    if (error.worst > 1e-3) {
      out.report.warnings.push_back("joints change their scale, which is left out: vertices are off by up to " +
                                    std::to_string(1000 * error.worst) + " mm");
    }
    return out;
  });
}

}  // namespace gsnav::io
