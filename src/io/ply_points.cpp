// SPDX-License-Identifier: Apache-2.0
#include "ply_points.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "cloud_fill.hpp"
#include "gsnav/detail/math/curves.hpp"
#include "neighbours.hpp"
#include "ply_body.hpp"
#include "quantised.hpp"

namespace gsnav::io::detail {
namespace {

constexpr std::array<const char*, 6> kNames = {"x", "y", "z", "red", "green", "blue"};
constexpr std::size_t kNeighbours = 3;
constexpr double kOpacity = 0.99, kMostMedians = 4, kLeastScale = 1e-7;

/// Clamps the scales of points to [kLeastScale, kMostMedians times their median].
void limit_scales(std::vector<double>& scales) {
  std::vector<double> sorted = scales;
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  // A point far from all others must not become a ball that hides them.
  const double most = std::max(kLeastScale, kMostMedians * *middle);
  for (double& s : scales) s = std::clamp(s, kLeastScale, most);
}

}  // namespace

double greatest_colour(PlyType type) noexcept {
  return type == PlyType::u8 ? 255.0 : type == PlyType::u16 ? 65535.0 : 1.0;
}

bool is_point_cloud(const PlyElement& vertex) {
  for (const char* name : kNames) {
    if (vertex.find(name) == nullptr) return false;
  }
  return vertex.find("scale_0") == nullptr && vertex.find("rot_0") == nullptr &&
         vertex.find("f_dc_0") == nullptr;
}

Result<LoadedCloud> parse_ply_points(std::span<const std::byte> bytes, const PlyHeader& header,
                                     const std::string& source) {
  PlyBody body(bytes, header);
  auto vertex = header.elements.begin();
  for (; vertex->name != "vertex"; ++vertex) {
    if (const std::uint64_t rows = body.skip(*vertex); rows != vertex->count) {
      return ply_rows_missing(source, *vertex, rows);
    }
  }
  if (const std::uint64_t rows = body.available(*vertex); rows < vertex->count) {
    return ply_rows_missing(source, *vertex, rows);
  }
  std::array<const PlyProperty*, kNames.size()> properties;
  std::array<double, 3> greatest;
  for (std::size_t k = 0; k < kNames.size(); ++k) properties[k] = vertex->find(kNames[k]);
  for (std::size_t k = 0; k < 3; ++k) greatest[k] = greatest_colour(properties[3 + k]->type);
  const std::size_t count = static_cast<std::size_t>(vertex->count);
  std::vector<Vec3d> points;
  std::vector<std::array<float, 3>> colours;
  points.reserve(count);
  colours.reserve(count);
  std::vector<double> block(properties.size() * kPlyBlock);
  for (std::size_t row = 0; row < count; row += kPlyBlock) {
    const std::size_t n = std::min(kPlyBlock, count - row);
    const std::size_t there = body.read(*vertex, properties, n, block.data());
    if (there != n) return ply_rows_missing(source, *vertex, row + there);
    for (std::size_t i = 0; i < n; ++i) {
      points.push_back({block[i], block[kPlyBlock + i], block[2 * kPlyBlock + i]});
      std::array<float, 3>& colour = colours.emplace_back();
      for (std::size_t k = 0; k < 3; ++k) {
        colour[k] = static_cast<float>(sh0_of_color(block[(3 + k) * kPlyBlock + i] / greatest[k]));
      }
    }
  }
  if (count == 0) return {Errc::invalid_file, source + ": a cloud without points"};
  std::vector<double> scales = neighbour_distances(points, kNeighbours);
  limit_scales(scales);
  const auto decode = [&](std::size_t first, std::size_t last, CloudSink& sink) -> Status {
    RawGaussian raw{.quat = {1, 0, 0, 0}, .opacity_logit = logit(kOpacity)};
    for (std::size_t i = first; i < last; ++i) {
      raw.mean = points[i];
      const double s = std::log(scales[i]);
      raw.log_scales = {s, s, s};
      for (std::size_t k = 0; k < 3; ++k) raw.sh0[k] = colours[i][k];
      sink.add(raw);
    }
    return {};
  };
  auto out = fill_cloud(count, 0, source, decode);
  if (!out) return out;
  out->report.warnings.push_back(
      "points without shapes: round Gaussians as large as the distances to the three nearest, opacity "
      "0.99");
  return out;
}

}  // namespace gsnav::io::detail
