// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "gsnav/kernels/camera.hpp"
#include "gsnav/kernels/gaussians.hpp"
#include "gsnav/kernels/sh.hpp"
#include "gsnav/kernels/splat.hpp"
#include "gsnav/math/functions.hpp"
#include "gsnav/math/mat.hpp"
#include "gsnav/math/quat.hpp"

namespace gsnav {

/// What decides which Gaussian is in front.
enum class SortOrder : std::uint8_t {
  z_depth,          ///< depth of the centre along the view axis (INRIA)
  camera_distance,  ///< distance of the centre from the camera (KHR_gaussian_splatting)
};

/// A camera as the projection of one set sees it: in the set's own frame, so that no Gaussian is
/// transformed to place its asset in the world. With x_world = s R x + t, camera coordinates are
/// s (W R)(x - c), c the camera's position in the asset's frame.
template <class S>
struct ProjectionCamera {
  Mat3<S> rotation{};       ///< W R, asset axes to camera axes
  Mat3<float> key_rotation{};  ///< the same in float: keys are float32 for every S
  Vec3d position{};         ///< c, asset frame, double
  S scale{1};               ///< s
  float key_scale = 1;
  S fx{}, fy{}, cx{}, cy{};
  S u_min{}, u_max{}, v_min{}, v_max{};  ///< limits of x/z and y/z in the Jacobian
  int width = 0, height = 0;
  float near_plane = 0.2f;
  S near_sigma{0};
  S eps2d{S(0.3)};
  bool mip = false;
  SortOrder sort_order = SortOrder::z_depth;
};

/// Builds the ProjectionCamera of a set (host, in double, rounded once).
template <class S>
ProjectionCamera<S> make_projection_camera(const Camera& camera, const GaussianSet& set,
                                           SortOrder sort_order) noexcept {
  ProjectionCamera<S> p;
  const Similarity& a = set.world_from_asset;
  const Mat3d rotation = camera.viewmat.linear * rotation_matrix(a.rotation);
  p.rotation = mat_cast<S>(rotation);
  p.key_rotation = mat_cast<float>(rotation);
  p.position = inverse(a) * camera.position();
  p.scale = static_cast<S>(a.scale);
  p.key_scale = static_cast<float>(a.scale);
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
  p.near_plane = static_cast<float>(camera.near_plane);
  p.near_sigma = static_cast<S>(camera.near_sigma);
  p.eps2d = static_cast<S>(set.eps2d);
  p.mip = set.filter == Filter::mip;
  p.sort_order = sort_order;
  return p;
}

/// sqrt(log2(e) / 2): |w|^2 in the whitened coordinates of SplatGeometry is log2(e) q / 2.
inline constexpr double kWhitenScale = 0.84932180028801904272;
/// log2(255): the footprint is alpha >= 1/255.
inline constexpr double kLog2Of255 = 7.9943534368588579;
inline constexpr double kLn2 = 0.69314718055994530942;

/// Result of `project`. `visible` holds where the footprint may reach the image; the rest is
/// meaningful there only.
template <class L>
struct Projected {
  mask_of<L> visible{};
  SplatGeometry<L> geometry{};
  L half_width{}, half_height{};  ///< of the footprint, pixels, padded so that rounding only adds
};

/// Camera-space axes of a Gaussian and what of them depth needs.
template <class L>
struct CameraAxes {
  Vec3<L> position{};       ///< mean in camera axes, asset units
  Mat3<L> axes{};           ///< columns: unit axes in camera space
  Vec3<L> scales{};
};

/// EWA projection of Gaussians (Zwicker et al. 2001; Kerbl et al. 2023), one or a pack of them.
///
///  - The Jacobian is taken at the mean with x/z and y/z clamped to the camera's limits.
///  - det is built from products, never as AC - B^2 (Cauchy-Binet): det0 = (fx fy / z^2)^2 sum
///    (s_j s_k r_i.(u, v, 1))^2 and det = det0 + h (|l1|^2 + |l2|^2) + h^2, so det > 0 always and its
///    relative error stays near 1e-6 for needles of 1e4 : 1.
///  - The inverse is kept as a Cholesky factor.
///
/// `delta`: mean - camera position, asset frame. `key_z`: z of the centre in float32, metres, from
/// `depth_key`. `opacity` in [0, 1].
template <class L, class F>
GSNAV_HD Projected<L> project(const ProjectionCamera<scalar_of<L>>& camera, const Vec3<L>& delta,
                              F key_z, const Quat<L>& quat, const Vec3<L>& scales, L opacity,
                              CameraAxes<L>& frame) noexcept {
  using S = scalar_of<L>;
  Projected<L> out;
  SplatGeometry<L>& g = out.geometry;
  const Mat3<L> rotation{{{L(camera.rotation(0, 0)), L(camera.rotation(0, 1)), L(camera.rotation(0, 2))},
                          {L(camera.rotation(1, 0)), L(camera.rotation(1, 1)), L(camera.rotation(1, 2))},
                          {L(camera.rotation(2, 0)), L(camera.rotation(2, 1)), L(camera.rotation(2, 2))}}};
  const Vec3<L> t = rotation * delta;
  const Mat3<L> axes = rotation * rotation_matrix(quat);
  frame = {t, axes, scales};

  const L inv_z = L(S(1)) / t.z;
  const L u = t.x * inv_z, v = t.y * inv_z;
  g.mean_x = fma(L(camera.fx), u, L(camera.cx));
  g.mean_y = fma(L(camera.fy), v, L(camera.cy));
  g.z = t.z * L(camera.scale);

  const L uj = clamp(u, L(camera.u_min), L(camera.u_max));
  const L vj = clamp(v, L(camera.v_min), L(camera.v_max));
  Vec3<L> m[3];  // rows of (camera axes) x (scales)
  for (int i = 0; i < 3; ++i) {
    m[i] = {axes.row[i].x * scales.x, axes.row[i].y * scales.y, axes.row[i].z * scales.z};
  }
  const L fz_x = L(camera.fx) * inv_z, fz_y = L(camera.fy) * inv_z;
  const Vec3<L> l1 = fma(-uj, m[2], m[0]) * fz_x;
  const Vec3<L> l2 = fma(-vj, m[2], m[1]) * fz_y;
  const L a0 = dot(l1, l1), c0 = dot(l2, l2), b0 = dot(l1, l2);

  // r_i . (u, v, 1) for the three axes, each weighted by the other two scales.
  const Vec3<L> along = fma(uj, axes.row[0], fma(vj, axes.row[1], axes.row[2]));
  const L fxfy = fz_x * fz_y;
  const Vec3<L> area{fxfy * (scales.y * scales.z) * along.x, fxfy * (scales.z * scales.x) * along.y,
                     fxfy * (scales.x * scales.y) * along.z};
  const L det0 = dot(area, area);
  const L h(camera.eps2d);
  const L det = fma(h, (a0 + c0) + h, det0);
  const L big_a = a0 + h, big_c = c0 + h;

  const L a_over_det = sqrt(big_a / det);
  g.a = L(S(kWhitenScale)) / sqrt(big_a);
  g.b = L(S(kWhitenScale)) * a_over_det;
  g.k = -(b0 / big_a) * g.b;

  if (camera.mip) opacity = opacity * sqrt(det0 / det);
  // The smallest normal number keeps log2 defined; such lanes fail s_max >= 0.
  g.log2_opacity = log2(max(opacity, L(S(1.2e-38))));
  g.s_max = g.log2_opacity + L(S(kLog2Of255));

  const L radius = sqrt(max(g.s_max, L(S(0))));
  // In x the test's own rounding cannot pass w1^2; in y it may by the cancellation in k dx + b dy.
  const L aspect = a_over_det * sqrt(big_c);
  const L pad_x = fma(abs(g.mean_x), L(S(1e-6)), L(S(1e-3)));
  const L pad_y = fma(abs(g.mean_y), L(S(1e-6)), L(S(1e-3)));
  out.half_width = fma(radius / g.a, L(S(1.00001)), pad_x);
  out.half_height = fma(radius * sqrt(big_c) * L(S(1.0 / kWhitenScale)),
                        fma(aspect, L(S(5e-7)), L(S(1.00001))), pad_y);

  const L huge(S(3e38));  // finite in float: an overflow is culled, never drawn as NaN
  const L half(S(0.5));
  out.visible = (key_z > F(camera.near_plane)) && (g.s_max >= L(S(0))) && (det <= huge) &&
                (big_a <= huge) && (g.mean_x + out.half_width >= half) &&
                (g.mean_y + out.half_height >= half) &&
                (g.mean_x - out.half_width <= L(S(camera.width)) - half) &&
                (g.mean_y - out.half_height <= L(S(camera.height)) - half);
  if (camera.near_sigma > S(0)) {
    out.visible = out.visible && (t.z > L(camera.near_sigma) * norm(m[2]));
  }
  return out;
}

/// The per-ray depth record of a projected Gaussian (kernels/depth.hpp).
template <class S>
GSNAV_HD SplatDepth<S> make_splat_depth(const ProjectionCamera<S>& camera, const CameraAxes<S>& f,
                                        S s_max) noexcept {
  SplatDepth<S> d;
  // Scales relative to the largest, so that their products stay away from underflow.
  const S largest = max(max(max(f.scales.x, f.scales.y), f.scales.z), S(1e-18));
  const Vec3<S> s = f.scales * (S(1) / largest);
  const S weight[3] = {s.y * s.z, s.z * s.x, s.x * s.y};
  const S u = f.position.x / f.position.z, v = f.position.y / f.position.z;
  for (int i = 0; i < 3; ++i) {
    const Vec3<S> c = f.axes.column(i) * weight[i];
    d.g[i] = fma(u, c.x, fma(v, c.y, c.z));
    d.gx[i] = c.x / camera.fx;
    d.gy[i] = c.y / camera.fy;
  }
  const Vec3<S> depth_row{f.axes.row[2].x * f.scales.x, f.axes.row[2].y * f.scales.y,
                          f.axes.row[2].z * f.scales.z};
  d.reach = sqrt(S(2 * kLn2) * s_max) * norm(depth_row) * camera.scale;
  return d;
}

/// The float32 sort key's value, metres: the same bits on every backend and for every S, because it is
/// one chain of fused operations over the stored float32 offset.
/// `offset`: float(origin - camera position), asset frame.
template <class F>
GSNAV_HD F depth_key(const Mat3<float>& rotation, float scale, const Vec3<F>& mean,
                     const Vec3<F>& offset) noexcept {
  const Vec3<F> row{F(rotation(2, 0)), F(rotation(2, 1)), F(rotation(2, 2))};
  return dot(row, mean + offset) * F(scale);
}

/// Sort key for SortOrder::camera_distance, metres.
template <class F>
GSNAV_HD F distance_key(float scale, const Vec3<F>& mean, const Vec3<F>& offset) noexcept {
  return norm(mean + offset) * F(scale);
}

/// How many consecutive Gaussians one work item projects. Its survivors lie together, in order.
inline constexpr std::size_t kProjectChunk = 1024;

/// Arguments of the projection of one set for one camera. Outputs have room for
/// kProjectChunk records per chunk; chunk c of the set writes its survivors from
/// (first_chunk + c) * kProjectChunk on and their number to counts[first_chunk + c].
template <class S>
struct ProjectArgs {
  GaussianView gaussians;
  ProjectionCamera<S> camera;
  View<const Vec3<float>> offsets_f;  ///< float(origin - camera), one an origin
  View<const Vec3<S>> offsets;        ///< the same in S
  bool color = true;                  ///< evaluate SH (RGB asked for)
  bool depth = true;                  ///< fill `depths`
  std::size_t first_chunk = 0;
  View<SplatGeometry<S>> geometry;
  View<SplatColor<S>> colors;   ///< empty unless `color`
  View<SplatDepth<S>> depths;   ///< empty unless `depth`
  View<SplatBounds> bounds;
  View<std::uint32_t> keys;     ///< bits of the float32 key (positive: they order like the floats)
  View<std::uint32_t> counts;

  GSNAV_HD std::size_t chunk_count() const noexcept {
    return (gaussians.size + kProjectChunk - 1) / kProjectChunk;
  }
};

/// Pixels whose centre lies within [center - half, center + half], clipped to [0, size): half-open.
template <class S>
GSNAV_HD void pixel_range(S center, S half, int size, std::int32_t& low, std::int32_t& high) noexcept {
  const S first = clamp(center - half - S(0.5), S(-1), S(size));
  const S last = clamp(center + half - S(0.5), S(-1), S(size));
  low = static_cast<std::int32_t>(first);        // truncation: first >= -1 ...
  if (S(low) < first) ++low;                     // ... made a ceiling
  high = static_cast<std::int32_t>(last);
  if (S(high) > last) --high;                    // floor
  low = low < 0 ? 0 : low;
  high = high >= size ? size : high + 1;
}

/// Colour of Gaussian i seen along `delta` (mean - camera, asset frame, any length).
template <class S>
GSNAV_HD SplatColor<S> gaussian_color(const GaussianView& gs, std::size_t i, Vec3<S> delta) noexcept {
  if (gs.sh_degree > 0) {
    const S n = norm(delta);
    // A camera at the mean sees no direction; z stands in, so that the colour is finite.
    delta = n > S(1e-12) ? delta * (S(1) / n) : Vec3<S>{S(0), S(0), S(1)};
    if (!gs.sh_rotations[0].empty()) {
      const Quat<S> q{S(gs.sh_rotations[0][i]), S(gs.sh_rotations[1][i]), S(gs.sh_rotations[2][i]),
                      S(gs.sh_rotations[3][i])};
      delta = rotate(conjugate(q), delta);
    }
  }
  const float* sh0 = gs.sh0.data + 3 * i;
  const std::size_t rest = static_cast<std::size_t>(sh_coefficient_count(gs.sh_degree) - 1);
  const float* shn = gs.shN.data + 3 * rest * i;
  const Vec3<S> c = sh_color<S>(gs.sh_degree, delta, [=](int k) {
    const float* p = k == 0 ? sh0 : shn + 3 * (k - 1);
    return Vec3<S>{S(p[0]), S(p[1]), S(p[2])};
  });
  return {c.x, c.y, c.z, S(0)};
}

/// Writes one survivor. Returns false where no pixel centre lies in its bounds.
template <class S>
GSNAV_HD bool write_splat(const ProjectArgs<S>& args, std::size_t slot, std::size_t i, float key,
                          const Projected<S>& p, const CameraAxes<S>& frame,
                          const Vec3<S>& delta) noexcept {
  SplatBounds b;
  pixel_range(p.geometry.mean_x, p.half_width, args.camera.width, b.x0, b.x1);
  pixel_range(p.geometry.mean_y, p.half_height, args.camera.height, b.y0, b.y1);
  if (b.x0 >= b.x1 || b.y0 >= b.y1) return false;
  args.geometry[slot] = p.geometry;
  args.bounds[slot] = b;
  args.keys[slot] = bits_of(key);
  if (args.color) args.colors[slot] = gaussian_color<S>(args.gaussians, i, delta);
  if (args.depth) args.depths[slot] = make_splat_depth(args.camera, frame, p.geometry.s_max);
  return true;
}

/// Projects chunk `c` of a set, one Gaussian after the other.
template <class S>
struct ProjectChunk {
  ProjectArgs<S> args;

  GSNAV_HD void operator()(std::size_t c) const noexcept {
    const GaussianView& gs = args.gaussians;
    const std::size_t begin = c * kProjectChunk;
    const std::size_t end = begin + kProjectChunk < gs.size ? begin + kProjectChunk : gs.size;
    const std::size_t base = (args.first_chunk + c) * kProjectChunk;
    std::uint32_t written = 0;
    for (std::size_t i = begin; i < end; ++i) {
      const std::size_t origin = gs.origin_ids.empty() ? 0 : gs.origin_ids[i];
      const Vec3<float> mean{gs.means[0][i], gs.means[1][i], gs.means[2][i]};
      const float z = depth_key(args.camera.key_rotation, args.camera.key_scale, mean,
                                args.offsets_f[origin]);
      if (!(z > args.camera.near_plane)) continue;
      const Vec3<S> delta = vec_cast<S>(mean) + args.offsets[origin];
      Quat<S> quat{S(gs.quats[0][i]), S(gs.quats[1][i]), S(gs.quats[2][i]), S(gs.quats[3][i])};
      // Rounded to float a unit quaternion is off by 6e-8: nothing in float, but not in a reference.
      if constexpr (sizeof(S) > sizeof(float)) normalize(quat);
      const Vec3<S> scales{S(gs.scales[0][i]), S(gs.scales[1][i]), S(gs.scales[2][i])};
      CameraAxes<S> frame;
      const Projected<S> p =
          project<S, float>(args.camera, delta, z, quat, scales, S(gs.opacities[i]), frame);
      if (!p.visible) continue;
      const float key = args.camera.sort_order == SortOrder::z_depth
                            ? z
                            : distance_key(args.camera.key_scale, mean, args.offsets_f[origin]);
      if (write_splat(args, base + written, i, key, p, frame, delta)) ++written;
    }
    args.counts[args.first_chunk + c] = written;
  }
};

}  // namespace gsnav
