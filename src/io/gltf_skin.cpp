// SPDX-License-Identifier: Apache-2.0
#include "gltf_skin.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>

#include "file.hpp"

namespace gsnav::io {
namespace detail {
namespace {

/// Compares the file's own skinning with skinning by rigid joints.
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
    to_joint_matrices(rigid, mesh_.skeleton.inverse_binds);
    for (std::size_t j = 0; j < joints; ++j) {
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

/// The node that a joint is named after, or kNoNode. joint_names may have added a number to the name.
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
