// SPDX-License-Identifier: Apache-2.0
// The renderer against the reference images of another one (Brush).
#include <doctest/doctest.h>

#include "ops/backends.hpp"
#include "support/brush.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

template <class S, class B>
double brush_error(B& backend, const BrushCase& brush) {
  RenderConfig config;
  config.quality.max_alpha = brush.max_alpha;
  config.quality.transmittance_min = brush.transmittance_min;
  const auto f = render<S>(backend, {brush.cloud.set()}, brush.camera, config);
  return brush.error(f.rgb, f.alpha);
}

}  // namespace

TEST_CASE("Brush's reference images") {
  for (const char* name : kBrushCases) {
    const auto brush = brush_case(name);
    if (!brush) continue;
    CAPTURE(name);
    SerialBackend serial;
    CHECK(brush_error<double>(serial, *brush) < 1e-5);
    CHECK(brush_error<float>(serial, *brush) < 1e-5);
#if defined(_OPENMP)
    OpenMPBackend openmp(2);
    CHECK(brush_error<float>(openmp, *brush) < 1e-5);
#endif
  }
}
