// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "gsnav/detail/math/dual_quat.hpp"
#include "gsnav/detail/math/svd.hpp"
#include "gsnav/skin/lbs.hpp"

// Skinning modes other than plain linear blending: dual quaternions, and linear blending with stretch.
// They are separate from the kernel that most assets use (skin/lbs.hpp).

namespace gsnav {

/// Limits of the stretch of a Gaussian along any direction.
inline constexpr double kLeastStretch = 0.5, kGreatestStretch = 2.0;

/// Skins one Gaussian by dual quaternion blending (Kavan et al. 2007, "Skinning with dual quaternions",
/// DLB). The body keeps its width where it twists, and bulges at the outside of elbows. Joints that
/// differ only by a translation give the result of linear blending.
/// @param blend sum over the influences of weight * dual quaternion of the joint. Each has the sign that
///   puts its real part on the side of the first one.
template <class L>
GSNAV_HD Skinned<L> skin(const DualQuat<L>& blend, const Vec3<L>& mean, const Quat<L>& quat) noexcept {
  Skinned<L> out;
  out.rotation = detail::unit(blend.real);
  const Vec3<L> translation = translation_of(blend);  // before the matrix: fewer registers on a GPU
  out.mean = detail::moved(rotation_matrix(out.rotation), translation, mean);
  out.quat = detail::unit(out.rotation * quat);
  return out;
}

/// m with its singular values clamped to [kLeastStretch, kGreatestStretch]. Where a body folds over,
/// det(m) < 0: the smallest singular value is then taken as negative, and is raised to the lower limit.
/// A matrix within the limits is returned unchanged, bit for bit.
template <class S>
GSNAV_HD Mat3<S> clamped_stretch(const Mat3<S>& m) noexcept {
  // Most Gaussians are hardly stretched. If |m^T m - 1| < 0.75, all singular values are within the
  // limits.
  const Vec3<S> a = m.column(0), b = m.column(1), c = m.column(2);
  const S aa = dot(a, a) - S(1), bb = dot(b, b) - S(1), cc = dot(c, c) - S(1);
  const S ab = dot(a, b), ac = dot(a, c), bc = dot(b, c);
  const S off = fma(ab, ab, fma(ac, ac, bc * bc));
  if (fma(aa, aa, fma(bb, bb, fma(cc, cc, off + off))) < S(0.5625) && determinant(m) > S(0)) return m;
  const Svd3<S> d = svd(m);
  const S least(static_cast<S>(kLeastStretch)), greatest(static_cast<S>(kGreatestStretch));
  if (d.values[2] >= least && d.values[0] <= greatest) return m;
  Mat3<S> out;
  for (int k = 0; k < 3; ++k) {
    const S value = clamp(d.values[k], least, greatest);
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j)
        out(i, j) = fma(value * d.left[k][i], d.right[k][j], k == 0 ? S(0) : out(i, j));
    }
  }
  return out;
}

namespace detail {

template <class S, class Out>
GSNAV_HD Vec3<S> canonical_mean(const SkinningArgs<S, Out>& args, std::size_t i) noexcept {
  return {S(args.means[0][i]), S(args.means[1][i]), S(args.means[2][i])};
}
template <class S, class Out>
GSNAV_HD Quat<S> canonical_quat(const SkinningArgs<S, Out>& args, std::size_t i) noexcept {
  return {S(args.quats[0][i]), S(args.quats[1][i]), S(args.quats[2][i]), S(args.quats[3][i])};
}

/// A joint of the sum in SkinGaussianStretched: its linear part, and the product that the gradient of
/// its weight adds. The first joint adds none.
template <class L>
struct StretchJoint {
  const Mat3<L>& linear;
  Vec3<L> apart{},  ///< where the joint puts the Gaussian, less where the first joint does
      gradient{};   ///< of the weight
};
template <class L>
GSNAV_HD Mat3<L> weighted(const L& weight, const StretchJoint<L>& joint) noexcept {
  return joint.linear * weight;
}
template <class L>
GSNAV_HD Mat3<L> weighted(const L& weight, const StretchJoint<L>& joint, Mat3<L> sum) noexcept {
  for (int r = 0; r < 3; ++r) {
    sum.row[r] = sum.row[r] + joint.linear.row[r] * weight + joint.gradient * joint.apart[r];
  }
  return sum;
}

}  // namespace detail

/// All elements of `q` times the weight.
template <class L>
GSNAV_HD DualQuat<L> weighted(const L& weight, const DualQuat<L>& q) noexcept {
  return {q.real * weight, q.dual * weight};
}
/// All elements of `q` times the weight, added to `sum`.
template <class L>
GSNAV_HD DualQuat<L> weighted(const L& weight, const DualQuat<L>& q, const DualQuat<L>& sum) noexcept {
  return {sum.real + q.real * weight, sum.dual + q.dual * weight};
}

/// Blended dual quaternion of Gaussian i, as skin() needs it. Its length is at least the greatest
/// weight.
template <class S, class Out>
GSNAV_HD DualQuat<S> blended_dual(const SkinningArgs<S, Out>& args, std::size_t i) noexcept {
  const std::size_t row = static_cast<std::size_t>(args.influences) * i;
  const auto joint = [&](int k) GSNAV_INLINED -> const DualQuat<S>& {
    return args.dual_joints[args.joint_indices[row + static_cast<std::size_t>(k)]];
  };
  const Quat<S> first = joint(0).real;
  return blend_influences(args.influences, joint, [&](int k) GSNAV_INLINED {
    const S w = skinning_weight<S>(args.weights[row + static_cast<std::size_t>(k)]);
    return k > 0 && dot(joint(k).real, first) < S(0) ? -w : w;
  });
}

/// Kernel that skins Gaussian i by dual quaternion blending.
template <class S, class Out = float>
struct SkinGaussianDual {
  SkinningArgs<S, Out> args;

  GSNAV_HD void operator()(std::size_t i) const noexcept {
    store_skinned(
        args, i,
        skin(blended_dual(args, i), detail::canonical_mean(args, i), detail::canonical_quat(args, i)));
  }
};

/// Kernel that skins Gaussian i by linear blending and also stretches its shape. The shape is
/// transformed by F instead of by a rotation. F is the derivative of the skinned position with respect
/// to the canonical one: F = sum_k w_k A_k + sum_k (A_k p + t_k) grad(w_k)^T. The singular values of F
/// are clamped (clamped_stretch). Means, quats and rotations are those of SkinGaussian.
template <class S, class Out = float>
struct SkinGaussianStretched {
  SkinningArgs<S, Out> args;

  GSNAV_HD void operator()(std::size_t i) const noexcept {
    SkinGaussian<S, Out>{args}(i);
    const std::size_t row = static_cast<std::size_t>(args.influences);
    const std::uint16_t* const indices = args.joint_indices.data + row * i;
    const std::uint16_t* const parts = args.weights.data + row * i;
    const float* const gradients = args.weight_gradients.data + 3 * (row - 1) * i;
    const Vec3<S> mean = detail::canonical_mean(args, i);
    const Vec3<S> place = args.joints[indices[0]] * mean;
    // The gradients of all weights sum to zero, so the first one is minus the sum of the others.
    const auto joint = [&](int k) GSNAV_INLINED -> detail::StretchJoint<S> {
      const Affine3<S>& a = args.joints[indices[k]];
      if (k == 0) return {a.linear};
      const float* const g = gradients + 3 * (k - 1);
      return {a.linear, a * mean - place, {S(g[0]), S(g[1]), S(g[2])}};
    };
    const auto weight = [&](int k) GSNAV_INLINED { return skinning_weight<S>(parts[k]); };
    const Mat3<S> f = blend_influences(args.influences, joint, weight);
    const Mat3<S> axes = clamped_stretch(f) * rotation_matrix(detail::canonical_quat(args, i));
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) {
        args.axes_out[3 * r + c][i] = static_cast<Out>(axes(r, c) * S(args.scales[c][i]));
      }
    }
  }
};

}  // namespace gsnav
