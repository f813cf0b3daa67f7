// SPDX-License-Identifier: Apache-2.0
#include "spz_planes.hpp"

#include <zstd.h>

#include <algorithm>
#include <utility>

#include "file.hpp"
#include "gsnav/core/huge_pages.hpp"
#include "gzip.hpp"
#include "widen_rows.hpp"
#include "zip.hpp"

namespace gsnav::io::detail {
namespace {

constexpr std::size_t kGzipHeader = 16, kPlainHeader = 32, kTocEntry = 16;
constexpr std::size_t kBands = 5;  // the last plane
constexpr int kMostDegree = 4, kMostFractionalBits = 30;
constexpr std::uint32_t kAxesExtension = 0xadbe0003;  // SPZ_ADOBE_coordinate_system

class PlanesReader {
 public:
  PlanesReader(std::span<const std::byte> bytes, const std::string& source)
      : bytes_(bytes), source_(source) {}

  Result<SpzPlanes> run() {
    const bool plain = bytes_.size() >= 4 && load_le<std::uint32_t>(bytes_.data()) == kSpzMagic;
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
    if (Status s = make_room(); !s) return s;
    const std::span<std::byte> bands = plane(kBands);
    std::size_t there = gzip.read(planes_.bytes);
    if (there == planes_.bytes.size()) there += gzip.read(bands);
    if (const std::size_t wanted = planes_.bytes.size() + bands.size(); there != wanted) {
      return fail(gaussians() + " need " + std::to_string(wanted) + " bytes, " + std::to_string(there) + " are there");
    }
    // What follows is read no further than it takes to see the checksum.
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

  /// Header, extensions, sizes of the streams, the streams: one for each plane that has bytes.
  Status read_zstd() {
    if (bytes_.size() < kPlainHeader) {
      return fail(std::to_string(bytes_.size()) + " bytes, the header alone has 32");
    }
    if (Status s = parse_header(bytes_.data(), 4, 4, "without gzip, only 4 is read"); !s) return s;
    const auto widths = planes_.header.widths();
    std::size_t wanted = 0;
    for (const std::size_t width : widths) wanted += width != 0 ? 1 : 0;
    const std::size_t streams = std::to_integer<std::size_t>(bytes_[15]);
    if (streams != wanted) {
      return fail(std::to_string(streams) + " streams, must be " + std::to_string(wanted) +
                  " for SH degree " + std::to_string(planes_.header.degree));
    }
    const std::size_t toc = load_le<std::uint32_t>(bytes_.data() + 16);
    if (toc < kPlainHeader || toc > bytes_.size() || bytes_.size() - toc < streams * kTocEntry) {
      return fail("the table of streams begins at byte " + std::to_string(toc) + " of " +
                  std::to_string(bytes_.size()));
    }
    if (Status s = read_extensions(bytes_.subspan(kPlainHeader, toc - kPlainHeader)); !s) return s;
    if (Status s = make_room(); !s) return s;
    std::span<const std::byte> left = bytes_.subspan(toc + streams * kTocEntry);
    const std::byte* entry = bytes_.data() + toc;
    for (std::size_t k = 0; k < widths.size(); ++k) {
      if (widths[k] == 0) continue;
      if (Status s = unpack(k, load_le<std::uint64_t>(entry), load_le<std::uint64_t>(entry + 8), left); !s) {
        return s;
      }
      entry += kTocEntry;
    }
    if (!left.empty()) warn_of_stray_bytes();
    return {};
  }

  /// Takes stream k, `packed` bytes, off the front of `left`.
  Status unpack(std::size_t k, std::uint64_t packed, std::uint64_t size, std::span<const std::byte>& left) {
    static constexpr const char* kNames[] = {"positions", "opacities",   "colours",
                                             "scales",    "quaternions", "SH bands"};
    const std::string stream = std::string("the stream of ") + kNames[k];
    const std::span<std::byte> to = plane(k);
    const std::size_t wanted = to.size();
    if (size != wanted) {
      return fail(stream + " has " + std::to_string(size) + " bytes unpacked, " + gaussians() +
                  " need " + std::to_string(wanted));
    }
    if (packed > left.size()) {
      return fail(stream + " has " + std::to_string(packed) + " bytes, " + std::to_string(left.size()) +
                  " are there");
    }
    const std::size_t n = static_cast<std::size_t>(packed);
    const std::size_t got = ZSTD_decompress(to.data(), wanted, left.data(), n);
    if (ZSTD_isError(got) != 0) {
      return fail(stream + " cannot be unpacked: " + ZSTD_getErrorName(got));
    }
    if (got != wanted) {
      return fail(stream + " holds " + std::to_string(got) + " bytes, must be " +
                  std::to_string(wanted));
    }
    left = left.subspan(n);
    return {};
  }

  /// Records of type, length and content, of which none is understood.
  Status read_extensions(std::span<const std::byte> records) {
    if ((planes_.header.flags & kSpzExtensions) == 0) return {};
    planes_.warnings.push_back("extensions in the file are not read");
    while (records.size() >= 8) {
      const std::uint32_t type = load_le<std::uint32_t>(records.data());
      const std::uint32_t size = load_le<std::uint32_t>(records.data() + 4);
      if (size > records.size() - 8) {
        return fail("an extension of " + std::to_string(size) + " bytes, " +
                    std::to_string(records.size() - 8) + " are there");
      }
      if (type == kAxesExtension) {
        planes_.warnings.push_back("an extension names other axes than SPZ's, which is not heeded");
      }
      records = records.subspan(8 + std::size_t{size});
    }
    return {};
  }

  /// The first 15 bytes, which all versions share.
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

  Status make_room() {
    const SpzHeader& h = planes_.header;
    const auto widths = h.widths();
    std::uint64_t total = 0;
    for (std::size_t k = 0; k < kBands; ++k) {
      planes_.starts[k] = static_cast<std::size_t>(total);
      total += std::uint64_t{h.count} * widths[k];
    }
    if (total + std::uint64_t{h.count} * widths[kBands] > kInflationSlack + kMostInflation * bytes_.size()) {
      return fail(gaussians() + " from " + std::to_string(bytes_.size()) + " bytes are not believed");
    }
    planes_.bytes.resize(static_cast<std::size_t>(total));
    planes_.bands = huge_vector<float>(3 * std::min<std::size_t>(15, h.coefficients()) * h.count);
    return {};
  }

  /// Where plane k is unpacked to.
  std::span<std::byte> plane(std::size_t k) {
    const std::size_t size = planes_.header.widths()[k] * planes_.header.count;
    return k == kBands ? packed_rows(planes_.bands, size) : std::span(planes_.bytes).subspan(planes_.starts[k], size);
  }

  void warn_of_stray_bytes() { planes_.warnings.push_back("stray bytes follow the " + gaussians()); }
  std::string gaussians() const { return std::to_string(planes_.header.count) + " Gaussians"; }

  std::span<const std::byte> bytes_;
  const std::string& source_;
  SpzPlanes planes_;
};

}  // namespace

Result<SpzPlanes> read_spz_planes(std::span<const std::byte> bytes, const std::string& source) {
  return PlanesReader(bytes, source).run();
}

}  // namespace gsnav::io::detail
