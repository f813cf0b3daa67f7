// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "batch_args.cuh"

// Cameras of plain rules as projection reads them: in parts, each when it is needed.

namespace gsnav::detail {

// What depth_record (batch_blend.cu) asks for, one value at a time.

struct GivenRow {
  const Vec3<float>& given_mean;
  const Vec3d& given_offset;
  __device__ const Vec3<float>& mean() const { return given_mean; }
  __device__ const Vec3d& offset() const { return given_offset; }
  __device__ Vec3<float> rounded_offset(const Vec3d& offset) const { return vec_cast<float>(offset); }
};
__device__ inline RowKey<float> key_of(const ProjectArgs<float>& args, const Vec3<float>& mean,
                                       std::size_t origin) {
  return row_key<float>(args.camera64, GivenRow{mean, args.offsets[origin]});
}
__device__ inline float depth_of(const ProjectArgs<float>& args, const Vec3<float>& mean,
                                 std::size_t origin) {
  return key_of(args, mean, origin).z;
}
__device__ inline Vec3<float> camera_delta(const ProjectArgs<float>& args, const Vec3<float>& mean,
                                           std::size_t origin) {
  return key_of(args, mean, origin).delta;
}
__device__ inline float sort_key(const ProjectArgs<float>& args, float, const Vec3<float>& mean,
                                 std::size_t origin) {
  return gsnav::sort_key(args.camera64, key_of(args, mean, origin));
}

}  // namespace gsnav::detail

namespace gsnav::cuda {

using Splat = gsnav::Splat<float>;

/// As above.
__device__ inline bool make_splat64(const ProjectArgs<float>& args, bool depth, std::size_t row, float,
                                    const Vec3<float>&, std::size_t, Splat& out) {
  const ViewedRow from({args.gaussians, row}, args.offsets);
  return gsnav::make_splat64(args.camera64, depth, from, row_key<float>(args.camera64, from), out);
}

/// What row_key reads of the double camera.
__device__ inline ProjectionCamera<double> key_camera_of(const PlainCamera& p) {
  ProjectionCamera<double> c;
  c.rotation.row[2] = {p.mean.rotation[6], p.mean.rotation[7], p.mean.rotation[8]};
  c.scale = p.key.scale;
  return c;
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

/// The double camera, as far as means and keys need it.
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
