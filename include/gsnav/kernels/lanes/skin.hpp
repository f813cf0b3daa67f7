// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gsnav/kernels/lanes/isa.hpp"
#include "gsnav/kernels/lbs.hpp"

namespace gsnav::lanes {
inline namespace GSNAV_LANES_TAG {

/// SkinGaussian<float> for the Gaussians [begin, end), kWidth side by side; the same bits.
inline void skin_range(const SkinningArgs<float>& args, std::size_t begin, std::size_t end) noexcept {
  constexpr std::size_t step = static_cast<std::size_t>(kWidth);
  for (std::size_t first = begin; first < end; first += step) {
    const std::size_t count = end - first < step ? end - first : step;
    // The last pack repeats its last Gaussian; only `count` lanes are written.
    const auto row = [&](std::size_t lane) { return first + (lane < count ? lane : count - 1); };
    const auto gather = [&](const auto& value) {
      float v[step];
      for (std::size_t l = 0; l < step; ++l) v[l] = value(row(l));
      return F::load(v);
    };
    const auto plane = [&](const View<const float>& p) {
      return count == step ? F::load(p.data + first) : gather([&](std::size_t i) { return p[i]; });
    };
    Affine3<F> joints[kInfluences];
    F weights[kInfluences];
    for (std::size_t k = 0; k < static_cast<std::size_t>(kInfluences); ++k) {
      weights[k] = gather([&](std::size_t i) { return args.weights[4 * i + k]; });
      float m[12][step];
      for (std::size_t l = 0; l < step; ++l) {
        const Affine3<float>& j = args.joints[args.joint_indices[4 * row(l) + k]];
        for (int r = 0; r < 3; ++r) {
          m[4 * r][l] = j.linear.row[r].x;
          m[4 * r + 1][l] = j.linear.row[r].y;
          m[4 * r + 2][l] = j.linear.row[r].z;
          m[4 * r + 3][l] = j.translation[r];
        }
      }
      for (int r = 0; r < 3; ++r) {
        joints[k].linear.row[r] = {F::load(m[4 * r]), F::load(m[4 * r + 1]), F::load(m[4 * r + 2])};
        joints[k].translation[r] = F::load(m[4 * r + 3]);
      }
    }
    const Vec3<F> mean{plane(args.means[0]), plane(args.means[1]), plane(args.means[2])};
    const Quat<F> quat{plane(args.quats[0]), plane(args.quats[1]), plane(args.quats[2]), plane(args.quats[3])};
    const Skinned<F> s = skin<F>(joints, weights, mean, quat);
    const auto write = [&](const View<float>& out, const F& v) {
      if (count == step) {
        v.store(out.data + first);
      } else {
        for (std::size_t l = 0; l < count; ++l) out[first + l] = v[static_cast<int>(l)];
      }
    };
    for (int k = 0; k < 3; ++k) write(args.means_out[k], s.mean[k]);
    const F quats[4] = {s.quat.w, s.quat.x, s.quat.y, s.quat.z};
    const F rotations[4] = {s.rotation.w, s.rotation.x, s.rotation.y, s.rotation.z};
    for (int k = 0; k < 4; ++k) {
      write(args.quats_out[k], quats[k]);
      if (!args.rotations_out[k].empty()) write(args.rotations_out[k], rotations[k]);
    }
  }
}

}  // namespace GSNAV_LANES_TAG
}  // namespace gsnav::lanes
