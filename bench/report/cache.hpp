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

/// Adds all that an image depends on in a camera.
void hash_camera(Hasher& hasher, const gsnav::Camera& camera);

/// An image by which others are judged. Float: rounding a float64 colour moves it by 3e-8 at most, far
/// below what is measured with it (a PSNR of 150 dB).
struct Reference {
  int width = 0, height = 0;
  std::vector<float> rgb;                     ///< [H][W][3]
  std::vector<float> alpha;                   ///< [H][W]
  std::vector<float> depth;                   ///< [H][W] median, metres; empty where the oracle has none
  std::vector<std::uint8_t> undecided;        ///< [H][W] colour may differ by rounding alone; or empty
  std::vector<std::uint8_t> undecided_depth;  ///< [H][W] the median may; or empty
  std::uint64_t evaluations = 0;              ///< (pixel, Gaussian) pairs blended; 0: not counted
};

/// References on disk, one file each, named by content hash. A file that is damaged is as good as
/// absent.
class ReferenceCache {
 public:
  /// An empty folder name: nothing is kept. The folder is made when the first entry is stored.
  explicit ReferenceCache(std::filesystem::path folder) : folder_(std::move(folder)) {}

  /// The entry, or nothing. `warning` says why where a file is there and cannot be used.
  std::optional<Reference> load(const std::string& hash, std::string& warning) const;
  /// Stores by way of a temporary file, so that an entry is whole or absent. Errors: file_not_found.
  gsnav::Status store(const std::string& hash, const Reference& reference) const;

  std::filesystem::path file(const std::string& hash) const { return folder_ / (hash + ".gsnavref"); }

 private:
  std::filesystem::path folder_;
};

}  // namespace gsnav_report
