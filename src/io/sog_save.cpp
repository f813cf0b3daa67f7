// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <iterator>
#include <new>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "cloud_check.hpp"
#include "codebook.hpp"
#include "file.hpp"
#include "format_range.hpp"
#include "gsnav/core/replace_file.hpp"
#include "gsnav/detail/core/run_guarded.hpp"
#include "gsnav/detail/core/thread_pool.hpp"
#include "gsnav/detail/io/sog.hpp"
#include "gsnav/detail/scene/spatial_order.hpp"
#include "json.hpp"
#include "quantised.hpp"
#include "threads.hpp"
#include "webp.hpp"
#include "zip_writer.hpp"

namespace gsnav::io {
namespace {

using detail::Json;
using detail::RgbaImage;

constexpr std::size_t kLargestPalette = 65536, kSmallPalette = 1024;  // labels have two bytes
constexpr std::size_t kEntriesPerRow = 64;
constexpr std::size_t kMostSide = 16383;  // of a WebP
/// Names of the images of a SOG, without their endings.
constexpr const char* kStems[] = {"means_l", "means_u",       "scales",    "quats",
                                  "sh0",     "shN_centroids", "shN_labels"};

/// The files of a SOG by name, in the order in which they are written.
using Files = std::vector<std::pair<std::string, std::string>>;

class SogWriter {
 public:
  /// `ending` is that of the images' names: ".webp", or next to another scene for example ".1.webp".
  SogWriter(const GaussianCloud& cloud, const std::string& target, std::string ending = ".webp")
      : cloud_(cloud), target_(target), ending_(std::move(ending)) {}

  Result<Files> run() {
    if (Status s = detail::check_arrays(target_, cloud_); !s) return s;
    const std::size_t n = cloud_.size();
    rows_ = rows_as_read(cloud_);
    width_ = std::max<std::size_t>(
        4, 4 * static_cast<std::size_t>(std::ceil(std::sqrt(static_cast<double>(n)) / 4)));
    height_ = std::max<std::size_t>(1, (n + width_ - 1) / width_);
    if (width_ > kMostSide) {
      return {Errc::unsupported, target_ + ": " + std::to_string(n) +
                                     " Gaussians are more than one SOG holds; write tiles"};
    }
    meta_ = {{"version", 2}, {"asset", {{"generator", "gsnav"}}}, {"count", n}};
    meta_["antialias"] = cloud_.filter == Filter::mip;
    // Begin with the part that takes longest. One thread makes each part, so the bytes do not depend on
    // the number of threads.
    Status (SogWriter::*const make[])(MetaMember&)
        const = {&SogWriter::bands, &SogWriter::means, &SogWriter::scales, &SogWriter::colours,
                 &SogWriter::quats};
    constexpr std::size_t kParts = std::size(make);
    std::array<MetaMember, kParts> parts;
    ThreadPool pool(static_cast<int>(std::min(detail::io_threads(), kParts)));
    const Status made =
        gsnav::detail::run_guarded(pool, static_cast<std::uint32_t>(kParts),
                                   [&](std::uint32_t k) { return (this->*make[k])(parts[k]); });
    if (made.code() == Errc::out_of_memory) throw std::bad_alloc();
    if (!made) return made;
    Files files;
    constexpr std::size_t kInFile[] = {1, 2, 4, 3, 0};  // the order that readers are used to
    for (const std::size_t k : kInFile) {
      if (!parts[k].meta.is_null()) meta_[parts[k].name] = std::move(parts[k].meta);
      for (auto& file : parts[k].files) files.push_back(std::move(file));
    }
    files.emplace_back("meta.json", meta_.dump());
    return files;
  }

 private:
  /// One member of meta.json and the files that it names.
  struct MetaMember {
    std::string name;
    Json meta;
    Files files;
  };

  RgbaImage plane() const {
    return {width_, height_, std::vector<std::uint8_t>(4 * width_ * height_, 255)};
  }

  /// Adds an image to a part, and its name to the part's metadata.
  Status add(MetaMember& part, const char* stem, const RgbaImage& image) const {
    const std::string name = stem + ending_;
    auto bytes = detail::encode_webp(image, target_ + ": " + name);
    if (!bytes) return bytes.status();
    part.meta["files"].push_back(name);
    part.files.emplace_back(name, std::move(*bytes));
    return {};
  }

  /// sign(v) log(1 + |v|), so that distant values take fewer of the steps.
  static double squeezed(double v) { return std::copysign(std::log1p(std::fabs(v)), v); }

  Status means(MetaMember& part) const {
    double low[3] = {0, 0, 0}, high[3] = {0, 0, 0};
    for (std::size_t i = 0; i < cloud_.size(); ++i) {
      const Vec3d m = cloud_.mean(i);
      for (int k = 0; k < 3; ++k) {
        const double v = squeezed(m[k]);
        low[k] = i == 0 ? v : std::min(low[k], v);
        high[k] = i == 0 ? v : std::max(high[k], v);
      }
    }
    RgbaImage lower = plane(), upper = plane();
    for (std::size_t i = 0; i < cloud_.size(); ++i) {
      const Vec3d m = cloud_.mean(rows_[i]);
      for (int k = 0; k < 3; ++k) {
        const double t = high[k] > low[k] ? (squeezed(m[k]) - low[k]) / (high[k] - low[k]) : 0;
        const std::uint32_t step = detail::nearest_step(t, 16);
        const std::size_t at = 4 * i + static_cast<std::size_t>(k);
        lower.pixels[at] = static_cast<std::uint8_t>(step & 255);
        upper.pixels[at] = static_cast<std::uint8_t>(step >> 8);
      }
    }
    part.name = "means";
    part.meta = {{"mins", low}, {"maxs", high}};
    if (Status s = add(part, "means_l", lower); !s) return s;
    return add(part, "means_u", upper);
  }

  Status scales(MetaMember& part) const {
    const std::size_t n = cloud_.size();
    std::vector<float> logs(3 * n);
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t k = 0; k < 3; ++k) {
        const double log_scale = std::log(static_cast<double>(cloud_.scales[k][rows_[i]]));
        logs[3 * i + k] = static_cast<float>(std::max(log_scale, detail::kSogLeastLogScale));
      }
    }
    const detail::ScalarCodebook book(logs);
    RgbaImage image = plane();
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t k = 0; k < 3; ++k) image.pixels[4 * i + k] = book.index(logs[3 * i + k]);
    }
    part.name = "scales";
    part.meta = {{"codebook", book.entries()}};
    return add(part, "scales", image);
  }

  Status quats(MetaMember& part) const {
    constexpr std::size_t kFirstMode = 252;
    RgbaImage image = plane();
    for (std::size_t i = 0; i < cloud_.size(); ++i) {
      double q[4], others[3];
      for (std::size_t k = 0; k < 4; ++k) q[k] = static_cast<double>(cloud_.quats[k][rows_[i]]);
      const std::size_t largest = detail::smallest_three(q, others);
      for (std::size_t k = 0; k < 3; ++k) {
        image.pixels[4 * i + k] =
            static_cast<std::uint8_t>(detail::nearest_step(others[k] * std::sqrt(0.5) + 0.5, 8));
      }
      image.pixels[4 * i + 3] = static_cast<std::uint8_t>(kFirstMode + largest);
    }
    part.name = "quats";
    return add(part, "quats", image);
  }

  Status colours(MetaMember& part) const {
    const detail::ScalarCodebook book(cloud_.sh0);
    RgbaImage image = plane();
    for (std::size_t i = 0; i < cloud_.size(); ++i) {
      for (std::size_t k = 0; k < 3; ++k)
        image.pixels[4 * i + k] = book.index(cloud_.sh0[3 * rows_[i] + k]);
      image.pixels[4 * i + 3] = static_cast<std::uint8_t>(
          detail::nearest_step(static_cast<double>(cloud_.opacities[rows_[i]]), 8));
    }
    part.name = "sh0";
    part.meta = {{"codebook", book.entries()}};
    return add(part, "sh0", image);
  }

  Status bands(MetaMember& part) const {
    if (cloud_.sh_degree == 0 || cloud_.size() == 0) return {};
    const std::size_t width = detail::rest_width(cloud_);
    const std::size_t most = std::clamp(cloud_.size() / 2, kSmallPalette, kLargestPalette);
    const detail::VectorPalette palette = detail::make_palette(cloud_.shN, width, most);
    const detail::ScalarCodebook book(palette.entries);
    const std::size_t rows = (palette.size + kEntriesPerRow - 1) / kEntriesPerRow;
    RgbaImage centroids{kEntriesPerRow * width / 3, rows, {}};
    centroids.pixels.assign(4 * centroids.width * rows, 255);
    for (std::size_t k = 0; k < palette.entries.size(); ++k) {
      centroids.pixels[k / 3 * 4 + k % 3] = book.index(palette.entries[k]);
    }
    RgbaImage labels = plane();
    for (std::size_t i = 0; i < cloud_.size(); ++i) {
      labels.pixels[4 * i] = static_cast<std::uint8_t>(palette.labels[rows_[i]] & 255);
      labels.pixels[4 * i + 1] = static_cast<std::uint8_t>(palette.labels[rows_[i]] >> 8);
      labels.pixels[4 * i + 2] = 0;
    }
    part.name = "shN";
    part.meta = {{"count", palette.size}, {"bands", cloud_.sh_degree}, {"codebook", book.entries()}};
    if (Status s = add(part, "shN_centroids", centroids); !s) return s;
    return add(part, "shN_labels", labels);
  }

  const GaussianCloud& cloud_;
  const std::string& target_;
  std::string ending_;
  std::vector<std::uint32_t> rows_;  ///< rows of the cloud, in the file's order
  std::size_t width_ = 0, height_ = 0;
  Json meta_;
};

/// Whether a file name is that of a SOG's image: "means_l.webp", "means_l.3.webp".
bool is_sog_image(const std::string& name) {
  return std::any_of(std::begin(kStems), std::end(kStems), [&](const std::string stem) {
    if (!name.starts_with(stem) || !name.ends_with(".webp") || name.size() < stem.size() + 5)
      return false;
    const std::string number = name.substr(stem.size(), name.size() - stem.size() - 5);
    return number.empty() || (number.size() > 1 && number[0] == '.' &&
                              number.find_first_not_of("0123456789", 1) == std::string::npos);
  });
}

/// Names in a folder that are those of a SOG's images, whether files or not.
std::vector<std::string> sog_images_in(const std::filesystem::path& folder) {
  std::vector<std::string> names;
  std::error_code error;
  for (std::filesystem::directory_iterator it(folder, error), end; !error && it != end;
       it.increment(error)) {
    const std::string name = it->path().filename().string();
    if (is_sog_image(name)) names.push_back(name);
  }
  return names;
}

/// An ending that no image in the folder has. The scene in the folder then stays complete until
/// meta.json names the new images.
std::string free_ending(const std::vector<std::string>& images) {
  std::string ending = ".webp";
  for (int n = 1;; ++n) {
    if (std::none_of(images.begin(), images.end(), [&](const std::string& name) {
          return name.substr(std::min(name.find('.'), name.size())) == ending;
        })) {
      return ending;
    }
    ending = "." + std::to_string(n) + ".webp";
  }
}

/// Writes the images, then meta.json, which makes them the folder's scene, then removes the images of
/// the previous scene.
Status write_folder(const std::filesystem::path& folder, const Files& files,
                    const std::vector<std::string>& before) {
  std::error_code ignored;
  Status status;
  for (const auto& [name, content] : files) {
    status = replace_file(folder / name, content);
    if (!status) break;
  }
  for (const std::string& name : before) {
    if (status && std::filesystem::is_regular_file(folder / name, ignored))
      std::filesystem::remove(folder / name, ignored);
  }
  for (const auto& [name, content] : files) {
    if (!status && name != "meta.json") std::filesystem::remove(folder / name, ignored);
  }
  return status;
}

}  // namespace

Status save_sog(const std::filesystem::path& path, const GaussianCloud& cloud) {
  const std::string target = path.string();
  return detail::guarded(target, [&]() -> Status {
    const bool bundle = path.extension() == ".sog";
    if (!bundle && path.filename() != "meta.json") {
      return {Errc::invalid_argument, target + ": a SOG is a file *.sog or a folder's meta.json"};
    }
    if (Status s = check_output_path(path); !s) return s;
    if (!bundle) {
      const std::filesystem::path folder = path.parent_path().empty() ? "." : path.parent_path();
      const std::vector<std::string> before = sog_images_in(folder);
      const auto files = SogWriter(cloud, target, free_ending(before)).run();
      return files ? write_folder(folder, *files, before) : files.status();
    }
    const auto files = SogWriter(cloud, target).run();
    if (!files) return files.status();
    detail::ZipWriter zip(target);
    for (const auto& [name, content] : *files) {
      if (Status s = zip.add(name, content, false); !s) return s;  // WebP is compressed already
    }
    return replace_file(path, zip.entries() + zip.finish());
  });
}

}  // namespace gsnav::io
