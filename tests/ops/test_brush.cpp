// SPDX-License-Identifier: Apache-2.0
// The reference images of another renderer (Brush): an oracle that nobody here wrote.
#include <doctest/doctest.h>

#include "ops/backends.hpp"
#include "support/data.hpp"
#include "support/safetensors.hpp"
#include "support/scenes.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

template <class S, class B>
double worst_error(B& backend, const std::string& path) {
  auto t = read_safetensors(path);
  const std::size_t n = t["opacities"].size();
  GaussianCloudBuilder builder(3);
  for (std::size_t i = 0; i < n; ++i) {
    RawGaussian g;
    for (std::size_t k = 0; k < 3; ++k) {
      g.mean[static_cast<int>(k)] = t["means"][3 * i + k];
      g.log_scales[static_cast<int>(k)] = t["scales"][3 * i + k];
      g.sh0[k] = t["coeffs"][48 * i + k];
    }
    g.quat = {t["quats"][4 * i], t["quats"][4 * i + 1], t["quats"][4 * i + 2], t["quats"][4 * i + 3]};
    g.opacity_logit = t["opacities"][i];
    g.shN = t["coeffs"].data() + 48 * i + 3;
    builder.add(g);
  }
  Camera camera;
  camera.width = 123;
  camera.height = 82;
  camera.fx = camera.fy = 0.5 * camera.width;
  camera.cx = 0.5 * camera.width;
  camera.cy = 0.5 * camera.height;
  camera.viewmat.translation = {-0.123, -0.456, 8.0};
  RenderConfig config;
  config.max_alpha = 0.999;
  config.transmittance_min = 0;
  const auto f = render<S>(backend, {builder.cloud().set()}, camera, config);
  const std::vector<float>& expected = t["out_img"];
  double worst = 0;
  for (std::size_t p = 0; p < f.alpha.size(); ++p) {
    for (std::size_t c = 0; c < 3; ++c) {
      worst = std::max(worst, std::abs(static_cast<double>(f.rgb[3 * p + c]) - static_cast<double>(expected[4 * p + c])));
    }
    worst = std::max(worst, std::abs(static_cast<double>(f.alpha[p]) - static_cast<double>(expected[4 * p + 3])));
  }
  return worst;
}

}  // namespace

TEST_CASE("Brush's reference images") {
  for (const char* name : {"tiny_case", "basic_case"}) {
    const std::string path = data_file(std::string("splats/brush_reference/") + name + ".safetensors");
    if (path.empty()) continue;
    CAPTURE(name);
    SerialBackend serial;
    CHECK(worst_error<double>(serial, path) < 1e-5);
    CHECK(worst_error<float>(serial, path) < 1e-5);
#if defined(_OPENMP)
    OpenMPBackend openmp(2);
    CHECK(worst_error<float>(openmp, path) < 1e-5);
#endif
  }
}
