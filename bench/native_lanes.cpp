// SPDX-License-Identifier: Apache-2.0
// Compiled with -march=native. It calls only functions that are always inlined, so that no other object
// file can link to code with this instruction set.
#include "native_lanes.hpp"

#include "gsnav/detail/math/pack.hpp"
#include "gsnav/frame/sh.hpp"
#include "gsnav/skin/lbs.hpp"

namespace gsnav_bench {

namespace {
using F = gsnav::Pack<float, GSNAV_PACK_WIDTH>;
constexpr std::size_t kStep = GSNAV_PACK_WIDTH;
}  // namespace

int native_width() noexcept { return GSNAV_PACK_WIDTH; }

void native_sh(const ShPlanes& planes, int degree, std::size_t begin, std::size_t end) noexcept {
  for (std::size_t i = begin; i < end; i += kStep) {
    gsnav::Vec3<F> d{F::load(planes.deltas[0] + i), F::load(planes.deltas[1] + i),
                     F::load(planes.deltas[2] + i)};
    if (degree > 0) {
      const F n = gsnav::norm(d);
      const auto far = n > F(1e-12f);
      const F inverse = F(1.0f) / n;
      d = {gsnav::select(far, d.x * inverse, F(0.0f)), gsnav::select(far, d.y * inverse, F(0.0f)),
           gsnav::select(far, d.z * inverse, F(1.0f))};
    }
    const gsnav::Vec3<F> color = gsnav::sh_color<F>(degree, d, [&](int k) noexcept {
      const float* p = planes.coefficients + 3 * static_cast<std::size_t>(k) * planes.size + i;
      return gsnav::Vec3<F>{F::load(p), F::load(p + planes.size), F::load(p + 2 * planes.size)};
    });
    color.x.store(planes.colors[0] + i);
    color.y.store(planes.colors[1] + i);
    color.z.store(planes.colors[2] + i);
  }
}

void native_polar(const float* const (&in)[9], float* const (&out)[9], std::size_t begin,
                  std::size_t end) noexcept {
  for (std::size_t i = begin; i < end; i += kStep) {
    gsnav::Mat3<F> m;
    for (int k = 0; k < 9; ++k) m(k / 3, k % 3) = F::load(in[k] + i);
    const gsnav::Mat3<F> r = gsnav::polar_rotation(m);
    for (int k = 0; k < 9; ++k) r(k / 3, k % 3).store(out[k] + i);
  }
}

}  // namespace gsnav_bench
