// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/io/sog.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "cloud_fill.hpp"
#include "described.hpp"
#include "file.hpp"
#include "quantised.hpp"
#include "sog_meta.hpp"
#include "sog_rows.hpp"
#include "webp.hpp"
#include "zip.hpp"

namespace gsnav::io {
namespace {

using detail::Codebook;
using detail::RgbaImage;
using detail::SogMeta;

// A constant image of 16383 x 16383 pixels takes a few bytes of WebP. Real sets have about one Gaussian
// for each byte of all files; refuse sets that claim many times more before allocating memory.
constexpr std::size_t kMostGaussiansPerByte = 8;
constexpr std::size_t kGaussianSlack = std::size_t{1} << 18;

/// The files of a SOG, in a folder or a bundle.
class SogFiles {
 public:
  Status open(const std::filesystem::path& path) {
    std::error_code ignored;
    if (std::filesystem::is_directory(path, ignored)) {
      folder_ = path;
    } else if (path.extension() == ".json") {
      folder_ = path.parent_path();
      meta_ = path.filename().string();
    } else {
      return open_bundle(path);
    }
    return {};
  }

  const std::string& meta() const noexcept { return meta_; }
  /// Name of a file of the set for messages.
  std::string label(const std::string& name) const {
    return zip_ ? bundle_name_ + ": " + name : (folder_ / name).string();
  }

  Result<std::vector<std::byte>> read(const std::string& name) const {
    if (zip_) return zip_->read(name);
    auto file = detail::read_file(folder_ / name);
    if (!file) return file.status();
    return std::vector<std::byte>(file->span().begin(), file->span().end());
  }

  /// Frees the bytes of a bundle. Nothing may be read afterwards.
  void close() noexcept {
    zip_.reset();
    bundle_ = {};
  }

 private:
  Status open_bundle(const std::filesystem::path& path) {
    bundle_name_ = path.string();
    auto file = detail::read_file(path);
    if (!file) return file.status();
    bundle_ = std::move(*file);
    auto zip = detail::ZipReader::open(bundle_.span(), bundle_name_);
    if (!zip) return zip.status();
    zip_ = std::move(*zip);
    return {};
  }

  std::filesystem::path folder_;
  std::string meta_ = "meta.json";
  std::string bundle_name_;
  detail::FileBytes bundle_;
  std::optional<detail::ZipReader> zip_;
};

/// An image: first its size, and its pixels after all sizes were checked. The file is read each time, so
/// that only one is in memory.
struct PlaneFile {
  std::string name, label;
  std::size_t bytes = 0;  ///< Size of the file.
  detail::WebpSize size;
  RgbaImage image;

  Status read(const SogFiles& files, const std::string& file) {
    name = file;
    label = files.label(file);
    const auto content = files.read(file);
    if (!content) return content.status();
    bytes = content->size();
    const auto found = detail::webp_size(*content, label);
    if (!found) return found.status();
    size = *found;
    return {};
  }
  Status decode(const SogFiles& files) {
    const auto content = files.read(name);
    if (!content) return content.status();
    auto decoded = detail::decode_webp(*content, label);
    if (!decoded) return decoded.status();
    if (decoded->width != size.width || decoded->height != size.height) {
      return {Errc::invalid_file, label + ": has changed while it was read"};
    }
    image = std::move(*decoded);
    return {};
  }
  std::string dimensions() const {
    return std::to_string(size.width) + " x " + std::to_string(size.height);
  }
  /// An error about pixel i of this image.
  Status fail(std::size_t i, const std::string& what) const {
    return {Errc::invalid_file, label + ": pixel " + std::to_string(i) + ": " + what};
  }
};

class SogReader {
 public:
  SogReader(SogFiles& files, SogMeta meta) : files_(files), meta_(std::move(meta)) {}

  /// Reads all rows, or those of `ranges` if it is not null.
  Result<LoadedCloud> run(const std::string& source, const std::vector<detail::RowRange>* ranges,
                          std::vector<std::uint8_t>* kept) {
    const std::vector<detail::RowRange> all = {{0, meta_.count}};
    if (ranges == nullptr) ranges = &all;
    std::uint64_t total = 0;
    for (const detail::RowRange& r : *ranges) {
      if (r.first > meta_.count || r.count > meta_.count - r.first) {
        return {Errc::invalid_file,
                source + ": rows " + std::to_string(r.first) + " and " + std::to_string(r.count) +
                    " from there on are asked for, it has " + std::to_string(meta_.count)};
      }
      total += r.count;
    }
    if (Status s = read_sizes(); !s) return s;
    const std::size_t count = static_cast<std::size_t>(total);
    if (kept != nullptr) kept->assign(count, 0);
    GaussianCloud planes;
    // Bands are most of the cloud. Decode them first and free their images before anything else is
    // allocated.
    if (Status s = look_up_bands(*ranges, count, planes.shN); !s) return s;
    for (PlaneFile* plane : {&low_, &high_, &scales_, &quats_, &sh0_}) {
      if (Status s = plane->decode(files_); !s) return s;
    }
    files_.close();
    detail::give_back_memory();
    const auto decode = [&](std::size_t first, std::size_t last, detail::CloudSink& sink) -> Status {
      RawGaussian raw;
      return for_rows(*ranges, first, last, [&](std::size_t row, std::size_t i) -> Status {
        raw.shN = sink.bands(i);
        Status s = gaussian(row, raw);
        if (s && sink.add(raw) && kept != nullptr) (*kept)[i] = 1;
        return s;
      });
    };
    auto out = detail::fill_cloud(count, meta_.degree, source, decode, true, std::move(planes));
    if (out) out->cloud.filter = meta_.antialias ? Filter::mip : Filter::classic;
    return out;
  }

 private:
  /// Calls f(row of the file, i) for i in [first, last), where i counts the rows of all ranges.
  template <class F>
  static Status for_rows(const std::vector<detail::RowRange>& ranges, std::size_t first,
                         std::size_t last, const F& f) {
    std::uint64_t before = 0;  // rows of the ranges so far
    for (const detail::RowRange& r : ranges) {
      const std::uint64_t from = std::max<std::uint64_t>(first, before);
      const std::uint64_t to = std::min<std::uint64_t>(last, before + r.count);
      for (std::uint64_t i = from; i < to; ++i) {
        if (Status s = f(static_cast<std::size_t>(r.first + i - before), static_cast<std::size_t>(i));
            !s)
          return s;
      }
      before += r.count;
    }
    return {};
  }

  /// Looks up the bands of all rows.
  Status look_up_bands(const std::vector<detail::RowRange>& ranges, std::size_t count,
                       std::vector<float>& bands) {
    if (meta_.degree == 0) return {};
    for (PlaneFile* plane : {&labels_, &centroids_}) {
      if (Status s = plane->decode(files_); !s) return s;
    }
    const std::size_t rest = 3 * static_cast<std::size_t>(sh_coefficient_count(meta_.degree) - 1);
    bands = huge_vector<float>(rest * count);
    const Status s = detail::for_pieces(
        count, detail::pieces_of(count),
        [&](std::size_t, std::size_t first, std::size_t last) -> Status {
          return for_rows(ranges, first, last, [&](std::size_t row, std::size_t i) -> Status {
            return palette_entry(row, bands.data() + rest * i);
          });
        });
    centroids_.image = labels_.image = {};
    return s;
  }

  /// Reads the sizes of all images, and checks that they fit one another, the count and the number of
  /// bytes.
  Status read_sizes() {
    const std::pair<PlaneFile*, const std::string*> wanted[] = {
        {&low_, &meta_.means_low}, {&high_, &meta_.means_high}, {&scales_, &meta_.scales},
        {&quats_, &meta_.quats},   {&sh0_, &meta_.sh0},         {&labels_, &meta_.labels}};
    const std::size_t planes = meta_.degree > 0 ? 6 : 5;
    std::size_t bytes = 0;
    for (std::size_t k = 0; k < planes; ++k) {
      PlaneFile& p = *wanted[k].first;
      if (Status s = p.read(files_, *wanted[k].second); !s) return s;
      bytes += p.bytes;
      if (p.size.width != low_.size.width || p.size.height != low_.size.height) {
        return {Errc::invalid_file, p.label + ": " + p.dimensions() + " pixels, but " + low_.name +
                                        " has " + low_.dimensions()};
      }
    }
    const std::size_t pixels = low_.size.width * low_.size.height;
    const std::string where =
        files_.label(files_.meta()) + ": 'count' is " + std::to_string(meta_.count);
    if (meta_.count > pixels) {
      return {Errc::invalid_file, where + ", but the planes have " + low_.dimensions() + " pixels"};
    }
    if (pixels > kGaussianSlack + kMostGaussiansPerByte * bytes) {
      return {Errc::invalid_file, where + " in planes of " + low_.dimensions() + " pixels, which " +
                                      std::to_string(bytes) + " bytes are too few for"};
    }
    return meta_.degree > 0 ? read_palette_size() : Status();
  }

  Status read_palette_size() {
    const std::size_t coefficients = static_cast<std::size_t>(sh_coefficient_count(meta_.degree) - 1);
    if (Status s = centroids_.read(files_, meta_.centroids); !s) return s;
    const std::size_t width = kEntriesPerRow * coefficients;
    const std::size_t rows = (meta_.palette + kEntriesPerRow - 1) / kEntriesPerRow;
    // The palette has at most 65536 entries, so a larger image would only waste memory.
    if (centroids_.size.width != width || centroids_.size.height < rows ||
        centroids_.size.height > kMostRows) {
      return {Errc::invalid_file, centroids_.label + ": " + centroids_.dimensions() +
                                      " pixels, must be " + std::to_string(width) + " x " +
                                      std::to_string(rows) + " for " + std::to_string(meta_.palette) +
                                      " entries of " + std::to_string(meta_.degree) + " bands"};
    }
    return {};
  }

  Status look_up(const PlaneFile& plane, std::size_t pixel, std::size_t channel, const Codebook& book,
                 double& value) const {
    const std::size_t index = plane.image.pixel(pixel)[channel];
    if (index >= book.size()) {
      return plane.fail(pixel, "codebook index " + std::to_string(index) + ", the codebook has " +
                                   std::to_string(book.size()) + " entries");
    }
    value = book[index];
    return {};
  }

  Status gaussian(std::size_t i, RawGaussian& raw) const {
    for (std::size_t k = 0; k < 3; ++k) {
      const int axis = static_cast<int>(k);
      const unsigned steps = low_.image.pixel(i)[k] + 256u * high_.image.pixel(i)[k];
      const double v = std::lerp(meta_.mins[k], meta_.maxs[k], steps / 65535.0);
      raw.mean[axis] = std::copysign(std::expm1(std::fabs(v)), v);
      double dc = 0;
      if (Status s = look_up(scales_, i, k, meta_.log_scales[k], raw.log_scales[axis]); !s) return s;
      if (Status s = look_up(sh0_, i, k, meta_.dc[k], dc); !s) return s;
      raw.sh0[k] = static_cast<float>(dc);
    }
    raw.opacity_logit = meta_.opacity_logits[sh0_.image.pixel(i)[3]];
    return quaternion(i, raw.quat);
  }

  /// Decodes a quaternion: three components in [-1, 1] / sqrt(2); the fourth, the largest, follows from
  /// unit length.
  Status quaternion(std::size_t i, Quatd& quat) const {
    const std::uint8_t* p = quats_.image.pixel(i);
    if (p[3] < kFirstMode) {
      return quats_.fail(i, "quaternion mode " + std::to_string(p[3]) + ", must be 252 to 255");
    }
    double others[3];
    for (std::size_t k = 0; k < 3; ++k) others[k] = (p[k] / 255.0 - 0.5) * std::sqrt(2.0);
    quat = detail::quat_without(static_cast<std::size_t>(p[3] - kFirstMode), others);
    return {};
  }

  Status palette_entry(std::size_t i, float* rest) const {
    const std::uint8_t* p = labels_.image.pixel(i);
    const std::size_t label = p[0] + std::size_t{256} * p[1];
    if (label >= meta_.palette) {
      return labels_.fail(i, "label " + std::to_string(label) + ", the palette has " +
                                 std::to_string(meta_.palette) + " entries");
    }
    const std::size_t coefficients = centroids_.size.width / kEntriesPerRow;
    const std::size_t first =
        label / kEntriesPerRow * centroids_.size.width + label % kEntriesPerRow * coefficients;
    for (std::size_t k = 0; k < 3 * coefficients; ++k) {
      double value = 0;
      if (Status s = look_up(centroids_, first + k / 3, k % 3, meta_.rest, value); !s) return s;
      rest[k] = static_cast<float>(value);
    }
    return {};
  }

  static constexpr int kFirstMode = 252;
  static constexpr std::size_t kEntriesPerRow = 64, kMostRows = 1024;

  SogFiles& files_;
  SogMeta meta_;
  PlaneFile low_, high_, scales_, quats_, sh0_, labels_, centroids_;
};

Result<LoadedCloud> load(const std::filesystem::path& path, const std::vector<detail::RowRange>* ranges,
                         std::vector<std::uint8_t>* kept = nullptr) {
  return detail::guarded(path.string(), [&]() -> Result<LoadedCloud> {
    SogFiles files;
    if (Status s = files.open(path); !s) return s;
    const auto text = files.read(files.meta());
    if (!text) return text.status();
    auto meta = detail::parse_sog_meta(*text, files.label(files.meta()));
    if (!meta) return meta.status();
    return SogReader(files, std::move(*meta)).run(path.string(), ranges, kept);
  });
}

}  // namespace

Result<LoadedCloud> load_sog(const std::filesystem::path& path) {
  return detail::described(load(path, nullptr));
}

Result<LoadedCloud> detail::load_sog_rows(const std::filesystem::path& path,
                                          const std::vector<RowRange>& ranges,
                                          std::vector<std::uint8_t>* kept) {
  return load(path, &ranges, kept);
}

}  // namespace gsnav::io
