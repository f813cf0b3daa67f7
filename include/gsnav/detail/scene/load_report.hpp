// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "gsnav/frame/gaussians.hpp"
#include "gsnav/frame/rules.hpp"
#include "gsnav/math/aabb.hpp"

namespace gsnav {

/// Result of reading a row: kept, or dropped because a value is not finite, its quaternion is zero or it
/// is transparent.
enum class RowFate : std::uint8_t { kept, non_finite, zero_quat, transparent };

/// What packing changed: the largest error of any row.
struct PackErrors {
  int mean_bits = 16;          ///< Bits of a mean's coordinate: 16, or 32 (float).
  int sh_bits = 8;             ///< Bits of an SH coefficient: 8, 16 or 32.
  double mean = 0;             ///< Movement of a mean, metres.
  double mean_deviations = 0;  ///< Movement of a mean, in its Gaussian's largest standard deviations.
  double scale = 0;            ///< Change of a standard deviation, relative to the Gaussian's largest.
  double rotation = 0;         ///< Rotation, radians.
  double opacity = 0;          ///< Change of an opacity.
  double sh0 = 0;              ///< Change of a coefficient of degree 0.
  double sh = 0, sh_rms = 0;   ///< Change of a coefficient of bands 1 to 3: largest, and root mean
                               ///< square.
};

/// The report of a loader on a file. Every repaired or dropped row is counted here.
struct LoadReport {
  std::string source;                     ///< Path or description.
  std::uint64_t read = 0;                 ///< Rows in the file.
  std::uint64_t kept = 0;                 ///< Gaussians in the cloud.
  std::uint64_t dropped_non_finite = 0;   ///< Rows with a position or SH coefficient that is not finite,
                                          ///< or a NaN scale or opacity.
  std::uint64_t dropped_zero_quat = 0;    ///< Rows whose quaternion is zero or not finite.
  std::uint64_t dropped_transparent = 0;  ///< Rows with opacity below 1/255, which are never drawn.
                                          ///< Dropping them changes no image.
  std::uint64_t clamped_scales = 0;       ///< Gaussians with a log-scale outside [-20, 20].
  int sh_degree = 0;                      ///< SH degree of the file. The cloud has a lower one if
                                          ///< sh_bytes_let_go is not 0.
  std::uint64_t sh_bytes_let_go = 0;      ///< Bytes saved by dropping bands that are zero everywhere
                                          ///< (LoadSceneOptions::keep_zero_bands).
  int sh_degree_used = 0;                 ///< Highest band with a non-zero coefficient.
  Filter filter = Filter::classic;        ///< Filter that the file asks for.
  float eps2d = 0.3f;                     ///< Term that the filter adds to the diagonal of the 2D
                                          ///< covariance, px^2.
  SortOrder sort_order = SortOrder::z_depth;  ///< Sort order that the file asks for.
  std::uint64_t memory = 0;                   ///< Bytes of the cloud's arrays.
  Vec3d up{};            ///< Guessed up axis in the asset's frame, one of +-y and +-z; zero for an
                         ///< empty cloud.
  bool up_seen = false;  ///< Whether the cloud's ground decided `up` (guess_up). false: it is the usual
                         ///< axis of the format.
  double up_confidence = 0;     ///< Confidence if up_seen, 0 to 1.
  double sh_storage_error = 0;  ///< Largest change of an SH coefficient by binary16 storage.
  bool compact = false;         ///< Whether SH is stored as binary16.
  bool packed = false;          ///< Whether the cloud is packed (PackedCloud); `packing` has the errors.
  PackErrors packing;           ///< Errors of packing.
  bool moving = false;  ///< Whether the file has 4D Gaussians. first_time and last_time are then the
                        ///< least and the greatest of their own times, seconds.
  double first_time = 0, last_time = 0;  ///< Range of time of a moving scene, seconds.
  Aabb<double> bounds{};                 ///< Box of the kept means, asset frame.
  std::vector<std::string> warnings;     ///< One line for each other oddity of the file.

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

  /// Adds the counts and the bounds of another part of the same scene.
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

  /// Number of rows that were dropped.
  std::uint64_t dropped() const noexcept {
    return dropped_non_finite + dropped_zero_quat + dropped_transparent;
  }
};

}  // namespace gsnav
