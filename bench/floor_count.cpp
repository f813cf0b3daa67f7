// SPDX-License-Identifier: Apache-2.0
// Compiled with -march=native, like floor_loops.cpp.
#include <bit>
#include <cmath>

#include "floor_loops.hpp"
#include "gsnav/detail/math/pack.hpp"

namespace gsnav_bench {

namespace {

/// Interval of x that the ellipse alpha >= alpha_min covers in a strip of rows; empty if left > right.
struct Span {
  double left = 1, right = 0;
};

/// The ellipse of a projected Gaussian: with d from its mean, (a dx)^2 + (k dx + b dy)^2 <= radius^2.
class Ellipse {
 public:
  Ellipse(const gsnav::SplatGeometry<float>& g, double log2_alpha_min) noexcept
      : a_(static_cast<double>(g.a)), k_(static_cast<double>(g.k)), b_(static_cast<double>(g.b)) {
    const double dx = -static_cast<double>(g.w1) / a_;
    x_ = static_cast<double>(g.ref_x) + dx;
    y_ = static_cast<double>(g.ref_y) - (static_cast<double>(g.w2) + k_ * dx) / b_;
    const double power = static_cast<double>(g.log2_opacity) - log2_alpha_min;
    radius_ = power > 0 ? std::sqrt(power) : 0;
  }

  Span in_rows(double first, double last) const noexcept {
    const double half_height = radius_ * std::sqrt(1 + k_ * k_ / (a_ * a_)) / b_;
    const double low = std::fmax(first - y_, -half_height), high = std::fmin(last - y_, half_height);
    if (low > high) return {};
    const double widest = -k_ * radius_ / (a_ * b_);  // height at which the right edge is farthest
    return {x_ + edge(std::fmin(std::fmax(-widest, low), high), -1),
            x_ + edge(std::fmin(std::fmax(widest, low), high), 1)};
  }

 private:
  double edge(double dy, double side) const noexcept {
    const double squares = a_ * a_ + k_ * k_,
                 root = radius_ * radius_ * squares - a_ * a_ * b_ * b_ * dy * dy;
    return (-k_ * b_ * dy + side * std::sqrt(std::fmax(root, 0))) / squares;
  }
  double a_, k_, b_, x_ = 0, y_ = 0, radius_ = 0;
};

}  // namespace

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
    const Ellipse ellipse(geometry[order[i]], static_cast<double>(rules.log2_alpha_min));
    for (int by = b.y0 / 4; by <= (b.y1 - 1) / 4; ++by) {
      const Span span = ellipse.in_rows(4 * by + 0.5, 4 * by + 3.5);
      for (int bx = b.x0 / 4; bx <= (b.x1 - 1) / 4; ++bx) {
        float* block = transmittance + 16 * (static_cast<std::ptrdiff_t>(by) * columns + bx);
        int changed = 0, open = 0;
        for (int part = 0; part < kParts; ++part) {
          float* at = block + part * kLanes;
          gsnav::BlendState<F, gsnav::DepthMode::none> state;
          state.transmittance = F::load(at);
          open += std::popcount(gsnav::lane_bits(state.open(rules)));
          const F x = F(static_cast<float>(4 * bx)) + F::load(lane_x + part * kLanes);
          const F y = F(static_cast<float>(4 * by)) + F::load(lane_y + part * kLanes);
          const auto hit =
              gsnav::blend_splat<false, gsnav::DepthMode::none, gsnav::Exp2::degree5, false>(
                  state, rules, splat, x, y);
          state.transmittance.store(at);
          changed += std::popcount(gsnav::lane_bits(hit));
        }
        const bool reached = span.left <= 4 * bx + 3.5 && span.right >= 4 * bx + 0.5;
        counts.evaluated += changed > 0 || (open > 0 && reached) ? 16 : 0;
        counts.needed += changed > 0 ? 16 : 0;
        counts.blended += static_cast<std::uint64_t>(changed);
      }
    }
  }
  return counts;
}

}  // namespace gsnav_bench
