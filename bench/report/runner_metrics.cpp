// SPDX-License-Identifier: Apache-2.0
#include "runner_metrics.hpp"

#include <cstddef>
#include <cstdint>
#include <vector>

#include "gsnav/eval.hpp"
#include "gsnav/eval/image_error.hpp"

namespace gsnav_report {

using namespace gsnav;

namespace {

Status judge_color(const Frames<float>& f, const Reference& r, Row& row) {
  const Result<eval::ImageError> e = eval::image_error(r.rgb, f.rgb, 3, r.undecided);
  if (!e) return e.status();
  row.set("rgb_max", e->max).set("rgb_p999", e->p999).set("rgb_rmse", e->rmse).set("rgb_psnr", e->psnr);
  row.set("rgb_over_half_lsb", e->over_half_lsb).set("rgb_over_lsb", e->over_lsb);
  row.set("rgb_over_2lsb", e->over_2lsb);
  const Result<eval::Ssim> s = eval::ssim(r.rgb, f.rgb, r.width, r.height);
  if (!s) return s.status();
  const Result<eval::Flip> flip = eval::flip(r.rgb, f.rgb, r.width, r.height);
  if (!flip) return flip.status();
  row.set("ssim", s->mean).set("flip_mean", flip->mean).set("flip_p99", flip->p99);
  return {};
}

Status judge_depth(const Frames<float>& f, const Reference& r, Row& row) {
  std::vector<std::uint8_t> undecided = r.undecided_depth;
  for (std::size_t i = 0; i < undecided.size(); ++i) undecided[i] |= r.undecided[i];
  eval::DepthErrorOptions options;
  options.max_range = kDepthRange;
  const Result<eval::DepthError> e =
      eval::depth_error(r.depth, f.median_depth, r.alpha, undecided, options);
  if (!e) return e.status();
  row.set("depth_p50", e->p50).set("depth_p99", e->p99).set("depth_max", e->max);
  row.set("depth_absrel_p90", e->abs_rel_p90).set("depth_missing", e->missing);
  return {};
}

}  // namespace

Status Judge::operator()(const Frames<float>& f, const Reference& r, const std::string& hash, Row& row) {
  if (!f.rgb.empty()) {
    Hasher h;
    h.array(f.rgb);
    const auto [known, added] = colors_.try_emplace(h.hex() + hash);
    if (added) {
      if (Status s = judge_color(f, r, known->second); !s) return s;
    }
    row.fill(known->second);
  }
  const Result<eval::ImageError> alpha = eval::image_error(r.alpha, f.alpha, 1, r.undecided);
  if (!alpha) return alpha.status();
  row.set("alpha_max", alpha->max).set("excluded", alpha->excluded);
  if (f.median_depth.empty() || r.depth.empty()) return {};
  return judge_depth(f, r, row);
}

}  // namespace gsnav_report
