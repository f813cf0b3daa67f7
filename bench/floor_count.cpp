// SPDX-License-Identifier: Apache-2.0
// Compiled with -march=native: as floor_loops.cpp.
#include <bit>

#include "floor_loops.hpp"
#include "gsnav/math/pack.hpp"

namespace gsnav_bench {

FragmentCounts count_fragments(gsnav::View<const std::uint32_t> order,
                               gsnav::View<const gsnav::SplatGeometry<float>> geometry,
                               gsnav::View<const gsnav::SplatBounds> bounds,
                               const gsnav::BlendRules<float>& rules, float* transmittance,
                               int columns) noexcept {
  constexpr int kLanes = GSNAV_PACK_WIDTH;
  using F = gsnav::Pack<float, kLanes>;
  constexpr int kParts = 16 / kLanes;  // packs of a 4x4 block
  float lane_x[16], lane_y[16];
  for (int l = 0; l < 16; ++l) {
    lane_x[l] = static_cast<float>(l % 4) + 0.5f;
    lane_y[l] = static_cast<float>(l / 4) + 0.5f;
  }
  FragmentCounts counts;
  for (std::size_t i = 0; i < order.size; ++i) {
    const gsnav::SplatBounds b = bounds[order[i]];
    const gsnav::SplatRecords<float> splat{&geometry[order[i]], nullptr, nullptr, nullptr};
    for (int by = b.y0 / 4; by <= (b.y1 - 1) / 4; ++by) {
      for (int bx = b.x0 / 4; bx <= (b.x1 - 1) / 4; ++bx) {
        float* block = transmittance + 16 * (static_cast<std::ptrdiff_t>(by) * columns + bx);
        int changed = 0;
        for (int part = 0; part < kParts; ++part) {
          float* at = block + part * kLanes;
          gsnav::BlendState<F, gsnav::DepthMode::none> state;
          state.transmittance = F::load(at);
          const F x = F(static_cast<float>(4 * bx)) + F::load(lane_x + part * kLanes);
          const F y = F(static_cast<float>(4 * by)) + F::load(lane_y + part * kLanes);
          const auto hit = gsnav::blend_splat<false, gsnav::DepthMode::none, gsnav::Exp2::degree6, false>(
              state, rules, splat, x, y);
          state.transmittance.store(at);
          changed += std::popcount(gsnav::lane_bits(hit));
        }
        counts.evaluated += changed > 0 ? 16 : 0;
        counts.blended += static_cast<std::uint64_t>(changed);
      }
    }
  }
  return counts;
}

}  // namespace gsnav_bench
