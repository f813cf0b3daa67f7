// SPDX-License-Identifier: Apache-2.0
#include "compare.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "gsnav/backends/openmp.hpp"
#include "gsnav/scene/basic_renderer.hpp"

namespace gsnav_convert {

using namespace gsnav;

FieldErrors largest_field_errors(const GaussianCloud& source,
                                 const std::vector<std::uint32_t>& source_rows,
                                 const GaussianCloud& made,
                                 const std::vector<std::uint32_t>& made_rows) {
  FieldErrors e;
  const std::size_t rest = source.size() == 0 ? 0 : source.shN.size() / source.size();
  const std::size_t rest_made = made.size() == 0 ? 0 : made.shN.size() / made.size();
  for (std::size_t row = 0; row < std::min(source_rows.size(), made_rows.size()); ++row) {
    const std::size_t i = source_rows[row], j = made_rows[row];
    e.mean = std::max(e.mean, norm(made.mean(j) - source.mean(i)));
    const auto parts = [](const GaussianCloud& c, std::size_t r) {
      return Quatd{static_cast<double>(c.quats[0][r]), static_cast<double>(c.quats[1][r]),
                   static_cast<double>(c.quats[2][r]), static_cast<double>(c.quats[3][r])};
    };
    const Quatd turn = conjugate(parts(source, i)) * parts(made, j);
    const double sine = std::sqrt(turn.x * turn.x + turn.y * turn.y + turn.z * turn.z);
    e.rotation = std::max(e.rotation, 2 * std::atan2(sine, std::fabs(turn.w)));
    e.opacity = std::max(e.opacity, std::fabs(static_cast<double>(made.opacities[j]) -
                                              static_cast<double>(source.opacities[i])));
    for (std::size_t k = 0; k < 3; ++k) {
      const double a = static_cast<double>(source.scales[k][i]),
                   b = static_cast<double>(made.scales[k][j]);
      if (a > 0) e.scale = std::max(e.scale, std::fabs(b / a - 1));
      e.scale_metres = std::max(e.scale_metres, std::fabs(b - a));
      const double change =
          static_cast<double>(made.sh0[3 * j + k]) - static_cast<double>(source.sh0[3 * i + k]);
      e.colour = std::max(e.colour, kSh0 * std::fabs(change));
    }
    for (std::size_t k = 0; k < std::max(rest, rest_made); ++k) {
      const float a = k < rest ? source.shN[i * rest + k] : 0,
                  b = k < rest_made ? made.shN[j * rest_made + k] : 0;
      e.bands = std::max(e.bands, std::fabs(static_cast<double>(b) - static_cast<double>(a)));
    }
  }
  return e;
}

Result<ImageErrors> image_errors(const GaussianCloud& source, const GaussianCloud& made,
                                 const std::vector<Camera>& cameras) {
  OpenMPBackend backend;
  const auto renderer_of = [&](const GaussianCloud& cloud) {
    RenderConfig config;
    config.sort_order = cloud.sort_order;
    return BasicRenderer<float, OpenMPBackend>(backend, config);
  };
  auto renderer = renderer_of(source), renderer_made = renderer_of(made);
  const auto psnr = [](double squares, double n) {
    return squares == 0 ? std::numeric_limits<double>::infinity() : -10 * std::log10(squares / n);
  };
  ImageErrors e;
  e.worst = std::numeric_limits<double>::infinity();
  double sum = 0, values = 0;
  for (const Camera& camera : cameras) {
    const auto want = renderer.render(source.set(), camera),
               got = renderer_made.render(made.set(), camera);
    for (const Status& s : {want.status(), got.status()}) {
      if (!s) return s;
    }
    double squares = 0;
    for (std::size_t k = 0; k < want->rgb.size(); ++k) {
      const double d = static_cast<double>(want->rgb[k]) - static_cast<double>(got->rgb[k]);
      squares += d * d;
      e.largest = std::max(e.largest, std::fabs(d));
    }
    const double n = static_cast<double>(want->rgb.size());
    e.worst = std::min(e.worst, psnr(squares, n));
    sum += squares;
    values += n;
  }
  e.psnr = psnr(sum, values);
  return e;
}

}  // namespace gsnav_convert
