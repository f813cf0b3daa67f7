// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include "gsnav/core/status.hpp"
#include "gsnav/image/camera.hpp"
#include "gsnav/render.hpp"
#include "gsnav/scene/prepare.hpp"

namespace gsnav_report {

using gsnav::content_hash;
using gsnav::Hasher;

/// Adds all properties of a camera that an image depends on to a hash.
void hash_camera(Hasher& hasher, const gsnav::Camera& camera);

/// An image by which others are judged. Float is enough: rounding a float64 colour moves it by at most
/// 3e-8, far below any difference that is measured with it (a PSNR of 150 dB).
struct Reference {
  int width = 0, height = 0;
  std::vector<float> rgb;                     ///< [H][W][3]
  std::vector<float> alpha;                   ///< [H][W]
  std::vector<float> depth;                   ///< [H][W] median, metres; empty if the oracle has none
  std::vector<std::uint8_t> undecided;        ///< [H][W] rounding alone may change the colour; or empty
  std::vector<std::uint8_t> undecided_depth;  ///< [H][W] rounding alone may change the median depth; or
                                              ///< empty
  std::uint64_t evaluations = 0;              ///< (pixel, Gaussian) pairs blended; 0: not counted
};

/// References on disk, one file each, named by content hash. A damaged file counts as absent.
class ReferenceCache {
 public:
  /// With an empty folder name the cache stores nothing. The folder is made when the first entry is
  /// stored.
  explicit ReferenceCache(std::filesystem::path folder) : folder_(std::move(folder)) {}

  /// The entry, or nothing. `warning` is set if a file exists but cannot be used, and says why.
  std::optional<Reference> load(const std::string& hash, std::string& warning) const;
  /// Writes a temporary file and renames it, so that an entry is either complete or absent. Errors:
  /// file_not_found.
  gsnav::Status store(const std::string& hash, const Reference& reference) const;

  std::filesystem::path file(const std::string& hash) const { return folder_ / (hash + ".gsnavref"); }

 private:
  std::filesystem::path folder_;
};

}  // namespace gsnav_report
