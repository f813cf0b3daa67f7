// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gsnav/detail/lanes/isa.hpp"
#include "gsnav/detail/sweep/capsule_batch.hpp"

namespace gsnav::lanes {
inline namespace GSNAV_LANES_TAG {

/// Reads kWidth capsules. `read(plane)` returns their values of one plane.
template <class Read>
GSNAV_HD Capsule<F> read_capsules(const CapsulePlanes<float>& c, const Read& read) noexcept {
  return {{read(c.p0[0]), read(c.p0[1]), read(c.p0[2])},
          {read(c.p1[0]), read(c.p1[1]), read(c.p1[2])},
          read(c.radius)};
}
/// Reads kWidth moving capsules.
template <class Read>
GSNAV_HD MovingCapsule<F> read_capsules(const MovingCapsulePlanes<float>& c, const Read& read) noexcept {
  return {read_capsules(c.begin, read), read_capsules(c.end, read)};
}

/// Computes the gaps of whole packs of pairs. Without points it is a separate function, so that no
/// register holds what only they need.
template <bool Points>
GSNAV_HD void gap_packs(const CapsuleGapArgs<float>& args, std::size_t begin, std::size_t end) noexcept {
  for (std::size_t i = begin; i < end; i += kWidth) {
    const auto read = [i](const View<const float>& plane) noexcept { return F::load(plane.data + i); };
    const CapsuleGap<F> g = capsule_gap(read_capsules(args.a, read), read_capsules(args.b, read));
    g.gap.store(args.gap.data + i);
    if constexpr (Points) {
      for (int k = 0; k < 3; ++k) {
        g.normal[k].store(args.normal[k].data + i);
        g.on_a[k].store(args.on_a[k].data + i);
        g.on_b[k].store(args.on_b[k].data + i);
      }
    }
  }
}

/// Computes GapOfPair<float> for the pairs [begin, end), kWidth at a time. The bits equal those of the
/// scalar kernel.
inline void gap_range(const CapsuleGapArgs<float>& args, std::size_t begin, std::size_t end) noexcept {
  const std::size_t packs = begin + (end - begin) / kWidth * kWidth;
  if (args.asks_for_points()) {
    gap_packs<true>(args, begin, packs);
  } else {
    gap_packs<false>(args, begin, packs);
  }
  const GapOfPair<float> one{args};
  for (std::size_t i = packs; i < end; ++i) one(i);
}

/// Writes the first `lanes` lanes of `r`, lane l as pair row(l). `write(plane, values)` writes one
/// plane.
template <class Row, class Write>
GSNAV_HD void write_sweeps(const SweepArgs<float>& args, const SweepResult<F>& r, int lanes,
                           const Row& row, const Write& write) noexcept {
  const std::uint32_t hit = lane_bits(r.hit), pushed = lane_bits(r.pushed),
                      closing = lane_bits(r.agent_closing);
  for (int l = 0; l < lanes; ++l) args.outcome[row(l)] = 0;
  for (std::uint32_t eventful = (hit | pushed | closing) & ((1u << lanes) - 1u); eventful != 0;
       eventful &= eventful - 1) {
    const int l = __builtin_ctz(eventful);
    args.outcome[row(l)] =
        sweep_outcome((hit >> l & 1u) != 0, (pushed >> l & 1u) != 0, (closing >> l & 1u) != 0);
  }
  write(args.time, r.time);
  write(args.start_gap, r.start_gap);
  if (!args.asks_for_contact()) return;
  write(args.contact_time, r.contact_time);
  write(args.gap, r.gap);
  for (int k = 0; k < 3; ++k) {
    write(args.normal[k], r.normal[k]);
    write(args.point[k], r.point[k]);
  }
}

/// Largest number of pairs per call of sweep_range.
inline constexpr std::size_t kSweepRange = 1024;

/// Computes SweepPair<float> for the pairs [begin, end), at most kSweepRange, kWidth at a time. The bits
/// equal those of the scalar kernel.
///
/// Most pairs move apart or pass each other and need only one evaluation. The others are collected and
/// finished together, so that a pack does not wait for a single lane.
inline void sweep_range(const SweepArgs<float>& args, std::size_t begin, std::size_t end) noexcept {
  std::uint32_t open[kSweepRange + kWidth];
  std::size_t count = 0;
  const int once = args.rules.max_iterations < 1 ? args.rules.max_iterations : 1;
  const std::size_t packs = begin + (end - begin) / kWidth * kWidth;
  for (std::size_t i = begin; i < packs; i += kWidth) {
    const auto read = [i](const View<const float>& plane) noexcept { return F::load(plane.data + i); };
    const auto write = [i](const View<float>& plane, const F& v) noexcept { v.store(plane.data + i); };
    mask_of<F> unfinished;
    const SweepResult<F> r =
        gsnav::detail::sweep_steps(read_capsules(args.agents, read), read_capsules(args.bodies, read),
                                   args.rules, once, unfinished);
    write_sweeps(
        args, r, kWidth, [i](int l) noexcept { return i + static_cast<std::size_t>(l); }, write);
    for (std::uint32_t bits = lane_bits(unfinished); bits != 0; bits &= bits - 1) {
      open[count++] = static_cast<std::uint32_t>(i + static_cast<std::size_t>(__builtin_ctz(bits)));
    }
  }
  for (std::size_t first = 0; first < count; first += kWidth) {
    const std::size_t lanes = count - first < kWidth ? count - first : kWidth;
    const std::uint32_t* const rows = open + first;
    for (std::size_t l = lanes; l < kWidth; ++l)
      open[first + l] = open[first];  // computed, but not written
    const auto read = [rows](const View<const float>& plane) noexcept {
      float v[kWidth];
      for (std::size_t l = 0; l < kWidth; ++l) v[l] = plane[rows[l]];
      return F::load(v);
    };
    const auto write = [rows, lanes](const View<float>& plane, const F& v) noexcept {
      for (std::size_t l = 0; l < lanes; ++l) plane[rows[l]] = v[static_cast<int>(l)];
    };
    const SweepResult<F> r =
        sweep(read_capsules(args.agents, read), read_capsules(args.bodies, read), args.rules);
    write_sweeps(
        args, r, static_cast<int>(lanes), [rows](int l) noexcept { return rows[l]; }, write);
  }
  const SweepPair<float> one{args};
  for (std::size_t i = packs; i < end; ++i) one(i);
}

}  // namespace GSNAV_LANES_TAG
}  // namespace gsnav::lanes
