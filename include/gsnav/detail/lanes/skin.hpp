// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gsnav/detail/lanes/isa.hpp"
#include "gsnav/skin/lbs.hpp"

namespace gsnav::lanes {
inline namespace GSNAV_LANES_TAG {

// The joint matrix of one Gaussian is blended as it lies in memory: twelve floats, the linear part by
// rows, then the translation. The matrices of a pack are then transposed in registers.
static_assert(sizeof(Affine3<float>) == 12 * sizeof(float));

/// Blended joint matrix of one Gaussian, with the functions that blend_influences needs.
struct BlendedRow {
#if GSNAV_PACK_WIDTH >= 8
  using Weight = Pack<float, 8>;
  Pack<float, 8> low;
  Pack<float, 4> high;

  static GSNAV_HD Pack<float, 4> half(const Weight& w) noexcept {
    return Pack<float, 4>(__builtin_shufflevector(w.v, w.v, 0, 1, 2, 3));
  }
  static GSNAV_HD BlendedRow load(const float* p) noexcept {
    return {Pack<float, 8>::load(p), Pack<float, 4>::load(p + 8)};
  }
  friend GSNAV_HD BlendedRow weighted(const Weight& w, const BlendedRow& a) noexcept {
    return {a.low * w, a.high * half(w)};
  }
  friend GSNAV_HD BlendedRow weighted(const Weight& w, const BlendedRow& a,
                                      const BlendedRow& sum) noexcept {
    return {fma(w, a.low, sum.low), fma(half(w), a.high, sum.high)};
  }
#else
  using Weight = Pack<float, 4>;
  Pack<float, 4> parts[3];

  static GSNAV_HD BlendedRow load(const float* p) noexcept {
    return {{Weight::load(p), Weight::load(p + 4), Weight::load(p + 8)}};
  }
  friend GSNAV_HD BlendedRow weighted(const Weight& w, const BlendedRow& a) noexcept {
    return {{a.parts[0] * w, a.parts[1] * w, a.parts[2] * w}};
  }
  friend GSNAV_HD BlendedRow weighted(const Weight& w, const BlendedRow& a,
                                      const BlendedRow& sum) noexcept {
    return {{fma(w, a.parts[0], sum.parts[0]), fma(w, a.parts[1], sum.parts[1]),
             fma(w, a.parts[2], sum.parts[2])}};
  }
#endif
};

template <int K>
GSNAV_HD BlendedRow blend_row(const float* joints, const std::uint16_t* indices,
                              const float* weights) noexcept {
  return blend_influences(
      K, [&](int k) GSNAV_INLINED { return BlendedRow::load(joints + std::size_t{12} * indices[k]); },
      [&](int k) GSNAV_INLINED { return BlendedRow::Weight(weights[k]); });
}

/// Blended matrices of every fourth Gaussian of a pack. Each 128-bit part of `parts[i]` holds four
/// elements of one matrix.
struct BlendedRows {
  F::vector parts[3];
};

template <int K>
GSNAV_HD BlendedRows blend_every_fourth(const float* joints, const std::uint16_t* indices,
                                        const float* weights) noexcept {
  const auto row = [&](int l) noexcept {
    return blend_row<K>(joints, indices + 4 * K * l, weights + 4 * K * l);
  };
  const BlendedRow r0 = row(0);
#if GSNAV_PACK_WIDTH == 16
  const BlendedRow r1 = row(1), r2 = row(2), r3 = row(3);
  const auto pair = [](const Pack<float, 8>& a, const Pack<float, 8>& b) noexcept {
    return __builtin_shufflevector(a.v, b.v, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
  };
  const auto x = pair(r0.low, r1.low), y = pair(r2.low, r3.low);
  const auto h = __builtin_shufflevector(r0.high.v, r1.high.v, 0, 1, 2, 3, 4, 5, 6, 7);
  const auto i = __builtin_shufflevector(r2.high.v, r3.high.v, 0, 1, 2, 3, 4, 5, 6, 7);
  return {{__builtin_shufflevector(x, y, 0, 1, 2, 3, 8, 9, 10, 11, 16, 17, 18, 19, 24, 25, 26, 27),
           __builtin_shufflevector(x, y, 4, 5, 6, 7, 12, 13, 14, 15, 20, 21, 22, 23, 28, 29, 30, 31),
           __builtin_shufflevector(h, i, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15)}};
#elif GSNAV_PACK_WIDTH == 8
  const BlendedRow r1 = row(1);
  return {{__builtin_shufflevector(r0.low.v, r1.low.v, 0, 1, 2, 3, 8, 9, 10, 11),
           __builtin_shufflevector(r0.low.v, r1.low.v, 4, 5, 6, 7, 12, 13, 14, 15),
           __builtin_shufflevector(r0.high.v, r1.high.v, 0, 1, 2, 3, 4, 5, 6, 7)}};
#else
  return {{r0.parts[0].v, r0.parts[1].v, r0.parts[2].v}};
#endif
}

/// Four elements of the matrices of a pack, one element per pack. The arguments are one of the parts of
/// four BlendedRows.
struct MatrixColumns {
  F c[4];

  GSNAV_HD MatrixColumns(F::vector m0, F::vector m1, F::vector m2, F::vector m3) noexcept {
    F::vector r[4] = {m0, m1, m2, m3};
    gsnav::detail::transpose_quarters(r);
    for (int k = 0; k < 4; ++k) c[k].v = r[k];
  }
};

/// Blended joint matrices of the kWidth Gaussians from `first` on.
template <int K>
GSNAV_HD Affine3<F> blend_joints(const SkinningArgs<float>& args, std::size_t first) noexcept {
  constexpr int step = K * kWidth;
  const std::uint16_t* const indices = args.joint_indices.data + K * first;
  const std::uint16_t* const parts = args.weights.data + K * first;
  const float* const joints = reinterpret_cast<const float*>(args.joints.data);
  float weights[step];
  for (int k = 0; k < step; ++k) weights[k] = skinning_weight<float>(parts[k]);
  const BlendedRows a = blend_every_fourth<K>(joints, indices, weights),
                    b = blend_every_fourth<K>(joints, indices + K, weights + K),
                    c = blend_every_fourth<K>(joints, indices + 2 * K, weights + 2 * K),
                    d = blend_every_fourth<K>(joints, indices + 3 * K, weights + 3 * K);
  const MatrixColumns m0(a.parts[0], b.parts[0], c.parts[0], d.parts[0]),
      m1(a.parts[1], b.parts[1], c.parts[1], d.parts[1]),
      m2(a.parts[2], b.parts[2], c.parts[2], d.parts[2]);
  return {{{{m0.c[0], m0.c[1], m0.c[2]}, {m0.c[3], m1.c[0], m1.c[1]}, {m1.c[2], m1.c[3], m2.c[0]}}},
          {m2.c[1], m2.c[2], m2.c[3]}};
}

/// Linear parts of the joints with the greatest weights, for the pack that begins at `first`. Rarely
/// called, and not inlined, so that its loads take no registers from skin_packs.
template <int K>
[[gnu::noinline, gnu::cold]] Mat3<F> greatest_joints(const SkinningArgs<float>& args,
                                                     std::size_t first) noexcept {
  Mat3<F> out;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      float v[kWidth];
      for (std::size_t l = 0; l < kWidth; ++l)
        v[l] = args.joints[args.joint_indices[K * (first + l)]].linear(i, j);
      out(i, j) = F::load(v);
    }
  }
  return out;
}

/// Computes SkinGaussian<float> for the Gaussians [begin, end) in whole packs. The bits equal those of
/// the scalar kernel.
template <int K>
GSNAV_HD void skin_packs(const SkinningArgs<float>& args, std::size_t begin, std::size_t end) noexcept {
  for (std::size_t first = begin; first < end; first += kWidth) {
    const auto at = [first](const View<const float>& plane) noexcept {
      return F::load(plane.data + first);
    };
    const Affine3<F> blend = blend_joints<K>(args, first);
    const Vec3<F> mean{at(args.means[0]), at(args.means[1]), at(args.means[2])};
    const Quat<F> quat{at(args.quats[0]), at(args.quats[1]), at(args.quats[2]), at(args.quats[3])};
    const auto greatest = [&]() noexcept { return greatest_joints<K>(args, first); };
    const Skinned<F> s = skin<F>(blend, greatest, mean, quat, args.writes_rotations());
    for (int k = 0; k < 3; ++k) s.mean[k].store(args.means_out[k].data + first);
    const F quats[4] = {s.quat.w, s.quat.x, s.quat.y, s.quat.z};
    for (int k = 0; k < 4; ++k) quats[k].store(args.quats_out[k].data + first);
    if (args.writes_rotations()) {
      const F rotations[4] = {s.rotation.w, s.rotation.x, s.rotation.y, s.rotation.z};
      for (int k = 0; k < 4; ++k) rotations[k].store(args.rotations_out[k].data + first);
    }
  }
}

/// Computes SkinGaussian<float> for the Gaussians [begin, end), kWidth at a time. The bits equal those
/// of the scalar kernel.
inline void skin_range(const SkinningArgs<float>& args, std::size_t begin, std::size_t end) noexcept {
  const std::size_t packs = begin + (end - begin) / kWidth * kWidth;
  if (args.influences == kInfluences8) {
    skin_packs<kInfluences8>(args, begin, packs);
  } else {
    skin_packs<kInfluences4>(args, begin, packs);
  }
  const SkinGaussian<float> one{args};
  for (std::size_t i = packs; i < end; ++i) one(i);
}

}  // namespace GSNAV_LANES_TAG
}  // namespace gsnav::lanes
