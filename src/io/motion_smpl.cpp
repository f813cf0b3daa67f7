// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <utility>

#include "file.hpp"
#include "gsnav/detail/avatar/smpl_joints.hpp"
#include "gsnav/detail/io/motion_file.hpp"
#include "npz_arrays.hpp"

namespace gsnav::io {
namespace {

using detail::NpzArrays;

// SMPL-X's hands begin at joint 25
constexpr std::size_t kSmplh = 52, kSmplx = 55, kBody = 22, kHands = 25;

/// The rotation by |v| radians about v.
Quatd rotation_vector(const double* v) {
  const Vec3d axis{v[0], v[1], v[2]};
  const double angle = norm(axis);
  if (!(angle > 0)) return {};
  return axis_angle(axis * (1.0 / angle), angle);
}

/// Rest positions [J] of the joints, for a body with the shape `betas`.
Result<std::vector<Vec3d>> rest_joints(const NpzArrays& model, const std::vector<double>& betas) {
  constexpr std::size_t any = NpzArrays::kAny;
  auto vertices = model.read("v_template", {any, 3});
  if (!vertices) return vertices.status();
  const std::size_t count = vertices->shape[0];
  if (!betas.empty()) {
    const auto shapes = model.read("shapedirs", {count, 3, any});
    if (!shapes) return shapes.status();
    const std::size_t columns = shapes->values.size() / std::max<std::size_t>(1, 3 * count);
    if (betas.size() > columns) {
      return {Errc::invalid_file, model.file().source() + ": shapedirs has " + std::to_string(columns) +
                                      " shapes for " + std::to_string(betas.size()) + " betas"};
    }
    for (std::size_t i = 0; i < 3 * count; ++i) {
      for (std::size_t k = 0; k < betas.size(); ++k)
        vertices->values[i] += shapes->values[i * columns + k] * betas[k];
    }
  }
  const auto regressor = model.read("J_regressor", {any, count});
  if (!regressor) return regressor.status();
  std::vector<Vec3d> out(regressor->values.size() / std::max<std::size_t>(1, count));
  for (std::size_t j = 0; j < out.size(); ++j) {
    for (std::size_t v = 0; v < count; ++v) {
      const double* p = &vertices->values[3 * v];
      out[j] += Vec3d{p[0], p[1], p[2]} * regressor->values[j * count + v];
    }
  }
  return out;
}

Status check_tree(const NpzArrays& model, const BodyJoints& body) {
  const auto tree = model.read("kintree_table", {2, body.names.size()});
  if (!tree) return tree.status();
  for (std::size_t j = 1; j < body.names.size(); ++j) {  // files write the root's parent in several ways
    if (tree->values[j] != static_cast<double>(body.parents[j])) {
      return {Errc::invalid_file, model.file().source() + ": kintree_table: joint " + std::to_string(j) +
                                      " has the parent " + std::to_string(tree->values[j])};
    }
  }
  return {};
}

Result<LoadedMotion> read_motion(const NpzArrays& motion, const NpzArrays& model,
                                 const SmplMotionOptions& options) {
  const std::string& source = motion.file().source();
  const auto poses = motion.read("poses", {NpzArrays::kAny, NpzArrays::kAny});
  if (!poses) return poses.status();
  const std::size_t frames = poses->shape[0];
  const auto trans = motion.read("trans", {frames, 3});
  if (!trans) return trans.status();
  const bool new_name = motion.file().contains("mocap_frame_rate");
  const auto rate = motion.number(new_name ? "mocap_frame_rate" : "mocap_framerate");
  if (!rate) return rate.status();
  std::vector<double> betas;
  if (motion.file().contains("betas")) {
    auto b = motion.read("betas", {NpzArrays::kAny});
    if (!b) return b.status();
    betas = std::move(b->values);
  }
  const auto places = rest_joints(model, betas);
  if (!places) return places.status();
  const std::size_t joints = places->size();
  const BodyJoints body = body_joints(joints);
  if (body.names.empty()) {
    return {Errc::unsupported, model.file().source() + ": J_regressor has " + std::to_string(joints) +
                                   " joints: neither SMPL's 24 nor SMPL-X's 55"};
  }
  if (Status s = check_tree(model, body); !s) return s;
  const std::size_t given = poses->values.size() / std::max<std::size_t>(1, 3 * frames);
  const bool smplh = given == kSmplh && joints == kSmplx;
  if (frames == 0 || poses->values.size() != 3 * given * frames || (given != joints && !smplh)) {
    return {Errc::unsupported, source + ": poses has the shape " + detail::shape_text(poses->shape) +
                                   ", must be [T, " + std::to_string(3 * joints) +
                                   "] for the model's joints"};
  }
  LoadedMotion out;
  out.skeleton.names.assign(body.names.begin(), body.names.end());
  out.skeleton.parents.assign(body.parents.begin(), body.parents.end());
  MotionClip& clip = out.clip;
  clip.frame_rate = *rate;
  clip.joints = joints;
  for (std::size_t j = 0; j < joints; ++j) {
    const std::int32_t parent = body.parents[j];
    const Vec3d place =
        (*places)[j] - (parent < 0 ? Vec3d{} : (*places)[static_cast<std::size_t>(parent)]);
    out.skeleton.rest_local.push_back({Mat3d::identity(), place});
    clip.translations.push_back(place);
  }
  // Turn Z up to Y up. The body model itself always has Y up.
  const Quatd up = options.z_up ? Quatd{std::sqrt(0.5), -std::sqrt(0.5), 0, 0} : Quatd{};
  clip.rotations.reserve(frames * joints);
  for (std::size_t t = 0; t < frames; ++t) {
    for (std::size_t j = 0; j < joints; ++j) {
      std::size_t at = j;
      if (smplh && j >= kBody) at = j < kHands ? given : j - (kHands - kBody);
      Quatd q = at < given ? rotation_vector(&poses->values[3 * (t * given + at)]) : Quatd{};
      if (j == 0) q = up * q;
      clip.rotations.push_back(q);
    }
    const Vec3d moved{trans->values[3 * t], trans->values[3 * t + 1], trans->values[3 * t + 2]};
    clip.root_translation.push_back(rotate(up, (*places)[0] + moved) - (*places)[0]);
  }
  for (const Status& s : {out.skeleton.validate(), clip.validate()}) {
    if (!s) return {Errc::invalid_file, source + ": " + s.message()};
  }
  clip.wrap_time = smooth_wrap_time(out.skeleton, clip);
  return out;
}

}  // namespace

Result<LoadedMotion> load_smpl_motion(const std::filesystem::path& path,
                                      const std::filesystem::path& model,
                                      const SmplMotionOptions& options) {
  return detail::guarded(path.string(), [&]() -> Result<LoadedMotion> {
    const auto motion_file = NpzFile::open(path);
    if (!motion_file) return motion_file.status();
    const auto model_file = NpzFile::open(model);
    if (!model_file) return model_file.status();
    return read_motion(NpzArrays(*motion_file), NpzArrays(*model_file), options);
  });
}

}  // namespace gsnav::io
