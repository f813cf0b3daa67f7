// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "gsnav/detail/frame/projection_camera.hpp"
#include "gsnav/frame/gaussians.hpp"
#include "gsnav/math/aabb.hpp"

namespace gsnav {

/// What becomes of a row of a file.
enum class RowFate : std::uint8_t { kept, non_finite, zero_quat, transparent };

/// What packing a cloud changed: the largest difference of any row's.
struct PackErrors {
  int mean_bits = 16;          ///< 16, or 32: floats
  int sh_bits = 8;             ///< 8, 16 or 32
  double mean = 0;             ///< metres
  double mean_deviations = 0;  ///< the same in the Gaussian's largest standard deviations
  double scale = 0;            ///< of a standard deviation, in the Gaussian's largest
  double rotation = 0;         ///< radians
  double opacity = 0;          ///< Difference of an opacity.
  double sh0 = 0;              ///< of a coefficient of degree 0
  double sh = 0, sh_rms = 0;   ///< of one from band 1 on: largest, root mean square
};

/// What a loader did to a file: nothing is repaired or dropped without being counted here.
struct LoadReport {
  std::string source;                     ///< path or description
  std::uint64_t read = 0;                 ///< rows in the file
  std::uint64_t kept = 0;                 ///< Gaussians in the cloud
  std::uint64_t dropped_non_finite = 0;   ///< NaN or infinite position, scale NaN, opacity NaN, SH
  std::uint64_t dropped_zero_quat = 0;    ///< zero or non-finite quaternion
  std::uint64_t dropped_transparent = 0;  ///< opacity below 1/255: never drawn (lossless)
  std::uint64_t clamped_scales = 0;       ///< log-scale outside [-20, 20]
  int sh_degree = 0;                      ///< of the file; the cloud has room for fewer where:
  std::uint64_t sh_bytes_let_go =
      0;                   ///< what bands of zeros alone would take (LoadSceneOptions::keep_zero_bands)
  int sh_degree_used = 0;  ///< highest band with a coefficient that is not zero
  Filter filter = Filter::classic;            ///< that the file asks for
  float eps2d = 0.3f;                         ///< its term on the 2D covariance's diagonal, px^2
  SortOrder sort_order = SortOrder::z_depth;  ///< Quantity that Gaussians are sorted by.
  std::uint64_t memory = 0;                   ///< bytes of the cloud's arrays
  Vec3d up{};            ///< guessed, asset frame: one of +-y, +-z; zero of an empty cloud
  bool up_seen = false;  ///< by the cloud's ground (guess_up); false: only by what its kind of file does
  double up_confidence = 0;     ///< of a seen one, 0 to 1
  double sh_storage_error = 0;  ///< largest difference of a coefficient by keeping them as binary16
  bool compact = false;         ///< SH is kept as binary16
  bool packed = false;          ///< all is kept in fewer bits (PackedCloud), which changed:
  PackErrors packing;           ///< Errors of packing, where `packed`.
  bool moving = false;  ///< 4D Gaussians; these are the first and the last of their own times, seconds:
  double first_time = 0, last_time = 0;  ///< Range of time of a moving scene, seconds.
  Aabb<double> bounds{};                 ///< of the kept means, asset frame
  std::vector<std::string> warnings;     ///< everything else a person should know

  /// Counts a row that was read.
  void count(RowFate fate, bool clamped) noexcept {
    ++read;
    switch (fate) {
      case RowFate::kept:
        ++kept;
        clamped_scales += clamped ? 1 : 0;
        break;
      case RowFate::non_finite:
        ++dropped_non_finite;
        break;
      case RowFate::zero_quat:
        ++dropped_zero_quat;
        break;
      case RowFate::transparent:
        ++dropped_transparent;
        break;
    }
  }

  /// Adds the counts of another part of the same scene, and its bounds.
  void add_counts(const LoadReport& part) noexcept {
    read += part.read;
    kept += part.kept;
    dropped_non_finite += part.dropped_non_finite;
    dropped_zero_quat += part.dropped_zero_quat;
    dropped_transparent += part.dropped_transparent;
    clamped_scales += part.clamped_scales;
    sh_degree = sh_degree > part.sh_degree ? sh_degree : part.sh_degree;
    bounds.add(part.bounds);
  }

  /// Rows that were left out.
  std::uint64_t dropped() const noexcept {
    return dropped_non_finite + dropped_zero_quat + dropped_transparent;
  }
};

}  // namespace gsnav
