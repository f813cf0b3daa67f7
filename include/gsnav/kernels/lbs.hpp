// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "gsnav/config.hpp"
#include "gsnav/core/view.hpp"
#include "gsnav/math/functions.hpp"
#include "gsnav/math/mat.hpp"
#include "gsnav/math/quat.hpp"

namespace gsnav {

/// Joints that move one Gaussian.
inline constexpr int kInfluences = 4;
/// A blended linear part with a smaller determinant has no orientation worth the name (the candy
/// wrapper of a 180 degree twist): the joint of the greatest weight gives the rotation there.
inline constexpr double kMinBlendDeterminant = 0.1;

namespace detail {

/// Cofactor matrix: det(m) times the inverse transposed.
template <class L>
GSNAV_HD Mat3<L> cofactors(const Mat3<L>& m) noexcept {
  return {{cross(m.row[1], m.row[2]), cross(m.row[2], m.row[0]), cross(m.row[0], m.row[1])}};
}

}  // namespace detail

/// Rotation nearest to m in the Frobenius norm (its polar factor), for det(m) > 0. Newton's iteration
/// X <- (X + X^-T) / 2 (Higham 1986): every singular value s goes to (s + 1/s) / 2, so it converges to 1
/// quadratically, and the more slowly the smaller s is; m from blends of rotations with det > 0.1 has
/// s >= 0.1 and needs at most 8 steps. Lanes that are done stay where they are while others go on.
template <class L>
GSNAV_HD Mat3<L> polar_rotation(const Mat3<L>& m) noexcept {
  using S = scalar_of<L>;
  // The next step's change is about the square of this one's: rounding from there on.
  const L converged(sizeof(S) > sizeof(float) ? S(1e-16) : S(1e-7));
  const L half(S(0.5));
  Mat3<L> x = m;
  auto active = half > L(S(0));
  for (int step = 0; step < 16; ++step) {
    const Mat3<L> c = detail::cofactors(x);
    const L weight = half / dot(x.row[0], c.row[0]);
    L change(S(0));
    for (int i = 0; i < 3; ++i) {
      const Vec3<L> next{fma(weight, c.row[i].x, half * x.row[i].x),
                         fma(weight, c.row[i].y, half * x.row[i].y),
                         fma(weight, c.row[i].z, half * x.row[i].z)};
      const Vec3<L> d = next - x.row[i];
      change = change + dot(d, d);
      // A lane that has converged stays: a pack gives the bits of its lanes alone.
      x.row[i] = {select(active, next.x, x.row[i].x), select(active, next.y, x.row[i].y),
                  select(active, next.z, x.row[i].z)};
    }
    active = active && (change > converged);
    if (!any(active)) break;
  }
  return x;
}

/// Unit quaternion of a rotation matrix without branches (Shepperd's four cases, the one with the
/// largest component selected): for lanes. Scalars get the same bits.
template <class L>
GSNAV_HD Quat<L> quat_from_rotation(const Mat3<L>& m) noexcept {
  using S = scalar_of<L>;
  const L one(S(1));
  const L xx = m(0, 0), yy = m(1, 1), zz = m(2, 2);
  const L ww = ((one + xx) + yy) + zz, ix = ((one + xx) - yy) - zz, iy = ((one - xx) + yy) - zz,
          iz = ((one - xx) - yy) + zz;  // 4 w^2, 4 x^2, 4 y^2, 4 z^2
  const L wx = m(2, 1) - m(1, 2), wy = m(0, 2) - m(2, 0), wz = m(1, 0) - m(0, 1);
  const L xy = m(0, 1) + m(1, 0), xz = m(0, 2) + m(2, 0), yz = m(1, 2) + m(2, 1);
  L best = ww;
  Quat<L> q{ww, wx, wy, wz};
  const auto take = [&](L value, const Quat<L>& other) noexcept {
    const mask_of<L> better = value > best;
    q.w = select(better, other.w, q.w);
    q.x = select(better, other.x, q.x);
    q.y = select(better, other.y, q.y);
    q.z = select(better, other.z, q.z);
    best = select(better, value, best);
  };
  take(ix, {wx, ix, xy, xz});
  take(iy, {wy, xy, iy, yz});
  take(iz, {wz, xz, yz, iz});
  return q * (one / sqrt(dot(q, q)));
}

/// A Gaussian after skinning.
template <class L>
struct Skinned {
  Vec3<L> mean{};
  Quat<L> quat{};      ///< orientation: rotation * canonical orientation
  Quat<L> rotation{};  ///< what the body has turned it by since the canonical pose
};

/// Linear blend skinning of one Gaussian, or of a pack of them.
///
/// `joints[k]`: posed joint * inverse bind of influence k, rigid, metres, relative to the actor's root
/// (so that an error of the weights' sum is scaled by the body's size, not by its place in the world).
/// `weights[k]` sum to 1; influence 0 has the greatest. The mean goes through the blended matrix, the
/// orientation through its polar factor, so that the result does not depend on how the ellipsoid's
/// axes are numbered.
template <class L>
GSNAV_HD Skinned<L> skin(const Affine3<L> (&joints)[kInfluences], const L (&weights)[kInfluences],
                         const Vec3<L>& mean, const Quat<L>& quat) noexcept {
  using S = scalar_of<L>;
  Mat3<L> blend = joints[0].linear * weights[0];
  Vec3<L> shift = joints[0].translation * weights[0];
  for (int k = 1; k < kInfluences; ++k) {
    for (int i = 0; i < 3; ++i) blend.row[i] = fma(weights[k], joints[k].linear.row[i], blend.row[i]);
    shift = fma(weights[k], joints[k].translation, shift);
  }
  Skinned<L> out;
  for (int i = 0; i < 3; ++i) {
    const Vec3<L>& r = blend.row[i];
    out.mean[i] = fma(r.z, mean.z, fma(r.y, mean.y, fma(r.x, mean.x, shift[i])));
  }
  const mask_of<L> usable = determinant(blend) > L(static_cast<S>(kMinBlendDeterminant));
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) blend(i, j) = select(usable, blend(i, j), joints[0].linear(i, j));
  }
  out.rotation = quat_from_rotation(polar_rotation(blend));
  out.quat = out.rotation * quat;
  out.quat = out.quat * (L(S(1)) / sqrt(dot(out.quat, out.quat)));
  return out;
}

/// Arrays of one skinning, all in the backend's memory. `S` is the scalar of the arithmetic, `Out` of
/// what is written.
template <class S, class Out = float>
struct SkinningArgs {
  View<const float> means[3];               ///< canonical x, y, z, metres, [N] each
  View<const float> quats[4];               ///< canonical w, x, y, z of unit length, [N] each
  View<const std::uint16_t> joint_indices;  ///< [N][4], the greatest weight first
  View<const float> weights;                ///< [N][4], each row sums to 1
  View<const Affine3<S>> joints;            ///< [J] posed joint * inverse bind, relative to the root
  View<Out> means_out[3];                   ///< [N] each
  View<Out> quats_out[4];                   ///< [N] each
  View<Out> rotations_out[4];               ///< [N] each, or empty: not asked for

  GSNAV_HD std::size_t size() const noexcept { return means[0].size; }
};

/// Skins Gaussian i.
template <class S, class Out = float>
struct SkinGaussian {
  SkinningArgs<S, Out> args;

  GSNAV_HD void operator()(std::size_t i) const noexcept {
    Affine3<S> joints[kInfluences];
    S weights[kInfluences];
    for (std::size_t k = 0; k < static_cast<std::size_t>(kInfluences); ++k) {
      joints[k] = args.joints[args.joint_indices[4 * i + k]];
      weights[k] = static_cast<S>(args.weights[4 * i + k]);
    }
    const Vec3<S> mean{S(args.means[0][i]), S(args.means[1][i]), S(args.means[2][i])};
    const Quat<S> quat{S(args.quats[0][i]), S(args.quats[1][i]), S(args.quats[2][i]),
                       S(args.quats[3][i])};
    const Skinned<S> s = skin<S>(joints, weights, mean, quat);
    args.means_out[0][i] = static_cast<Out>(s.mean.x);
    args.means_out[1][i] = static_cast<Out>(s.mean.y);
    args.means_out[2][i] = static_cast<Out>(s.mean.z);
    args.quats_out[0][i] = static_cast<Out>(s.quat.w);
    args.quats_out[1][i] = static_cast<Out>(s.quat.x);
    args.quats_out[2][i] = static_cast<Out>(s.quat.y);
    args.quats_out[3][i] = static_cast<Out>(s.quat.z);
    if (!args.rotations_out[0].empty()) {
      args.rotations_out[0][i] = static_cast<Out>(s.rotation.w);
      args.rotations_out[1][i] = static_cast<Out>(s.rotation.x);
      args.rotations_out[2][i] = static_cast<Out>(s.rotation.y);
      args.rotations_out[3][i] = static_cast<Out>(s.rotation.z);
    }
  }
};

}  // namespace gsnav
