// SPDX-License-Identifier: Apache-2.0
// N38 to N40, N61: colours from spherical harmonics.
#include <doctest/doctest.h>

#include <algorithm>

#include "gsnav/detail/frame/project_chunk.hpp"
#include "hard_cases/arrays.hpp"
#include "hard_cases/cases.hpp"
#include "hard_cases/truth_sh.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

/// Largest error over sum |c|, of evaluate_sh in lanes of L.
template <class L>
double sh_error(std::size_t count, int degree) {
  constexpr int kLanes = LaneIo<L>::width;
  using S = scalar_of<L>;
  const int terms = sh_coefficient_count(degree);
  Rng rng(static_cast<std::uint64_t>(38 + degree));
  double worst = 0;
  for (std::size_t at = 0; at < count; at += kLanes) {
    float d[3][kLanes], c[16][kLanes];
    for (int l = 0; l < kLanes; ++l) {
      Vec3d v = normalized(Vec3d{rng.normal(), rng.normal(), rng.normal()});
      if (at % 64 == 0) v = {0, 0, l % 2 == 0 ? 1.0 : -1.0};  // the poles
      if (at % 64 == 16) v = l % 2 == 0 ? Vec3d{1, 0, 0} : Vec3d{0, -1, 0};
      for (int k = 0; k < 3; ++k) d[k][l] = static_cast<float>(v[k]);
      for (int k = 0; k < terms; ++k) c[k][l] = static_cast<float>(rng.normal());
    }
    Vec3<L> direction{LaneIo<L>::load(d[0]), LaneIo<L>::load(d[1]), LaneIo<L>::load(d[2])};
    // What float rounds off a unit vector's length counts in the reference's precision.
    if constexpr (std::is_same_v<L, double>) direction = normalized(direction);
    const Vec3<L> sum = evaluate_sh<L>(degree, direction, [&](int k) {
      return Vec3<L>{LaneIo<L>::load(c[k]), L(S(0)), L(S(1))};
    });
    double out[kLanes];
    LaneIo<L>::store(sum.x, out);
    for (int l = 0; l < kLanes; ++l) {
      const Real v[3] = {d[0][l], d[1][l], d[2][l]};
      Real expected = 0, size = 0;
      for (int band = 0, k = 0; band <= degree; ++band) {
        for (int m = -band; m <= band; ++m, ++k) {
          expected += truth_sh_basis(band, m, v) * static_cast<Real>(c[k][l]);
          size += std::abs(static_cast<Real>(c[k][l]));
        }
      }
      worst =
          std::max(worst, static_cast<double>(std::abs(static_cast<Real>(out[l]) - expected) / size));
    }
  }
  return worst;
}

/// gaussian_color out of line: inlined at each call, it is the largest function that sanitizers compile.
template <class S>
[[gnu::noinline]] SplatColor<S> color_seen_along(const ColorRows& rows, std::size_t i,
                                                 const Vec3<S>& direction) {
  return gaussian_color<S>(rows, 3, i, direction);
}

/// A cloud of random colours of degree 3 on a grid before the camera.
GaussianCloud coloured(std::uint64_t seed, double spread) {
  Rng rng(seed);
  GaussianCloudBuilder builder(3);
  std::vector<float> rest(45);
  for (int y = 0; y < 8; ++y) {
    for (int x = 0; x < 8; ++x) {
      RawGaussian g = gaussian({0.35 * (x - 3.5), 0.35 * (y - 3.5), 3}, {0.12, 0.12, 0.03}, 0.9);
      for (float& c : g.sh0) c = static_cast<float>(spread * rng.normal());
      for (float& c : rest) c = static_cast<float>(spread * rng.normal());
      g.shN = rest.data();
      builder.add(g);
    }
  }
  return builder.cloud();
}

}  // namespace

TEST_CASE("N38_sh_constants") {
  for_each_lane_type([]<class L>(const char* name) {
    for (int degree = 0; degree <= 3; ++degree) {
      const std::size_t directions = degree < 3 ? 5000 : std::is_same_v<L, float> ? 100000 : 20000;
      const double worst = sh_error<L>(sample_count(directions), degree);
      CHECK(worst <= (std::is_same_v<L, double> ? 1e-15 : 2e-6));
      MESSAGE(std::string(name) << ", degree " << degree << ": " << worst << " of the sum of |c|");
    }
  });
}

TEST_CASE("N39_sh_dir_zero") {
  const GaussianCloud cloud = coloured(39, 0.3);
  const ColorRows view = cloud.view().color;
  const auto check = [&]<class S>(S) {
    for (std::size_t i = 0; i < cloud.size(); ++i) {
      const SplatColor<S> forward = color_seen_along<S>(view, i, {S(0), S(0), S(1)});
      for (const double tiny : {0.0, -0.0, 1e-38, 1e-30, 1e-20, 1e-13}) {
        // No direction to speak of: the one forward, not NaN.
        const SplatColor<S> c = color_seen_along<S>(view, i, {S(tiny), S(-tiny), S(0)});
        CHECK(c.r == forward.r);
        CHECK(c.g == forward.g);
        CHECK(c.b == forward.b);
      }
      // A tenth of a nanometre away there is one.
      const SplatColor<S> a = color_seen_along<S>(view, i, {S(1e-10), S(0), S(0)});
      const SplatColor<S> b = color_seen_along<S>(view, i, {S(1), S(0), S(0)});
      CHECK(std::abs(static_cast<double>(a.r - b.r)) < 1e-6);
    }
  };
  check(1.0f);
  check(1.0);
  // In an image: the camera at a mean, drawn by none of the pinhole's rules.
  Camera camera = axis_camera();
  camera.viewmat.translation = -cloud.mean(27);
  render_everywhere({&cloud}, camera, all_outputs(),
                    [](const auto& f, const auto&) { CHECK(all_finite(f)); });
}

TEST_CASE("N40_sh_negative") {
  // DC and one term of band 1 along z, seen along z: 0.5 + Y_0 c_0 + Y_1 c_1.
  const Real forward[3] = {0, 0, 1};
  const Real y0 = truth_sh_basis(0, 0, forward), y1 = truth_sh_basis(1, 0, forward);
  struct Row {
    float c0, c1;
  };
  for (const Row& row : {Row{-3, 0}, Row{-3, 2}, Row{3, -4}, Row{-1, -1}, Row{5, 0}, Row{30, 10},
                         Row{1e4f, 0}, Row{-1.7724538f, 0}}) {
    GaussianCloudBuilder builder(1);
    const float rest[9] = {0, 0, 0, row.c1, row.c1, row.c1, 0, 0, 0};
    RawGaussian g = gaussian({0, 0, 3}, {1, 1, 0.1}, 0.8, {row.c0, row.c0, row.c0});
    g.shN = rest;
    builder.add(g);
    const GaussianCloud cloud = builder.cloud();
    const Real sum = 0.5L + y0 * static_cast<Real>(row.c0) + y1 * static_cast<Real>(row.c1);
    const double expected =
        static_cast<double>(std::max<Real>(sum, 0) * static_cast<Real>(cloud.opacities[0]));
    render_everywhere({&cloud}, axis_camera(), all_outputs(), [&](const auto& f, const auto&) {
      const double red = static_cast<double>(f.rgb[3 * kAxisPixel]);
      CHECK(red >= 0);
      // The sum cancels by up to its terms.
      const double size =
          0.5 + std::abs(static_cast<double>(row.c0)) + std::abs(static_cast<double>(row.c1));
      CHECK(std::abs(red - expected) < 1e-6 * size);
      if (sum < -1e-6L) CHECK(red == 0);
    });
  }
  // What is above 1 stays above 1 until the end: half behind half.
  const GaussianCloud two = cloud_of({gaussian({0, 0, 3}, {1, 1, 0.1}, 0.5, {20, 0, 0}),
                                      gaussian({0, 0, 4}, {2, 2, 0.1}, 0.5, {-20, 0, 0})});
  const double bright = 0.5 + static_cast<double>(y0) * 20;
  render_everywhere({&two}, axis_camera(), all_outputs(), [&](const auto& f, const auto&) {
    CHECK(static_cast<double>(f.rgb[3 * kAxisPixel]) == doctest::Approx(0.5 * bright).epsilon(1e-6));
  });
}

TEST_CASE("N61_sh_rotation_equiv") {
  const GaussianCloud cloud = coloured(61, 0.2);
  Rng rng(610);
  SetExtras turned;
  GaussianCloud rotated = cloud;  // the same with coefficients turned instead of directions
  double orthogonal = 0;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const Quatf q = quat_cast<float>(random_rotation(rng));
    const float w[4] = {q.w, q.x, q.y, q.z};
    for (std::size_t k = 0; k < 4; ++k) turned.sh_rotations[k].push_back(w[k]);
    const Mat3d m = rotation_matrix(quat_cast<double>(q));
    Real r[3][3];
    for (int a = 0; a < 3; ++a) {
      for (int b = 0; b < 3; ++b) r[a][b] = m(a, b);
    }
    for (int band = 1; band <= 3; ++band) {
      const std::size_t n = static_cast<std::size_t>(2 * band + 1),
                        first = static_cast<std::size_t>(band * band);
      const std::vector<Real> d = fit_band_rotation(band, r);
      for (std::size_t a = 0; a < n; ++a) {
        Real length = 0;
        for (std::size_t b = 0; b < n; ++b) length += d[a * n + b] * d[a * n + b];
        orthogonal = std::max(orthogonal, static_cast<double>(std::abs(length - 1)));
        for (std::size_t channel = 0; channel < 3; ++channel) {
          Real sum = 0;
          for (std::size_t b = 0; b < n; ++b) {
            sum += d[a * n + b] * static_cast<Real>(cloud.shN[(15 * i + first - 1 + b) * 3 + channel]);
          }
          rotated.shN[(15 * i + first - 1 + a) * 3 + channel] = static_cast<float>(sum);
        }
      }
    }
  }
  CHECK(orthogonal < 1e-6);  // of the truth: a float quaternion's rotation is a rotation to 1e-7
  for_each_renderer([&](auto& renderer) {
    const auto a = renderer.render_with(cloud, turned, axis_camera(), all_outputs());
    const auto b = renderer.render_with(rotated, {}, axis_camera(), all_outputs());
    const auto plain = renderer.render_with(cloud, {}, axis_camera(), all_outputs());
    CHECK(a.alpha == b.alpha);
    double worst = 0, changed = 0;
    for (std::size_t p = 0; p < a.rgb.size(); ++p) {
      worst = std::max(worst, std::abs(static_cast<double>(a.rgb[p]) - static_cast<double>(b.rgb[p])));
      changed =
          std::max(changed, std::abs(static_cast<double>(a.rgb[p]) - static_cast<double>(plain.rgb[p])));
    }
    MESSAGE(renderer.name() << ": colours differ by " << worst << "; not turned by " << changed);
    CHECK(worst < 1e-5);
    CHECK(changed > 0.3);
  });
}
