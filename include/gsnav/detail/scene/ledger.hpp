// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <cstdio>
#include <span>
#include <string>

#include "gsnav/detail/core/parallel.hpp"
#include "gsnav/detail/core/pool_backend.hpp"
#include "gsnav/detail/render/count_culled.hpp"
#include "gsnav/detail/render/render_workspace.hpp"
#include "gsnav/detail/scene/load_report.hpp"
#include "gsnav/detail/scene/scene_bands.hpp"
#include "gsnav/render/config.hpp"
#include "gsnav/scene/lod_cut.hpp"

namespace gsnav {

/// Counts and error bounds of everything that a frame skipped, merged or rounded. It is computed on
/// request.
struct FrameLedger {
  // Skipped without changing the image.
  CullCounts culled;              ///< Gaussians of chunks out of view or not in the cut.
  std::uint64_t visible = 0;      ///< RenderStats::visible; 0 where the device does not count.
  std::uint64_t transparent = 0;  ///< Left out by the reader: opacity below 1/255, so never drawn.
  // Changed.
  std::uint64_t converted =
      0;  ///< Gaussians of sets whose colours are in another space than the frame's blend_space.
  bool other_order = false;  ///< Whether the frame blends in another order than the scene's file asks
                             ///< for.
  std::uint64_t unseen = 0;  ///< Gaussians left out by a visible set (VisibleSets).
  double unseen_weight = 0;  ///< Largest share of a pixel that any viewpoint saw of an unseen Gaussian.
                             ///< It is sampled, not a bound.
  LodStats lod;              ///< Counts of the cut. Zeros without level of detail.
  std::uint64_t sh_skipped = 0;      ///< SH coefficients in bands that are not read, in memory or not.
  double sh_error = 0;               ///< Largest change of a colour by the skipped bands.
  std::uint64_t sh_bytes = 0;        ///< Bytes that the dropped bands would take.
  std::uint64_t clamped = 0;         ///< Gaussians whose log-scale the reader limited to [-20, 20].
  double sh_storage_error = 0;       ///< Largest change of an SH coefficient by compact storage.
  double alpha_min = 0;              ///< Alphas below this are not blended.
  double transmittance_min = 0;      ///< Largest share of light lost behind a closed pixel.
  double alpha_error = 0;            ///< Relative error of the exponential.
  int max_sh_degree = kMaxShDegree;  ///< Highest SH degree evaluated; bands above it were left out.
  int key_bits = 32;                 ///< Bits of the sort key that were compared.
  bool other_rules = false;          ///< Whether `response` or `compat` differs from the contract. Such
                                     ///< an error has no bound here.
};

/// Makes the ledger of a frame of `sets` from `camera`, whose counts are `stats`. `report`, `bands` and
/// `lod` are optional. With `lod`, all stored bands count as read.
inline FrameLedger frame_ledger(std::span<const GaussianSet> sets, const Camera& camera,
                                const RenderConfig& config, const RenderStats& stats,
                                const LoadReport* report = nullptr, const SceneBands* bands = nullptr,
                                const LodCut* lod = nullptr) {
  FrameLedger out;
  std::size_t rows = 0;
  for (const GaussianSet& set : sets) {
    rows += set.gaussians.size();
    if (set.color_space != config.blend_space) out.converted += set.gaussians.size();
  }
  out.other_order = report != nullptr && report->sort_order != config.sort_order;
  PoolBackend backend(threads_for(rows));
  out.culled = count_culled(backend, sets, camera, config);
  out.visible = stats.visible;
  out.alpha_min = config.quality.alpha_min;
  out.transmittance_min = config.quality.transmittance_min;
  // Relative errors of the quintic and of the cubic for exp2 (Exponential).
  out.alpha_error = config.quality.exponential == Exponential::exact ? 4e-7 : 1.0e-4;
  out.max_sh_degree = config.quality.max_sh_degree;
  out.key_bits = config.quality.key_bits;
  out.other_rules = config.response != Response::ewa || config.compat != Compat::none;
  if (report != nullptr) {
    out.transparent = report->dropped_transparent;
    out.clamped = report->clamped_scales;
    out.sh_storage_error = report->sh_storage_error;
    out.sh_bytes = report->sh_bytes_let_go;
  }
  if (bands != nullptr) {
    if (lod == nullptr) out.sh_skipped = bands->sh_numbers - bands->sh_numbers_read;
    if (out.sh_skipped != 0 || bands->bytes_let_go != 0) out.sh_error = bands->color_error;
    out.sh_bytes += bands->bytes_let_go;
  }
  if (lod != nullptr) out.lod = lod->stats();
  return out;
}

/// The ledger as text: one line for each fact, each ended by a newline.
inline std::string ledger_text(const FrameLedger& l) {
  std::string out;
  const auto line = [&out](const char* format, auto... values) {
    char text[260];
    std::snprintf(text, sizeof text, format, values...);
    out += text;
    out += '\n';
  };
  const auto count = [](std::uint64_t n) { return static_cast<unsigned long long>(n); };
  const auto share = [](std::uint64_t a, std::uint64_t b) {
    return b == 0 ? 0.0 : 100.0 * static_cast<double>(a) / static_cast<double>(b);
  };
  const CullCounts& n = l.culled;
  line(
      "skipped: %llu of %llu Gaussians in chunks out of view or not in the cut (%.1f %% of all, %.1f %% "
      "of those that "
      "could be); "
      "%llu touched, %.2f for each that reaches a tile%s",
      count(n.removed()), count(n.rows), share(n.removed(), n.rows), share(n.removed(), n.removable()),
      count(n.touched), n.touched_per_emitting(),
      l.visible == 0 ? "" : ("; " + std::to_string(l.visible) + " drawn").c_str());
  if (l.transparent != 0)
    line("skipped, same bits: %llu Gaussians below 1/255 everywhere", count(l.transparent));
  if (l.sh_skipped != 0) {
    line("skipped: %llu SH coefficients; no colour changes by more than %.2g", count(l.sh_skipped),
         l.sh_error);
  }
  if (l.sh_bytes != 0) {
    line("not held: SH bands of %llu bytes; no colour changes by more than %.2g", count(l.sh_bytes),
         l.sh_error);
  }
  if (l.unseen != 0) {
    line(
        "left out: %llu Gaussians of which, and of those beside them, no viewpoint in or near the "
        "camera's cell sees more "
        "than %.1g of a pixel; sampled, not proved",
        count(l.unseen), l.unseen_weight);
  }
  if (l.lod.shown != 0) {
    line(
        "merged: %llu of %llu Gaussians in view, drawn as %llu in all; off by %.2f px root mean square "
        "at most",
        count(l.lod.merged), count(l.lod.shown), count(l.lod.drawn), l.lod.error_px);
  }
  if (l.converted != 0)
    line("converted: the colours of %llu Gaussians to the frame's space", count(l.converted));
  if (l.other_order)
    line("order: %s", "not the one that the scene's file asks for (depth, or distance from the camera)");
  if (l.key_bits < 32) line("order: by %d bits of each key", l.key_bits);
  if (l.max_sh_degree < kMaxShDegree) line("left out: SH bands above degree %d", l.max_sh_degree);
  if (l.other_rules)
    line("rules: %s", "not the contract's (RenderConfig::response, RenderConfig::compat)");
  if (l.clamped != 0) line("clamped: %llu log-scales to [-20, 20]", count(l.clamped));
  if (l.sh_storage_error > 0) line("quantised: SH coefficients, by %.2g at most", l.sh_storage_error);
  line("left out: alphas below %.4f, a Gaussian and pixel; %.4f of the light behind a closed pixel",
       l.alpha_min, l.transmittance_min);
  line("rounded: the exponential of each alpha, by %.1g relative", l.alpha_error);
  return out;
}

}  // namespace gsnav
