// SPDX-License-Identifier: Apache-2.0
#include "spz_planes.hpp"

#include <zstd.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

#include "cloud_fill.hpp"
#include "gsnav/detail/core/huge_pages.hpp"
#include "gzip.hpp"
#include "quantised.hpp"
#include "widen_rows.hpp"
#include "zip.hpp"

namespace gsnav::io::detail {
namespace {

constexpr std::size_t kGzipHeader = 16, kPlainHeader = 32, kTocEntry = 16;
enum PlaneIndex : std::size_t {
  kPositions,
  kOpacities,
  kColours,
  kScales,
  kQuaternions,
  kBands,
  kPlanes
};
constexpr std::size_t kMostWidth = 72;  // of a plane, bytes
constexpr int kMostDegree = 4, kMostFractionalBits = 30;
constexpr std::uint32_t kAxesExtension = 0xadbe0003;  // SPZ_ADOBE_coordinate_system

class PlanesReader {
 public:
  PlanesReader(const ByteSource& bytes, const std::string& source, bool turn)
      : bytes_(bytes), source_(source), turn_(turn) {}

  Result<SpzPlanes> run() {
    const std::byte* const magic = bytes_.size() < 4 ? nullptr : bytes_.get(0, 4, room_);
    const bool plain = magic != nullptr && load_le<std::uint32_t>(magic) == kSpzMagic;
    if (Status s = plain ? read_zstd() : read_gzip(); !s) return s;
    return std::move(planes_);
  }

 private:
  Status fail(const std::string& what) const { return {Errc::invalid_file, source_ + ": " + what}; }

  Status read_gzip() {
    GzipReader gzip(bytes_);
    std::array<std::byte, kGzipHeader> header;
    if (gzip.read(header) != kGzipHeader || load_le<std::uint32_t>(header.data()) != kSpzMagic) {
      return fail("no gzip stream that begins with SPZ's header");
    }
    if (Status s = parse_header(header.data(), 1, 3, "in gzip, 1 to 3 are read"); !s) return s;
    std::uint64_t wanted = 0, there = 0;
    if (Status s = believe(wanted); !s) return s;
    make_room();
    std::array<std::byte, kRowsAtOnce * kMostWidth> rows;
    const auto widths = planes_.header.widths();
    for (std::size_t k = 0; k < kPlanes; ++k) {
      const std::size_t count = widths[k] != 0 ? planes_.header.count : 0;
      for (std::size_t row = 0; row < count; row += kRowsAtOnce) {
        const std::size_t n = std::min(kRowsAtOnce, count - row);
        const std::size_t got = gzip.read(std::span(rows).first(n * widths[k]));
        there += got;
        if (got != n * widths[k]) {
          return fail(gaussians() + " need " + std::to_string(wanted) + " bytes, " +
                      std::to_string(there) + " are there");
        }
        take(k, rows.data(), row, n);
      }
    }
    // Read the rest of the stream only as far as needed to verify the checksum.
    std::array<std::byte, 4096> rest;
    std::size_t stray = 0;
    for (std::size_t piece = 0; piece < 64 && !gzip.at_end(); ++piece) {
      const std::size_t n = gzip.read(rest);
      stray += n;
      if (n != rest.size()) break;
    }
    if (!gzip.at_end()) return fail("the gzip stream does not end well after its " + gaussians());
    const bool extended = (planes_.header.flags & kSpzExtensions) != 0;
    if (extended) planes_.warnings.push_back("extensions in the file are not read");
    if (!extended && stray != 0) warn_of_stray_bytes();
    return {};
  }

  /// Reads version 4: header, extensions, table of sizes, and a stream for each plane that has bytes.
  Status read_zstd() {
    if (bytes_.size() < kPlainHeader) {
      return fail(std::to_string(bytes_.size()) + " bytes, the header alone has 32");
    }
    const std::byte* const header = bytes_.get(0, kPlainHeader, room_);
    if (header == nullptr) return reading_failed(source_);
    if (Status s = parse_header(header, 4, 4, "without gzip, only 4 is read"); !s) return s;
    const auto widths = planes_.header.widths();
    const std::size_t wanted = kPlanes - (widths[kBands] == 0 ? 1 : 0);
    const std::size_t streams = std::to_integer<std::size_t>(header[15]);
    if (streams != wanted) {
      return fail(std::to_string(streams) + " streams, must be " + std::to_string(wanted) +
                  " for SH degree " + std::to_string(planes_.header.degree));
    }
    const std::size_t toc = load_le<std::uint32_t>(header + 16);
    if (toc < kPlainHeader || toc > bytes_.size() || bytes_.size() - toc < streams * kTocEntry) {
      return fail("the table of streams begins at byte " + std::to_string(toc) + " of " +
                  std::to_string(bytes_.size()));
    }
    if (Status s = read_extensions(bytes_.part(kPlainHeader, toc - kPlainHeader)); !s) return s;
    std::uint64_t total = 0;
    if (Status s = believe(total); !s) return s;
    std::array<ByteSource, kPlanes> packed;
    if (Status s = find_streams(toc, streams, packed); !s) return s;
    return unpack_all(packed);
  }

  /// Finds the streams, which follow one another, from the table at byte `toc`.
  Status find_streams(std::size_t toc, std::size_t streams, std::array<ByteSource, kPlanes>& packed) {
    const std::byte* const table = bytes_.get(toc, streams * kTocEntry, room_);
    if (table == nullptr) return reading_failed(source_);
    std::uint64_t at = toc + streams * kTocEntry;
    for (std::size_t k = 0; k < streams; ++k) {
      const std::uint64_t size = load_le<std::uint64_t>(table + k * kTocEntry);
      const std::uint64_t unpacked = load_le<std::uint64_t>(table + k * kTocEntry + 8);
      const std::uint64_t wanted = std::uint64_t{planes_.header.count} * planes_.header.widths()[k];
      if (unpacked != wanted) {
        return fail(stream(k) + " has " + std::to_string(unpacked) + " bytes unpacked, " + gaussians() +
                    " need " + std::to_string(wanted));
      }
      if (size > bytes_.size() - at) {
        return fail(stream(k) + " has " + std::to_string(size) + " bytes, " +
                    std::to_string(bytes_.size() - at) + " are there");
      }
      packed[k] = bytes_.part(at, size);
      at += size;
    }
    if (at != bytes_.size()) warn_of_stray_bytes();
    return {};
  }

  /// Unpacks the streams one at a time into planes that are not in use yet, and decodes the rows from
  /// there.
  Status unpack_all(const std::array<ByteSource, kPlanes>& packed) {
    GaussianCloud& cloud = planes_.cloud;
    const std::size_t count = planes_.header.count, width = planes_.header.widths()[kBands];
    make_bands();
    if (width != 0) {  // Bands come first: only then the largest stream and the largest plane are in
                       // memory with nothing else.
      if (Status s = unpack(kBands, packed[kBands], packed_rows(cloud.shN, width * count)); !s) return s;
      widen_rows<kMostWidth>(cloud.shN, count, width,
                             [this](const std::byte* in, float* out) { bands(in, out); });
    }
    make_room();
    const auto bytes_of = [](std::vector<float>& plane) {
      return std::as_writable_bytes(std::span(plane));
    };
    for (const std::size_t k : {kPositions, kQuaternions, kOpacities, kScales, kColours}) {
      const std::span<std::byte> plane = bytes_of(k == kPositions     ? cloud.sh0
                                                  : k == kQuaternions ? cloud.quats[0]
                                                                      : cloud.quats[1]);
      const std::span<std::byte> to = plane.first(planes_.header.widths()[k] * count);
      if (Status s = unpack(k, packed[k], to); !s) return s;
      if (k == kQuaternions) continue;  // they need no decoding
      for_pieces(count, pieces_of(count),
                 [&](std::size_t, std::size_t first, std::size_t last) -> Status {
                   take(k, to.data() + first * planes_.header.widths()[k], first, last - first);
                   return {};
                 })
          .throw_if_error();
    }
    return {};
  }

  Status unpack(std::size_t k, const ByteSource& packed, std::span<std::byte> to) {
    const auto n = static_cast<std::size_t>(packed.size());
    const std::byte* const bytes = packed.get(0, n, room_);
    if (bytes == nullptr) return reading_failed(source_);
    const std::size_t got = ZSTD_decompress(to.data(), to.size(), bytes, n);
    release(room_);
    give_back_memory();
    if (ZSTD_isError(got) != 0) {
      return fail(stream(k) + " cannot be unpacked: " + ZSTD_getErrorName(got));
    }
    if (got != to.size()) {
      return fail(stream(k) + " holds " + std::to_string(got) + " bytes, must be " +
                  std::to_string(to.size()));
    }
    return {};
  }

  /// Skips extensions: records of type, length and content, none of which is understood.
  Status read_extensions(ByteSource records) {
    if ((planes_.header.flags & kSpzExtensions) == 0) return {};
    planes_.warnings.push_back("extensions in the file are not read");
    while (records.size() >= 8) {
      const std::byte* const record = records.get(0, 8, room_);
      if (record == nullptr) return reading_failed(source_);
      const std::uint32_t type = load_le<std::uint32_t>(record),
                          size = load_le<std::uint32_t>(record + 4);
      if (size > records.size() - 8) {
        return fail("an extension of " + std::to_string(size) + " bytes, " +
                    std::to_string(records.size() - 8) + " are there");
      }
      if (type == kAxesExtension) {
        planes_.warnings.push_back("an extension that names other axes is ignored");
      }
      records = records.part(8 + std::uint64_t{size}, records.size() - 8 - size);
    }
    return {};
  }

  /// Parses the first 15 bytes, which all versions share.
  Status parse_header(const std::byte* p, std::uint32_t first, std::uint32_t last, const char* read) {
    SpzHeader& h = planes_.header;
    h.version = load_le<std::uint32_t>(p + 4);
    h.count = load_le<std::uint32_t>(p + 8);
    h.degree = std::to_integer<int>(p[12]);
    h.fractional_bits = std::to_integer<int>(p[13]);
    h.flags = std::to_integer<unsigned>(p[14]);
    if (h.version < first || h.version > last) {
      return {Errc::unsupported,
              source_ + ": SPZ version " + std::to_string(h.version) + " " + read + "; convert it"};
    }
    if (h.degree > kMostDegree) {
      return fail("SH degree " + std::to_string(h.degree) + ", must be at most 4");
    }
    if (h.fractional_bits > kMostFractionalBits) {
      return fail(std::to_string(h.fractional_bits) + " fractional bits, must be at most 30");
    }
    return {};
  }

  /// Checks that the unpacked size of all planes is plausible for the size of the file. `total` gets
  /// that size.
  Status believe(std::uint64_t& total) const {
    for (const std::size_t width : planes_.header.widths())
      total += std::uint64_t{planes_.header.count} * width;
    if (total <= kInflationSlack + kMostInflation * bytes_.size()) return {};
    return fail(gaussians() + " from " + std::to_string(bytes_.size()) +
                " bytes are implausible; the file is damaged");
  }

  /// Floats of shN in each row.
  std::size_t rest_in_cloud() const noexcept {
    return 3 * std::min<std::size_t>(15, planes_.header.coefficients());
  }
  void make_bands() { planes_.cloud.shN = huge_vector<float>(rest_in_cloud() * planes_.header.count); }
  void make_room() {
    if (planes_.cloud.shN.empty()) make_bands();
    planes_.cloud.sh_degree = std::min(planes_.header.degree, kMaxShDegree);
    resize_planes(planes_.cloud, planes_.header.count);
  }

  /// Decodes n rows of plane k, the first of which is `first`.
  void take(std::size_t k, const std::byte* rows, std::size_t first, std::size_t n) {
    GaussianCloud& cloud = planes_.cloud;
    const std::size_t width = planes_.header.widths()[k], rest = rest_in_cloud();
    for (std::size_t i = first; i < first + n; ++i, rows += width) {
      if (k == kOpacities) cloud.opacities[i] = static_cast<float>(number(*rows));
      if (k == kQuaternions)
        std::copy_n(rows, width, std::as_writable_bytes(std::span(cloud.quats[0])).data() + 4 * i);
      if (k == kBands) bands(rows, cloud.shN.data() + rest * i);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        if (k == kPositions) cloud.means[axis][i] = static_cast<float>(position(rows, axis));
        if (k == kColours)
          cloud.sh0[3 * i + axis] = static_cast<float>((number(rows[axis]) / 255 - 0.5) / 0.15);
        if (k == kScales) cloud.scales[axis][i] = static_cast<float>(number(rows[axis]) / 16 - 10);
      }
    }
  }

  /// A coordinate from binary16, or from 24 bits in steps of a power of two. A float holds it exactly.
  double position(const std::byte* row, std::size_t axis) const {
    const double turned = turn_ && axis > 0 ? -1 : 1;
    if (planes_.header.version == 1)
      return turned * half_to_double(load_le<std::uint16_t>(row + 2 * axis));
    const std::byte* p = row + 3 * axis;
    const int low = std::to_integer<int>(p[0]) | std::to_integer<int>(p[1]) << 8;
    const int high = static_cast<std::int8_t>(std::to_integer<int>(p[2]));
    return turned * std::ldexp(high * 65536 + low, -planes_.header.fractional_bits);
  }

  void bands(const std::byte* in, float* out) const {
    for (std::size_t k = 0; k < rest_in_cloud(); ++k) {
      const float sign = turn_ ? kHalfTurnAboutX[k / 3] : 1.0f;
      out[k] = static_cast<float>((number(in[k]) - 128) / 128) * sign;
    }
  }

  static double number(std::byte b) noexcept { return static_cast<double>(std::to_integer<int>(b)); }

  static std::string stream(std::size_t k) {
    static constexpr const char* kStreams[] = {"positions", "opacities",   "colours",
                                               "scales",    "quaternions", "SH bands"};
    return std::string("the stream of ") + kStreams[k];
  }

  void warn_of_stray_bytes() { planes_.warnings.push_back("stray bytes follow the " + gaussians()); }
  std::string gaussians() const { return std::to_string(planes_.header.count) + " Gaussians"; }

  const ByteSource bytes_;
  const std::string& source_;
  const bool turn_;
  SpzPlanes planes_;
  std::vector<std::byte> room_;  ///< scratch for parts of a file
};

}  // namespace

Result<SpzPlanes> read_spz_planes(const ByteSource& bytes, const std::string& source, bool turn) {
  return PlanesReader(bytes, source, turn).run();
}

}  // namespace gsnav::io::detail
