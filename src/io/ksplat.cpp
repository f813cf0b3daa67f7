// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/io/ksplat.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "cloud_fill.hpp"
#include "described.hpp"
#include "file.hpp"
#include "quantised.hpp"

namespace gsnav::io {
namespace {

using detail::load_le;

constexpr std::size_t kHeader = 4096, kSectionHeader = 1024, kBucketCentre = 12;

/// Sizes in bytes of a record's fields, by compression level. Four bytes of colour follow
/// the quaternion.
struct CompressionLevel {
  std::size_t number;   ///< Size of a coordinate of the position, the scale or the quaternion.
  std::size_t rest;     ///< Size of an SH coefficient.
  std::uint32_t range;  ///< Steps from a bucket's centre to its side, unless the section has its own.
};
constexpr std::array<CompressionLevel, 3> kLevels = {{{4, 4, 1}, {2, 2, 32767}, {2, 1, 32767}}};

struct Section {
  std::size_t count = 0, capacity = 0;  ///< Number of Gaussians, and the size of a full bucket.
  std::size_t full = 0, partial = 0;    ///< Number of full and of partial buckets.
  std::size_t record = 0;               ///< Bytes of a record.
  int degree = 0;
  double range = 0, step = 0;
  std::size_t first = 0;                ///< Index of its first Gaussian among those of all sections.
  std::vector<std::byte> bucket_bytes;  ///< Sizes of its partial buckets, then the centres of all
                                        ///< buckets.
  std::vector<std::uint64_t> ends;      ///< For each partial bucket, one past its last Gaussian.
  detail::ByteSource records;

  const std::byte* centre(std::size_t bucket) const {
    return bucket_bytes.data() + 4 * partial + bucket * kBucketCentre;
  }
  /// The bucket of Gaussian i. Full buckets come first; empty ones hold nothing.
  std::size_t bucket_of(std::size_t i) const {
    if (i < full * capacity) return i / capacity;
    return full + static_cast<std::size_t>(std::upper_bound(ends.begin(), ends.end(), i) - ends.begin());
  }
};

class KsplatReader {
 public:
  KsplatReader(const detail::ByteSource& bytes, const std::string& source)
      : bytes_(bytes), source_(source) {}

  Result<LoadedCloud> run() {
    if (Status s = read_header(); !s) return s;
    std::uint64_t data = kHeader + sections_.size() * kSectionHeader, sum = 0;
    int degree = 0;
    for (std::size_t k = 0; k < sections_.size(); ++k) {
      sections_[k].first = static_cast<std::size_t>(sum);
      if (Status s = read_section(k, data); !s) return s;
      sum += sections_[k].count;
      degree = std::max(degree, sections_[k].count != 0 ? sections_[k].degree : 0);
    }
    if (sum != count_) {
      return fail("the header's count is " + std::to_string(count_) + ", its sections have " +
                  std::to_string(sum));
    }
    const auto decode = [this](std::size_t first, std::size_t last, detail::CloudSink& sink) -> Status {
      for (const Section& s : sections_) {
        const std::size_t from = std::max(first, s.first), to = std::min(last, s.first + s.count);
        if (from >= to) continue;
        if (Status status = add_rows(s, from - s.first, to - s.first, sink); !status) return status;
      }
      return {};
    };
    auto out = detail::fill_cloud(static_cast<std::size_t>(sum), degree, source_, decode);
    if (out && data != bytes_.size()) {
      out->report.warnings.push_back(std::to_string(bytes_.size() - data) +
                                     " stray bytes follow the last section");
    }
    return out;
  }

 private:
  Status fail(const std::string& what) const { return {Errc::invalid_file, source_ + ": " + what}; }

  Status read_header() {
    if (bytes_.size() < kHeader) {
      return fail(std::to_string(bytes_.size()) + " bytes, the header alone has 4096");
    }
    std::vector<std::byte> scratch;
    const std::byte* h = bytes_.get(0, kHeader, scratch);
    if (h == nullptr) return detail::reading_failed(source_);
    const int major = std::to_integer<int>(h[0]), minor = std::to_integer<int>(h[1]);
    if (major != 0 || minor < 1) {
      return {Errc::unsupported, source_ + ": version " + std::to_string(major) + "." +
                                     std::to_string(minor) + ", 0.1 and later 0.x are read"};
    }
    const std::uint32_t sections = load_le<std::uint32_t>(h + 4);
    count_ = load_le<std::uint32_t>(h + 16);
    const std::size_t level = load_le<std::uint16_t>(h + 20);
    if (level >= kLevels.size()) {
      return {Errc::unsupported,
              source_ + ": compression level " + std::to_string(level) + ", 0 to 2 are read"};
    }
    quantised_ = level > 0;
    level_ = kLevels[level];
    const float low = load_le<float>(h + 36), high = load_le<float>(h + 40);
    rest_low_ = low != 0 ? static_cast<double>(low) : -1.5;
    rest_high_ = high != 0 ? static_cast<double>(high) : 1.5;
    if (sections > (bytes_.size() - kHeader) / kSectionHeader) {
      return fail(std::to_string(sections) + " section headers do not fit into " +
                  std::to_string(bytes_.size()) + " bytes");
    }
    sections_.resize(sections);
    return {};
  }

  /// Reads section k, whose data begin at `data`. Moves `data` to their end.
  Status read_section(std::size_t k, std::uint64_t& data) {
    std::vector<std::byte> scratch;
    const std::byte* h = bytes_.get(kHeader + k * kSectionHeader, kSectionHeader, scratch);
    if (h == nullptr) return detail::reading_failed(source_);
    const std::string where = "section " + std::to_string(k) + ": ";
    const auto field = [h](std::size_t offset) {
      return std::uint64_t{load_le<std::uint32_t>(h + offset)};
    };
    Section& s = sections_[k];
    const std::uint64_t most = field(4), buckets = field(12), full = field(32), partial = field(36);
    const std::uint64_t centre = load_le<std::uint16_t>(h + 20);
    s.count = static_cast<std::size_t>(field(0));
    s.capacity = static_cast<std::size_t>(field(8));
    s.full = static_cast<std::size_t>(full);
    s.partial = static_cast<std::size_t>(partial);
    s.degree = load_le<std::uint16_t>(h + 40);
    if (s.degree > kMaxShDegree) {
      return fail(where + "SH degree " + std::to_string(s.degree) + ", must be at most 3");
    }
    if (s.count > most) {
      return fail(where + std::to_string(s.count) + " Gaussians in room for " + std::to_string(most));
    }
    s.record = 10 * level_.number + 4 +
               level_.rest * 3 * static_cast<std::size_t>(sh_coefficient_count(s.degree) - 1);
    // All factors have at most 32 bits, so the sum of these products cannot overflow.
    const std::uint64_t size = 4 * partial + centre * buckets + s.record * most;
    if (size > bytes_.size() - data) {
      return fail(where + std::to_string(most) + " Gaussians in " + std::to_string(buckets) +
                  " buckets need " + std::to_string(size) + " bytes, " +
                  std::to_string(bytes_.size() - data) + " are there");
    }
    const std::uint64_t tables = 4 * partial + centre * buckets, begin = data;
    s.records = bytes_.part(begin + tables, s.record * most);
    data += size;
    if (!quantised_ || s.count == 0) return {};
    if (centre != kBucketCentre) {
      return fail(where + std::to_string(centre) + " bytes to a bucket, must be 12");
    }
    std::vector<std::byte> table_room;
    const std::byte* table = bytes_.get(begin, static_cast<std::size_t>(tables), table_room);
    if (table == nullptr && tables != 0) return detail::reading_failed(source_);
    s.bucket_bytes.assign(table, table + tables);
    std::uint64_t held = full * s.capacity;
    for (std::size_t b = 0; b < s.partial; ++b) {
      held += load_le<std::uint32_t>(s.bucket_bytes.data() + 4 * b);
      s.ends.push_back(held);
    }
    if (full + partial > buckets || held < s.count) {
      return fail(where + std::to_string(full) + " full and " + std::to_string(partial) +
                  " other buckets, of " + std::to_string(buckets) + " in all, hold " +
                  std::to_string(held) + " of its " + std::to_string(s.count) + " Gaussians");
    }
    const std::uint64_t range = field(24);
    s.range = static_cast<double>(range != 0 ? range : level_.range);
    s.step = static_cast<double>(load_le<float>(h + 16)) / 2 / s.range;
    return {};
  }

  double number(const std::byte* record, std::size_t index) const {
    const std::byte* p = record + level_.number * index;
    return quantised_ ? detail::half_to_double(load_le<std::uint16_t>(p))
                      : static_cast<double>(load_le<float>(p));
  }

  double coefficient(const std::byte* p) const {
    if (level_.rest == 4) return static_cast<double>(load_le<float>(p));
    if (level_.rest == 2) return detail::half_to_double(load_le<std::uint16_t>(p));
    return rest_low_ + std::to_integer<int>(*p) / 255.0 * (rest_high_ - rest_low_);
  }

  /// Adds the Gaussians [from, to) of a section.
  Status add_rows(const Section& s, std::size_t from, std::size_t to, detail::CloudSink& sink) const {
    std::vector<std::byte> scratch;
    for (std::size_t row = from; row < to; row += detail::kRowsAtOnce) {
      const std::size_t n = std::min(detail::kRowsAtOnce, to - row);
      const std::byte* records = s.records.get(std::uint64_t{row} * s.record, n * s.record, scratch);
      if (records == nullptr) return detail::reading_failed(source_);
      for (std::size_t i = 0; i < n; ++i) add(s, row + i, records + i * s.record, sink);
    }
    return {};
  }

  void add(const Section& s, std::size_t i, const std::byte* record, detail::CloudSink& sink) const {
    RawGaussian raw;
    if (quantised_) {
      const std::byte* centre = s.centre(s.bucket_of(i));
      for (std::size_t k = 0; k < 3; ++k) {
        const double steps = load_le<std::uint16_t>(record + 2 * k) - s.range;
        raw.mean[static_cast<int>(k)] =
            steps * s.step + static_cast<double>(load_le<float>(centre + 4 * k));
      }
    } else {
      raw.mean = {number(record, 0), number(record, 1), number(record, 2)};
    }
    const std::byte* colour = record + 10 * level_.number;
    for (std::size_t k = 0; k < 3; ++k) {
      raw.log_scales[static_cast<int>(k)] = std::log(number(record, 3 + k));
      raw.sh0[k] = static_cast<float>(sh0_of_color(std::to_integer<int>(colour[k]) / 255.0));
    }
    raw.quat = {number(record, 6), number(record, 7), number(record, 8), number(record, 9)};
    raw.opacity_logit = detail::opacity_logit(std::to_integer<unsigned>(colour[3]));
    std::array<float, 45> rest{};
    raw.shN = rest.data();
    // Bands are stored one after another; within a band, channel after channel.
    const std::byte* p = colour + 4;
    for (std::size_t band = 1; band <= static_cast<std::size_t>(s.degree); ++band) {
      const std::size_t first = band * band - 1, width = 2 * band + 1;
      for (std::size_t k = 0; k < 3 * width; ++k, p += level_.rest) {
        rest[3 * (first + k % width) + k / width] = static_cast<float>(coefficient(p));
      }
    }
    sink.add(raw);
  }

  detail::ByteSource bytes_;
  const std::string& source_;
  std::uint32_t count_ = 0;
  bool quantised_ = false;
  CompressionLevel level_{};
  double rest_low_ = 0, rest_high_ = 0;
  std::vector<Section> sections_;
};

}  // namespace

Result<LoadedCloud> parse_ksplat(std::span<const std::byte> bytes, std::string source) {
  return detail::guarded(source, [&] { return detail::described(KsplatReader(bytes, source).run()); });
}

Result<LoadedCloud> load_ksplat(const std::filesystem::path& path) {
  return detail::guarded(path.string(), [&]() -> Result<LoadedCloud> {
    detail::RandomFile file;
    if (Status s = file.open(path); !s) return s;
    return detail::described(KsplatReader(file, path.string()).run());
  });
}

}  // namespace gsnav::io
