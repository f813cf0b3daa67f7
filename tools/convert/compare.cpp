// SPDX-License-Identifier: Apache-2.0
#include "compare.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "gsnav/backends/openmp.hpp"
#include "gsnav/scene/renderer.hpp"
#include "gsnav/scene/spatial_order.hpp"

namespace gsnav_convert {

using namespace gsnav;

namespace {
constexpr double kSmallestScale = 1e-4;  // metres: whatever is smaller is drawn as a point
}

GaussianCloud in_order(const GaussianCloud& cloud, const std::vector<std::uint32_t>& order) {
  GaussianCloud out = cloud;
  const auto permute = [&order](auto& to, const auto& from, std::size_t stride) {
    for (std::size_t i = 0; i < order.size() && !from.empty(); ++i) {
      std::copy_n(from.begin() + static_cast<std::ptrdiff_t>(stride * order[i]), stride,
                  to.begin() + static_cast<std::ptrdiff_t>(stride * i));
    }
  };
  for (std::size_t k = 0; k < 3; ++k) {
    permute(out.means[k], cloud.means[k], 1);
    permute(out.scales[k], cloud.scales[k], 1);
  }
  for (std::size_t k = 0; k < 4; ++k) permute(out.quats[k], cloud.quats[k], 1);
  permute(out.opacities, cloud.opacities, 1);
  permute(out.sh0, cloud.sh0, 3);
  permute(out.shN, cloud.shN, cloud.size() == 0 ? 0 : cloud.shN.size() / cloud.size());
  permute(out.origin_ids, cloud.origin_ids, 1);
  out.row_ids = order;
  bound_chunks(out);
  return out;
}

FieldErrors largest_field_errors(const GaussianCloud& source, const GaussianCloud& made) {
  FieldErrors e;
  const std::size_t rest = source.size() == 0 ? 0 : source.shN.size() / source.size();
  const std::size_t rest_made = made.size() == 0 ? 0 : made.shN.size() / made.size();
  for (std::size_t i = 0; i < std::min(source.size(), made.size()); ++i) {
    e.mean = std::max(e.mean, norm(made.mean(i) - source.mean(i)));
    const auto parts = [i](const GaussianCloud& c) {
      return Quatd{static_cast<double>(c.quats[0][i]), static_cast<double>(c.quats[1][i]),
                   static_cast<double>(c.quats[2][i]), static_cast<double>(c.quats[3][i])};
    };
    const Quatd turn = conjugate(parts(source)) * parts(made);
    const double sine = std::sqrt(turn.x * turn.x + turn.y * turn.y + turn.z * turn.z);
    e.rotation = std::max(e.rotation, 2 * std::atan2(sine, std::fabs(turn.w)));
    e.opacity =
        std::max(e.opacity, std::fabs(static_cast<double>(made.opacities[i] - source.opacities[i])));
    for (std::size_t k = 0; k < 3; ++k) {
      const double a = static_cast<double>(source.scales[k][i]),
                   b = static_cast<double>(made.scales[k][i]);
      if (a > kSmallestScale) e.scale = std::max(e.scale, std::fabs(b / a - 1));
      const auto drawn = [&](const GaussianCloud& c) {
        return std::clamp(0.5 + kSh0 * static_cast<double>(c.sh0[3 * i + k]), 0.0, 1.0);
      };
      e.colour = std::max(e.colour, std::fabs(drawn(made) - drawn(source)));
    }
    for (std::size_t k = 0; k < std::max(rest, rest_made); ++k) {
      const float a = k < rest ? source.shN[i * rest + k] : 0,
                  b = k < rest_made ? made.shN[i * rest_made + k] : 0;
      e.bands = std::max(e.bands, std::fabs(static_cast<double>(b - a)));
    }
  }
  return e;
}

std::vector<Camera> views_around(const GaussianCloud& cloud, int count, int width, int height) {
  std::vector<Camera> out;
  if (cloud.size() == 0) return out;
  Vec3d low, high;
  for (int k = 0; k < 3; ++k) {
    std::vector<double> along(cloud.size());
    for (std::size_t i = 0; i < along.size(); ++i) along[i] = cloud.mean(i)[k];
    const auto at = [&along](double share) {
      const auto n = static_cast<std::ptrdiff_t>(share * static_cast<double>(along.size() - 1));
      std::nth_element(along.begin(), along.begin() + n, along.end());
      return along[static_cast<std::size_t>(n)];
    };
    low[k] = at(0.1);
    high[k] = at(0.9);
  }
  const Vec3d middle = (low + high) * 0.5;
  const double radius = std::max(0.5 * norm(high - low), 1e-3);
  constexpr double kPi = 3.14159265358979323846;
  for (int v = 0; v < count; ++v) {
    const double angle = 2 * kPi * v / count;
    const Vec3d eye = middle + Vec3d{std::sin(angle), -0.35, std::cos(angle)} * (1.8 * radius);
    out.push_back(Camera::look_at(eye, middle, {0, -1, 0}, width, height, 60));
  }
  return out;
}

Result<ImageErrors> image_errors(const GaussianCloud& source, const GaussianCloud& made,
                                 const std::vector<Camera>& cameras) {
  OpenMPBackend backend;
  Renderer<float, OpenMPBackend> renderer(backend);
  const auto psnr = [](double squares, double n) {
    return squares == 0 ? std::numeric_limits<double>::infinity() : -10 * std::log10(squares / n);
  };
  ImageErrors e;
  e.worst = std::numeric_limits<double>::infinity();
  double sum = 0, values = 0;
  for (const Camera& camera : cameras) {
    const auto want = renderer.render(source.set(), camera), got = renderer.render(made.set(), camera);
    for (const Status& s : {want.status(), got.status()}) {
      if (!s) return s;
    }
    double squares = 0;
    for (std::size_t k = 0; k < want->rgb.size(); ++k) {
      const double d = std::clamp(static_cast<double>(want->rgb[k]), 0.0, 1.0) -
                       std::clamp(static_cast<double>(got->rgb[k]), 0.0, 1.0);
      squares += d * d;
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
