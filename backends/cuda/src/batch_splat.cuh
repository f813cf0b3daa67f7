// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "batch_args.cuh"

// Cameras with plain rules in the parts that projection reads, each when it is needed.

namespace gsnav::cuda {

using Splat = gsnav::Splat<float>;

/// Part of the double camera that row_key reads.
__device__ inline ProjectionCamera<double> key_camera_of(const PlainCamera& p) {
  ProjectionCamera<double> c;
  c.rotation.row[2] = {p.mean.rotation[6], p.mean.rotation[7], p.mean.rotation[8]};
  c.scale = p.key.scale;
  return c;
}

/// Copies the rotation and the intrinsics.
template <class S, class Packed>
__device__ inline void set_lens(ProjectionCamera<S>& c, const Packed& p) {
  for (int i = 0; i < 9; ++i) c.rotation.row[i / 3][i % 3] = p.rotation[i];
  c.fx = p.fx;
  c.fy = p.fy;
  c.cx = p.cx;
  c.cy = p.cy;
}

/// The float camera that `p` packs, without its key.
__device__ inline ProjectionCamera<float> camera_of(const BatchArgs& a, const PlainCamera::Axes& p) {
  ProjectionCamera<float> c;
  set_lens(c, p);
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

/// The double camera, as far as means and keys need it.
__device__ inline ProjectionCamera<double> camera_of(const PlainCamera::Mean& p) {
  ProjectionCamera<double> c;
  set_lens(c, p);
  return c;
}

}  // namespace gsnav::cuda
