// SPDX-License-Identifier: Apache-2.0
#include "ply_compressed.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "cloud_fill.hpp"
#include "file.hpp"
#include "quantised.hpp"

namespace gsnav::io::detail {
namespace {

constexpr std::size_t kChunk = 256;  // Gaussians that share their bounds

/// An element whose rows are all inside the file, and the offsets of the values that are read.
struct ElementRows {
  const PlyElement* element = nullptr;
  ByteSource bytes;
  std::vector<std::size_t> offsets;
};

/// Consecutive rows of an element in memory.
struct ElementBlock {
  const ElementRows* rows = nullptr;
  const std::byte* first = nullptr;

  template <class T>
  T at(std::size_t row, std::size_t value) const noexcept {
    return load_le<T>(first + row * rows->element->stride + rows->offsets[value]);
  }
};

class CompressedPlyReader {
 public:
  CompressedPlyReader(const ByteSource& bytes, const PlyHeader& header, const std::string& source)
      : bytes_(bytes), header_(header), source_(source) {}

  Result<LoadedCloud> run() {
    if (header_.format != PlyFormat::little) {
      return {Errc::unsupported, source_ + ": a compressed PLY must be binary_little_endian"};
    }
    if (Status s = find_rows(); !s) return s;
    if (Status s = find_columns(); !s) return s;
    std::vector<std::byte> chunk_room;
    ElementBlock chunks;
    if (Status s = get(chunk_, 0, static_cast<std::size_t>(chunk_.element->count), chunk_room, chunks);
        !s) {
      return s;
    }
    const auto decode = [&](std::size_t first, std::size_t last, CloudSink& sink) -> Status {
      std::vector<std::byte> vertex_room, sh_room;
      ElementBlock vertex, sh;
      for (std::size_t row = first; row < last; row += kRowsAtOnce) {
        const std::size_t n = std::min(kRowsAtOnce, last - row);
        if (Status s = get(vertex_, row, n, vertex_room, vertex); !s) return s;
        if (Status s = get(sh_, row, n, sh_room, sh); !s) return s;
        for (std::size_t i = 0; i < n; ++i) add(chunks, (row + i) / kChunk, vertex, sh, i, sink);
      }
      return {};
    };
    auto out = fill_cloud(static_cast<std::size_t>(vertex_.element->count), degree_, source_, decode);
    if (!out) return out;
    out->cloud.filter = header_.mip ? Filter::mip : Filter::classic;
    LoadReport& report = out->report;
    if (sh_in_file_ == kMostSh) {
      report.warnings.push_back("SH degree 4 in the file: bands up to degree 3 are read");
    }
    if (stray_ != 0) {
      report.warnings.push_back(std::to_string(stray_) + " stray bytes follow the last element");
    }
    return out;
  }

 private:
  Status fail(const std::string& what) const { return {Errc::invalid_file, source_ + ": " + what}; }

  /// Reads n rows from `row` on. The element may be missing.
  Status get(const ElementRows& rows, std::size_t row, std::size_t n, std::vector<std::byte>& scratch,
             ElementBlock& out) const {
    out.rows = &rows;
    if (rows.element == nullptr) return {};
    const std::size_t stride = rows.element->stride;
    out.first = rows.bytes.get(std::uint64_t{row} * stride, n * stride, scratch);
    return out.first != nullptr ? Status() : reading_failed(source_);
  }

  /// Finds the three elements and checks that the file has all their rows.
  Status find_rows() {
    std::uint64_t at = header_.size;
    for (const PlyElement& e : header_.elements) {
      if (e.has_list) {
        return {Errc::unsupported, source_ + ": element " + in_quotes(e.name) + " has a list property"};
      }
      ElementRows* rows = e.name == "chunk" ? &chunk_ : e.name == "vertex" ? &vertex_ : &sh_;
      if (rows != &sh_ || e.name == "sh") *rows = {&e, bytes_.part(at, 0), {}};
      if (e.stride == 0) continue;
      const std::uint64_t there = (bytes_.size() - at) / e.stride;
      if (there < e.count) return ply_rows_missing(source_, e, there);
      at += e.count * e.stride;
    }
    stray_ = bytes_.size() - at;
    if (chunk_.element == nullptr) return fail("no element 'chunk'");
    const std::uint64_t vertices = vertex_.element->count, chunks = chunk_.element->count;
    if (chunks != vertices / kChunk + (vertices % kChunk != 0 ? 1 : 0)) {
      return fail("element 'chunk' has " + std::to_string(chunks) + " rows, which do not fit the " +
                  std::to_string(vertices) + " of 'vertex', 256 to a chunk");
    }
    if (sh_.element != nullptr && sh_.element->count != vertices) {
      return fail("element 'sh' has " + std::to_string(sh_.element->count) + " rows, 'vertex' has " +
                  std::to_string(vertices));
    }
    return {};
  }

  /// Adds the offset of a property, which must have the given type.
  Status column(ElementRows& rows, const std::string& name, PlyType type, const char* type_name) {
    const PlyProperty* p = rows.element->find(name);
    if (p == nullptr) {
      return fail("element " + in_quotes(rows.element->name) + " has no property " + in_quotes(name));
    }
    if (p->type != type) {
      return fail("property " + in_quotes(name) + " of element " + in_quotes(rows.element->name) +
                  " must be " + type_name);
    }
    rows.offsets.push_back(p->offset);
    return {};
  }

  Status find_columns() {
    for (const char* what : {"packed_position", "packed_rotation", "packed_scale", "packed_color"}) {
      if (Status s = column(vertex_, what, PlyType::u32, "uint"); !s) return s;
    }
    // Older files have no ranges of colours: their bytes are fractions of [0, 1].
    has_colours_ = chunk_.element->find("min_r") != nullptr;
    for (const char* end : {"min_", "max_"}) {
      for (std::size_t k = 0; k < bounds(); ++k) {
        static constexpr const char* kNames[] = {"x",       "y", "z", "scale_x", "scale_y",
                                                 "scale_z", "r", "g", "b"};
        if (Status s = column(chunk_, std::string(end) + kNames[k], PlyType::f32, "float"); !s) return s;
      }
    }
    if (sh_.element == nullptr) return {};
    sh_in_file_ = sh_.element->properties.size();
    static constexpr std::array<std::size_t, 4> kCounts = {9, 24, 45, kMostSh};
    const auto found = std::find(kCounts.begin(), kCounts.end(), sh_in_file_);
    if (found == kCounts.end()) {
      return fail("element 'sh' has " + std::to_string(sh_in_file_) +
                  " properties, must be 9, 24, 45 or 72");
    }
    degree_ = std::min(kMaxShDegree, static_cast<int>(found - kCounts.begin()) + 1);
    const std::size_t coefficients = static_cast<std::size_t>(sh_coefficient_count(degree_) - 1);
    // The file is channel-major; in the cloud, the channels of a coefficient are together.
    for (std::size_t k = 0; k < coefficients; ++k) {
      for (std::size_t channel = 0; channel < 3; ++channel) {
        const std::string name = "f_rest_" + std::to_string(channel * (sh_in_file_ / 3) + k);
        if (Status s = column(sh_, name, PlyType::u8, "uchar"); !s) return s;
      }
    }
    return {};
  }

  /// Number of bounds of each kind, low and high, of a chunk.
  std::size_t bounds() const noexcept { return has_colours_ ? 9 : 6; }

  /// Decodes the `bits` from `shift` on, as a fraction of a chunk's range of value `which` (x y z,
  /// scales, rgb).
  double between(const ElementBlock& chunks, std::size_t chunk, std::size_t which, std::uint32_t packed,
                 int shift, int bits) const {
    const double low = static_cast<double>(chunks.at<float>(chunk, which)),
                 high = static_cast<double>(chunks.at<float>(chunk, bounds() + which)),
                 t = fraction(packed, shift, bits);
    return (1 - t) * low + t * high;  // not std::lerp, which may turn a NaN into a number
  }

  static double fraction(std::uint32_t packed, int shift, int bits) noexcept {
    const std::uint32_t most = (std::uint32_t{1} << bits) - 1;
    return static_cast<double>((packed >> shift) & most) / static_cast<double>(most);
  }

  /// Adds row i of the blocks, which belongs to `chunk`.
  void add(const ElementBlock& chunks, std::size_t chunk, const ElementBlock& vertex,
           const ElementBlock& sh, std::size_t i, CloudSink& sink) const {
    const std::uint32_t position = vertex.at<std::uint32_t>(i, 0),
                        rotation = vertex.at<std::uint32_t>(i, 1),
                        scale = vertex.at<std::uint32_t>(i, 2), colour = vertex.at<std::uint32_t>(i, 3);
    static constexpr int kShift[] = {21, 11, 0}, kBits[] = {11, 10, 11};
    RawGaussian raw;
    double others[3];
    for (std::size_t k = 0; k < 3; ++k) {
      const int axis = static_cast<int>(k);
      raw.mean[axis] = between(chunks, chunk, k, position, kShift[k], kBits[k]);
      raw.log_scales[axis] = between(chunks, chunk, 3 + k, scale, kShift[k], kBits[k]);
      raw.sh0[k] = static_cast<float>(
          sh0_of_color(has_colours_ ? between(chunks, chunk, 6 + k, colour, 24 - 8 * axis, 8)
                                    : fraction(colour, 24 - 8 * axis, 8)));
      others[k] = (fraction(rotation, 20 - 10 * axis, 10) - 0.5) * std::sqrt(2.0);
    }
    raw.quat = quat_without(rotation >> 30, others);
    raw.opacity_logit = opacity_logit(colour & 0xff);
    std::array<float, 45> rest;
    raw.shN = rest.data();
    for (std::size_t k = 0; k < sh_.offsets.size(); ++k) {
      // 256 cells over [-4, 4]. Each is read as its centre, the first and the last as their outer ends.
      const double byte = static_cast<double>(sh.at<std::uint8_t>(i, k));
      const double value = byte == 0 ? 0 : byte == 255 ? 1 : (byte + 0.5) / 256;
      rest[k] = static_cast<float>(8 * (value - 0.5));
    }
    sink.add(raw);
  }

  static constexpr std::size_t kMostSh = 72;

  ByteSource bytes_;
  const PlyHeader& header_;
  const std::string& source_;
  ElementRows chunk_, vertex_, sh_;
  bool has_colours_ = false;
  int degree_ = 0;
  std::size_t sh_in_file_ = 0, stray_ = 0;
};

}  // namespace

bool is_compressed_ply(const PlyHeader& header) {
  return std::any_of(header.elements.begin(), header.elements.end(), [](const PlyElement& e) {
    return e.name == "vertex" && e.find("packed_position") != nullptr;
  });
}

Result<LoadedCloud> parse_compressed_ply(const ByteSource& bytes, const PlyHeader& header,
                                         const std::string& source) {
  return CompressedPlyReader(bytes, header, source).run();
}

}  // namespace gsnav::io::detail
