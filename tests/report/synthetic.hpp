// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "csv.hpp"
#include "gsnav/core/rng.hpp"

namespace gsnav_test {

using gsnav_report::Row;

/// A setting with the error and the cost that the made-up report gives it.
struct SyntheticSetting {
  const char *profile, *knob, *value;
  double psnr, time;  ///< dB; share of exact's time
};

inline const SyntheticSetting kSyntheticSettings[] = {
    {"exact", "none", "", 112, 1.0},
    {"fast", "none", "", 74, 0.72},
    {"exact", "alpha_min", "0.008", 61, 0.9},
    {"exact", "alpha_min", "0.016", 52, 0.83},
    {"exact", "alpha_min", "0.032", 43, 0.75},
    {"exact", "transmittance_min", "0.001", 69, 0.97},
    {"exact", "transmittance_min", "0.01", 50, 0.9},
    {"exact", "sh_degree", "2", 44, 0.97},
    {"exact", "sh_degree", "1", 38, 0.94},
    {"exact", "sh_degree", "0", 31, 0.9},
    {"exact", "key_bits", "24", 105, 0.99},
    {"exact", "key_bits", "16", 66, 0.96},
    {"exact", "key_bits", "12", 48, 0.95},
    {"exact", "storage", "position_fixed24", 58, 1.0},
    {"exact", "storage", "quat_10", 55, 1.01},
    {"exact", "storage", "opacity_8", 60, 1.0},
    {"exact", "response", "tangent_plane", 41, 1.1},
    {"exact", "compat", "inria", 37, 1.4},
};

/// The first columns of a row of this kind.
inline Row synthetic_row(const char* kind) {
  Row r;
  r.set("kind", kind).set("machine", "2 cores of a <virtual> machine").set("commit", "0123abcd");
  return r.set("date", "2026-01-31");
}

/// One measured render: a setting with this error and time.
inline Row synthetic_render(const SyntheticSetting& s, double psnr, double ms) {
  const double rmse = std::pow(10.0, -psnr / 20);
  Row r = synthetic_row("render");
  r.set("profile", s.profile).set("knob", s.knob).set("knob_value", s.value).set("oracle", "contract");
  r.set("rgb_max", 12 * rmse).set("rgb_p999", 6 * rmse).set("rgb_rmse", rmse).set("rgb_psnr", psnr);
  r.set("rgb_over_half_lsb", rmse * 3).set("rgb_over_lsb", rmse).set("rgb_over_2lsb", rmse / 3);
  r.set("ssim", 1 - rmse)
      .set("flip_mean", 2 * rmse)
      .set("flip_p99", 9 * rmse)
      .set("alpha_max", 5 * rmse);
  r.set("depth_p50", rmse * 0.1).set("depth_p99", rmse).set("depth_max", 6 * rmse);
  r.set("depth_absrel_p90", 0.3 * rmse).set("depth_missing", 0.0).set("excluded", 2e-5);
  r.set("time_p50_ms", ms).set("time_p99_ms", 1.2 * ms).set("gaussians", 300000).set("visible", 120000);
  r.set("pairs", 900000 * s.time).set("evaluations", 3e7 * s.time).set("bytes", 7e7);
  r.set("peak_rss", 4.2e8).set("touched", 150000).set("emitting", 120000);
  return r;
}

/// Renders of two scenes from four views by two backends.
inline void add_synthetic_renders(std::vector<Row>& rows) {
  gsnav::Rng rng(5);
  const std::pair<int, int> sizes[] = {{256, 256}, {640, 480}};
  for (const auto& [width, height] : sizes) {
    for (const char* scene : {"flat_300k", "ruin & garden"}) {
      for (int view = 0; view < 4; ++view) {
        const double hard = rng.uniform(-4, 4), slow = rng.uniform(0.7, 1.4);
        for (const char* backend : {"serial", "openmp"}) {
          const double speed = backend[0] == 's' ? 1.0 : 0.22;
          for (const SyntheticSetting& s : kSyntheticSettings) {
            const double psnr = s.psnr + hard + rng.uniform(-0.5, 0.5);
            const double ms = 1e-4 * width * height * slow * speed * s.time * rng.uniform(0.98, 1.02);
            Row r = synthetic_render(s, psnr, ms);
            r.set("scene", scene).set("view", view).set("width", width).set("height", height);
            r.set("sensor", "rgbd").set("backend", backend).set("threads", speed < 1 ? 2 : 1);
            if (view == 3 && psnr < 60 && width == 256)
              r.set("image", std::string("diff_") + s.knob + ".png");
            rows.push_back(r);
          }
        }
      }
    }
  }
}

/// A report as a run would write it, with invented numbers: every kind of row, two scenes, four views.
inline std::vector<Row> synthetic_rows() {
  std::vector<Row> rows;
  add_synthetic_renders(rows);
  rows.push_back(synthetic_row("ledger")
                     .set("profile", "fast")
                     .set("knob", "exp2")
                     .set("knob_value", "cubic")
                     .set("note", "exp2 by a cubic on [0, 1): relative error of alpha below 1e-4"));
  rows.push_back(synthetic_row("ledger")
                     .set("profile", "exact")
                     .set("knob", "scalar")
                     .set("knob_value", "float32")
                     .set("note", "rounding"));
  for (const char* poses : {"walk", "random_60deg"}) {
    for (int k = 1; k <= 8; ++k) {
      Row r = synthetic_row("skinning");
      r.set("knob", "poses").set("knob_value", poses).set("influences", k);
      rows.push_back(Row(r)
                         .set("name", "position")
                         .set("error_unit", "m")
                         .set("error_max", 0.3 * std::pow(0.3, k))
                         .set("error_p99", 0.05 * std::pow(0.28, k)));
      rows.push_back(Row(r)
                         .set("name", "rotation")
                         .set("error_unit", "deg")
                         .set("error_max", 60 * std::pow(0.3, k))
                         .set("error_p99", 9 * std::pow(0.28, k)));
    }
    for (const char* backend : {"serial", "openmp"}) {
      Row r = synthetic_row("skinning");
      r.set("knob", "poses").set("knob_value", poses).set("influences", 4).set("backend", backend);
      r.set("name", "position").set("error_unit", "m").set("error_max", 1.1e-6).set("error_p99", 6e-7);
      rows.push_back(r.set("time_p50_ms", 1.5).set("time_p99_ms", 1.7).set("items_per_second", 6.6e7));
    }
  }
  for (const char* speed : {"0.1", "1", "10"}) {
    Row r = synthetic_row("sweep");
    r.set("name", "penetration, float32")
        .set("backend", "serial")
        .set("knob", "speed")
        .set("knob_value", speed);
    rows.push_back(r.set("error_unit", "m")
                       .set("error_max", 2.4e-6)
                       .set("error_p99", 9e-7)
                       .set("time_p50_ms", 0.8));
  }
  for (const char* name : {"project<float>", "rasterize_tile", "sort_keys"}) {
    Row r = synthetic_row("kernel");
    r.set("name", name).set("backend", "openmp").set("time_p50_ms", 3.2).set("items_per_second", 9.1e7);
    rows.push_back(r.set("error_max", 3e-7).set("error_unit", "relative"));
  }
  return rows;
}

}  // namespace gsnav_test
