// SPDX-License-Identifier: Apache-2.0
#include <zstd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <vector>

#include "cloud_check.hpp"
#include "file.hpp"
#include "format_range.hpp"
#include "gsnav/core/replace_file.hpp"
#include "gsnav/detail/core/thread_pool.hpp"
#include "gsnav/detail/io/spz.hpp"
#include "gsnav/detail/scene/spatial_order.hpp"
#include "quantised.hpp"
#include "spz_planes.hpp"
#include "threads.hpp"

namespace gsnav::io {
namespace {

constexpr int kLevel = 12;  // of zstd; higher levels hardly make files smaller
constexpr int kJob = 1 << 20;
constexpr std::uint32_t kTocOffset = 32;

using ByteColumn = std::vector<std::uint8_t>;

class SpzWriter {
 public:
  SpzWriter(const GaussianCloud& cloud, const SaveSpzOptions& options, const std::string& target)
      : cloud_(cloud), options_(options), target_(target), turn_(options.keep_axes ? 1.0 : -1.0) {}

  Status run(const std::filesystem::path& path) {
    if (Status s = check(); !s) return s;
    const std::size_t coefficients = header_.coefficients();
    const auto widths = header_.widths();
    for (std::size_t k = 0; k < 6; ++k) planes_[k].resize(widths[k] * cloud_.size());
    const std::vector<std::uint32_t> order = rows_as_read(cloud_);
    constexpr std::size_t kPiece = 8192;
    const std::size_t pieces = (cloud_.size() + kPiece - 1) / kPiece;
    ThreadPool(static_cast<int>(detail::io_threads()))
        .run(static_cast<std::uint32_t>(pieces), [&](std::uint32_t p) {
          for (std::size_t i = p * kPiece; i < std::min((p + 1) * kPiece, cloud_.size()); ++i)
            add(i, order[i], coefficients);
        });
    std::vector<ByteColumn> streams;
    std::vector<std::array<std::uint64_t, 2>> toc;
    for (std::size_t k = 0; k < 6; ++k) {
      if (widths[k] == 0) continue;
      ByteColumn packed;
      if (Status s = pack(planes_[k], packed); !s) return s;
      toc.push_back({packed.size(), planes_[k].size()});
      streams.push_back(std::move(packed));
    }
    OutputFile out;
    if (Status s = out.open(path); !s) return s;
    const std::uint32_t head[] = {detail::kSpzMagic, header_.version, header_.count};
    const std::uint8_t small[] = {
        static_cast<std::uint8_t>(header_.degree), static_cast<std::uint8_t>(header_.fractional_bits),
        static_cast<std::uint8_t>(header_.flags), static_cast<std::uint8_t>(streams.size())};
    const std::uint32_t tail[] = {kTocOffset, 0, 0, 0};
    out.write(head, sizeof head);
    out.write(small, sizeof small);
    out.write(tail, sizeof tail);
    for (const auto& entry : toc) out.write(entry.data(), sizeof entry);
    for (const ByteColumn& stream : streams) out.write(stream.data(), stream.size());
    return out.commit();
  }

 private:
  Status fail(const std::string& what) const { return {Errc::invalid_argument, target_ + ": " + what}; }

  /// Compresses a plane by zstd's own threads if it has them. The bytes do not depend on their number.
  Status pack(const ByteColumn& plane, ByteColumn& packed) const {
    const std::unique_ptr<ZSTD_CCtx, std::size_t (*)(ZSTD_CCtx*)> context(ZSTD_createCCtx(),
                                                                          ZSTD_freeCCtx);
    if (!context) return {Errc::out_of_memory, target_ + ": not enough memory"};
    ZSTD_CCtx_setParameter(context.get(), ZSTD_c_compressionLevel, kLevel);
    // Returns an error in a zstd without threads; ignore it.
    ZSTD_CCtx_setParameter(context.get(), ZSTD_c_nbWorkers, static_cast<int>(detail::io_threads()));
    ZSTD_CCtx_setParameter(context.get(), ZSTD_c_jobSize, kJob);
    packed.resize(ZSTD_compressBound(plane.size()));
    const std::size_t n =
        ZSTD_compress2(context.get(), packed.data(), packed.size(), plane.data(), plane.size());
    if (ZSTD_isError(n) != 0) {
      return {Errc::out_of_memory, target_ + ": zstd: " + ZSTD_getErrorName(n)};
    }
    packed.resize(n);
    return {};
  }

  Status check() {
    if (Status s = detail::check_arrays(target_, cloud_); !s) return s;
    if (cloud_.size() > 0xffffffff) return fail("SPZ counts with 32 bits");
    if (options_.fractional_bits < 0 || options_.fractional_bits > 23) {
      return fail("fractional_bits is " + std::to_string(options_.fractional_bits) +
                  ", must be 0 to 23");
    }
    for (const int bits : {options_.sh1_bits, options_.sh_rest_bits}) {
      if (bits < 1 || bits > 8) {
        return fail(std::to_string(bits) + " bits for SH bands, must be 1 to 8");
      }
    }
    double farthest = 0;
    for (std::size_t i = 0; i < cloud_.size(); ++i) {
      const Vec3d m = cloud_.mean(i);
      for (int k = 0; k < 3; ++k) farthest = std::max(farthest, std::fabs(m[k]));
    }
    int bits = options_.fractional_bits;
    while (bits >= 0 && std::ldexp(farthest, bits) > kMostSteps) --bits;
    if (bits < 0) {
      return fail("a mean is " + std::to_string(farthest) + " m out, SPZ reaches 8388607 m");
    }
    header_.count = static_cast<std::uint32_t>(cloud_.size());
    header_.degree = cloud_.sh_degree;
    header_.fractional_bits = bits;
    header_.flags = cloud_.filter == Filter::mip ? detail::kSpzAntialiased : 0;
    return {};
  }

  /// Makes record i from the cloud's `row`.
  void add(std::size_t i, std::size_t row, std::size_t coefficients) {
    const Vec3d m = cloud_.mean(row);
    const double place[] = {m.x, turn_ * m.y, turn_ * m.z};
    for (std::size_t k = 0; k < 3; ++k) {
      const auto steps =
          static_cast<std::int32_t>(std::nearbyint(std::ldexp(place[k], header_.fractional_bits)));
      for (int shift = 0; shift < 24; shift += 8) {
        planes_[0][9 * i + 3 * k + static_cast<std::size_t>(shift / 8)] =
            static_cast<std::uint8_t>(static_cast<std::uint32_t>(steps) >> shift);
      }
      const double colour = static_cast<double>(cloud_.sh0[3 * row + k]) * detail::kSpzColour + 0.5;
      planes_[2][3 * i + k] = static_cast<std::uint8_t>(detail::nearest_step(colour, 8));
      const double log_scale = std::log(static_cast<double>(cloud_.scales[k][row]));
      planes_[3][3 * i + k] = static_cast<std::uint8_t>(
          detail::nearest_step((log_scale - detail::kSpzLeastLogScale) * detail::kSpzLogSteps / 255, 8));
    }
    const double opacity = static_cast<double>(cloud_.opacities[row]);
    planes_[1][i] = static_cast<std::uint8_t>(detail::nearest_step(opacity, 8));
    add_quaternion(i, row);
    for (std::size_t k = 0; k < 3 * coefficients; ++k) {
      const float sign = options_.keep_axes ? 1.0f : detail::kHalfTurnAboutX[k / 3];
      const int bits = k < 9 ? options_.sh1_bits : options_.sh_rest_bits;
      planes_[5][3 * coefficients * i + k] =
          sh_byte(static_cast<double>(sign * cloud_.shN[3 * coefficients * row + k]), bits);
    }
  }

  void add_quaternion(std::size_t i, std::size_t row) {
    const auto part = [&](std::size_t k) { return static_cast<double>(cloud_.quats[k][row]); };
    const double xyzw[4] = {part(1), turn_ * part(2), turn_ * part(3), part(0)};
    double others[3];
    std::uint32_t word = static_cast<std::uint32_t>(detail::smallest_three(xyzw, others));
    for (const double c : others) {
      const std::uint32_t magnitude = detail::nearest_step(std::fabs(c) * std::sqrt(2.0), 9);
      word = word << 10 | (c < 0 ? 512u : 0u) | magnitude;
    }
    for (int shift = 0; shift < 32; shift += 8) {
      planes_[4][4 * i + static_cast<std::size_t>(shift / 8)] = static_cast<std::uint8_t>(word >> shift);
    }
  }

  /// Rounds v to one of 2^bits steps over [-1, 1), the middle one of which is zero.
  static std::uint8_t sh_byte(double v, int bits) {
    const double step = std::exp2(8 - bits);
    const double most = 256 - step;
    return static_cast<std::uint8_t>(std::clamp(
        std::nearbyint((v * detail::kSpzBandSteps + detail::kSpzBandSteps) / step) * step, 0.0, most));
  }

  static constexpr double kMostSteps = 8388607;

  const GaussianCloud& cloud_;
  const SaveSpzOptions& options_;
  const std::string& target_;
  double turn_;  ///< sign of y and z
  detail::SpzHeader header_;
  std::array<ByteColumn, 6> planes_;
};

}  // namespace

Status save_spz(const std::filesystem::path& path, const GaussianCloud& cloud,
                const SaveSpzOptions& options) {
  const std::string target = path.string();
  return detail::guarded(target, [&] { return SpzWriter(cloud, options, target).run(path); });
}

}  // namespace gsnav::io
