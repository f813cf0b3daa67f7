// SPDX-License-Identifier: Apache-2.0
#include "skinning_modes.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

#include "gsnav/avatar.hpp"
#include "gsnav/backends/openmp.hpp"
#include "gsnav/backends/serial.hpp"
#include "gsnav/skin/skin.hpp"
#include "skinning_timing.hpp"

namespace gsnav_report {

using namespace gsnav;

namespace {

/// One skinning in the scalar S, with all of its arrays.
template <class S>
struct ModeSkinning {
  std::vector<S> planes[3 + 4 + 4 + 9];
  std::vector<Affine3<S>> joints;
  std::vector<DualQuat<S>> duals;
  SkinningArgs<S, S> args;

  explicit ModeSkinning(const AvatarAsset& asset) {
    const ShapeRows v = asset.cloud.view().shape;
    for (auto& p : planes) p.resize(asset.size());
    for (std::size_t k = 0; k < 3; ++k)
      args.means[k] = v.means[k], args.means_out[k] = view_of(planes[k]);
    for (std::size_t k = 0; k < 4; ++k) {
      args.quats[k] = v.quats[k];
      args.quats_out[k] = view_of(planes[3 + k]);
      args.rotations_out[k] = view_of(planes[7 + k]);
    }
    args.influences = asset.influences;
    args.joint_indices = view_of(asset.joint_indices);
    args.weights = view_of(asset.skinning_weights);
    if (asset.skinning != Skinning::linear_stretched) return;
    args.weight_gradients = view_of(asset.weight_gradients);
    for (std::size_t k = 0; k < 3; ++k) args.scales[k] = v.scales[k];
    for (std::size_t k = 0; k < 9; ++k) args.axes_out[k] = view_of(planes[11 + k]);
  }
  void set_pose(const AvatarAsset& asset, const Matrices& pose) {
    joints.clear();
    duals.clear();
    for (const auto& m : pose) {
      joints.push_back(affine_cast<S>(m));
      duals.push_back(dual_quat_cast<S>(dual_quat(m)));
    }
    args.joints = {joints.data(), joints.size()};
    if (asset.skinning == Skinning::dual_quaternion) args.dual_joints = {duals.data(), duals.size()};
  }
  double value(std::size_t plane, std::size_t i) const { return static_cast<double>(planes[plane][i]); }
  Mat3d covariance(std::size_t i) const {
    Mat3d m;
    for (int k = 0; k < 9; ++k) m(k / 3, k % 3) = value(11 + static_cast<std::size_t>(k), i);
    return m * transpose(m);
  }
};

/// Derivative of the posed position under linear blending with respect to the canonical position p.
Mat3d derivative(const SoftWeights& weights, const Matrices& joints, const Vec3d& p) {
  constexpr double kStep = 1e-5;
  std::vector<double> w;
  const auto place = [&](const Vec3d& x) {
    weights.at(x, w);
    Vec3d out{};
    for (std::size_t j = 0; j < joints.size(); ++j) out += (joints[j] * x) * w[j];
    return out;
  };
  Mat3d f;
  for (int c = 0; c < 3; ++c) {
    Vec3d step{};
    step[c] = kStep;
    const Vec3d d = (place(p + step) - place(p - step)) * (0.5 / kStep);
    for (int r = 0; r < 3; ++r) f(r, c) = d[r];
  }
  return f;
}

double greatest(const Mat3d& m) {
  double out = 0;
  for (int k = 0; k < 9; ++k) out = std::max(out, std::abs(m(k / 3, k % 3)));
  return out;
}

/// Rows of float32 against float64 in one mode, with its time.
template <class B>
Status float_rows(B& backend, Row base, const AvatarAsset& asset, const std::vector<Matrices>& poses,
                  const SkinningOptions& o, std::vector<Row>& rows) {
  SerialBackend serial;
  ModeSkinning<float> f(asset);
  ModeSkinning<double> d(asset);
  SkinningErrors e;
  std::vector<double> shape;
  for (const Matrices& pose : poses) {
    f.set_pose(asset, pose);
    d.set_pose(asset, pose);
    if (Status s = skin_gaussians<float>(backend, f.args); !s) return s;
    if (Status s = backend.synchronize(); !s) return s;
    if (Status s = skin_gaussians<double>(serial, d.args); !s) return s;
    for (std::size_t i = 0; i < asset.size(); i += 5) {
      const auto at = [i](const auto& s) { return Vec3d{s.value(0, i), s.value(1, i), s.value(2, i)}; };
      const auto turn = [i](const auto& s) {
        return rotation_matrix(Quatd{s.value(7, i), s.value(8, i), s.value(9, i), s.value(10, i)});
      };
      e.position.push_back(norm(at(f) - at(d)));
      e.rotation.push_back(angle_degrees(turn(f), turn(d)));
      if (asset.skinning != Skinning::linear_stretched) continue;
      const Mat3d want = d.covariance(i);
      shape.push_back(100 * greatest(f.covariance(i) + want * -1.0) / greatest(want));
    }
  }
  const Status status = time_skinning(backend, asset, f.args, o.runs, base);
  add_skinning_rows(rows, base, e);
  if (!shape.empty()) add_error_row(rows, base, "covariance", "%", shape);
  return status;
}

}  // namespace

Status mode_rows(const AvatarAsset& body, const std::vector<Matrices>& poses, const char* name,
                 const SkinningOptions& o, std::vector<Row>& rows) {
  // The body with the soft weights, since their derivative is known.
  AvatarAsset asset = body;
  const SoftWeights soft(body);
  const std::size_t joints = body.skeleton.size();
  std::vector<std::uint16_t> indices;
  std::vector<float> weights;
  std::vector<double> w;
  for (std::size_t i = 0; i < body.size(); ++i) {
    soft.at(body.cloud.mean(i), w);
    for (std::size_t j = 0; j < joints; ++j) {
      indices.push_back(static_cast<std::uint16_t>(j));
      weights.push_back(static_cast<float>(w[j]));
    }
  }
  if (const auto kept = asset.set_weights(joints, indices, weights, kInfluences8); !kept)
    return kept.status();
  if (Status s = bake_weight_gradients(asset); !s) return s;
  Row base;
  base.set("kind", "skinning").set("scene", "humanoid").set("knob", "poses").set("knob_value", name);

  ModeSkinning<double> exact(asset);
  SerialBackend serial;
  std::vector<double> turned, stretched;
  std::size_t held = 0;
  for (const Matrices& pose : poses) {
    exact.set_pose(asset, pose);
    if (Status s = skin_gaussians<double>(serial, exact.args); !s) return s;
    for (std::size_t i = 0; i < asset.size(); i += 16) {
      const auto& c = asset.cloud;
      const Quatd q =
          quat_cast<double>(Quatf{c.quats[0][i], c.quats[1][i], c.quats[2][i], c.quats[3][i]});
      const auto shape = [&](const Mat3d& m) {
        Mat3d axes = m * rotation_matrix(q);
        for (auto& row : axes.row) {
          for (std::size_t k = 0; k < 3; ++k)
            row[static_cast<int>(k)] *= static_cast<double>(c.scales[k][i]);
        }
        return axes * transpose(axes);
      };
      const Mat3d f = derivative(soft, pose, c.mean(i));
      const Svd3<double> d = svd(f);
      if (d.values[2] < kLeastStretch || d.values[0] > kGreatestStretch) {
        ++held;
        continue;
      }
      const Mat3d want = shape(f);
      const Quatd turn{exact.value(7, i), exact.value(8, i), exact.value(9, i), exact.value(10, i)};
      turned.push_back(100 * greatest(shape(rotation_matrix(turn)) + want * -1.0) / greatest(want));
      stretched.push_back(100 * greatest(exact.covariance(i) + want * -1.0) / greatest(want));
    }
  }
  const std::string share =
      std::to_string(100.0 * static_cast<double>(held) /
                     static_cast<double>(std::max<std::size_t>(1, held + turned.size())));
  const std::string left_out = " (" + share.substr(0, 4) + " % beyond the bounds left out)";
  Row row = base;
  row.set("note", "LBS + polar: shapes turned only, against the skin's derivative" + left_out);
  add_error_row(rows, row, "covariance", "%", turned);
  row.set("note", "LBS + stretch, float64, against the skin's derivative" + left_out);
  add_error_row(rows, row, "covariance", "%", stretched);

  OpenMPBackend openmp(o.threads);
  for (const Skinning mode : {Skinning::linear_stretched, Skinning::dual_quaternion}) {
    asset.skinning = mode;
    base.set("profile", "exact");
    base.set("note",
             std::string(mode == Skinning::dual_quaternion ? "dual quaternions" : "LBS + stretch") +
                 ": float32 against float64; time for 100000 Gaussians");
    Row by_serial = base, by_openmp = base;
    by_serial.set("backend", "serial").set("threads", 1);
    by_openmp.set("backend", "openmp").set("threads", openmp.threads());
    if (Status s = float_rows(serial, std::move(by_serial), asset, poses, o, rows); !s) return s;
    if (Status s = float_rows(openmp, std::move(by_openmp), asset, poses, o, rows); !s) return s;
  }
  return {};
}

}  // namespace gsnav_report
