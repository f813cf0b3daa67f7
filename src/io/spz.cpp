// SPDX-License-Identifier: Apache-2.0
#include "gsnav/io/spz.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "file.hpp"
#include "gzip.hpp"
#include "quantised.hpp"
#include "zip.hpp"

namespace gsnav::io {
namespace {

using detail::load_le;

constexpr std::uint32_t kMagic = 0x5053474e;  // "NGSP"
constexpr std::size_t kHeader = 16;
constexpr int kMostDegree = 4, kMostFractionalBits = 30;
constexpr unsigned kAntialiased = 1, kExtensions = 2;

// Half a turn about x turns y and z: a basis function changes its sign with odd powers of the two.
constexpr std::array<float, 15> kTurned = {-1, -1, 1, -1, 1, 1, -1, 1, -1, 1, -1, -1, 1, -1, 1};

class SpzReader {
 public:
  SpzReader(std::span<const std::byte> bytes, const std::string& source, const LoadSpzOptions& options)
      : bytes_(bytes), source_(source), turn_(!options.keep_axes) {}

  Result<LoadedCloud> run() {
    if (bytes_.size() >= 8 && load_le<std::uint32_t>(bytes_.data()) == kMagic) {
      return {Errc::unsupported, source_ + ": SPZ version " +
                                     std::to_string(load_le<std::uint32_t>(bytes_.data() + 4)) +
                                     " without gzip, versions 1 to 3 in gzip are read; convert it"};
    }
    detail::GzipReader gzip(bytes_);
    if (Status s = read_header(gzip); !s) return s;
    if (Status s = read_planes(gzip); !s) return s;
    GaussianCloudBuilder builder(std::min(degree_, kMaxShDegree), source_);
    builder.cloud().filter = (flags_ & kAntialiased) != 0 ? Filter::mip : Filter::classic;
    builder.reserve(count_);
    for (std::size_t i = 0; i < count_; ++i) add(i, builder);
    auto& warnings = builder.report().warnings;
    if (degree_ > kMaxShDegree) {
      warnings.push_back("SH degree 4 in the file: bands up to degree 3 are read");
    }
    if ((flags_ & kExtensions) != 0) warnings.push_back("extensions in the file are not read");
    if ((flags_ & kExtensions) == 0 && stray_ != 0) {
      warnings.push_back("stray bytes follow the " + std::to_string(count_) + " Gaussians");
    }
    return LoadedCloud{std::move(builder.cloud()), std::move(builder.report())};
  }

 private:
  Status fail(const std::string& what) const { return {Errc::invalid_file, source_ + ": " + what}; }

  Status read_header(detail::GzipReader& gzip) {
    std::array<std::byte, kHeader> header;
    if (gzip.read(header) != kHeader || load_le<std::uint32_t>(header.data()) != kMagic) {
      return fail("no gzip stream that begins with SPZ's header");
    }
    version_ = load_le<std::uint32_t>(&header[4]);
    count_ = load_le<std::uint32_t>(&header[8]);
    degree_ = std::to_integer<int>(header[12]);
    fractional_bits_ = std::to_integer<int>(header[13]);
    flags_ = std::to_integer<unsigned>(header[14]);
    if (version_ < 1 || version_ > 3) {
      return {Errc::unsupported,
              source_ + ": SPZ version " + std::to_string(version_) + " in gzip, 1 to 3 are read"};
    }
    if (degree_ > kMostDegree) {
      return fail("SH degree " + std::to_string(degree_) + ", must be at most 4");
    }
    if (fractional_bits_ > kMostFractionalBits) {
      return fail(std::to_string(fractional_bits_) + " fractional bits, must be at most 30");
    }
    return {};
  }

  /// Positions, opacities, colours, scales, quaternions and SH bands follow each other.
  Status read_planes(detail::GzipReader& gzip) {
    coefficients_ = static_cast<std::size_t>((degree_ + 1) * (degree_ + 1) - 1);
    const std::size_t sizes[] = {version_ == 1 ? 6u : 9u, 1, 3, 3, version_ < 3 ? 3u : 4u,
                                 3 * coefficients_};
    std::uint64_t total = 0;
    for (std::size_t k = 0; k < std::size(sizes); ++k) {
      starts_[k] = static_cast<std::size_t>(total);
      total += std::uint64_t{count_} * sizes[k];
    }
    const std::string gaussians = std::to_string(count_) + " Gaussians";
    if (total > detail::kInflationSlack + detail::kMostInflation * bytes_.size()) {
      return fail(gaussians + " from " + std::to_string(bytes_.size()) + " bytes are not believed");
    }
    planes_.resize(static_cast<std::size_t>(total));
    if (const std::size_t there = gzip.read(planes_); there != planes_.size()) {
      return fail(gaussians + " need " + std::to_string(total) + " bytes, " + std::to_string(there) +
                  " are there");
    }
    // What follows is read no further than it takes to see the checksum.
    std::array<std::byte, 4096> rest;
    for (std::size_t piece = 0; piece < 64 && !gzip.at_end(); ++piece) {
      const std::size_t n = gzip.read(rest);
      stray_ += n;
      if (n != rest.size()) break;
    }
    if (!gzip.at_end()) return fail("the gzip stream does not end well after its " + gaussians);
    return {};
  }

  const std::byte* plane(std::size_t k, std::size_t i, std::size_t size) const noexcept {
    return planes_.data() + starts_[k] + i * size;
  }
  static double number(std::byte b) noexcept { return static_cast<double>(std::to_integer<int>(b)); }

  void add(std::size_t i, GaussianCloudBuilder& builder) const {
    RawGaussian raw;
    const std::byte *colour = plane(2, i, 3), *scale = plane(3, i, 3);
    for (std::size_t k = 0; k < 3; ++k) {
      const int axis = static_cast<int>(k);
      raw.mean[axis] = position(i, k);
      raw.sh0[k] = static_cast<float>((number(colour[k]) / 255 - 0.5) / 0.15);
      raw.log_scales[axis] = number(scale[k]) / 16 - 10;
    }
    raw.opacity_logit = detail::opacity_logit(std::to_integer<unsigned>(*plane(1, i, 1)));
    raw.quat = quaternion(i);
    if (turn_) {
      raw.mean = {raw.mean.x, -raw.mean.y, -raw.mean.z};
      raw.quat = {raw.quat.w, raw.quat.x, -raw.quat.y, -raw.quat.z};
    }
    std::array<float, 45> rest;
    raw.shN = rest.data();
    const std::byte* bands = plane(5, i, 3 * coefficients_);
    for (std::size_t k = 0; k < std::min(rest.size(), 3 * coefficients_); ++k) {
      rest[k] = static_cast<float>((number(bands[k]) - 128) / 128) * (turn_ ? kTurned[k / 3] : 1.0f);
    }
    builder.add(raw);
  }

  double position(std::size_t i, std::size_t axis) const {
    if (version_ == 1) return detail::half_to_double(load_le<std::uint16_t>(plane(0, i, 6) + 2 * axis));
    const std::byte* p = plane(0, i, 9) + 3 * axis;
    const int low = std::to_integer<int>(p[0]) | std::to_integer<int>(p[1]) << 8;
    const int high = static_cast<std::int8_t>(std::to_integer<int>(p[2]));
    return std::ldexp(high * 65536 + low, -fractional_bits_);
  }

  Quatd quaternion(std::size_t i) const {
    double others[3];
    if (version_ < 3) {  // x, y and z of a quaternion whose w is positive
      const std::byte* p = plane(4, i, 3);
      for (std::size_t k = 0; k < 3; ++k) others[k] = number(p[k]) / 127.5 - 1;
      return detail::quat_without(0, others);
    }
    // Three signs and magnitudes, the last in the lowest bits, of x, y, z, w without the largest.
    const std::uint32_t packed = load_le<std::uint32_t>(plane(4, i, 4));
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t bits = packed >> (20 - 10 * k);
      const double magnitude = static_cast<double>(bits & 511) / 511 * std::sqrt(0.5);
      others[k] = (bits & 512) != 0 ? -magnitude : magnitude;
    }
    const Quatd xyzw = detail::quat_without(packed >> 30, others);
    return {xyzw.z, xyzw.w, xyzw.x, xyzw.y};
  }

  std::span<const std::byte> bytes_;
  const std::string& source_;
  bool turn_;
  std::uint32_t version_ = 0, count_ = 0;
  int degree_ = 0, fractional_bits_ = 0;
  unsigned flags_ = 0;
  std::size_t coefficients_ = 0, stray_ = 0;
  std::array<std::size_t, 6> starts_{};
  std::vector<std::byte> planes_;
};

}  // namespace

Result<LoadedCloud> parse_spz(std::span<const std::byte> bytes, std::string source,
                              const LoadSpzOptions& options) {
  return detail::guarded(source, [&] { return SpzReader(bytes, source, options).run(); });
}

Result<LoadedCloud> load_spz(const std::filesystem::path& path, const LoadSpzOptions& options) {
  return detail::guarded(path.string(), [&]() -> Result<LoadedCloud> {
    auto file = detail::read_file(path);
    if (!file) return file.status();
    return SpzReader(file->span(), path.string(), options).run();
  });
}

}  // namespace gsnav::io
