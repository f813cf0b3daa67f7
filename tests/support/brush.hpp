// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "gsnav/image/camera.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"
#include "support/data.hpp"
#include "support/safetensors.hpp"

namespace gsnav_test {

/// A reference image of another renderer (Brush): an oracle that nobody here wrote.
struct BrushCase {
  gsnav::GaussianCloud cloud;
  gsnav::Camera camera;
  std::vector<float> rgba;  ///< [82][123][4], over black
  /// What Brush does otherwise than the contract.
  static constexpr double max_alpha = 0.999, transmittance_min = 0;

  /// Largest difference of colour and alpha to an image of it.
  template <class S>
  double error(const std::vector<S>& rgb, const std::vector<S>& alpha) const {
    double worst = 0;
    for (std::size_t p = 0; p < alpha.size(); ++p) {
      for (std::size_t c = 0; c < 4; ++c) {
        const double value = static_cast<double>(c < 3 ? rgb[3 * p + c] : alpha[p]);
        worst = std::max(worst, std::abs(value - static_cast<double>(rgba[4 * p + c])));
      }
    }
    return worst;
  }
};

inline constexpr const char* kBrushCases[] = {"tiny_case", "basic_case"};

/// One of kBrushCases; nothing (after one line that says so) where its file is not there.
inline std::optional<BrushCase> brush_case(const std::string& name) {
  const std::string path = data_file("splats/brush_reference/" + name + ".safetensors");
  if (path.empty()) return {};
  auto t = read_safetensors(path);
  gsnav::GaussianCloudBuilder builder(3);
  for (std::size_t i = 0; i < t["opacities"].size(); ++i) {
    gsnav::RawGaussian g;
    for (std::size_t k = 0; k < 3; ++k) {
      g.mean[static_cast<int>(k)] = t["means"][3 * i + k];
      g.log_scales[static_cast<int>(k)] = t["scales"][3 * i + k];
      g.sh0[k] = t["coeffs"][48 * i + k];
    }
    const float* q = t["quats"].data() + 4 * i;
    g.quat = {q[0], q[1], q[2], q[3]};
    g.opacity_logit = t["opacities"][i];
    g.shN = t["coeffs"].data() + 48 * i + 3;
    builder.add(g);
  }
  BrushCase out;
  out.cloud = builder.cloud();
  out.camera.set_hfov(123, 82, 90);
  out.camera.viewmat.translation = {-0.123, -0.456, 8.0};
  out.rgba = t["out_img"];
  return out;
}

}  // namespace gsnav_test
