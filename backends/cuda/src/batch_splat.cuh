// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "batch_args.cuh"

// A projected Gaussian in registers.

namespace gsnav::cuda {

struct Splat {
  SplatGeometry<float> geometry;
  SplatBounds bounds;
  SplatDepth<float> depth;
  SplatPerspective<float> perspective;
};

/// `store_splat` into registers. False where no pixel centre lies in the bounds.
/// `Plain`: neither depth nor perspective is asked for.
template <bool Plain, class T, class U>
__device__ inline bool make_splat(const ProjectionCamera<T>& camera, bool depth, const Projected<T>& p,
                           const SplatAxes<T>& axes, U mean_x, U mean_y, Splat& out) {
  ProjectArgs<float> to;
  to.depth = !Plain && depth;
  to.geometry = {&out.geometry, 1};
  to.bounds = {&out.bounds, 1};
  to.depths = {&out.depth, 1};
  to.perspectives = {&out.perspective, 1};
  return gsnav::detail::store_splat(to, 0, camera, p, axes, mean_x, mean_y);
}

/// The same in double, for Gaussians whose geometry float cannot hold.
__device__ inline bool make_splat64(const ProjectArgs<float>& args, bool depth, std::size_t row, float key,
                                    const Vec3<float>& mean, std::size_t origin, Splat& out) {
  SplatAxes<double> axes;
  const Projected<double> p = gsnav::detail::project64(args, row, key, mean, origin, axes);
  return make_splat<false>(args.camera64, depth, p, axes, p.mean_x, p.mean_y, out);
}

/// The float camera that `p` packs, but for its key.
__device__ inline ProjectionCamera<float> camera_of(const BatchArgs& a, const PlainCamera::Axes& p) {
  ProjectionCamera<float> c;
  for (int i = 0; i < 9; ++i) c.rotation.row[i / 3][i % 3] = p.rotation[i];
  c.fx = p.fx;
  c.fy = p.fy;
  c.cx = p.cx;
  c.cy = p.cy;
  c.u_min = p.u_min;
  c.u_max = p.u_max;
  c.v_min = p.v_min;
  c.v_max = p.v_max;
  c.width = a.grid.width;
  c.height = a.grid.height;
  c.eps2d = p.eps2d;
  c.log2_alpha_min = p.log2_alpha_min;
  return c;
}

__device__ inline ProjectionCamera<double> camera_of(const PlainCamera::Mean& p) {
  ProjectionCamera<double> c;
  for (int i = 0; i < 9; ++i) c.rotation.row[i / 3][i % 3] = p.rotation[i];
  c.fx = p.fx;
  c.fy = p.fy;
  c.cx = p.cx;
  c.cy = p.cy;
  return c;
}

}  // namespace gsnav::cuda
