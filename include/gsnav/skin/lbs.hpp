// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "gsnav/config.hpp"
#include "gsnav/core/view.hpp"
#include "gsnav/detail/math/dual_quat.hpp"
#include "gsnav/math/functions.hpp"
#include "gsnav/math/mat.hpp"
#include "gsnav/math/quat.hpp"

namespace gsnav {

/// Joints that move one Gaussian: one of these two.
inline constexpr int kInfluences4 = 4, kInfluences8 = 8;
/// Skinning weights are whole numbers of parts, of which this many are 1; those of a Gaussian make 1
/// exactly. Rounding weights (detail/avatar/skinning_weights.hpp) moves a Gaussian by at most K / (4 *
/// kWeightParts) of the greatest distance between the places where its joints alone would put it: 15 um
/// a metre for K = 4, 31 um for K = 8.
inline constexpr int kWeightParts = 65535;
/// A blended linear part with a smaller determinant has no orientation worth the name (the candy
/// wrapper of a 180 degree twist): the joint of the greatest weight gives the rotation there.
inline constexpr double kMinBlendDeterminant = 0.1;

namespace detail {

/// Cofactor matrix: det(m) times the inverse transposed. Errors are roundings of m's greatest elements:
/// enough for the polar factor of what has det > 0.1, not for needles (cross() has what they need).
template <class L>
GSNAV_HD Mat3<L> cofactors(const Mat3<L>& m) noexcept {
  return {{rough_cross(m.row[1], m.row[2]), rough_cross(m.row[2], m.row[0]),
           rough_cross(m.row[0], m.row[1])}};
}

}  // namespace detail

/// A rotation times `scale` > 0.
template <class L>
struct ScaledRotation {
  Mat3<L> matrix;  ///< The rotation times the scale.
  L scale;         ///< Scale, > 0.
};

/// The rotation nearest to m in the Frobenius norm (its polar factor), for det(m) > 0, in closed form
/// from the sum of m's singular values (Markley 1993, FOAM). The sum is the greatest root of (x^2 -
/// |m|^2)^2 - 8 det(m) x - 4 |cofactors|^2, to which Newton's iteration descends from sqrt(3) |m|
/// without passing it. Error of an element for blends of rotations with det > 0.1: 1e-6 in float, 2e-15
/// in double; it grows as the greatest singular value over the sum of the other two. Lanes that are done
/// stay where they are while others go on.
template <class L>
GSNAV_HD ScaledRotation<L> scaled_polar_rotation(const Mat3<L>& m) noexcept {
  using S = scalar_of<L>;
  // The error is about the square of the last step, so this is rounding.
  const L converged(sizeof(S) > sizeof(float) ? S(1e-9) : S(2e-4));
  const Mat3<L> c = detail::cofactors(m);
  const L det = dot(m.row[0], c.row[0]);
  // m times its transposed, whose trace is |m|^2 and whose principal minors add up to |cofactors|^2.
  L g00 = dot(m.row[0], m.row[0]), g11 = dot(m.row[1], m.row[1]), g22 = dot(m.row[2], m.row[2]);
  const L g01 = dot(m.row[0], m.row[1]), g02 = dot(m.row[0], m.row[2]), g12 = dot(m.row[1], m.row[2]);
  const L m2 = g00 + (g11 + g22);
  const L c2 = fma(g00, g11, -(g01 * g01)) + (fma(g11, g22, -(g12 * g12)) + fma(g22, g00, -(g02 * g02)));
  const L four(S(4)), det2 = det + det;
  L sum = sqrt(L(S(3)) * m2);
  auto active = det > L(S(0));
  for (int step = 0; step < 32; ++step) {
    const L t = fma(sum, sum, -m2);
    const L value = fma(t, t, -(four * fma(det2, sum, c2))), slope = four * fma(sum, t, -det2);
    const L change = value / slope;
    // A lane that has converged stays: a pack gives the bits of its lanes alone.
    sum = select(active, sum - change, sum);
    active = active && (change > converged * sum);
    if (!any(active)) break;
  }
  // With singular values a, b, c and their vectors, ((ab + bc + ca + |m|^2) I - m m^T) m + sum *
  // cofactors is (a + b) (b + c) (c + a) times the rotation.
  const L pairs = L(S(0.5)) * fma(sum, sum, -m2), d = pairs + m2;
  g00 = d - g00;
  g11 = d - g11;
  g22 = d - g22;
  return {{{fma(-g02, m.row[2], fma(-g01, m.row[1], fma(g00, m.row[0], c.row[0] * sum))),
            fma(-g12, m.row[2], fma(g11, m.row[1], fma(-g01, m.row[0], c.row[1] * sum))),
            fma(g22, m.row[2], fma(-g12, m.row[1], fma(-g02, m.row[0], c.row[2] * sum)))}},
          fma(pairs, sum, -det)};
}
/// The rotation nearest to m.
template <class L>
GSNAV_HD Mat3<L> polar_rotation(const Mat3<L>& m) noexcept {
  const ScaledRotation<L> r = scaled_polar_rotation(m);
  return r.matrix * (L(scalar_of<L>(1)) / r.scale);
}

/// Quaternion of a rotation, of any length, without branches (Shepperd's four cases, the one with the
/// largest component selected): for lanes. Scalars get the same bits.
template <class L>
GSNAV_HD Quat<L> quat_direction(const ScaledRotation<L>& rotation) noexcept {
  const Mat3<L>& m = rotation.matrix;
  const L one = rotation.scale;
  const L xx = m(0, 0), yy = m(1, 1), zz = m(2, 2);
  const L ww = ((one + xx) + yy) + zz, ix = ((one + xx) - yy) - zz, iy = ((one - xx) + yy) - zz,
          iz = ((one - xx) - yy) + zz;  // 4 w^2, 4 x^2, 4 y^2, 4 z^2
  const L wx = m(2, 1) - m(1, 2), wy = m(0, 2) - m(2, 0), wz = m(1, 0) - m(0, 1);
  const L xy = m(0, 1) + m(1, 0), xz = m(0, 2) + m(2, 0), yz = m(1, 2) + m(2, 1);
  L best = ww;
  Quat<L> q{ww, wx, wy, wz};
  const auto take = [&](L value, const Quat<L>& other) GSNAV_INLINED {
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
  return q;
}

/// A Gaussian after skinning.
template <class L>
struct Skinned {
  Vec3<L> mean{};      ///< Posed centre.
  Quat<L> quat{};      ///< orientation: rotation * canonical orientation
  Quat<L> rotation{};  ///< what the body has turned it by since the canonical pose
};

/// Linear blend skinning of one Gaussian, or of a pack of them.
///
/// `blend`: sum over the influences of weight * (posed joint * inverse bind), the joints rigid, metres,
/// relative to the actor's root (so that an error of the weights' sum is scaled by the body's size, not
/// by its place in the world). `first()`: linear part of the joint of the greatest weight; called where
/// a blend has no orientation. The mean goes through the blended matrix, the orientation through its
/// polar factor, so that the result does not depend on how the ellipsoid's axes are numbered.
/// `rotation`: whether Skinned::rotation is asked for.
template <class L, class First>
GSNAV_HD Skinned<L> skin(Affine3<L> blend, const First& first, const Vec3<L>& mean, const Quat<L>& quat,
                         bool rotation = true) noexcept {
  using S = scalar_of<L>;
  Skinned<L> out;
  for (int i = 0; i < 3; ++i) {
    const Vec3<L>& r = blend.linear.row[i];
    out.mean[i] = fma(r.z, mean.z, fma(r.y, mean.y, fma(r.x, mean.x, blend.translation[i])));
  }
  const mask_of<L> usable = dot(blend.linear.row[0], detail::cofactors(blend.linear).row[0]) >
                            L(static_cast<S>(kMinBlendDeterminant));
  if (!all(usable)) {
    const Mat3<L> greatest = first();
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j)
        blend.linear(i, j) = select(usable, blend.linear(i, j), greatest(i, j));
    }
  }
  const Quat<L> turn = quat_direction(scaled_polar_rotation(blend.linear)), turned = turn * quat;
  const L one(S(1));
  if (rotation) out.rotation = turn * (one / sqrt(dot(turn, turn)));
  out.quat = turned * (one / sqrt(dot(turned, turned)));
  return out;
}

/// Arrays of one skinning, all in the backend's memory. `S` is the scalar of the arithmetic, `Out` of
/// what is written.
template <class S, class Out = float>
struct SkinningArgs {
  View<const float> means[3];               ///< canonical x, y, z, metres, [N] each
  View<const float> quats[4];               ///< canonical w, x, y, z of unit length, [N] each
  int influences = kInfluences4;            ///< K: 4 or 8
  View<const std::uint16_t> joint_indices;  ///< [N][K], the greatest weight first
  View<const std::uint16_t> weights;  ///< [N][K] parts of kWeightParts, which is the sum of each row
  View<const Affine3<S>> joints;      ///< [J] posed joint * inverse bind, relative to the root
  View<Out> means_out[3];             ///< [N] each
  View<Out> quats_out[4];             ///< [N] each
  View<Out> rotations_out[4];         ///< [N] each, or empty: not asked for
  /// Dual quaternion blending: `joints` as dual quaternions, [J], which are then what is read. Empty:
  /// linear blending.
  View<const DualQuat<S>> dual_joints;
  /// Linear blending with stretch: gradients of the second to last weight of each Gaussian by its
  /// canonical place, [N][K-1][3], 1/metres, standard deviations, and where the shapes go. Empty: shapes
  /// are turned only.
  View<const float> weight_gradients;
  View<const float> scales[3];  ///< canonical, metres, [N] each
  View<Out> axes_out[9];        ///< [N] each, as ShapeRows::axes

  /// Number of Gaussians.
  GSNAV_HD std::size_t size() const noexcept { return means[0].size; }
  /// Whether rotations are written too.
  GSNAV_HD bool writes_rotations() const noexcept { return !rotations_out[0].empty(); }
};

/// A skinning weight from its parts. The lanes do the same.
template <class S>
GSNAV_HD S skinning_weight(std::uint16_t parts) noexcept {
  return static_cast<S>(parts) * static_cast<S>(1.0 / kWeightParts);
}

/// Every number of `a` times the weight, and the same added to `sum`.
template <class L>
GSNAV_HD Affine3<L> weighted(const L& weight, const Affine3<L>& a) noexcept {
  return {a.linear * weight, a.translation * weight};
}
template <class L>
GSNAV_HD Affine3<L> weighted(const L& weight, const Affine3<L>& a, const Affine3<L>& sum) noexcept {
  Affine3<L> out;
  for (int r = 0; r < 3; ++r) out.linear.row[r] = fma(weight, a.linear.row[r], sum.linear.row[r]);
  out.translation = fma(weight, a.translation, sum.translation);
  return out;
}

/// The blend of a Gaussian's K joints: the sum of weight(k) * joint(k), in the order of k. A joint is
/// whatever has the two functions `weighted`: its numbers may be blended in any layout.
template <int K, class Joint, class Weight>
GSNAV_HD auto blend_influences(const Joint& joint, const Weight& weight) noexcept {
  auto sum = weighted(weight(0), joint(0));
  for (int k = 1; k < K; ++k) sum = weighted(weight(k), joint(k), sum);
  return sum;
}

/// What skinning reads of a Gaussian.
template <int K>
struct SkinRow {
  std::uint16_t joints[K], parts[K];  ///< Joint and weight of each influence.
  Vec3<float> mean;                   ///< Centre in the rest pose.
  Quat<float> quat;                   ///< Rotation in the rest pose.
};

/// Of Gaussian i.
template <int K, class S, class Out>
GSNAV_HD SkinRow<K> read_skin_row(const SkinningArgs<S, Out>& args, std::size_t i) noexcept {
  SkinRow<K> row;
  for (std::size_t k = 0; k < K; ++k) {
    row.joints[k] = args.joint_indices[K * i + k];
    row.parts[k] = args.weights[K * i + k];
  }
  row.mean = {args.means[0][i], args.means[1][i], args.means[2][i]};
  row.quat = {args.quats[0][i], args.quats[1][i], args.quats[2][i], args.quats[3][i]};
  return row;
}

/// Skins a Gaussian whose K joints `joint_at(index)` gives (an Affine3<S>, or a reference to one).
template <class S, int K, class JointAt>
GSNAV_HD Skinned<S> skin_row(const SkinRow<K>& row, const JointAt& joint_at, bool rotation) noexcept {
  const auto joint = [&](int k) GSNAV_INLINED -> decltype(auto) { return joint_at(row.joints[k]); };
  const auto weight = [&](int k) GSNAV_INLINED { return skinning_weight<S>(row.parts[k]); };
  const Affine3<S> blend = blend_influences<K>(joint, weight);
  const auto first = [&]() GSNAV_INLINED { return joint_at(row.joints[0]).linear; };
  return skin<S>(blend, first, vec_cast<S>(row.mean), quat_cast<S>(row.quat), rotation);
}

/// Writes Gaussian i. `Args`: SkinningArgs, or what has its arrays.
template <class Args, class S>
GSNAV_HD void store_skinned(const Args& args, std::size_t i, const Skinned<S>& s) noexcept {
  using Out = std::remove_reference_t<decltype(args.means_out[0][i])>;
  for (int k = 0; k < 3; ++k) args.means_out[k][i] = static_cast<Out>(s.mean[k]);
  const S quat[4] = {s.quat.w, s.quat.x, s.quat.y, s.quat.z};
  for (int k = 0; k < 4; ++k) args.quats_out[k][i] = static_cast<Out>(quat[k]);
  if (!args.writes_rotations()) return;
  const S rotation[4] = {s.rotation.w, s.rotation.x, s.rotation.y, s.rotation.z};
  for (int k = 0; k < 4; ++k) args.rotations_out[k][i] = static_cast<Out>(rotation[k]);
}

/// Skins Gaussian i.
template <class S, class Out = float>
struct SkinGaussian {
  SkinningArgs<S, Out> args;  ///< Arrays of the avatar.

  /// Skins Gaussian i.
  GSNAV_HD void operator()(std::size_t i) const noexcept {
    const auto joint_at = [this](std::uint16_t j)
                              GSNAV_INLINED -> const Affine3<S>& { return args.joints[j]; };
    if (args.influences == kInfluences8) {
      store_skinned(
          args, i, skin_row<S>(read_skin_row<kInfluences8>(args, i), joint_at, args.writes_rotations()));
    } else {
      store_skinned(
          args, i, skin_row<S>(read_skin_row<kInfluences4>(args, i), joint_at, args.writes_rotations()));
    }
  }
};

}  // namespace gsnav
