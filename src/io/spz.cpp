// SPDX-License-Identifier: Apache-2.0
#include "gsnav/io/spz.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "cloud_fill.hpp"
#include "described.hpp"
#include "file.hpp"
#include "quantised.hpp"
#include "spz_planes.hpp"
#include "widen_rows.hpp"

namespace gsnav::io {
namespace {

using detail::load_le;

class SpzDecoder {
 public:
  SpzDecoder(detail::SpzPlanes& planes, bool turn)
      : planes_(planes), header_(planes.header), turn_(turn) {}

  Result<LoadedCloud> run(const std::string& source) {
    widen_bands();
    const auto decode = [this](std::size_t first, std::size_t last, detail::CloudSink& sink) -> Status {
      for (std::size_t i = first; i < last; ++i) add(i, sink);
      return {};
    };
    auto out = detail::fill_cloud(header_.count, std::min(header_.degree, kMaxShDegree), source, decode, true,
                                  std::move(planes_.bands));
    if (!out) return out;
    const bool mip = (header_.flags & detail::kSpzAntialiased) != 0;
    out->cloud.filter = mip ? Filter::mip : Filter::classic;
    out->report.warnings = planes_.warnings;
    if (header_.degree > kMaxShDegree) {
      out->report.warnings.push_back("SH degree 4 in the file: bands up to degree 3 are read");
    }
    return out;
  }

 private:
  static double number(std::byte b) noexcept { return static_cast<double>(std::to_integer<int>(b)); }

  void add(std::size_t i, detail::CloudSink& sink) const {
    RawGaussian raw;
    const std::byte *colour = planes_.at(2, i, 3), *scale = planes_.at(3, i, 3);
    for (std::size_t k = 0; k < 3; ++k) {
      const int axis = static_cast<int>(k);
      raw.mean[axis] = position(i, k);
      raw.sh0[k] = static_cast<float>((number(colour[k]) / 255 - 0.5) / 0.15);
      raw.log_scales[axis] = number(scale[k]) / 16 - 10;
    }
    raw.opacity_logit = detail::opacity_logit(std::to_integer<unsigned>(*planes_.at(1, i, 1)));
    raw.quat = quaternion(i);
    if (turn_) {
      raw.mean = {raw.mean.x, -raw.mean.y, -raw.mean.z};
      raw.quat = {raw.quat.w, raw.quat.x, -raw.quat.y, -raw.quat.z};
    }
    raw.shN = sink.bands(i);
    sink.add(raw);
  }

  void widen_bands() {
    const std::size_t in_file = 3 * header_.coefficients(), kept = std::min<std::size_t>(45, in_file);
    detail::widen_rows<72>(planes_.bands, header_.count, in_file, [&](const std::byte* bands, float* out) {
      for (std::size_t k = 0; k < kept; ++k) {
        const float sign = turn_ ? detail::kHalfTurnAboutX[k / 3] : 1.0f;
        out[k] = static_cast<float>((number(bands[k]) - 128) / 128) * sign;
      }
    });
  }

  double position(std::size_t i, std::size_t axis) const {
    if (header_.version == 1) {
      return detail::half_to_double(load_le<std::uint16_t>(planes_.at(0, i, 6) + 2 * axis));
    }
    const std::byte* p = planes_.at(0, i, 9) + 3 * axis;
    const int low = std::to_integer<int>(p[0]) | std::to_integer<int>(p[1]) << 8;
    const int high = static_cast<std::int8_t>(std::to_integer<int>(p[2]));
    return std::ldexp(high * 65536 + low, -header_.fractional_bits);
  }

  Quatd quaternion(std::size_t i) const {
    double others[3];
    if (header_.version < 3) {  // x, y and z of a quaternion whose w is positive
      const std::byte* p = planes_.at(4, i, 3);
      for (std::size_t k = 0; k < 3; ++k) others[k] = number(p[k]) / 127.5 - 1;
      return detail::quat_without(0, others);
    }
    // Three signs and magnitudes, the last in the lowest bits, of x, y, z, w without the largest.
    const std::uint32_t packed = load_le<std::uint32_t>(planes_.at(4, i, 4));
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t bits = packed >> (20 - 10 * k);
      const double magnitude = static_cast<double>(bits & 511) / 511 * std::sqrt(0.5);
      others[k] = (bits & 512) != 0 ? -magnitude : magnitude;
    }
    const Quatd xyzw = detail::quat_without(packed >> 30, others);
    return {xyzw.z, xyzw.w, xyzw.x, xyzw.y};
  }

  detail::SpzPlanes& planes_;
  const detail::SpzHeader& header_;
  bool turn_;
};

Result<LoadedCloud> decode(Result<detail::SpzPlanes> planes, const std::string& source,
                           const LoadSpzOptions& options) {
  if (!planes) return planes.status();
  return detail::described(SpzDecoder(*planes, !options.keep_axes).run(source),
                           options.keep_axes ? Vec3d{0, 1, 0} : Vec3d{0, -1, 0});
}

}  // namespace

Result<LoadedCloud> parse_spz(std::span<const std::byte> bytes, std::string source,
                              const LoadSpzOptions& options) {
  return detail::guarded(
      source, [&] { return decode(detail::read_spz_planes(bytes, source), source, options); });
}

Result<LoadedCloud> load_spz(const std::filesystem::path& path, const LoadSpzOptions& options) {
  const std::string source = path.string();
  // The packed bytes are gone before the cloud is made.
  const auto planes = [&]() -> Result<detail::SpzPlanes> {
    const auto file = detail::read_file(path);
    if (!file) return file.status();
    return detail::read_spz_planes(file->span(), source);
  };
  return detail::guarded(source, [&] { return decode(planes(), source, options); });
}

}  // namespace gsnav::io
