// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gsnav/detail/frame/projection_camera.hpp"
#include "gsnav/detail/frame/splat.hpp"
#include "gsnav/detail/image/pinhole.hpp"
#include "gsnav/math/functions.hpp"
#include "gsnav/math/mat.hpp"
#include "gsnav/math/quat.hpp"

namespace gsnav {

/// sqrt(log2(e) / 2). With it, |w|^2 in the whitened coordinates of SplatGeometry is log2(e) q / 2.
inline constexpr double kWhitenScale = 0.84932180028801904272;
/// 2 ln 2: a squared distance in standard deviations, per unit of |w|^2.
inline constexpr double kSquaredSigmas = 1 / (kWhitenScale * kWhitenScale);

/// Squared radius of a footprint, in standard deviations. `excess` is opacity_excess of the Gaussian.
template <class L>
GSNAV_HD constexpr L footprint_radius2(L excess) noexcept {
  return excess * L(scalar_of<L>(kSquaredSigmas));
}
/// Radius of a footprint, in standard deviations; 0 if `excess` is negative.
template <class L>
GSNAV_HD L footprint_radius(L excess) noexcept {
  using S = scalar_of<L>;
  return sqrt(max(excess, L(S(0)))) * L(S(1 / kWhitenScale));
}

/// A Gaussian in camera axes: mean, factor M of its covariance M M^T, and cofactors of M.
template <class L>
struct SplatAxes {
  Vec3<L> position{};   ///< mean relative to the camera, asset units
  Mat3<L> factor{};     ///< M: columns are the axes times their standard deviations, in asset units
  Mat3<L> cofactors{};  ///< columns c_i = m_j x m_k up to sign, in asset units squared
};

/// Axes from a unit quaternion and scales. The cofactors are products, exact to one rounding.
/// @param delta mean - camera position, asset frame
template <class L>
GSNAV_HD SplatAxes<L> splat_axes(const Mat3<scalar_of<L>>& rotation, const Vec3<L>& delta,
                                 const Quat<L>& quat, const Vec3<L>& scales) noexcept {
  const Mat3<L> r = mat_cast<L>(rotation);
  const Mat3<L> axes = r * rotation_matrix(quat);
  const Vec3<L> areas{scales.y * scales.z, scales.z * scales.x, scales.x * scales.y};
  SplatAxes<L> out;
  out.position = r * delta;
  for (int i = 0; i < 3; ++i) {
    const Vec3<L>& a = axes.row[i];
    out.factor.row[i] = {a.x * scales.x, a.y * scales.y, a.z * scales.z};
    out.cofactors.row[i] = {a.x * areas.x, a.y * areas.y, a.z * areas.z};
  }
  return out;
}

/// Axes from any factor in asset axes. The blended axes of a skinned Gaussian need be neither orthogonal
/// nor right-handed. Cofactors are differences of products, rounded once.
template <class L>
GSNAV_HD SplatAxes<L> splat_axes(const Mat3<scalar_of<L>>& rotation, const Vec3<L>& delta,
                                 const Mat3<L>& factor) noexcept {
  const Mat3<L> r = mat_cast<L>(rotation);
  SplatAxes<L> out;
  out.position = r * delta;
  out.factor = r * factor;
  out.cofactors = transpose(cofactors(transpose(out.factor)));
  return out;
}

/// Result of `project`. `visible` is true where the footprint may reach the image; the other members are
/// valid only there.
template <class L>
struct Projected {
  mask_of<L> visible{};
  L mean_x{}, mean_y{};  ///< pixels
  L a{}, k{}, b{};       ///< whitened triple about the mean (detail/frame/splat.hpp)
  L log2_opacity{};
  L s_max{};                     ///< |w|^2 at the edge of the footprint
  L variance_x{}, variance_y{};  ///< diagonal of the 2D covariance, px^2
  L center_x{}, center_y{};  ///< centre of the footprint's bounds: the mean, except under perspective
  L half_width{}, half_height{};   ///< half size of the bounds in pixels, padded so that rounding cannot
                                   ///< shrink them
  L slope_x{}, slope_y{}, bend{};  ///< perspective: f = 1 + slope . d about the mean, and c
};

namespace detail {

/// Computes the response along each ray, for a Gaussian whose linearisation at the mean is whitened by
/// (a, k, b).
///
/// Let r = r_c + delta be a ray with third component 1, where r_c goes through the mean mu. Along r the
/// maximum of the response of covariance S has exponent q = |mu x r|_S^2 / (r . adj(S) r). The numerator
/// is the linearised q_e times D0 = r_c . adj(S) r_c. By Sylvester's identity for the minors of adj(S),
///
///     D0 (r . adj(S) r) = (r_c . adj(S) r)^2 + q_e D0 det(S) / z^2,
///
/// so q = q_e / (f^2 + c q_e), where f = r_c . adj(S) r / D0 is linear in the pixel and c = det(S) /
/// (z^2 D0). That costs one division per pixel and has no cancellation.
///
/// S is Sigma dilated by h (z / f)^2 across the view axis, which is h px^2 at the mean's depth.
/// Response::tangent_plane has c = 0 and isotropic S.
template <class L, class S>
GSNAV_HD void add_perspective(const ProjectionCamera<S>& camera, const SplatAxes<L>& axes, L u, L v,
                              Projected<L>& out) noexcept {
  L slope_u, slope_v;
  if (camera.response == Response::tangent_plane) {
    const L inv = L(S(1)) / fma(u, u, fma(v, v, L(S(1))));
    slope_u = u * inv;
    slope_v = v * inv;
    out.bend = L(S(0));
  } else {
    const Vec3<L>& mx = axes.factor.row[0];
    const Vec3<L>& my = axes.factor.row[1];
    const Vec3<L>& mz = axes.factor.row[2];
    const Vec3<L>& cx = axes.cofactors.row[0];
    const Vec3<L>& cy = axes.cofactors.row[1];
    const L z = axes.position.z;
    const L h(camera.eps2d);
    const L ex = h * (z / L(camera.fx)) * (z / L(camera.fx));
    const L ey = h * (z / L(camera.fy)) * (z / L(camera.fy));
    const Vec3<L> area = fma(u, cx, fma(v, cy, axes.cofactors.row[2]));
    const Vec3<L> across_x = fma(-u, mz, mx), across_y = fma(-v, mz, my);
    const L d0 =
        fma(ex, ey, fma(ex, dot(across_y, across_y), fma(ey, dot(across_x, across_x), dot(area, area))));
    slope_u = fma(-ey, dot(mz, across_x), dot(cx, area)) / d0;
    slope_v = fma(-ex, dot(mz, across_y), dot(cy, area)) / d0;
    const L volume = dot(mx, cx);
    const L det =
        fma(volume, volume, fma(ex, dot(cx, cx), fma(ey, dot(cy, cy), (ex * ey) * dot(mz, mz))));
    out.bend = L(S(kSquaredSigmas)) * (det / ((z * z) * d0));
  }
  out.slope_x = slope_u / L(camera.fx);
  out.slope_y = slope_v / L(camera.fy);

  // The footprint |w| <= kappa f is a conic with a focus at the mean. It is an ellipse while its
  // eccentricity is less than 1.
  const L one(S(1)), zero(S(0)), everywhere(S(1e30));
  const L rest = one - out.bend * out.s_max;
  const L kappa2 = out.s_max / rest;
  const L m2 = out.slope_y / out.b;
  const L m1 = (out.slope_x - out.k * m2) / out.a;
  const L open = one - kappa2 * fma(m1, m1, m2 * m2);
  // Near a parabola, rounding would decide its extent. Use the whole image as bounds.
  const auto ellipse = (rest > zero) && (open > zero) && (rest * open > L(S(0.01)));
  const L along_x = m1 / out.a, along_y = (m2 - out.k * along_x) / out.b;
  const L reach_x = one / (out.a * out.a);
  const L reach_y = out.variance_y * L(S(kSquaredSigmas));
  const L center_x = out.mean_x + kappa2 * along_x / open;
  const L center_y = out.mean_y + kappa2 * along_y / open;
  const L half_x = sqrt(kappa2 * fma(open, reach_x, kappa2 * along_x * along_x)) / open;
  const L half_y = sqrt(kappa2 * fma(open, reach_y, kappa2 * along_y * along_y)) / open;
  // Values computed as differences carry rounding errors of less than a thousandth.
  const L pad(S(1.001)), pixel(S(0.01));
  out.center_x = select(ellipse, center_x, zero);
  out.center_y = select(ellipse, center_y, zero);
  out.half_width = select(ellipse, fma(half_x, pad, pixel + abs(center_x) * L(S(1e-6))), everywhere);
  out.half_height = select(ellipse, fma(half_y, pad, pixel + abs(center_y) * L(S(1e-6))), everywhere);
}

}  // namespace detail

/// Projects one Gaussian, or a pack of Gaussians (Zwicker et al. 2001; Kerbl et al. 2023).
///
/// - The Jacobian is taken at the mean. Response::ewa clamps its x/z and y/z to the camera's limits.
/// - The determinant is built from products, never as AC - B^2 (Cauchy-Binet). det0 = (fx fy / z^2)^2
///   sum (c_i.(u, v, 1))^2, with the cofactor columns c_i, and det = det0 + h (|l1|^2 + |l2|^2) + h^2.
///   So det > 0 always, and its relative error stays near 1e-6 for needles of 1e4 : 1.
/// - The inverse is kept as a Cholesky factor.
///
/// @param key_z depth_key of the centre, rounded to float32, metres
/// @param opacity in [0, 1]
template <class L, class F>
GSNAV_HD Projected<L> project(const ProjectionCamera<scalar_of<L>>& camera, const SplatAxes<L>& axes,
                              F key_z, L opacity) noexcept {
  using S = scalar_of<L>;
  Projected<L> out;
  const Vec3<L>& t = axes.position;
  const Mat3<L>& m = axes.factor;

  const PinholePoint<L> at(camera, t);
  const L &inv_z = at.inv_z, &u = at.u, &v = at.v;
  out.mean_x = at.x;
  out.mean_y = at.y;

  const bool ewa = camera.response == Response::ewa;
  const L uj = ewa ? clamp(u, L(camera.u_min), L(camera.u_max)) : u;
  const L vj = ewa ? clamp(v, L(camera.v_min), L(camera.v_max)) : v;
  const L fz_x = L(camera.fx) * inv_z, fz_y = L(camera.fy) * inv_z;
  const Vec3<L> l1 = fma(-uj, m.row[2], m.row[0]) * fz_x;
  const Vec3<L> l2 = fma(-vj, m.row[2], m.row[1]) * fz_y;
  const L a0 = dot(l1, l1), c0 = dot(l2, l2), b0 = dot(l1, l2);
  const Vec3<L> area =
      fma(uj, axes.cofactors.row[0], fma(vj, axes.cofactors.row[1], axes.cofactors.row[2])) *
      (fz_x * fz_y);
  const L det0 = dot(area, area);
  const L h(camera.eps2d);
  const L det = fma(h, (a0 + c0) + h, det0);
  const L big_a = a0 + h, big_c = c0 + h;
  out.variance_x = big_a;
  out.variance_y = big_c;

  const L a_over_det = sqrt(big_a / det);
  out.a = L(S(kWhitenScale)) / sqrt(big_a);
  out.b = L(S(kWhitenScale)) * a_over_det;
  out.k = -(b0 / big_a) * out.b;

  if (camera.mip) {
    const L base(camera.base_eps2d);
    const L det_base = fma(base, (a0 + c0) + base, det0);
    opacity = opacity * max(sqrt(det_base / det), L(camera.min_compensation));
  }
  out.log2_opacity = log2_of_opacity(opacity);
  out.s_max = opacity_excess(out.log2_opacity, camera.log2_alpha_min);

  if (ewa) {
    const L radius = sqrt(max(out.s_max, L(S(0))));
    // In x, the rounding of the pixel test cannot exceed w1^2. In y it can, because k dx + b dy cancels.
    const L aspect = a_over_det * sqrt(big_c);
    // Means are rounded at the magnitude of the principal point, however near to the image they end up.
    const L pad_x = fma(abs(out.mean_x) + L(abs(camera.cx)), L(S(1e-6)), L(S(1e-3)));
    const L pad_y = fma(abs(out.mean_y) + L(abs(camera.cy)), L(S(1e-6)), L(S(1e-3)));
    out.center_x = out.mean_x;
    out.center_y = out.mean_y;
    out.half_width = fma(radius / out.a, L(S(1.00001)), pad_x);
    out.half_height = fma(radius * sqrt(big_c) * L(S(1.0 / kWhitenScale)),
                          fma(aspect, L(S(5e-7)), L(S(1.00001))), pad_y);
  } else {
    detail::add_perspective(camera, axes, u, v, out);
  }

  const L huge(S(3e38));  // finite in float: Gaussians that overflow are culled, never drawn as NaN
  const L half(S(0.5));
  out.visible = beyond_near_plane(camera.near_plane, key_z) && (out.s_max >= L(S(0))) && (det <= huge) &&
                (big_a <= huge) && (abs(out.mean_x) <= huge) && (abs(out.mean_y) <= huge) &&
                (out.center_x + out.half_width >= half) && (out.center_y + out.half_height >= half) &&
                (out.center_x - out.half_width <= L(S(camera.width)) - half) &&
                (out.center_y - out.half_height <= L(S(camera.height)) - half);
  if (camera.near_sigma > S(0)) {
    out.visible = out.visible && (t.z > L(camera.near_sigma) * norm(m.row[2]));
  }
  return out;
}

/// Per-ray depth record of a projected Gaussian (detail/frame/depth.hpp). Compat modes use the depth of
/// the centre only.
template <class L>
GSNAV_HD SplatDepth<L> make_splat_depth(const ProjectionCamera<scalar_of<L>>& camera,
                                        const SplatAxes<L>& axes, const Projected<L>& p) noexcept {
  using S = scalar_of<L>;
  SplatDepth<L> d;
  d.mean_x = p.mean_x;
  d.mean_y = p.mean_y;
  d.z = axes.position.z * L(camera.scale);
  if (camera.compat != Compat::none) return d;
  // Divide the cofactors by the largest entry, so that their products do not underflow.
  L largest(S(0));
  for (int i = 0; i < 3; ++i) {
    const Vec3<L>& c = axes.cofactors.row[i];
    largest = max(largest, max(abs(c.x), max(abs(c.y), abs(c.z))));
  }
  const L unit = select(largest > L(S(1e-37)), L(S(1)) / largest, L(S(0)));
  const L u = axes.position.x / axes.position.z, v = axes.position.y / axes.position.z;
  for (int i = 0; i < 3; ++i) {
    const Vec3<L> c = axes.cofactors.column(i) * unit;
    d.g[i] = fma(u, c.x, fma(v, c.y, c.z));
    d.gx[i] = c.x / L(camera.fx);
    d.gy[i] = c.y / L(camera.fy);
  }
  d.reach = sqrt(footprint_radius2(p.s_max)) * norm(axes.factor.row[2]) * L(camera.scale);
  return d;
}

/// Sort key for SortOrder::z_depth: depth of a centre along the view axis, metres, in double. Callers
/// round it once, to float32.
///
/// The rounded key has the same bits on every backend. It has them in any float64 renderer too, unless
/// two float64 results straddle a float32 rounding boundary (about 1 key in 1e8). It depends neither on
/// a set's origins nor on the world's origin.
/// @param delta mean - camera position, asset frame, in double or a pack of doubles
template <class D>
GSNAV_HD D depth_key(const ProjectionCamera<double>& camera, const Vec3<D>& delta) noexcept {
  const Vec3d& row = camera.rotation.row[2];
  return dot(Vec3<D>{D(row.x), D(row.y), D(row.z)}, delta) * D(camera.scale);
}

/// Sort key for SortOrder::camera_distance: distance of a centre from the camera, metres, in double.
/// Callers round it once, to float32, as `depth_key`.
template <class D>
GSNAV_HD D distance_key(const ProjectionCamera<double>& camera, const Vec3<D>& delta) noexcept {
  return norm(delta) * D(camera.scale);
}

}  // namespace gsnav
