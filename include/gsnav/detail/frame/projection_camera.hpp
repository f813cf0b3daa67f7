// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "gsnav/detail/image/pinhole.hpp"
#include "gsnav/frame/gaussians.hpp"
#include "gsnav/frame/rules.hpp"
#include "gsnav/image/camera.hpp"
#include "gsnav/math/functions.hpp"
#include "gsnav/math/mat.hpp"
#include "gsnav/math/quat.hpp"

namespace gsnav {

/// Conversion of a float32 key to the integer that is sorted. It keeps all 32 bits, or n of them: the
/// bits of the key minus those of the near plane, without the lowest ones. With n = 24, 20 bits of the
/// mantissa remain, for keys up to 2^16 times the near plane.
struct KeyCode {
  std::uint32_t base = 0, largest = 0xffffffffu;
  int shift = 0;

  static KeyCode of(int bits, float near_plane) noexcept {
    if (bits >= 32) return {};
    return {bits_of(near_plane), (1u << bits) - 1u, bits < 27 ? 27 - bits : 0};
  }
  GSNAV_HD std::uint32_t operator()(float key) const noexcept {
    const std::uint32_t bits = bits_of(key);
    // A key that rounding moved below the near plane gets code 0.
    const std::uint32_t code = (bits > base ? bits - base : 0u) >> shift;
    return code < largest ? code : largest;
  }
  /// Lower bound of all codes. A distance may round to slightly less than the near plane, but not to
  /// half of it.
  std::uint32_t lowest(float near_plane) const noexcept { return (*this)(0.5f * near_plane); }
};

/// True for a centre beyond the near plane.
/// @param z depth_key of the centre, rounded to float32, metres
template <class F>
GSNAV_HD mask_of<F> beyond_near_plane(float near_plane, const F& z) noexcept {
  return z > F(near_plane);
}

/// Settings of the projection besides the camera.
struct ProjectionRules {
  SortOrder sort_order = SortOrder::z_depth;
  Response response = Response::ewa;
  Compat compat = Compat::none;
  double log2_alpha_min = kLog2AlphaMin;
  int key_bits = 32;
};

/// One axis of the image, as bounds of footprints need it.
struct ImageAxis {
  Vec3d direction;       ///< in the asset frame
  double f, c;           ///< focal length and principal point, pixels
  double limit, extent;  ///< largest |u| (|v|) in the Jacobian; size of the image, pixels

  /// |(1, u)| for the largest u of the Jacobian.
  GSNAV_HD double slant() const noexcept { return sqrt(1 + limit * limit); }
  /// Its first (left or top) and last sides, moved outwards by `margin` pixels.
  GSNAV_HD ImageSide<double> first_side(double margin) const noexcept {
    return ImageSide<double>::first(f, c, margin);
  }
  GSNAV_HD ImageSide<double> last_side(double margin) const noexcept {
    return ImageSide<double>::last(f, c, extent, margin);
  }
  /// The function of a side, as a direction in the asset frame.
  GSNAV_HD Vec3d normal(const ImageSide<double>& side, const Vec3d& view_axis) const noexcept {
    return direction * side.across + view_axis * side.ahead;
  }
};

/// A camera in the frame of one set, so that Gaussians need not be transformed to the world. With
/// x_world = s R x + t, camera coordinates are s (W R)(x - c), where c is the camera's position in the
/// asset's frame.
template <class S>
struct ProjectionCamera {
  Mat3<S> rotation{};  ///< W R, asset axes to camera axes
  Vec3d position{};    ///< c, asset frame, double
  S scale{1};          ///< s
  S fx{}, fy{}, cx{}, cy{};
  S u_min{}, u_max{}, v_min{}, v_max{};  ///< limits of x/z and y/z in the Jacobian
  int width = 0, height = 0;
  float near_plane = 0;
  S near_sigma{0};
  S eps2d{S(0.3)};
  S base_eps2d{0};        ///< GaussianSet::base_eps2d
  S log2_alpha_min{};     ///< the footprint is alpha >= 2^log2_alpha_min
  S min_compensation{0};  ///< lower limit of the mip filter's opacity compensation
  bool mip = false;
  SortOrder sort_order = SortOrder::z_depth;
  Response response = Response::ewa;
  Compat compat = Compat::none;
  KeyCode key_code{};

  /// Columns (0) or rows (1) of the image.
  GSNAV_HD ImageAxis image_axis(int k) const noexcept {
    if (k == 0)
      return {rotation.row[0], fx, cx, max(abs(u_min), abs(u_max)), static_cast<double>(width)};
    return {rotation.row[1], fy, cy, max(abs(v_min), abs(v_max)), static_cast<double>(height)};
  }
};

/// Makes the ProjectionCamera of a set. Host code; computed in double and rounded once.
template <class S>
ProjectionCamera<S> make_projection_camera(const Camera& camera, const GaussianSet& set,
                                           const ProjectionRules& rules = {}) noexcept {
  ProjectionCamera<S> p;
  const bool habitat = rules.compat == Compat::habitat_gs;
  const Similarity& a = set.world_from_asset;
  const Mat3d rotation = camera.viewmat.linear * rotation_matrix(a.rotation);
  p.rotation = mat_cast<S>(rotation);
  p.position = camera.position_in(a);
  p.scale = static_cast<S>(a.scale);
  p.fx = static_cast<S>(camera.fx);
  p.fy = static_cast<S>(camera.fy);
  p.cx = static_cast<S>(camera.cx);
  p.cy = static_cast<S>(camera.cy);
  const double tx = 0.3 * camera.width / (2 * camera.fx), ty = 0.3 * camera.height / (2 * camera.fy);
  p.u_min = static_cast<S>(-(camera.cx / camera.fx + tx));
  p.u_max = static_cast<S>((camera.width - camera.cx) / camera.fx + tx);
  p.v_min = static_cast<S>(-(camera.cy / camera.fy + ty));
  p.v_max = static_cast<S>((camera.height - camera.cy) / camera.fy + ty);
  p.width = camera.width;
  p.height = camera.height;
  p.near_plane = habitat ? 0.2f : static_cast<float>(camera.near_plane);
  p.near_sigma = habitat ? S(0) : static_cast<S>(camera.near_sigma);
  p.eps2d = static_cast<S>(set.eps2d);
  p.base_eps2d = static_cast<S>(set.base_eps2d);
  p.log2_alpha_min = static_cast<S>(rules.log2_alpha_min);
  p.min_compensation = habitat ? S(0.005) : S(0);
  p.mip = set.filter == Filter::mip || habitat;
  p.sort_order = rules.sort_order;
  p.response = rules.response;
  p.compat = rules.compat;
  p.key_code = KeyCode::of(rules.key_bits, p.near_plane);
  return p;
}

}  // namespace gsnav
