// SPDX-License-Identifier: Apache-2.0
#include "runner_ledger.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "gsnav/math/functions.hpp"
#include "gsnav/render.hpp"
#include "gsnav/render/config.hpp"
#include "gsnav/scene/lod_cut.hpp"
#include "gsnav/scene/prepare.hpp"

namespace gsnav_report {

using namespace gsnav;

namespace {

/// Largest relative error of 2^x in float32 over the exponents of visible alphas.
template <Exp2 M>
double exp2_error() {
  double worst = 0;
  for (int i = 0; i <= 1 << 20; ++i) {
    const float x = -8.0f * static_cast<float>(i) / static_cast<float>(1 << 20);
    const double truth = std::exp2(static_cast<double>(x));
    worst = std::max(worst, std::abs(static_cast<double>(gsnav::exp2<M>(x)) / truth - 1));
  }
  return worst;
}

Row entry(const char* profile, const char* name, const char* knob, double error, const char* unit,
          const char* note) {
  Row row;
  row.set("kind", "ledger").set("profile", profile).set("name", name).set("knob", knob);
  row.set("error_max", error).set("error_unit", unit);
  return row.set("note", note);
}

}  // namespace

std::vector<Row> ledger_rows() {
  const RenderConfig c;
  const double rounding = static_cast<double>(std::numeric_limits<float>::epsilon()) / 2;
  std::vector<Row> rows{
      entry("exact", "float32 arithmetic", "", rounding, "relative, a rounding",
            "all kernels; forms that do not cancel, means projected in float64 "
            "(docs/reference/image_contract.md)"),
      entry("exact", "exp2 by a polynomial of degree 5", "", exp2_error<Exp2::degree5>(),
            "relative, of alpha", "rounding; measured over the exponents that pass the alpha cut"),
      entry("exact", "sort by the float32 key", "key_bits", rounding, "relative, of depth",
            "part of the contract: two Gaussians nearer than a rounding may swap against float64 order"),
      entry("exact", "alpha cut", "alpha_min", c.quality.alpha_min, "alpha, a Gaussian and pixel",
            "part of the contract: a Gaussian is not blended where its alpha is below"),
      entry("exact", "transmittance stop", "transmittance_min", c.quality.transmittance_min,
            "alpha, a pixel", "part of the contract: Gaussians behind a closed pixel are left out"),
      entry("fast", "exp2 by a cubic", "", exp2_error<Exp2::degree3>(), "relative, of alpha",
            "in place of degree 5"),
      entry("fast", "transmittance stop", "transmittance_min", Quality::fast().transmittance_min,
            "alpha, a pixel",
            "the colour of a closed pixel is divided by its alpha; all else as in exact"),
      entry("fast", "SH bands left out", "", kUnseenColor, "colour, a Gaussian",
            "bands of a chunk that change none of its colours by more, seen from anywhere; in tools "
            "that profile a "
            "scene (docs/notes/lod.md)"),
      entry("lod", "merged Gaussians", "", LodChoice{}.pixels, "pixels, root mean square",
            "merged Gaussians lie no farther from where they are shown, on this sensor; all else as in "
            "fast"),
  };
  return rows;
}

}  // namespace gsnav_report
