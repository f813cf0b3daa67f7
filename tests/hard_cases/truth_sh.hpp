// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "hard_cases/truth.hpp"

// Real spherical harmonics in long double by the recursion of the associated Legendre functions and
// multiples of the azimuth: no polynomial of x, y and z is written out.

namespace gsnav_test {

/// P_l^m(cos theta) with the Condon-Shortley phase, m >= 0.
inline Real legendre(int l, int m, Real cosine) {
  const Real sine = std::sqrt(std::max<Real>(0, 1 - cosine * cosine));
  Real diagonal = 1;  // P_m^m = (-1)^m (2m - 1)!! sin^m
  for (int k = 1; k <= m; ++k) diagonal *= -(2 * k - 1) * sine;
  if (l == m) return diagonal;
  Real below = diagonal, here = cosine * (2 * m + 1) * diagonal;
  for (int k = m + 2; k <= l; ++k) {
    const Real next = ((2 * k - 1) * cosine * here - (k + m - 1) * below) / (k - m);
    below = here;
    here = next;
  }
  return here;
}

/// Basis function of band l and order m (-l to l) at a direction of any length.
inline Real truth_sh_basis(int l, int m, const Real d[3]) {
  const Real pi = 3.14159265358979323846264338327950288L;
  const Real n = std::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
  const int a = std::abs(m);
  Real factorials = 1;  // (l - a)! / (l + a)!
  for (int k = l - a + 1; k <= l + a; ++k) factorials /= k;
  const Real scale = std::sqrt((2 * l + 1) / (4 * pi) * factorials) * (m == 0 ? 1 : std::sqrt(2.0L));
  const Real azimuth = std::atan2(d[1], d[0]);
  const Real wave = m < 0 ? std::sin(a * azimuth) : std::cos(a * azimuth);
  return scale * wave * legendre(l, a, d[2] / n);
}

/// How coefficients of band l must change so that the function they stand for is turned by `rotation`:
/// fitted by least squares to directions all over the sphere. Row-major, 2l + 1 rows.
inline std::vector<Real> fit_band_rotation(int l, const Real rotation[3][3]) {
  const std::size_t n = static_cast<std::size_t>(2 * l + 1), samples = 40;
  std::vector<Real> gram(n * n, 0), right(n * n, 0);
  for (std::size_t s = 0; s < samples; ++s) {
    // A spiral of equal areas.
    const Real z = 1 - 2 * (static_cast<Real>(s) + 0.5L) / samples, r = std::sqrt(1 - z * z);
    const Real turn = 2.39996322972865332L * static_cast<Real>(s);
    const Real d[3] = {r * std::cos(turn), r * std::sin(turn), z};
    Real back[3];  // the rotation's inverse applied
    for (int i = 0; i < 3; ++i)
      back[i] = rotation[0][i] * d[0] + rotation[1][i] * d[1] + rotation[2][i] * d[2];
    for (std::size_t i = 0; i < n; ++i) {
      const Real yi = truth_sh_basis(l, static_cast<int>(i) - l, d);
      for (std::size_t k = 0; k < n; ++k) {
        gram[i * n + k] += yi * truth_sh_basis(l, static_cast<int>(k) - l, d);
        right[i * n + k] += yi * truth_sh_basis(l, static_cast<int>(k) - l, back);
      }
    }
  }
  // Gauss-Jordan; the Gram matrix is close to a multiple of the identity.
  for (std::size_t p = 0; p < n; ++p) {
    const Real pivot = gram[p * n + p];
    for (std::size_t k = 0; k < n; ++k) {
      gram[p * n + k] /= pivot;
      right[p * n + k] /= pivot;
    }
    for (std::size_t i = 0; i < n; ++i) {
      const Real factor = gram[i * n + p];
      if (i == p || factor == 0) continue;
      for (std::size_t k = 0; k < n; ++k) {
        gram[i * n + k] -= factor * gram[p * n + k];
        right[i * n + k] -= factor * right[p * n + k];
      }
    }
  }
  return right;
}

}  // namespace gsnav_test
