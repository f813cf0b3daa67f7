// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "gsnav/core/status.hpp"
#include "gsnav/frame/gaussians.hpp"

namespace gsnav {

/// Method of computing 2^x for the alpha of a Gaussian at a pixel.
enum class Exponential {
  exact,  ///< Only rounding errors.
  fast,   ///< A cubic: alpha within 1.0e-4 relative. On a GPU the hardware instruction, within 2e-7.
};

/// The settings of RenderConfig that trade accuracy for speed. docs/reference/image_contract.md has the
/// error budgets, measured against the float64 contract image.
struct Quality {
  /// Frames with meshes always use Exponential::exact.
  Exponential exponential = Exponential::exact;
  /// Skip a Gaussian at a pixel where its alpha is lower. Range (0, 1); values below 2^-126 act as
  /// 2^-126.
  double alpha_min = 1.0 / 255;
  double max_alpha = 0.99;  ///< upper limit of a Gaussian's alpha, in (0, 1]
  /// Stop blending a pixel once its transmittance is lower. Range [0, 1).
  double transmittance_min = 1e-4;
  /// Treat a closed pixel as opaque: divide its colour and its accumulated depth by its alpha, then set
  /// its alpha to 1. The background does not show through it. A mesh behind the pixel takes the
  /// remaining transmittance before that, so nothing is divided there. Ignored with a Compat.
  bool normalize_closed = false;
  int max_sh_degree = kMaxShDegree;  ///< highest SH degree to evaluate, 0 to 3
  int key_bits = 32;                 ///< bits of the depth key that sorting compares, 8 to 32

  /// The contract: float32 rounding is the only error.
  static constexpr Quality exact() noexcept { return {}; }
  /// Exponential::fast; blending stops at a transmittance of 1/1000, and closed pixels are normalized.
  static constexpr Quality fast() noexcept {
    Quality q;
    q.exponential = Exponential::fast;
    q.transmittance_min = 1e-3;
    q.normalize_closed = true;
    return q;
  }
  bool operator==(const Quality&) const = default;
};

/// Checks all fields.
/// @return invalid_argument naming the field.
inline Status validate(const Quality& q) {
  const BadArgument bad{"RenderConfig.quality."};
  if (q.exponential != Exponential::exact && q.exponential != Exponential::fast) {
    return bad("exponential", std::to_string(static_cast<int>(q.exponential)),
               "must be a value of the enumeration");
  }
  if (q.max_sh_degree < 0 || q.max_sh_degree > kMaxShDegree) {
    return bad("max_sh_degree", q.max_sh_degree, "must be in [0, 3]");
  }
  if (q.key_bits < 8 || q.key_bits > 32) return bad("key_bits", q.key_bits, "must be in [8, 32]");
  if (!(q.alpha_min > 0 && q.alpha_min < 1)) return bad("alpha_min", q.alpha_min, "must be in (0, 1)");
  if (!(q.max_alpha > 0 && q.max_alpha <= 1)) return bad("max_alpha", q.max_alpha, "must be in (0, 1]");
  if (!(q.transmittance_min >= 0 && q.transmittance_min < 1)) {
    return bad("transmittance_min", q.transmittance_min, "must be in [0, 1)");
  }
  return {};
}

}  // namespace gsnav
