// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/io/avatar_file.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "avatar_arrays.hpp"
#include "file.hpp"
#include "gsnav/detail/avatar/smpl_joints.hpp"
#include "gsnav/detail/avatar/weight_gradients.hpp"
#include "gsnav/detail/io/npz_file.hpp"
#include "gsnav/detail/math/curves.hpp"
#include "gsnav/detail/skin/fk.hpp"
#include "npz_arrays.hpp"

namespace gsnav::io {
namespace {

constexpr std::size_t kMostJoints = 4096;

class AvatarReader {
 public:
  AvatarReader(const NpzFile& file, const LoadAvatarOptions& options)
      : file_(file), arrays_(file), options_(options) {}

  Result<LoadedAvatar> run() {
    for (const auto& step :
         {&AvatarReader::read_joints, &AvatarReader::read_arrays, &AvatarReader::read_cloud,
          &AvatarReader::read_weights, &AvatarReader::read_skinning, &AvatarReader::read_capsules}) {
      if (Status s = (this->*step)(); !s) return s;
    }
    out_.asset.name = std::filesystem::path(file_.source()).stem().string();
    if (Status s = out_.asset.validate(); !s) return {s.code(), file_.source() + ": " + s.message()};
    return std::move(out_);
  }

 private:
  Status bad(const std::string& what) const {
    return {Errc::invalid_file, file_.source() + ": " + what};
  }

  Status read_joints() {
    auto binds = detail::read_transforms(arrays_, "joints_inv_bind_matrix");
    if (!binds) return binds.status();
    Skeleton& skeleton = out_.asset.skeleton;
    skeleton.inverse_binds = std::move(*binds);
    const std::size_t joints = skeleton.inverse_binds.size();
    if (joints > kMostJoints) {
      return {Errc::unsupported, file_.source() + ": joints_inv_bind_matrix has " +
                                     std::to_string(joints) + " joints, more than " +
                                     std::to_string(kMostJoints)};
    }
    if (Status s = name_joints(joints); !s) return s;
    std::vector<Affine3<double>> globals;
    for (std::size_t j = 0; j < joints; ++j) {
      const Affine3<double>& m = skeleton.inverse_binds[j];
      // Float32 matrices are only approximately rigid.
      globals.push_back(rigid_inverse(Affine3<double>{polar_rotation(m.linear), m.translation}));
      // One that comes later is refused below.
      const std::int32_t parent = std::min(skeleton.parents[j], static_cast<std::int32_t>(j) - 1);
      skeleton.rest_local.push_back(joint_local(globals.data(), parent, globals[j]));
    }
    if (Status s = skeleton.validate(); !s) return {s.code(), file_.source() + ": " + s.message()};
    return {};
  }

  Status name_joints(std::size_t joints) {
    Skeleton& skeleton = out_.asset.skeleton;
    if (!options_.joint_names.empty() || !options_.joint_parents.empty()) {
      if (options_.joint_names.size() != joints || options_.joint_parents.size() != joints) {
        return {Errc::invalid_argument,
                file_.source() + ": " + std::to_string(options_.joint_names.size()) +
                    " joint_names and " + std::to_string(options_.joint_parents.size()) +
                    " joint_parents for " + std::to_string(joints) + " joints"};
      }
      skeleton.names = options_.joint_names;
      skeleton.parents = options_.joint_parents;
      return {};
    }
    if (file_.contains("joint_names")) return read_names(joints);
    const BodyJoints known = body_joints(joints);
    if (known.names.empty()) {
      return {Errc::unsupported, file_.source() + ": joints_inv_bind_matrix has " +
                                     std::to_string(joints) +
                                     " joints: neither SMPL's 24 nor SMPL-X's 55, and no joint_names"};
    }
    skeleton.names.assign(known.names.begin(), known.names.end());
    skeleton.parents.assign(known.parents.begin(), known.parents.end());
    return {};
  }

  Status read_names(std::size_t joints) {
    Skeleton& skeleton = out_.asset.skeleton;
    const auto names = file_.read_text("joint_names");
    if (!names) return names.status();
    for (std::size_t at = 0; at <= names->size();) {
      const std::size_t end = std::min(names->find('\n', at), names->size());
      skeleton.names.push_back(names->substr(at, end - at));
      at = end + 1;
    }
    const auto parents = arrays_.read("joint_parents", {joints});
    if (!parents) return parents.status();
    for (std::size_t j = 0; j < joints; ++j) {
      const double p = parents->values[j];
      if (!(p >= -1 && p < static_cast<double>(joints)) || p != std::floor(p)) {
        return bad("joint_parents[" + std::to_string(j) + "] is " + std::to_string(p));
      }
      skeleton.parents.push_back(static_cast<std::int32_t>(p));
    }
    return {};
  }

  Status read_arrays() {
    auto in = detail::read_avatar_arrays(arrays_, out_.asset.skeleton.size(), options_.colors,
                                         out_.report.warnings);
    if (in) in_ = std::move(*in);
    return in.status();
  }

  Status read_cloud() {
    const std::size_t rest = 3 * static_cast<std::size_t>(sh_coefficient_count(in_.sh_degree) - 1);
    GaussianCloudBuilder builder(in_.sh_degree, file_.source());
    builder.report().warnings = std::move(out_.report.warnings);
    builder.reserve(in_.count);
    std::vector<float> shn(rest);
    RawGaussian raw;
    for (std::size_t i = 0; i < in_.count; ++i) {
      const double* sh = &in_.shs.values[i * (3 + rest)];
      for (std::size_t k = 0; k < 3; ++k) {
        raw.mean[static_cast<int>(k)] = in_.means.values[3 * i + k];
        raw.log_scales[static_cast<int>(k)] = std::log(in_.scales.values[3 * i + k]);
        raw.sh0[k] = static_cast<float>(sh[k]);
      }
      for (std::size_t k = 0; k < rest; ++k) shn[k] = static_cast<float>(sh[3 + k]);
      raw.shN = shn.data();
      const double* q = &in_.quats.values[4 * i];
      raw.quat = {q[0], q[1], q[2], q[3]};
      raw.opacity_logit = logit_by_logs(in_.opacities.values[i]);
      if (builder.add(raw)) kept_.push_back(i);
    }
    out_.asset.cloud = std::move(builder.cloud());
    out_.report = std::move(builder.report());
    if (kept_.empty()) return bad("no Gaussian can be seen");
    return {};
  }

  Status read_weights() {
    const std::size_t joints = out_.asset.skeleton.size();
    std::vector<std::uint16_t> indices;
    std::vector<float> weights;
    indices.reserve(kept_.size() * joints);
    weights.reserve(kept_.size() * joints);
    std::size_t unequal = 0;
    for (const std::size_t i : kept_) {
      const double* row = &in_.weights.values[i * joints];
      double sum = 0.0;
      for (std::size_t j = 0; j < joints; ++j) {
        indices.push_back(static_cast<std::uint16_t>(j));
        weights.push_back(static_cast<float>(row[j]));
        sum += row[j];
      }
      if (!(sum > 0)) return bad("lbs_weights: row " + std::to_string(i) + " is all zero");
      unequal += std::fabs(sum - 1.0) > 1e-3 ? 1 : 0;
    }
    if (unequal != 0) {
      out_.report.warnings.push_back("lbs_weights: " + std::to_string(unequal) +
                                     " rows do not sum to 1; they were divided by their sums");
    }
    const auto report = choose_weights(out_.asset, joints, indices, weights, options_.weights);
    if (!report) return {report.code(), file_.source() + ": lbs_weights: " + report.message()};
    out_.weights = *report;
    if (out_.weights.needs_more != 0) {
      out_.report.warnings.push_back("lbs_weights: with " + std::to_string(out_.weights.influences) +
                                     " weights " + std::to_string(out_.weights.needs_more) +
                                     " Gaussians are off by up to " +
                                     std::to_string(1000 * out_.weights.position_error) + " mm");
    }
    return {};
  }

  Status read_skinning() {
    if (!file_.contains("skinning")) return {};
    const auto mode = arrays_.number("skinning");
    if (!mode) return mode.status();
    for (const Skinning known :
         {Skinning::linear, Skinning::linear_stretched, Skinning::dual_quaternion}) {
      if (*mode != static_cast<double>(known)) continue;
      out_.asset.skinning = known;
      return known == Skinning::linear_stretched ? bake_weight_gradients(out_.asset) : Status();
    }
    return bad("skinning is " + std::to_string(*mode) +
               ", must be 0 (linear), 1 (with stretch) or 2 (dual quaternions)");
  }

  /// Reads the capsules, if the file has any.
  Status read_capsules() {
    if (!file_.contains("capsules")) return {};
    const auto capsules = arrays_.read("capsules", {detail::NpzArrays::kAny, 7});
    if (!capsules) return capsules.status();
    const std::size_t count = capsules->values.size() / 7;
    const auto joints = arrays_.read("capsule_joints", {count});
    if (!joints) return joints.status();
    for (std::size_t c = 0; c < count; ++c) {
      const double* v = &capsules->values[7 * c];
      const double j = joints->values[c];
      if (!(j >= 0 && j < static_cast<double>(out_.asset.skeleton.size())) || j != std::floor(j)) {
        return bad("capsule_joints[" + std::to_string(c) + "] is " + std::to_string(j));
      }
      if (!(v[6] >= 0))
        return bad("capsules: capsule " + std::to_string(c) + " has the radius " + std::to_string(v[6]));
      out_.asset.capsules.push_back(
          {static_cast<std::uint16_t>(j), {v[0], v[1], v[2]}, {v[3], v[4], v[5]}, v[6]});
    }
    return {};
  }

  const NpzFile& file_;
  detail::NpzArrays arrays_;
  const LoadAvatarOptions& options_;
  detail::AvatarFileArrays in_;
  LoadedAvatar out_;
  std::vector<std::size_t> kept_;  ///< Rows of the file that are in the cloud.
};

}  // namespace

Result<LoadedAvatar> load_avatar(const std::filesystem::path& path, const LoadAvatarOptions& options) {
  return detail::guarded(path.string(), [&]() -> Result<LoadedAvatar> {
    const int influences = options.weights.influences;
    if (influences != 0 && influences != kInfluences4 && influences != kInfluences8) {
      return {Errc::invalid_argument, path.string() + ": LoadAvatarOptions.weights.influences is " +
                                          std::to_string(influences) + "; 4, 8 or 0 are supported"};
    }
    const auto file = NpzFile::open(path);
    if (!file) return file.status();
    return AvatarReader(*file, options).run();
  });
}

}  // namespace gsnav::io
