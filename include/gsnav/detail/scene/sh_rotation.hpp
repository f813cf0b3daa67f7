// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "gsnav/frame/sh.hpp"
#include "gsnav/math/quat.hpp"

namespace gsnav {

/// Rotates spherical harmonics of degree 0 to 3 together with the scene. The colour seen along a rotated
/// direction is then the one that was seen along the original direction. Exact except for rounding.
class ShRotation {
 public:
  /// `rotation` is a unit quaternion.
  explicit ShRotation(const Quatd& rotation) noexcept {
    // The matrix of a band is the integral of Y_i(d) Y_j(R^-1 d) over the sphere. The quadrature,
    // Gauss-Legendre in z and even steps around it, is exact up to degree 7.
    constexpr double kNodes[] = {-0.8611363115940526, -0.3399810435848563, 0.3399810435848563,
                                 0.8611363115940526};
    constexpr double kWeights[] = {0.34785484513745385, 0.6521451548625461, 0.6521451548625461,
                                   0.34785484513745385};
    constexpr double kPi = std::numbers::pi;
    constexpr int kSteps = 8;
    const Quatd back = conjugate(rotation);
    for (std::size_t node = 0; node < 4; ++node) {
      const double z = kNodes[node], radius = std::sqrt(1 - z * z);
      for (int step = 0; step < kSteps; ++step) {
        const double angle = 2 * kPi * step / kSteps;
        const Vec3d d{radius * std::cos(angle), radius * std::sin(angle), z};
        const Basis after = basis(d), before = basis(rotate(back, d));
        const double weight = kWeights[node] * 2 * kPi / kSteps;
        for (std::size_t i = 0; i < kTerms; ++i) {
          for (std::size_t j = 0; j < kTerms; ++j) matrix_[i][j] += weight * after[i] * before[j];
        }
      }
    }
  }

  /// Rotates the coefficients of one Gaussian in place: [(degree + 1)^2 - 1][3], colour inner.
  void apply(int degree, float* rest) const noexcept {
    for (int band = 1; band <= degree; ++band) {
      const std::size_t first = static_cast<std::size_t>(band * band - 1);
      const std::size_t n = static_cast<std::size_t>(2 * band + 1);
      std::array<float, 21> turned{};
      for (std::size_t i = 0; i < n; ++i) {
        for (std::size_t channel = 0; channel < 3; ++channel) {
          double sum = 0;
          for (std::size_t j = 0; j < n; ++j) {
            sum += matrix_[first + i][first + j] * static_cast<double>(rest[3 * (first + j) + channel]);
          }
          turned[3 * i + channel] = static_cast<float>(sum);
        }
      }
      for (std::size_t k = 0; k < 3 * n; ++k) rest[3 * first + k] = turned[k];
    }
  }

 private:
  static constexpr std::size_t kTerms = 15;  ///< Basis functions of degree 1 to 3.
  using Basis = std::array<double, kTerms>;

  static Basis basis(const Vec3d& d) noexcept {
    Basis out;
    for (std::size_t wanted = 0; wanted < kTerms; ++wanted) {
      out[wanted] = evaluate_sh<double>(3, d, [wanted](int k) {
                      return Vec3d{k == static_cast<int>(wanted) + 1 ? 1.0 : 0.0, 0.0, 0.0};
                    }).x;
    }
    return out;
  }

  std::array<Basis, kTerms> matrix_{};
};

}  // namespace gsnav
