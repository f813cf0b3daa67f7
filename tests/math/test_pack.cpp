// SPDX-License-Identifier: Apache-2.0
// A pack is its lanes: the same bits as the scalar functions.
#include <doctest/doctest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "gsnav/core/rng.hpp"
#include "gsnav/detail/math/pack.hpp"
#include "gsnav/detail/math/pack_columns.hpp"
#include "gsnav/detail/math/pack_double.hpp"
#include "gsnav/detail/math/pack_layout.hpp"
#include "gsnav/detail/math/pack_words.hpp"
#include "gsnav/detail/math/packs.hpp"
#include "gsnav/math/quat.hpp"

using namespace gsnav;

namespace {

template <int N>
void check_lanes() {
  using P = Pack<float, N>;
  Rng rng(7);
  for (int round = 0; round < 20000; ++round) {
    float a[N], b[N], c[N], positive[N];
    for (int i = 0; i < N; ++i) {
      a[i] = static_cast<float>(std::exp2(rng.uniform(-20, 20)) * (rng.uniform() < 0.5 ? -1 : 1));
      b[i] = static_cast<float>(std::exp2(rng.uniform(-20, 20)) * (rng.uniform() < 0.5 ? -1 : 1));
      c[i] = round % 2 == 0 ? -a[i] * b[i] : static_cast<float>(rng.normal());
      positive[i] = static_cast<float>(std::exp2(rng.uniform(-100, 100)));
    }
    const P pa = P::load(a), pb = P::load(b), pc = P::load(c), pp = P::load(positive);
    const P sum = pa + pb, product = pa * pb, quotient = pa / pb, fused = fma(pa, pb, pc);
    const P root = sqrt(pp), power = gsnav::exp2(pb), logarithm = gsnav::log2(pp);
    const P coarse = gsnav::exp2<Exp2::degree3>(pb);
    const P low = min(pa, pb), high = max(pa, pb), magnitude = abs(pa);
    const auto less = pa < pb;
    const P chosen = select(less, pa, pc);
    std::uint32_t bits = 0;
    for (int i = 0; i < N; ++i) {
      const auto same = [&](const P& p, float s) { return bits_of(p[i]) == bits_of(s); };
      REQUIRE(same(sum, a[i] + b[i]));
      REQUIRE(same(product, a[i] * b[i]));
      REQUIRE(same(quotient, a[i] / b[i]));
      REQUIRE(same(fused, gsnav::fma(a[i], b[i], c[i])));
      REQUIRE(same(root, gsnav::sqrt(positive[i])));
      REQUIRE(same(power, gsnav::exp2(b[i])));
      REQUIRE(same(coarse, gsnav::exp2<Exp2::degree3>(b[i])));
      REQUIRE(same(logarithm, gsnav::log2(positive[i])));
      REQUIRE(same(low, gsnav::min(a[i], b[i])));
      REQUIRE(same(high, gsnav::max(a[i], b[i])));
      REQUIRE(same(magnitude, std::abs(a[i])));
      REQUIRE(same(chosen, a[i] < b[i] ? a[i] : c[i]));
      bits |= (a[i] < b[i] ? 1u : 0u) << i;
    }
    REQUIRE(lane_bits(less) == bits);
    REQUIRE(any(less) == (bits != 0));
    REQUIRE(all(less || !less));
    REQUIRE(!any(less && !less));
  }
}

template <int N>
void check_memory() {
  using P = Pack<float, N>;
  constexpr int kRepeated = N >= 8 ? 4 : 2;
  float a[N], b[N], c[N], mixed[3 * N], repeated[N];
  for (int i = 0; i < N; ++i) {
    a[i] = static_cast<float>(i) + 0.25f;
    b[i] = static_cast<float>(i) + 0.5f;
    c[i] = static_cast<float>(i) + 0.75f;
  }
  store_interleaved(P::load(a), P::load(b), P::load(c), mixed);
  load_repeated<kRepeated, N>(a + 1).store(repeated);
  for (int i = 0; i < N; ++i) {
    CHECK(mixed[3 * i] == a[i]);
    CHECK(mixed[3 * i + 1] == b[i]);
    CHECK(mixed[3 * i + 2] == c[i]);
    CHECK(repeated[i] == a[1 + i % kRepeated]);
  }
  constexpr int kHigh = N == 16 ? 4 : 2, kWide = N / kHigh;
  P blocks[kHigh];
  for (int k = 0; k < kHigh; ++k) blocks[k] = P::load(a) + P(static_cast<float>(100 * k));
  transpose_chunks<kHigh>(blocks);
  for (int k = 0; k < kHigh; ++k) {
    for (int i = 0; i < N; ++i) {
      CHECK(blocks[k][i] == a[k * kWide + i % kWide] + static_cast<float>(100 * (i / kWide)));
    }
  }
  std::uint8_t indices[N];
  const int listed = store_lane_indices(P::load(c) > P(2.0f), 7, indices);
  REQUIRE(listed == N - 2);
  for (int i = 0; i < listed; ++i) CHECK(indices[i] == 7 + 2 + i);
}

/// The columns of a matrix with N rows of K numbers, read and written, against its elements.
template <int K, int N>
void check_columns(Rng& rng) {
  using P = Pack<float, N>;
  std::vector<float> matrix(K * N);
  for (float& x : matrix) x = static_cast<float>(rng.normal());
  const auto element = [&matrix](int row, int column) {
    return matrix[static_cast<std::size_t>(K * row + column)];
  };
  P columns[K];
  load_columns<K>(matrix.data(), columns);
  for (int k = 0; k < K; ++k) {
    for (int row = 0; row < N; ++row) REQUIRE(columns[k][row] == element(row, k));
  }
  std::vector<float> written(matrix.size());
  store_columns<K>(columns, written.data());
  REQUIRE(written == matrix);
}

#if defined(GSNAV_WORDS)
/// Columns of words, against its elements; and every finite half and every word as a float.
template <int N>
void check_words(Rng& rng) {
  std::uint16_t matrix[N][8];
  std::int8_t bytes[N][8];
  for (int row = 0; row < N; ++row) {
    for (int k = 0; k < 8; ++k) {
      matrix[row][k] = static_cast<std::uint16_t>(rng.uniform() * 65536.0);
      bytes[row][k] = static_cast<std::int8_t>(matrix[row][k] >> 8);
    }
  }
  Words<N> eight[8], three[8], codes[8];
  load_words<N>([&](int row) { return words_of<8>(matrix[row]); }, eight);
  load_words<N>([&](int row) { return words_of<3>(matrix[row]); }, three);
  load_words<N>([&](int row) { return words_of_bytes(bytes[row]); }, codes);
  for (int k = 0; k < 8; ++k) {
    const Pack<float, N> values = floats_of_integers(codes[k]);
    for (int row = 0; row < N; ++row) {
      const std::uint16_t of_eight = eight[k][row], of_three = three[k][row];
      REQUIRE(of_eight == matrix[row][k]);
      if (k < 3) REQUIRE(of_three == matrix[row][k]);
      REQUIRE(values[row] == static_cast<float>(bytes[row][k]));
    }
  }
  for (unsigned first = 0; first < 0x10000u; first += N) {
    Words<N> words;
    for (unsigned i = 0; i < N; ++i) words[i] = static_cast<std::uint16_t>(first + i);
    const Pack<float, N> halves = floats_of_halves(words), integers = floats_of_integers(words);
    for (int i = 0; i < N; ++i) {
      const std::uint16_t word = words[i];
      REQUIRE(integers[i] == static_cast<float>(static_cast<std::int16_t>(word)));
      const int exponent = word >> 10 & 31, fraction = word & 1023;
      if (exponent == 31) continue;  // no finite half
      const double magnitude =
          exponent == 0 ? std::ldexp(fraction, -24) : std::ldexp(1024 + fraction, exponent - 25);
      const auto half = static_cast<float>(std::copysign(magnitude, word >> 15 != 0 ? -1.0 : 1.0));
      REQUIRE(bits_of(halves[i]) == bits_of(half));
    }
  }
}
#endif

/// Chosen lanes, against a loop over the bits that choose them.
template <int N>
void check_chosen_lanes(Rng& rng) {
  std::uint32_t lanes[N];
  for (std::uint32_t& x : lanes) x = static_cast<std::uint32_t>(rng.uniform() * 4294967296.0);
  for (int round = 0; round < 500; ++round) {
    const std::uint32_t bits = static_cast<std::uint32_t>(rng.uniform() * (1 << N));
    std::vector<std::uint32_t> expected;
    std::vector<std::uint8_t> expected_places;
    float marks[N] = {};
    for (int i = 0; i < N; ++i) {
      const bool chosen = (bits >> i & 1u) != 0;
      marks[i] = chosen ? 1.0f : 0.0f;
      if (!chosen) continue;
      expected.push_back(lanes[i]);
      expected_places.push_back(static_cast<std::uint8_t>(100 + i));
    }
    std::vector<std::uint32_t> written(expected.size());  // a write beyond the end is an error
    REQUIRE(store_lanes(bits, lanes, written.data()) == static_cast<int>(expected.size()));
    REQUIRE(written == expected);
    if constexpr (N <= GSNAV_PACK_WIDTH) {  // wider masks have no registers here
      std::vector<std::uint8_t> places(N);
      const int count =
          store_lane_indices(Pack<float, N>::load(marks) > Pack<float, N>(0.5f), 100, places.data());
      places.resize(static_cast<std::size_t>(count));
      REQUIRE(places == expected_places);
    }
  }
}

/// A power of two times 1 + k / 2^bits, either sign.
float short_number(Rng& rng, double low, double high, int bits) {
  const double k = std::floor(rng.uniform() * std::exp2(bits));
  const double m = (1 + k * std::exp2(-bits)) * (rng.uniform() < 0.5 ? -1 : 1);
  return static_cast<float>(std::ldexp(m, static_cast<int>(std::floor(rng.uniform(low, high)))));
}

/// fma against the C library's, where products end in the middle between two floats and what is added
/// decides the side (below the last bit of a double too), and where results are below the normal floats.
/// Returns how often rounding to double first would have been wrong.
template <int N>
int check_fma_at_middles() {
  using P = Pack<float, N>;
  Rng rng(10);
  int wrong_twice = 0;
  for (int round = 0; round < 40000; ++round) {
    const bool small = round % 2 == 0;
    float a[N], b[N], c[N];
    for (int i = 0; i < N; ++i) {
      a[i] = short_number(rng, small ? -76 : 0, small ? -64 : 1, 12);
      b[i] = short_number(rng, small ? -76 : 0, small ? -64 : 1, 13);
      c[i] = short_number(rng, small ? -149 : -100, small ? -126 : 1, 1 + round % 23);
    }
    const P fused = fma(P::load(a), P::load(b), P::load(c));
    for (int i = 0; i < N; ++i) {
      const float once = std::fma(a[i], b[i], c[i]);
      REQUIRE(bits_of(fused[i]) == bits_of(once));
      const double sum =
          static_cast<double>(a[i]) * static_cast<double>(b[i]) + static_cast<double>(c[i]);
      if (static_cast<float>(sum) != once) ++wrong_twice;
    }
  }
  return wrong_twice;
}

/// Lanes of doubles are their doubles.
template <int N>
void check_doubles() {
  using D = PackPair<N>;
  Rng rng(11);
  for (int round = 0; round < 5000; ++round) {
    double a[N], b[N], c[N];
    float f[N];
    for (int i = 0; i < N; ++i) {
      a[i] = rng.normal() * 100;
      b[i] = rng.normal();
      c[i] = round % 2 == 0 ? -a[i] * b[i] : rng.normal();
      f[i] = static_cast<float>(rng.normal());
    }
    const D pa = D::load(a), pb = D::load(b), pc = D::load(c), wide(Pack<float, N>::load(f));
    const D fused = fma(pa, pb, pc), root = sqrt(pb * pb), whole = truncated(pa),
            clamped = clamp(pa, pb, pc);
    const Pack<float, N> narrow(pa);
    const auto lane = [](const D& d, int i) { return i < N / 2 ? d.low[i] : d.high[i - N / 2]; };
    for (int i = 0; i < N; ++i) {
      REQUIRE(lane(fused, i) == std::fma(a[i], b[i], c[i]));
      REQUIRE(lane(root, i) == std::sqrt(b[i] * b[i]));
      REQUIRE(lane(whole, i) == std::trunc(a[i]));
      REQUIRE(lane(clamped, i) == gsnav::clamp(a[i], b[i], c[i]));
      REQUIRE(lane(wide, i) == static_cast<double>(f[i]));
      REQUIRE(narrow[i] == static_cast<float>(a[i]));
    }
  }
}

/// min and max give the second where either is NaN; no comparison with NaN holds.
template <int N>
void check_nan() {
  using P = Pack<float, N>;
  const P nan(std::numeric_limits<float>::quiet_NaN()), one(1.0f);
  CHECK(min(nan, one)[N - 1] == 1.0f);
  CHECK(max(nan, one)[N - 1] == 1.0f);
  CHECK(std::isnan(min(one, nan)[0]));
  CHECK(std::isnan(max(one, nan)[0]));
  CHECK(!any(nan < one || nan <= one || nan > one || nan >= one || nan <= nan));
  CHECK(lane_bits(one > P(0.0f)) == (1u << N) - 1u);
}

/// Packs side by side are the packs.
template <Exp2 M>
void check_side_by_side() {
  using P = Pack<float, GSNAV_PACK_WIDTH>;
  using Group = Packs<P, 3>;
  Rng rng(9);
  for (int round = 0; round < 1000; ++round) {
    float v[3][GSNAV_PACK_WIDTH];
    for (auto& lanes : v) {
      for (float& x : lanes) x = static_cast<float>(rng.uniform(-126, 126));
    }
    const Group x = Group::of([&](int g) { return P::load(v[g]); });
    const Group power = exp2_in_range<M>(x), chosen = select(x >= Group(1.0f), min(x, Group(2.0f)), -x);
    const Group sum = fma(x, x, power) - chosen;
    for (int g = 0; g < 3; ++g) {
      for (int i = 0; i < GSNAV_PACK_WIDTH; ++i) {
        const float s = v[g][i], p = gsnav::exp2<M>(s), c = s >= 1 ? gsnav::min(s, 2.0f) : -s;
        REQUIRE(bits_of(power.v[g][i]) == bits_of(p));
        REQUIRE(bits_of(chosen.v[g][i]) == bits_of(c));
        REQUIRE(bits_of(sum.v[g][i]) == bits_of(gsnav::fma(s, s, p) - c));
      }
    }
  }
}

}  // namespace

TEST_CASE("columns and chosen lanes of packs are those of the matrix") {
  Rng rng(8);
  check_columns<3, 4>(rng), check_columns<4, 4>(rng), check_columns<8, 4>(rng);
  check_columns<3, 8>(rng), check_columns<4, 8>(rng), check_columns<8, 8>(rng);
  check_columns<3, 16>(rng), check_columns<4, 16>(rng), check_columns<8, 16>(rng);
#if defined(GSNAV_WORDS)
  check_words<8>(rng);
#if defined(__AVX512F__)
  check_words<16>(rng);
#endif
#endif
  check_chosen_lanes<4>(rng), check_chosen_lanes<8>(rng), check_chosen_lanes<16>(rng);
}

TEST_CASE("packs of the natural width are their lanes") { check_lanes<GSNAV_PACK_WIDTH>(); }
TEST_CASE("packs of four are their lanes") { check_lanes<4>(); }

TEST_CASE("fma of a pack rounds once, where two roundings would show and below the normal floats") {
  CHECK(check_fma_at_middles<4>() > 1000);
  CHECK(check_fma_at_middles<GSNAV_PACK_WIDTH>() > 1000);
}
TEST_CASE("packs of doubles are their doubles") { check_doubles<GSNAV_PACK_WIDTH>(); }
TEST_CASE("packs: min and max give the second of a NaN, and no comparison with one holds") {
  check_nan<4>();
  check_nan<GSNAV_PACK_WIDTH>();
}

TEST_CASE("packs go through memory in order") {
  check_memory<4>();
  check_memory<GSNAV_PACK_WIDTH>();
}
TEST_CASE("packs side by side are the packs") {
  check_side_by_side<Exp2::degree5>();
  check_side_by_side<Exp2::degree3>();
}

TEST_CASE("vector code over packs is its lanes") {
  using P = Pack<float, GSNAV_PACK_WIDTH>;
  Rng rng(8);
  for (int round = 0; round < 2000; ++round) {
    float v[7][GSNAV_PACK_WIDTH];
    for (auto& plane : v) {
      for (float& x : plane) x = static_cast<float>(rng.normal());
    }
    const Quat<P> q{P::load(v[0]), P::load(v[1]), P::load(v[2]), P::load(v[3])};
    const Vec3<P> r = rotate(q, Vec3<P>{P::load(v[4]), P::load(v[5]), P::load(v[6])});
    const Vec3<P> x = cross(r, Vec3<P>{q.x, q.y, q.z});
    for (int i = 0; i < GSNAV_PACK_WIDTH; ++i) {
      const Quatf qs{v[0][i], v[1][i], v[2][i], v[3][i]};
      const Vec3f rs = rotate(qs, Vec3f{v[4][i], v[5][i], v[6][i]});
      const Vec3f xs = cross(rs, Vec3f{qs.x, qs.y, qs.z});
      REQUIRE(r.x[i] == rs.x);
      REQUIRE(r.y[i] == rs.y);
      REQUIRE(r.z[i] == rs.z);
      REQUIRE(x.y[i] == xs.y);
    }
  }
}
