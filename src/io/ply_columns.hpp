// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "gsnav/core/status.hpp"
#include "ply_header.hpp"

namespace gsnav::io::detail {

inline constexpr std::size_t kPlyFixed = 14;  // x y z, f_dc 3, opacity, scale 3, rot 4

/// The vertex properties that are read, in the order of a block's columns: kPlyFixed, then `rest` of
/// f_rest, then time, time scale and motion if there are any.
struct PlyColumns {
  std::vector<const PlyProperty*> properties;
  int degree = 0;
  std::size_t rest = 0;          ///< Number of f_rest columns read: 3 ((degree + 1)^2 - 1).
  std::size_t rest_in_file = 0;  ///< Number of f_rest properties in the file.
  /// If the file has red, green, blue and no f_dc: the value that stands for a full colour. Otherwise 0.
  double greatest_colour = 0;
  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);
  std::size_t time = kNone, time_scale = kNone;  ///< Columns of t and t_scale.
  std::size_t motion = kNone,
              motion_count = 0;  ///< First column of motion_0 ..., and the number of such columns.

  bool moves() const noexcept { return time != kNone || time_scale != kNone || motion_count != 0; }
};

/// Chooses the columns. Error: invalid_file naming a property that is missing, or a wrong number of
/// f_rest_* or motion_*.
Result<PlyColumns> choose_ply_columns(const PlyElement& vertex, const std::string& source);

/// Adds the columns of 4D Gaussians (t, t_scale, motion_*) that exist.
Status choose_temporal_columns(const PlyElement& vertex, const std::string& source, PlyColumns& columns);

}  // namespace gsnav::io::detail
