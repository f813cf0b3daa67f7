// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "gsnav/detail/core/huge_pages.hpp"
#include "gsnav/detail/frame/row_bounds.hpp"
#include "gsnav/detail/frame/set_rows.hpp"
#include "gsnav/detail/math/smallest_three.hpp"
#include "gsnav/detail/scene/load_report.hpp"
#include "gsnav/detail/scene/needed_bands.hpp"
#include "gsnav/detail/scene/packed_rows.hpp"
#include "gsnav/math/aabb.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"

namespace gsnav {

namespace detail {

/// Rounds a value to a code in [0, largest].
inline std::uint16_t code_of(double value, double largest) noexcept {
  return static_cast<std::uint16_t>(std::nearbyint(clamp(value, 0.0, largest)));
}

/// The three codes of a unit quaternion that unpack_quat reads.
inline std::array<std::uint16_t, 3> pack_quat(const Quatd& q) noexcept {
  const double parts[] = {q.w, q.x, q.y, q.z}, middle = static_cast<double>(kQuatCodes) / 2;
  double others[3];
  const std::size_t missing = smallest_three(parts, others);
  std::array<std::uint16_t, 3> out{};
  for (std::size_t k = 0; k < 3; ++k) {
    const std::uint16_t code =
        code_of(others[k] * middle * std::sqrt(2.0) + middle, static_cast<double>(kQuatCodes));
    out[k] = static_cast<std::uint16_t>(2u * code + (missing >> k & 1u));
  }
  return out;
}

/// Quantizes positions, shapes and opacities of a cloud: the codes of its rows and the steps of its
/// chunks.
inline void pack_shapes(const GaussianCloud& cloud, PackedCloud& out) {
  const std::size_t n = cloud.size();
  out.codes = huge_vector<std::uint16_t>(ShapeRows::kCodePlanes * n);
  out.chunks.resize(cloud.view().chunk_count());
  const auto plane = [&](std::size_t k) { return out.codes.data() + k * n; };
  for (std::size_t c = 0; c < out.chunks.size(); ++c) {
    PackedChunk& chunk = out.chunks[c];
    const std::size_t first = c * kProjectChunk, last = std::min(n, first + kProjectChunk);
    float largest = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const auto [low, high] =
          std::minmax_element(cloud.means[k].data() + first, cloud.means[k].data() + last);
      const int axis = static_cast<int>(k);
      chunk.low[axis] = *low;
      chunk.step[axis] = (*high - *low) / 65535.0f;
      largest = std::max(
          largest, *std::max_element(cloud.scales[k].data() + first, cloud.scales[k].data() + last));
    }
    chunk.scale_step = std::sqrt(largest) / 65535.0f;
    const auto steps = [](double value, float step) {
      return step > 0 ? value / static_cast<double>(step) : 0.0;
    };
    for (std::size_t i = first; i < last; ++i) {
      for (std::size_t k = 0; k < 3; ++k) {
        const int axis = static_cast<int>(k);
        const double from_low =
            static_cast<double>(cloud.means[k][i]) - static_cast<double>(chunk.low[axis]);
        plane(ShapeRows::kMeans + k)[i] = code_of(steps(from_low, chunk.step[axis]), 65535);
        const double root = std::sqrt(static_cast<double>(cloud.scales[k][i]));
        plane(ShapeRows::kScales + k)[i] = code_of(steps(root, chunk.scale_step), 65535);
      }
      const auto quat = pack_quat(cloud.quat(i));
      for (std::size_t k = 0; k < 3; ++k) plane(ShapeRows::kQuats + k)[i] = quat[k];
      plane(ShapeRows::kOpacity)[i] = code_of(65535.0 * static_cast<double>(cloud.opacities[i]), 65535);
    }
  }
}

/// Measures the errors of positions, shapes and opacities of `packed`, which was made from `cloud`.
inline void compare_shapes(const GaussianCloud& cloud, const ShapeRows& packed,
                           PackErrors& out) noexcept {
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const Vec3d was{static_cast<double>(cloud.means[0][i]), static_cast<double>(cloud.means[1][i]),
                    static_cast<double>(cloud.means[2][i])};
    const Vec3f scales = scales_of(packed, i);
    const Quatd q = quat_cast<double>(quat_of(packed, i));
    double largest = 0, change = 0, same = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const double s = static_cast<double>(cloud.scales[k][i]);
      largest = std::max(largest, s);
      change = std::max(change, std::fabs(static_cast<double>(scales[static_cast<int>(k)]) - s));
    }
    const double parts[] = {q.w, q.x, q.y, q.z};
    double sum = 0;  // squared differences; |q - r| = 2 sin(angle / 4)
    for (std::size_t k = 0; k < 4; ++k) same += parts[k] * static_cast<double>(cloud.quats[k][i]);
    for (std::size_t k = 0; k < 4; ++k) {
      const double d = parts[k] - (same < 0 ? -1.0 : 1.0) * static_cast<double>(cloud.quats[k][i]);
      sum += d * d;
    }
    const double moved = norm(vec_cast<double>(mean_of(packed, i)) - was);
    out.mean = std::max(out.mean, moved);
    if (moved > 0) out.mean_deviations = std::max(out.mean_deviations, moved / std::max(largest, 1e-9));
    if (change > 0) out.scale = std::max(out.scale, change / std::max(largest, 1e-9));
    out.rotation = std::max(out.rotation, 4 * std::asin(std::min(1.0, std::sqrt(sum) / 2)));
    out.opacity = std::max(out.opacity, std::fabs(static_cast<double>(opacity_of(packed, i)) -
                                                  static_cast<double>(cloud.opacities[i])));
  }
}

/// Packs SH bands with 8 bits, chunk after chunk.
class BandPacker {
 public:
  /// Allocates out.shN for bands up to `degree`. out.chunks must exist.
  BandPacker(PackedCloud& out, int degree) : out_(out), rest_(sh_band_numbers(degree)) {
    out.rest.sh_degree = degree;
    out.shN = huge_vector<std::int8_t>(rest_ * out.count);
  }
  /// Packs the next `chunks` chunks, whose bands are at `bands`.
  void add(const float* bands, std::size_t chunks) {
    for (const std::size_t end = chunk_ + chunks; chunk_ < end; ++chunk_) {
      const std::size_t first = chunk_ * kProjectChunk * rest_;
      const std::size_t n = std::min(out_.count * rest_, (chunk_ + 1) * kProjectChunk * rest_) - first;
      float(&steps)[3] = out_.chunks[chunk_].sh_steps;
      const auto band = [this](std::size_t at) {
        return packed_band(1 + static_cast<int>(at % rest_ / 3));
      };
      float largest[3]{};
      for (std::size_t at = 0; at < n; ++at) largest[band(at)] = max(largest[band(at)], abs(bands[at]));
      for (int b = 0; b < 3; ++b) steps[b] = largest[b] / 127.0f;
      for (std::size_t at = 0; at < n; ++at) {
        const float step = steps[band(at)];
        const double code =
            step > 0 ? clamp(static_cast<double>(bands[at]) / static_cast<double>(step), -127.0, 127.0)
                     : 0;
        const std::int8_t kept = static_cast<std::int8_t>(std::nearbyint(code));
        out_.shN[first + at] = kept;
        const double error = std::fabs(static_cast<double>(static_cast<float>(kept) * step - bands[at]));
        largest_ = std::max(largest_, error);
        squares_ += error * error;
      }
      bands += n;
    }
  }
  /// Writes the errors of the packed bands to `errors`. Bands above `degree` are zero.
  void give(PackErrors& errors, int degree) const noexcept {
    const std::size_t n = sh_band_numbers(degree) * out_.count;
    errors.sh = largest_;
    errors.sh_rms = n == 0 ? 0 : std::sqrt(squares_ / static_cast<double>(n));
  }

 private:
  PackedCloud& out_;
  std::size_t rest_, chunk_ = 0;
  double largest_ = 0, squares_ = 0;
};

/// Bounds of each run of `rows` packed rows, from the values that they stand for.
inline std::vector<ChunkBounds> packed_bounds(const PackedCloud& packed, std::size_t rows) {
  const GaussianRows all = packed.view();
  const ShapeRows& v = all.shape;
  std::vector<ChunkBounds> out((v.size + rows - 1) / rows);
  for (std::size_t c = 0; c < out.size(); ++c) {
    RowBounds run;
    for (std::size_t i = c * rows; i < std::min(v.size, (c + 1) * rows); ++i)
      run.add(all.origin_of(i) + vec_cast<double>(mean_of(v, i)), scales_of(v, i), opacity_of(v, i));
    out[c] = run.bounds();
  }
  return out;
}

/// Packs everything except the bands. Consumes the planes of `cloud`.
inline PackedCloud pack_rows(GaussianCloud& cloud, const PackLimits& limits, PackErrors& found) {
  PackedCloud out;
  out.count = cloud.size();
  pack_shapes(cloud, out);
  compare_shapes(cloud, out.view().shape, found);
  if (found.mean_deviations > limits.mean) {
    found.mean_bits = 32;
    found.mean = found.mean_deviations = 0;
    out.codes.resize(ShapeRows::kMeans * out.count);
    out.codes.shrink_to_fit();
    out.rest.means = std::move(cloud.means);
  }
  cloud.means = {};
  cloud.scales = {};
  cloud.quats = {};
  release(cloud.opacities);
  out.sh0.resize(cloud.sh0.size());
  for (std::size_t i = 0; i < out.sh0.size(); ++i) {
    out.sh0[i] = half_of_float(cloud.sh0[i]);
    found.sh0 = std::max(found.sh0, static_cast<double>(abs(half_to_float(out.sh0[i]) - cloud.sh0[i])));
  }
  release(cloud.sh0);
  out.rest.origin_ids = std::move(cloud.origin_ids);
  out.rest.origins = std::move(cloud.origins);
  out.rest.row_ids = std::move(cloud.row_ids);
  out.rest.filter = cloud.filter;
  out.rest.eps2d = cloud.eps2d;
  out.rest.sort_order = cloud.sort_order;
  out.rest.color_space = cloud.color_space;
  if (!cloud.chunk_bounds.empty()) {
    out.rest.part_bounds = packed_bounds(out, kChunkPart);
    out.rest.chunk_bounds = packed_bounds(out, kProjectChunk);
  }
  return out;
}

}  // namespace detail

/// Packs a cloud, which is consumed plane by plane. `errors`, if not null, gets the errors of packing.
inline PackedCloud pack_cloud(GaussianCloud cloud, const PackLimits& limits = {},
                              PackErrors* errors = nullptr) {
  PackErrors found;
  expand_sh(cloud);
  PackedCloud out = detail::pack_rows(cloud, limits, found);
  detail::BandPacker bands(out, cloud.sh_degree);
  bands.add(cloud.shN.data(), out.chunks.size());
  bands.give(found, cloud.sh_degree);
  if (found.sh_rms > limits.sh) {
    release(out.shN);
    found.sh_rms = 0;
    found.sh = half_sh_error(cloud);
    found.sh_bits = found.sh > limits.sh_max ? 32 : 16;
    if (found.sh_bits == 16) compact_sh(cloud);
    if (found.sh_bits == 32) found.sh = 0;
    out.rest.shN = std::move(cloud.shN);
    out.rest.shN_half = std::move(cloud.shN_half);
  }
  if (errors != nullptr) *errors = found;
  return out;
}

/// Converts packed rows back to floats.
inline GaussianCloud unpack_cloud(const PackedCloud& packed) {
  GaussianCloud out = packed.rest;
  const GaussianRows all = packed.view();
  const ShapeRows& v = all.shape;
  const std::size_t n = packed.size(), rest = all.color.rest() / 3;
  const auto planes = [n](auto& of) {
    for (auto& plane : of) plane = huge_vector<float>(n);
  };
  planes(out.means);
  planes(out.scales);
  planes(out.quats);
  out.opacities = huge_vector<float>(n);
  out.sh0 = huge_vector<float>(3 * n);
  out.shN = huge_vector<float>(3 * rest * n);
  release(out.shN_half);
  for (std::size_t i = 0; i < n; ++i) {
    const Vec3f mean = mean_of(v, i), scales = scales_of(v, i);
    const Quatf q = quat_of(v, i);
    const float parts[] = {q.w, q.x, q.y, q.z};
    for (std::size_t k = 0; k < 3; ++k) {
      out.means[k][i] = mean[static_cast<int>(k)];
      out.scales[k][i] = scales[static_cast<int>(k)];
    }
    for (std::size_t k = 0; k < 4; ++k) out.quats[k][i] = parts[k];
    out.opacities[i] = opacity_of(v, i);
    for (std::size_t k = 0; k <= rest; ++k) {
      const Vec3f c = packed_coefficient(all.color, i, static_cast<int>(k));
      float* const to = k == 0 ? &out.sh0[3 * i] : &out.shN[3 * (rest * i + k - 1)];
      for (int channel = 0; channel < 3; ++channel) to[channel] = c[channel];
    }
  }
  return out;
}

}  // namespace gsnav
