// SPDX-License-Identifier: Apache-2.0
#include "lod_rows.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "gsnav/backends/openmp.hpp"
#include "gsnav/detail/eval/oracle_photo.hpp"
#include "gsnav/scene/basic_renderer.hpp"
#include "samples.hpp"

using namespace gsnav;

namespace gsnav_bench {

namespace {

constexpr std::size_t kPhoto = kLodPhoto;

double psnr(const std::vector<float>& a, const std::vector<float>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const double d = static_cast<double>(std::clamp(a[i], 0.0f, 1.0f) - std::clamp(b[i], 0.0f, 1.0f));
    sum += d * d;
  }
  return -10 * std::log10(std::max(sum / static_cast<double>(a.size()), 1e-30));
}

/// Calls f(index into the fine image) for the k x k rays of pixel p of an image of that width.
template <class F>
void for_each_ray(std::size_t p, std::size_t width, const F& f) {
  const std::size_t x = p % width, y = p / width;
  for (std::size_t i = 0; i < kPhoto * kPhoto; ++i)
    f((y * kPhoto + i / kPhoto) * width * kPhoto + x * kPhoto + i % kPhoto);
}

/// Relative difference of a depth from the nearest depth among the rays of its pixel. At an edge the
/// depth of any ray is right, and a value between them is wrong. The difference is 1 if there is a depth
/// but no ray has one, or if there is none but all rays have one.
double depth_error(float depth, const std::vector<float>& fine, std::size_t pixel, std::size_t width) {
  double least = std::numeric_limits<double>::infinity();
  for_each_ray(pixel, width, [&](std::size_t i) {
    const double a = static_cast<double>(depth), b = static_cast<double>(fine[i]);
    const double off = (a > 0) != (b > 0) ? 1.0 : b > 0 ? std::abs(a - b) / b : 0.0;
    least = std::min(least, off);
  });
  return least;
}

}  // namespace

LodViews lod_views(const GaussianCloud& cloud, const std::vector<Camera>& cameras) {
  OpenMPBackend all;
  RenderConfig exact;
  exact.outputs = kRgb | kMedianDepth;
  BasicRenderer<float, OpenMPBackend> renderer(all, exact);
  LodViews views;
  views.cameras = cameras;
  for (const Camera& camera : cameras) {
    Frames<float> fine =
        renderer.render(cloud.set(), eval::detail::magnified(camera, kLodPhoto)).value();
    std::vector<float>& out = views.rgb.emplace_back(3 * views.pixels());
    for (std::size_t p = 0; p < views.pixels(); ++p) {
      double sum[3]{};
      for_each_ray(p, views.width(), [&](std::size_t i) {
        for (std::size_t c = 0; c < 3; ++c) sum[c] += static_cast<double>(fine.rgb[3 * i + c]);
      });
      for (std::size_t c = 0; c < 3; ++c)
        out[3 * p + c] = static_cast<float>(sum[c] / (kPhoto * kPhoto));
    }
    views.depths.push_back(std::move(fine.median_depth));
  }
  return views;
}

void LodRow::add(const std::vector<float>& rgb, const std::vector<float>& median_depth, double ms,
                 double visible, double pairs) {
  LodViews& views = *views_;
  const std::size_t view = count_++;
  const double quality = psnr(views.rgb[view], rgb);
  if (draw_ == LodDraw::direct && views.direct.size() == view) views.direct.push_back(quality);
  const double gain = quality - views.direct[view];
  for (std::size_t p = 0; p < median_depth.size(); ++p) {
    depth_errors_.push_back(depth_error(median_depth[p], views.depths[view], p, views.width()));
  }
  if (views.each)
    std::printf("view %zu: %.2f dB, %+.2f, %.3f ms\n", views.first + view, quality, gain, ms);
  quality_ += quality;
  worst_ = std::min(worst_, quality);
  if (gain < gain_) least_view_ = view;
  gain_ = std::min(gain_, gain);
  below_ += gain < 0 ? 1 : 0;
  ms_ += ms;
  visible_ += visible;
  pairs_ += pairs;
}

void LodRow::print_head() {
  std::printf("%-12s %6s %8s %8s %9s %5s %6s %8s %7s %9s %9s %9s %9s %8s %8s\n", "", "pixels", "mean dB",
              "worst", "least +dB", "view", "below", "ms", "faster", "visible", "pairs", "z>2 %",
              "z p99 %", "RGB-D ms", "depth ms");
}

void LodRow::print(const char* name, double pixels) const {
  LodViews& views = *views_;
  const double n = static_cast<double>(count_);
  if (draw_ == LodDraw::direct) views.direct_ms = ms_ / n;
  const auto off =
      std::count_if(depth_errors_.begin(), depth_errors_.end(), [](double e) { return e > 0.02; });
  std::printf(
      "%-12s %6.2f %8.2f %8.2f %9.2f %5zu %6zu %8.4f %7.2f %9.0f %9.0f %9.3f %9.3f %8.4f %8.4f\n", name,
      pixels, quality_ / n, worst_, gain_, views.first + least_view_, below_, ms_ / n,
      views.direct_ms / (ms_ / n), visible_ / n, pairs_ / n,
      100 * static_cast<double>(off) / static_cast<double>(depth_errors_.size()),
      100 * quantile(depth_errors_, 0.99), rgbd_ms_, depth_ms_);
  std::fflush(stdout);
}

}  // namespace gsnav_bench
