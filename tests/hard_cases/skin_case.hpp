// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "gsnav/detail/avatar/skinning_weights.hpp"
#include "gsnav/skin/skin.hpp"
#include "hard_cases/arrays.hpp"
#include "hard_cases/cases.hpp"
#include "hard_cases/truth.hpp"
#include "support/rotations.hpp"

namespace gsnav_test {

/// Gaussians with K joints each, as skinning is given them.
struct SkinCase {
  int influences = 4;  // K
  std::vector<float> means[3], quats[4];
  std::vector<std::uint16_t> joints, weights;  // [N][K]
  std::vector<gsnav::Affine3<double>> matrices;

  std::size_t size() const { return means[0].size(); }
  std::size_t row() const { return static_cast<std::size_t>(influences); }
  /// `w` and `j` have K values.
  void add(const gsnav::Vec3d& mean, const gsnav::Quatd& quat, const std::vector<double>& w,
           const std::vector<std::uint16_t>& j) {
    for (int k = 0; k < 3; ++k) means[k].push_back(static_cast<float>(mean[k]));
    const double q[4] = {quat.w, quat.x, quat.y, quat.z};
    for (int k = 0; k < 4; ++k) quats[k].push_back(static_cast<float>(q[k]));
    weights.resize(weights.size() + row());
    gsnav::round_weights(w.data(), row(), weights.data() + weights.size() - row());
    joints.insert(joints.end(), j.begin(), j.end());
  }
  gsnav::Vec3d mean(std::size_t i) const { return {means[0][i], means[1][i], means[2][i]}; }
  gsnav::Quatd quat(std::size_t i) const { return {quats[0][i], quats[1][i], quats[2][i], quats[3][i]}; }
  /// Blended matrix in long double from the stored weights and the matrices as the kernel has them.
  template <class S>
  void blend(std::size_t i, Real linear[3][3], Real shift[3]) const {
    for (int r = 0; r < 3; ++r) {
      shift[r] = 0;
      for (int c = 0; c < 3; ++c) linear[r][c] = 0;
    }
    for (std::size_t k = row() * i; k < row() * (i + 1); ++k) {
      const Real w = weights[k] / Real(gsnav::kWeightParts);
      const gsnav::Affine3<double>& m = matrices[joints[k]];
      for (int r = 0; r < 3; ++r) {
        shift[r] += w * static_cast<Real>(static_cast<S>(m.translation[r]));
        for (int c = 0; c < 3; ++c)
          linear[r][c] += w * static_cast<Real>(static_cast<S>(m.linear(r, c)));
      }
    }
  }
};

struct SkinResult {
  std::vector<gsnav::Vec3d> means;
  std::vector<gsnav::Quatd> quats, rotations;
};

/// Skins on a backend in its scalar.
template <class R>
SkinResult skin_on(R& renderer, const SkinCase& c) {
  using S = typename R::scalar;
  using B = std::remove_cvref_t<decltype(renderer.backend())>;
  Arrays<B> arrays(renderer.backend());
  std::vector<gsnav::Affine3<S>> matrices;
  for (const auto& m : c.matrices) matrices.push_back(gsnav::affine_cast<S>(m));
  gsnav::SkinningArgs<S, S> args;
  for (int k = 0; k < 3; ++k) {
    args.means[k] = arrays.in(c.means[k]);
    args.means_out[k] = arrays.template out<S>(c.size());
  }
  for (int k = 0; k < 4; ++k) {
    args.quats[k] = arrays.in(c.quats[k]);
    args.quats_out[k] = arrays.template out<S>(c.size());
    args.rotations_out[k] = arrays.template out<S>(c.size());
  }
  args.influences = c.influences;
  args.joint_indices = arrays.in(c.joints);
  args.weights = arrays.in(c.weights);
  args.joints = arrays.in(matrices);
  gsnav::skin_gaussians(renderer.backend(), args).throw_if_error();
  std::vector<S> m[3], q[4], r[4];
  for (int k = 0; k < 3; ++k) m[k] = arrays.fetch(args.means_out[k]);
  for (int k = 0; k < 4; ++k) {
    q[k] = arrays.fetch(args.quats_out[k]);
    r[k] = arrays.fetch(args.rotations_out[k]);
  }
  SkinResult out;
  for (std::size_t i = 0; i < c.size(); ++i) {
    out.means.push_back(gsnav::vec_cast<double>(gsnav::Vec3<S>{m[0][i], m[1][i], m[2][i]}));
    out.quats.push_back(gsnav::quat_cast<double>(gsnav::Quat<S>{q[0][i], q[1][i], q[2][i], q[3][i]}));
    out.rotations.push_back(
        gsnav::quat_cast<double>(gsnav::Quat<S>{r[0][i], r[1][i], r[2][i], r[3][i]}));
  }
  return out;
}

/// Skins everywhere; float results must have the serial backend's bits.
template <class F>
void skin_everywhere(const SkinCase& c, const F& check) {
  SkinResult reference;
  const auto bits = [](const std::vector<gsnav::Quatd>& a, const std::vector<gsnav::Quatd>& b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                      [](const gsnav::Quatd& p, const gsnav::Quatd& q) {
                        return p.w == q.w && p.x == q.x && p.y == q.y && p.z == q.z;
                      });
  };
  for_each_backend([&](auto& renderer) {
    const SkinResult result = skin_on(renderer, c);
    if (std::remove_reference_t<decltype(renderer)>::is_float) {
      if (reference.means.empty()) reference = result;
      CHECK(result.means == reference.means);
      CHECK(bits(result.quats, reference.quats));
      CHECK(bits(result.rotations, reference.rotations));
    }
    check(result,
          static_cast<const CaseImages<typename std::remove_reference_t<decltype(renderer)>::scalar>&>(
              renderer));
  });
}

/// 2 to `influences` joints at most `degrees` from the first, weights sorted; each row its own joints.
inline SkinCase random_case(std::uint64_t seed, std::size_t count, double degrees, int influences = 4) {
  gsnav::Rng rng(seed);
  SkinCase c;
  c.influences = influences;
  const std::size_t row = c.row(),
                    distinct = 64000 / row;  // joint indices have 16 bits: rows far apart share
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t n = 2 + rng.below(row - 1);
    std::vector<double> w(row, 0.0);
    for (std::size_t k = 0; k < n; ++k) w[k] = rng.uniform(0.02, 1.0);
    std::sort(w.begin(), w.end(), std::greater<>());
    const gsnav::Quatd base = random_rotation(rng);
    std::vector<std::uint16_t> j(row);
    for (std::size_t k = 0; k < row; ++k) {
      j[k] = static_cast<std::uint16_t>(row * (i % distinct) + k);
      if (i >= distinct) continue;
      const gsnav::Quatd q = k == 0 ? base : rotation_within(rng, degrees) * base;
      c.matrices.push_back(
          {gsnav::rotation_matrix(q), {rng.uniform(-1, 1), rng.uniform(-1, 1), rng.uniform(-1, 1)}});
    }
    c.add({rng.uniform(-1, 1), rng.uniform(0, 2), rng.uniform(-1, 1)}, random_rotation(rng), w, j);
  }
  return c;
}

}  // namespace gsnav_test
