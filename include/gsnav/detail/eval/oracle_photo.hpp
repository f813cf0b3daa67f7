// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "gsnav/eval/oracle.hpp"

namespace gsnav::eval {

/// Largest k of oracle_photo.
inline constexpr int kMaxPhotoFactor = 16;

namespace detail {

/// Camera with k times the resolution. Each pixel becomes k x k.
inline Camera magnified(Camera c, int k) noexcept {
  c.fx *= k;
  c.fy *= k;
  c.cx *= k;
  c.cy *= k;
  c.width *= k;
  c.height *= k;
  return c;
}

/// Reduces k x k blocks of `fine` to pixels of `out`, from row `to` on.
class PhotoReducer {
 public:
  PhotoReducer(int k, const OracleFrames& fine, OracleFrames& out, std::size_t to) noexcept
      : k_(static_cast<std::size_t>(k)), fine_(fine), out_(out), to_(to) {}

  void reduce_row(std::size_t row) const {
    std::vector<double> returns;
    for (std::size_t x = 0; x < out_.width; ++x) {
      const std::size_t pixel = (to_ + row) * out_.width + x;
      for (std::size_t c = 0; c < 3; ++c) out_.rgb[3 * pixel + c] = mean(fine_.rgb, 3, c, x, row);
      out_.alpha[pixel] = mean(fine_.alpha, 1, 0, x, row);
      out_.accumulated_depth[pixel] = mean(fine_.accumulated_depth, 1, 0, x, row);
      out_.median_depth[pixel] = median(fine_.median_depth, x, row, returns);
      out_.expected_depth[pixel] = median(fine_.expected_depth, x, row, returns);
      out_.first_hit_depth[pixel] = median(fine_.first_hit_depth, x, row, returns);
      out_.undecided[pixel] = any_of(fine_.undecided, x, row);
      out_.undecided_depth[pixel] = any_of(fine_.undecided_depth, x, row);
      out_.order_flip[pixel] = any_of(fine_.order_flip, x, row);
    }
  }

 private:
  template <class F>
  void for_each_fine(std::size_t x, std::size_t row, const F& f) const {
    for (std::size_t i = 0; i < k_; ++i) {
      for (std::size_t j = 0; j < k_; ++j) f((row * k_ + i) * fine_.width + x * k_ + j);
    }
  }
  double mean(const std::vector<double>& image, std::size_t channels, std::size_t channel, std::size_t x,
              std::size_t row) const {
    double sum = 0;
    for_each_fine(x, row, [&](std::size_t p) { sum += image[channels * p + channel]; });
    return sum / static_cast<double>(k_ * k_);
  }
  double median(const std::vector<double>& image, std::size_t x, std::size_t row,
                std::vector<double>& returns) const {
    returns.clear();
    for_each_fine(x, row, [&](std::size_t p) {
      if (image[p] > 0) returns.push_back(image[p]);
    });
    if (2 * returns.size() < k_ * k_) return 0;
    const auto middle = returns.begin() + static_cast<std::ptrdiff_t>((returns.size() - 1) / 2);
    std::nth_element(returns.begin(), middle, returns.end());
    return *middle;
  }
  std::uint8_t any_of(const std::vector<std::uint8_t>& mask, std::size_t x, std::size_t row) const {
    std::uint8_t any = 0;
    for_each_fine(x, row, [&](std::size_t p) { any = static_cast<std::uint8_t>(any | mask[p]); });
    return any;
  }

  std::size_t k_;
  const OracleFrames& fine_;
  OracleFrames& out_;
  std::size_t to_;
};

}  // namespace detail

/// Renders the image of a sensor that integrates over its pixels, O_photo(k). The reference of `config`
/// is rendered at k times the resolution and reduced to that of the camera.
///
/// Each k x k block is reduced as follows:
/// - colour, alpha and accumulated depth: mean
/// - median, expected and first-hit depth: median of the samples with a return (the lower of two middle
///   ones, so that it is a depth that occurs); 0 if fewer than half of the samples have a return
/// - masks: 1 if any sample is 1
///
/// Works in bands of about 2^20 fine pixels, which take 90 MB in addition to the memory of
/// oracle_render.
/// @param backend Backend on the host that runs the reference renderer.
/// @param sets Gaussians to render.
/// @param camera Camera, with the resolution of the result.
/// @param k Factor, in [1, 16].
/// @param config `crop` is in pixels of `camera`. Counts are those of the fine image.
/// @return the errors of oracle_render; invalid_argument if k is out of range or the fine image too
/// large.
template <Backend B>
requires is_host_backend<B> Result<OracleFrames> oracle_photo(B& backend,
                                                              std::span<const GaussianSet> sets,
                                                              const Camera& camera, int k,
                                                              OracleConfig config = {}) {
  if (Status s = validate(config, camera); !s) return s;
  if (config.mesh != nullptr) {
    return Status(Errc::unsupported, "OracleConfig.mesh: its planes have the image's resolution only");
  }
  if (k < 1 || k > kMaxPhotoFactor || k * std::max(camera.width, camera.height) > kMaxImageSide) {
    return Status(Errc::invalid_argument,
                  std::string("oracle_photo: k = ") + std::to_string(k) +
                      ": must be in [1, 16], and no side of the image times k above 16384");
  }
  const PixelRect rect = oracle_rect(config, camera);
  config.crop = {k * rect.x0, k * rect.y0, k * rect.x1, k * rect.y1};
  const Camera fine_camera = detail::magnified(camera, k);
  OracleFrames out;
  out.resize(rect.width(), rect.height());
  const auto render = [&](const auto& scene) {
    out.counts = scene.counts;
    const std::size_t fine_row = scene.rect.width() * static_cast<std::size_t>(k);
    const int band = static_cast<int>(std::max<std::size_t>(1, (std::size_t{1} << 20) / fine_row));
    OracleFrames fine;
    for (int y = rect.y0; y < rect.y1; y += band) {
      const int end = std::min(y + band, rect.y1);
      detail::render_rows(backend, scene, k * y, k * end, fine);
      const detail::PhotoReducer reducer(k, fine, out, static_cast<std::size_t>(y - rect.y0));
      backend.parallel_for(static_cast<std::size_t>(end - y),
                           [&](std::size_t row) { reducer.reduce_row(row); });
      out.counts.listed += fine.counts.listed;
      out.counts.evaluations += fine.counts.evaluations;
      out.counts.order_flips += fine.counts.order_flips;
    }
  };
  if (Status s = detail::with_oracle_scene(backend, sets, fine_camera, config, render); !s) return s;
  if (Status s = backend.synchronize(); !s) return s;
  return out;
}

}  // namespace gsnav::eval
