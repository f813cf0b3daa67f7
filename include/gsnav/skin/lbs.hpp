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

/// Supported numbers of joints that move one Gaussian (SkinningArgs::influences).
inline constexpr int kInfluences4 = 4,  ///< four joints per Gaussian
    kInfluences8 = 8;                   ///< eight joints per Gaussian
/// Number of parts that make a skinning weight of 1. Weights are stored as integers of parts, and those
/// of a Gaussian sum to kWeightParts exactly. Rounding weights (detail/avatar/skinning_weights.hpp)
/// moves a Gaussian of K joints by at most K d / (4 kWeightParts). Each joint alone would move it to a
/// position of its own; d is the greatest distance between two of these positions. For d = 1 m the bound
/// is 15 um with four joints, and 31 um with eight.
inline constexpr int kWeightParts = 65535;
/// Smallest determinant of a blended linear part that still has a useful orientation. Below it (a 180
/// degree twist, the candy-wrapper effect) the joint with the greatest weight gives the rotation.
inline constexpr double kMinBlendDeterminant = 0.1;

namespace detail {

/// linear * p + translation, as every mode of skinning rounds it.
template <class L>
GSNAV_HD Vec3<L> moved(const Mat3<L>& linear, const Vec3<L>& translation, const Vec3<L>& p) noexcept {
  Vec3<L> out;
  for (int i = 0; i < 3; ++i) {
    const Vec3<L>& r = linear.row[i];
    out[i] = fma(r.z, p.z, fma(r.y, p.y, fma(r.x, p.x, translation[i])));
  }
  return out;
}
/// q divided by its length, which is not 0.
template <class L>
GSNAV_HD Quat<L> unit(const Quat<L>& q) noexcept {
  return q * (L(scalar_of<L>(1)) / sqrt(dot(q, q)));
}

}  // namespace detail

/// A rotation matrix multiplied by a factor.
template <class L>
struct ScaledRotation {
  Mat3<L> matrix;  ///< scale * rotation
  L scale;         ///< > 0
};

/// Rotation nearest to m in the Frobenius norm (its polar factor), for det(m) > 0. Returned with a
/// scale; see polar_rotation for the rotation itself.
///
/// It is computed in closed form from the sum x of m's singular values (Markley 1993, FOAM). That sum is
/// the greatest root of (x^2 - |m|^2)^2 - 8 det(m) x - 4 |cofactors|^2. Newton's iteration descends to
/// it from sqrt(3) |m| without passing it.
///
/// The error per element for blends of rotations with det > 0.1 is 1e-6 in float and 2e-15 in double. It
/// grows with the ratio of the greatest singular value to the sum of the other two.
template <class L>
GSNAV_HD ScaledRotation<L> scaled_polar_rotation(const Mat3<L>& m) noexcept {
  using S = scalar_of<L>;
  // Newton's iteration squares the error in each step, so after a step this small only rounding is left.
  const L converged(sizeof(S) > sizeof(float) ? S(1e-9) : S(2e-4));
  const Mat3<L> c = rough_cofactors(m);
  const L det = dot(m.row[0], c.row[0]);
  // m m^T. Its trace is |m|^2, and its principal minors sum to |cofactors|^2.
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
    // A converged lane keeps its value, so that a pack gives the bits of each lane computed alone.
    sum = select(active, sum - change, sum);
    active = active && (change > converged * sum);
    if (!any(active)) break;
  }
  // Let a, b, c be the singular values and sum = a + b + c. Then ((ab + bc + ca + |m|^2) I - m m^T) m +
  // sum * cofactors equals (a + b)(b + c)(c + a) times the rotation.
  const L pairs = L(S(0.5)) * fma(sum, sum, -m2), d = pairs + m2;
  g00 = d - g00;
  g11 = d - g11;
  g22 = d - g22;
  return {{{fma(-g02, m.row[2], fma(-g01, m.row[1], fma(g00, m.row[0], c.row[0] * sum))),
            fma(-g12, m.row[2], fma(g11, m.row[1], fma(-g01, m.row[0], c.row[1] * sum))),
            fma(g22, m.row[2], fma(-g12, m.row[1], fma(-g02, m.row[0], c.row[2] * sum)))}},
          fma(pairs, sum, -det)};
}
/// Rotation nearest to m in the Frobenius norm, for det(m) > 0. Accuracy of scaled_polar_rotation.
template <class L>
GSNAV_HD Mat3<L> polar_rotation(const Mat3<L>& m) noexcept {
  const ScaledRotation<L> r = scaled_polar_rotation(m);
  return r.matrix * (L(scalar_of<L>(1)) / r.scale);
}

/// Quaternion of a rotation, not normalised. Evaluates Shepperd's four cases without branches and
/// selects the one with the largest component, so it also runs on packs. Scalars and packs get the same
/// bits.
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

/// A skinned Gaussian.
template <class L>
struct Skinned {
  Vec3<L> mean{};      ///< metres, relative to the actor's root
  Quat<L> quat{};      ///< orientation: rotation * canonical orientation
  Quat<L> rotation{};  ///< rotation of the body at this Gaussian since the canonical pose
};

/// Skins one Gaussian, or a pack of Gaussians, by linear blend skinning. The mean is transformed by the
/// blended matrix, and the orientation by its polar factor. The result does not depend on the numbering
/// of the ellipsoid's axes.
///
/// @param blend sum over the influences of weight * (posed joint * inverse bind), with rigid joints, in
///   metres. Joints are relative to the actor's root, so that an error in the sum of weights scales with
///   the body and not with its distance from the origin.
/// @param first callable that returns the linear part of the joint with the greatest weight. It is
///   called when the blend has no useful orientation (see kMinBlendDeterminant).
/// @param mean canonical position, metres
/// @param quat canonical orientation, unit length
/// @param rotation whether to compute Skinned::rotation
template <class L, class First>
GSNAV_HD Skinned<L> skin(Affine3<L> blend, const First& first, const Vec3<L>& mean, const Quat<L>& quat,
                         bool rotation = true) noexcept {
  using S = scalar_of<L>;
  Skinned<L> out;
  out.mean = detail::moved(blend.linear, blend.translation, mean);
  const mask_of<L> usable = dot(blend.linear.row[0], rough_cofactors(blend.linear).row[0]) >
                            L(static_cast<S>(kMinBlendDeterminant));
  if (!all(usable)) {
    const Mat3<L> greatest = first();
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j)
        blend.linear(i, j) = select(usable, blend.linear(i, j), greatest(i, j));
    }
  }
  const Quat<L> turn = quat_direction(scaled_polar_rotation(blend.linear)), turned = turn * quat;
  if (rotation) out.rotation = detail::unit(turn);
  out.quat = detail::unit(turned);
  return out;
}

/// Arrays for skinning N Gaussians of one avatar, all in the backend's memory. `S` is the scalar type of
/// the arithmetic, `Out` that of the results.
template <class S, class Out = float>
struct SkinningArgs {
  View<const float> means[3];               ///< canonical positions x, y, z, metres, [N] each
  View<const float> quats[4];               ///< canonical orientations w, x, y, z, unit length, [N] each
  int influences = kInfluences4;            ///< joints per Gaussian, K: 4 or 8
  View<const std::uint16_t> joint_indices;  ///< [N][K], joint with the greatest weight first
  View<const std::uint16_t> weights;        ///< [N][K], in parts of kWeightParts; each row sums to
                                            ///< kWeightParts
  View<const Affine3<S>> joints;            ///< [J], posed joint * inverse bind, relative to the root
  View<Out> means_out[3];                   ///< skinned positions x, y, z, metres, [N] each
  View<Out> quats_out[4];                   ///< skinned orientations w, x, y, z, [N] each
  View<Out> rotations_out[4];  ///< Skinned::rotation w, x, y, z, [N] each. Empty: not computed.
  /// Joints as dual quaternions, [J]. If set, Gaussians are skinned by dual quaternion blending and
  /// `joints` is not read. Empty: linear blending.
  View<const DualQuat<S>> dual_joints;
  /// Gradients of the weights by canonical position, [N][K-1][3], 1/metres, for the second to the last
  /// influence. If set, linear blending also stretches the shapes: `scales` is read and `axes_out`
  /// written. Empty: shapes are only rotated.
  View<const float> weight_gradients;
  View<const float> scales[3];  ///< canonical standard deviations, metres, [N] each; for stretch
  View<Out> axes_out[9];  ///< skinned shapes, [N] each, in the layout of ShapeRows::axes; for stretch

  /// Number of Gaussians, N.
  GSNAV_HD std::size_t size() const noexcept { return means[0].size; }
  /// True if rotations_out is to be written.
  GSNAV_HD bool writes_rotations() const noexcept { return !rotations_out[0].empty(); }
};

/// Converts a skinning weight from parts of kWeightParts to [0, 1]. SIMD kernels compute the same bits.
template <class S>
GSNAV_HD S skinning_weight(std::uint16_t parts) noexcept {
  return static_cast<S>(parts) * static_cast<S>(1.0 / kWeightParts);
}

/// All elements of `a` times the weight.
template <class L>
GSNAV_HD Affine3<L> weighted(const L& weight, const Affine3<L>& a) noexcept {
  return {a.linear * weight, a.translation * weight};
}
/// All elements of `a` times the weight, added to `sum`.
template <class L>
GSNAV_HD Affine3<L> weighted(const L& weight, const Affine3<L>& a, const Affine3<L>& sum) noexcept {
  Affine3<L> out;
  for (int r = 0; r < 3; ++r) out.linear.row[r] = fma(weight, a.linear.row[r], sum.linear.row[r]);
  out.translation = fma(weight, a.translation, sum.translation);
  return out;
}

/// Blended transform of a Gaussian: the sum of weight(k) * joint(k) for k < count, in the order of k;
/// count >= 1. A joint may be of any type that has the two functions `weighted`.
template <class Joint, class Weight>
GSNAV_HD auto blend_influences(int count, const Joint& joint, const Weight& weight) noexcept {
  auto sum = weighted(weight(0), joint(0));
  for (int k = 1; k < count; ++k) sum = weighted(weight(k), joint(k), sum);
  return sum;
}

/// Inputs of skinning for one Gaussian.
template <int K>
struct SkinRow {
  std::uint16_t joints[K],  ///< joint indices
      parts[K];             ///< weights, in parts of kWeightParts
  Vec3<float> mean;         ///< canonical position, metres
  Quat<float> quat;         ///< canonical orientation
};

/// Reads the inputs of Gaussian i.
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

/// Skins one Gaussian. `joint_at(index)` returns a joint as `Affine3<S>`, or a reference to it.
template <class S, int K, class JointAt>
GSNAV_HD Skinned<S> skin_row(const SkinRow<K>& row, const JointAt& joint_at, bool rotation) noexcept {
  const auto joint = [&](int k) GSNAV_INLINED -> decltype(auto) { return joint_at(row.joints[k]); };
  const auto weight = [&](int k) GSNAV_INLINED { return skinning_weight<S>(row.parts[k]); };
  const Affine3<S> blend = blend_influences(K, joint, weight);
  const auto first = [&]() GSNAV_INLINED { return joint_at(row.joints[0]).linear; };
  return skin<S>(blend, first, vec_cast<S>(row.mean), quat_cast<S>(row.quat), rotation);
}

/// Writes the results of Gaussian i. `Args` is SkinningArgs or a type with the same output arrays.
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

/// Kernel that skins Gaussian i by linear blending.
template <class S, class Out = float>
struct SkinGaussian {
  SkinningArgs<S, Out> args;  ///< inputs and outputs

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
