// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "gsnav/core/status.hpp"
#include "gsnav/frame/gaussians.hpp"

namespace gsnav {

/// How 2^x is computed for the alpha of a Gaussian at a pixel.
enum class Exponential {
  exact,  ///< error of rounding only
  fast,   ///< a cubic: alpha within 1.0e-4 relative; on a GPU its own instruction, within 2e-7
};

/// The part of RenderConfig that trades error for speed. docs/reference/image_contract.md has the error
/// budgets against the float64 contract image.
struct Quality {
  /// Frames with meshes use Exponential::exact whatever is set here.
  Exponential exponential = Exponential::exact;
  /// In (0, 1): a Gaussian is not blended where its alpha is lower. Below 2^-126 it is 2^-126.
  double alpha_min = 1.0 / 255;
  double max_alpha = 0.99;           ///< in (0, 1]: upper limit of a Gaussian's alpha
  double transmittance_min = 1e-4;   ///< in [0, 1): a pixel is closed once its transmittance is lower
  int max_sh_degree = kMaxShDegree;  ///< in [0, 3]: SH bands above it are left out
  int key_bits = 32;                 ///< in [8, 32]: bits of the sort key that are compared

  /// The contract; float32 rounding is the only error.
  static constexpr Quality exact() noexcept { return {}; }
  /// `exact` with Exponential::fast.
  static constexpr Quality fast() noexcept {
    Quality q;
    q.exponential = Exponential::fast;
    return q;
  }
  bool operator==(const Quality&) const = default;
};

/// invalid_argument, naming the field, or ok.
inline Status validate(const Quality& q) {
  const BadArgument bad{"RenderConfig.quality."};
  if (q.exponential != Exponential::exact && q.exponential != Exponential::fast) {
    return bad("exponential", std::to_string(static_cast<int>(q.exponential)),
               "there is none of this number");
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
