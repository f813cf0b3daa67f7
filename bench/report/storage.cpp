// SPDX-License-Identifier: Apache-2.0
#include "storage.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "gsnav/io/scene_file.hpp"
#include "gsnav/render.hpp"
#include "gsnav/scene/packed_cloud.hpp"
#include "gsnav/scene/prepare.hpp"
#include "runner_system.hpp"

namespace gsnav_report {

using namespace gsnav;

namespace {

constexpr double kInf = std::numeric_limits<double>::infinity();
constexpr double kHalfSqrt2 = 0.70710678118654752440;

constexpr std::array<StorageCodec, 12> kCodecs{{
    {"position_fp16", "positions as float16 offsets from the 64 m lattice", 0x1p-10, -65504, 65504, 16,
     3},
    {"position_fixed24", "positions in 24 bit, 12 of them fraction (SPZ)", 1.0 / 4096, -kInf, kInf, 24,
     3},
    {"position_fixed26", "positions in 26 bit, 14 of them fraction", 1.0 / 16384, -kInf, kInf, 26, 3},
    {"position_fixed28", "positions in 28 bit, 16 of them fraction", 1.0 / 65536, -kInf, kInf, 28, 3},
    {"position_u16_8m", "positions in 16 bit within cells of 8 m", 8.0 / 65536, -kInf, kInf, 16, 3},
    {"log_scale_8", "log-scales in 8 bit, steps of 1/16 from -10 (SPZ)", 1.0 / 16, -10, 255.0 / 16 - 10,
     8, 3},
    {"quat_10", "the three smallest components in 10 bit", kHalfSqrt2 / 511, -kHalfSqrt2, kHalfSqrt2, 8,
     4},
    {"opacity_8", "opacity in 8 bit", 1.0 / 255, 0, 1, 8, 1},
    {"sh0_8", "degree-0 colour in 8 bit, scale 0.15 (SPZ)", 1 / (0.15 * 255), -0.5 / 0.15, 0.5 / 0.15, 8,
     3},
    {"shN_8", "higher SH in 8 bit, steps of 1/128 (SPZ)", 1.0 / 128, -1, 127.0 / 128, 8, -1},
    {"shN_10", "higher SH in 10 bit, steps of 1/512", 1.0 / 512, -1, 511.0 / 512, 10, -1},
    {"shN_12", "higher SH in 12 bit, steps of 1/2048", 1.0 / 2048, -1, 2047.0 / 2048, 12, -1},
}};

/// The nearest point of the grid low + k step within the range; if low is infinite, of the grid k step.
float snap(float x, const StorageCodec& c) noexcept {
  const double v = static_cast<double>(x), from = std::isinf(c.low) ? 0.0 : c.low;
  return static_cast<float>(
      std::clamp(from + std::nearbyint((v - from) / c.step) * c.step, c.low, c.high));
}

void snap_quats(GaussianCloud& cloud, const StorageCodec& c) {
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    double q[4];
    std::size_t largest = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      q[k] = static_cast<double>(cloud.quats[k][i]);
      if (std::abs(q[k]) > std::abs(q[largest])) largest = k;
    }
    const double sign = q[largest] < 0 ? -1 : 1;
    double rest = 1;
    for (std::size_t k = 0; k < 4; ++k) {
      if (k == largest) continue;
      q[k] = std::clamp(std::nearbyint(sign * q[k] / c.step) * c.step, c.low, c.high);
      rest -= q[k] * q[k];
    }
    q[largest] = std::sqrt(std::max(rest, 0.0));
    for (std::size_t k = 0; k < 4; ++k) cloud.quats[k][i] = static_cast<float>(q[k]);
  }
}

}  // namespace

std::span<const StorageCodec> storage_codecs() noexcept { return kCodecs; }

float round_to_half(float x) noexcept {
  const double v = static_cast<double>(x);
  const int exponent = v == 0 ? -14 : std::max(std::ilogb(v), -14);
  const double step = std::ldexp(1.0, exponent - 10);
  return static_cast<float>(std::clamp(std::nearbyint(v / step) * step, -65504.0, 65504.0));
}

std::size_t band_bytes(const PackedCloud& packed) noexcept {
  return packed.shN.size() + sizeof(float) * packed.rest.shN.size() +
         sizeof(std::uint16_t) * packed.rest.shN_half.size();
}

Result<StoredPacked> read_packed(const std::string& path) {
  reset_peak_memory();
  const std::uint64_t before = peak_memory();
  Result<io::LoadedPackedCloud> loaded = io::load_packed_scene(path);
  if (!loaded) return loaded.status();
  const std::uint64_t peak = peak_memory() - before;
  return StoredPacked{std::move(loaded->cloud), peak};
}

Result<GaussianCloud> through_storage(const GaussianCloud& cloud, std::string_view name) {
  if (name == kCompactStorage) {
    GaussianCloud out = cloud;
    compact_sh(out);
    return out;
  }
  const auto codec =
      std::find_if(kCodecs.begin(), kCodecs.end(), [&](const auto& c) { return c.name == name; });
  if (codec == kCodecs.end()) {
    std::string known;
    for (const StorageCodec& c : kCodecs) known.append(known.empty() ? "" : ", ").append(c.name);
    return {Errc::invalid_argument, "storage codec " + std::string(name) + ": known are " + known};
  }
  GaussianCloud out = cloud;
  const auto each = [](auto& values, const auto& f) {
    for (float& v : values) v = f(v);
  };
  const auto to_grid = [&](float v) { return snap(v, *codec); };
  if (name == "position_fp16") {
    for (auto& plane : out.means) each(plane, round_to_half);
  } else if (name.substr(0, 8) == "position") {
    for (auto& plane : out.means) each(plane, to_grid);
  } else if (name == "log_scale_8") {
    for (auto& plane : out.scales) {
      each(plane, [&](float s) { return std::exp(snap(std::log(s), *codec)); });
    }
  } else if (name == "quat_10") {
    snap_quats(out, *codec);
  } else {
    each(name == "opacity_8" ? out.opacities : name == "sh0_8" ? out.sh0 : out.shN, to_grid);
  }
  if (!out.chunk_bounds.empty()) bound_chunks(out);
  return out;
}

std::size_t stored_bytes(const GaussianCloud& cloud, const StorageCodec& codec) noexcept {
  const double values = codec.values > 0
                            ? static_cast<double>(codec.values) * static_cast<double>(cloud.size())
                            : static_cast<double>(cloud.shN.size());
  return cloud.bytes() - static_cast<std::size_t>(values * (32 - codec.bits) / 8);
}

}  // namespace gsnav_report
