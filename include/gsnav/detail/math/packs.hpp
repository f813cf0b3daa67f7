// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gsnav/detail/math/pack.hpp"

namespace gsnav {

/// G packs that are processed side by side. A long chain of dependent instructions, such as exp2, leaves
/// a processor idle, because it looks ahead only a limited number of instructions. Interleaving G
/// independent chains keeps it busy.
template <class P, int G>
struct Packs {
  P v[G];

  GSNAV_HD Packs() noexcept = default;
  GSNAV_HD Packs(scalar_of<P> s) noexcept : Packs(P(s)) {}
  GSNAV_HD explicit Packs(P p) noexcept {
    for (P& x : v) x = p;
  }
  /// Packs f(0), ..., f(G - 1).
  template <class F>
  GSNAV_HD static Packs of(const F& f) noexcept {
    Packs r;
    for (int i = 0; i < G; ++i) r.v[i] = f(i);
    return r;
  }

  GSNAV_HD friend Packs operator+(const Packs& a, const Packs& b) noexcept {
    return of([&](int i) GSNAV_INLINED { return a.v[i] + b.v[i]; });
  }
  GSNAV_HD friend Packs operator-(const Packs& a, const Packs& b) noexcept {
    return of([&](int i) GSNAV_INLINED { return a.v[i] - b.v[i]; });
  }
  GSNAV_HD friend Packs operator-(const Packs& a) noexcept {
    return of([&](int i) GSNAV_INLINED { return -a.v[i]; });
  }
};

/// Comparison result of Packs.
template <class P, int G>
struct PackMasks {
  mask_of<P> v[G];
};

template <class P, int G>
struct LaneTraits<Packs<P, G>> {
  using scalar = scalar_of<P>;
  using mask = PackMasks<P, G>;
  static constexpr int width = G * LaneTraits<P>::width;
};

template <class P, int G>
GSNAV_HD PackMasks<P, G> operator>=(const Packs<P, G>& a, const Packs<P, G>& b) noexcept {
  PackMasks<P, G> r;
  for (int i = 0; i < G; ++i) r.v[i] = a.v[i] >= b.v[i];
  return r;
}
template <class P, int G>
GSNAV_HD Packs<P, G> select(const PackMasks<P, G>& m, const Packs<P, G>& a,
                            const Packs<P, G>& b) noexcept {
  return Packs<P, G>::of([&](int i) GSNAV_INLINED { return select(m.v[i], a.v[i], b.v[i]); });
}
template <class P, int G>
GSNAV_HD Packs<P, G> min(const Packs<P, G>& a, const Packs<P, G>& b) noexcept {
  return Packs<P, G>::of([&](int i) GSNAV_INLINED { return min(a.v[i], b.v[i]); });
}
/// a * b + c, rounded once.
template <class P, int G>
GSNAV_HD Packs<P, G> fma(const Packs<P, G>& a, const Packs<P, G>& b, const Packs<P, G>& c) noexcept {
  return Packs<P, G>::of([&](int i) GSNAV_INLINED { return fma(a.v[i], b.v[i], c.v[i]); });
}

template <class P, int G>
GSNAV_HD Packs<P, G> scale_by_rounded(const Packs<P, G>& p, const Packs<P, G>& t) noexcept {
  return Packs<P, G>::of([&](int i) GSNAV_INLINED { return scale_by_rounded(p.v[i], t.v[i]); });
}

/// 2^x for x in [-126, 126], with the bits of the scalar exp2 in each lane. The result for any other x
/// is unspecified.
template <Exp2 M, class P, int G>
GSNAV_HD Packs<P, G> exp2_in_range(const Packs<P, G>& x) noexcept {
  return detail::exp2_by_polynomial<M>(x);
}

}  // namespace gsnav
