// SPDX-License-Identifier: Apache-2.0
#include "skinning.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <string>
#include <utility>

#include "gsnav/avatar.hpp"
#include "gsnav/backends/openmp.hpp"
#include "gsnav/backends/serial.hpp"
#include "gsnav/core/rng.hpp"
#include "gsnav/demo.hpp"
#include "skinning_modes.hpp"
#include "skinning_timing.hpp"
#include "skinning_truth.hpp"

namespace gsnav_report {

using namespace gsnav;

namespace {

/// Weights of all joints for every Gaussian, [N][J].
std::vector<double> dense_weights(const AvatarAsset& asset) {
  const SoftWeights weights(asset);
  std::vector<double> out, row;
  for (std::size_t i = 0; i < asset.size(); ++i) {
    weights.at(asset.cloud.mean(i), row);
    out.insert(out.end(), row.begin(), row.end());
  }
  return out;
}

/// A pose in which every joint is turned by up to `degrees` about a random axis of its own.
LocalPose random_pose(const Skeleton& skeleton, Rng& rng, double degrees) {
  LocalPose pose = skeleton.rest_pose();
  for (Quatd& q : pose.rotations) {
    const Vec3d axis = normalized(Vec3d{rng.normal(), rng.normal(), rng.normal()});
    q = q * axis_angle(axis, rng.uniform(-degrees, degrees) * 0.017453292519943295);
  }
  return pose;
}

struct Posed {
  Vec3d mean{};
  Mat3d rotation{};
};

/// Blends all joints with a weight in double, by the definition of skinning. For blends without an
/// orientation it follows the kernel's rule.
Posed blend(const Matrices& joints, const double* weights, const Vec3d& mean) {
  Mat3d linear{};
  Vec3d shift{};
  std::size_t heaviest = 0;
  for (std::size_t j = 0; j < joints.size(); ++j) {
    if (weights[j] == 0) continue;
    linear = linear + joints[j].linear * weights[j];
    shift = shift + joints[j].translation * weights[j];
    if (weights[j] > weights[heaviest]) heaviest = j;
  }
  const bool usable = determinant(linear) > kMinBlendDeterminant;
  return {linear * mean + shift, polar_rotation(usable ? linear : joints[heaviest].linear)};
}

/// The k greatest of `dense`, divided by their sum; the others become 0.
void truncate_weights(const double* dense, std::size_t joints, std::size_t k, std::vector<double>& out) {
  std::vector<std::size_t> order(joints);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::partial_sort(
      order.begin(), order.begin() + static_cast<std::ptrdiff_t>(k), order.end(),
      [&](std::size_t a, std::size_t b) { return dense[a] != dense[b] ? dense[a] > dense[b] : a < b; });
  out.assign(joints, 0.0);
  double sum = 0;
  for (std::size_t j = 0; j < k; ++j) sum += dense[order[j]];
  for (std::size_t j = 0; j < k; ++j) out[order[j]] = dense[order[j]] / sum;
}

/// Arguments and arrays of one skinning in float32.
struct FloatSkinning {
  std::array<std::vector<float>, 3> means;
  std::array<std::vector<float>, 4> quats, rotations;
  std::vector<Affine3<float>> joints;
  SkinningArgs<float> args;

  explicit FloatSkinning(const AvatarAsset& asset) {
    const ShapeRows v = asset.cloud.view().shape;
    for (std::size_t k = 0; k < 3; ++k) {
      means[k].resize(asset.size());
      args.means[k] = v.means[k];
      args.means_out[k] = view_of(means[k]);
    }
    for (std::size_t k = 0; k < 4; ++k) {
      quats[k].resize(asset.size());
      rotations[k].resize(asset.size());
      args.quats[k] = v.quats[k];
      args.quats_out[k] = view_of(quats[k]);
      args.rotations_out[k] = view_of(rotations[k]);
    }
    args.joint_indices = view_of(asset.joint_indices);
    args.weights = view_of(asset.skinning_weights);
  }
  void set_pose(const Matrices& m) {
    joints.clear();
    for (const auto& a : m) joints.push_back(affine_cast<float>(a));
    args.joints = {joints.data(), joints.size()};
  }
};

/// Rows of float32 on a backend against float64 with the same four weights, with the time for 100,000
/// Gaussians.
template <class B>
Status float_rows(B& backend, Row base, const AvatarAsset& sampled, const AvatarAsset& timed,
                  const std::vector<Matrices>& poses, const SkinningOptions& o, std::vector<Row>& rows) {
  FloatSkinning small(sampled);
  SkinningErrors e;
  std::vector<double> weights(sampled.skeleton.size());
  for (const Matrices& pose : poses) {
    small.set_pose(pose);
    if (Status s = skin_gaussians<float>(backend, small.args); !s) return s;
    if (Status s = backend.synchronize(); !s) return s;
    for (std::size_t i = 0; i < sampled.size(); ++i) {
      std::fill(weights.begin(), weights.end(), 0.0);
      for (std::size_t k = 4 * i; k < 4 * i + 4; ++k) {
        weights[sampled.joint_indices[k]] += weight_of_parts(sampled.skinning_weights[k]);
      }
      const Posed truth = blend(pose, weights.data(), sampled.cloud.mean(i));
      const Vec3d mean{small.means[0][i], small.means[1][i], small.means[2][i]};
      const Quatd q{small.rotations[0][i], small.rotations[1][i], small.rotations[2][i],
                    small.rotations[3][i]};
      e.position.push_back(norm(mean - truth.mean));
      e.rotation.push_back(angle_degrees(rotation_matrix(q), truth.rotation));
    }
  }
  FloatSkinning large(timed);
  large.set_pose(poses.front());
  const Status status = time_skinning(backend, timed, large.args, o.runs, base);
  base.set("note", "float32 against float64 with the same weights; time for 100000 Gaussians");
  add_skinning_rows(rows, std::move(base), e);
  return status;
}

}  // namespace

Result<std::vector<Row>> skinning_rows(const SkinningOptions& o) {
  HumanoidOptions small, large;
  small.gaussians = o.sampled;
  large.gaussians = o.gaussians;
  const Result<AvatarAsset> sampled = try_make_humanoid(small), timed = try_make_humanoid(large);
  if (!sampled) return sampled.status();
  if (!timed) return timed.status();
  const Skeleton& skeleton = sampled->skeleton;
  const Result<WalkMotion> walk = WalkMotion::create(skeleton, {});
  if (!walk) return walk.status();
  std::vector<LocalPose> walking(static_cast<std::size_t>(o.poses)), random;
  Rng rng(17);
  for (std::size_t p = 0; p < walking.size(); ++p) {
    walk->pose(static_cast<double>(p) / o.poses, 1.0, 0.0, walking[p]);
    random.push_back(random_pose(skeleton, rng, 60));
  }
  std::vector<Row> rows;
  const std::vector<double> dense = dense_weights(*sampled);
  const std::size_t joints = skeleton.size();
  SerialBackend serial;
  OpenMPBackend openmp(o.threads);
  const std::pair<const char*, const std::vector<LocalPose>*> sets[] = {{"walk", &walking},
                                                                        {"random_60deg", &random}};
  constexpr std::size_t kMostInfluences = 8;
  std::size_t done = 0;
  const auto stopped = [&](const std::string& what) {
    return o.on_step && !o.on_step(done++, std::size(sets) * (kMostInfluences + 1), what);
  };
  for (const auto& [name, poses] : sets) {
    const std::vector<Matrices> matrices = skinning_matrices(skeleton, *poses);
    Row base;
    base.set("kind", "skinning").set("scene", "humanoid").set("knob", "poses").set("knob_value", name);
    std::vector<double> weights;
    for (std::size_t k = 1; k <= kMostInfluences; ++k) {
      if (stopped(std::string(name) + ", influences per Gaussian: " + std::to_string(k)))
        return std::vector<Row>{};
      SkinningErrors e;
      for (std::size_t i = 0; i < sampled->size(); ++i) {
        truncate_weights(&dense[i * joints], joints, k, weights);
        for (const Matrices& pose : matrices) {
          const Posed truth = blend(pose, &dense[i * joints], sampled->cloud.mean(i));
          const Posed cut = blend(pose, weights.data(), sampled->cloud.mean(i));
          e.position.push_back(norm(cut.mean - truth.mean));
          e.rotation.push_back(angle_degrees(cut.rotation, truth.rotation));
        }
      }
      Row row = base;
      row.set("influences", static_cast<int>(k))
          .set("note", "float64, K greatest weights against all joints");
      add_skinning_rows(rows, std::move(row), e);
    }
    if (stopped(std::string(name) + ", float32")) return std::vector<Row>{};
    base.set("profile", "exact");
    Row by_serial = base, by_openmp = base;
    by_serial.set("backend", "serial").set("threads", 1);
    by_openmp.set("backend", "openmp").set("threads", openmp.threads());
    if (Status s = float_rows(serial, std::move(by_serial), *sampled, *timed, matrices, o, rows); !s)
      return s;
    if (Status s = float_rows(openmp, std::move(by_openmp), *sampled, *timed, matrices, o, rows); !s)
      return s;
    if (Status s = mode_rows(*timed, matrices, name, o, rows); !s) return s;
  }
  return rows;
}

}  // namespace gsnav_report
