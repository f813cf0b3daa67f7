// SPDX-License-Identifier: Apache-2.0
#include "ply_columns.hpp"

#include <algorithm>
#include <array>

#include "gsnav/detail/frame/temporal.hpp"
#include "gsnav/frame/gaussians.hpp"
#include "ply_points.hpp"

namespace gsnav::io::detail {

Result<PlyColumns> choose_ply_columns(const PlyElement& vertex, const std::string& source) {
  static constexpr std::array<const char*, kPlyFixed> kNames = {
      "x",       "y",       "z",       "f_dc_0", "f_dc_1", "f_dc_2", "opacity",
      "scale_0", "scale_1", "scale_2", "rot_0",  "rot_1",  "rot_2",  "rot_3"};
  static constexpr std::array<const char*, 3> kColours = {"red", "green", "blue"};
  PlyColumns c;
  const PlyProperty* red = vertex.find("red");
  if (vertex.find("f_dc_0") == nullptr && red != nullptr) {
    c.greatest_colour = greatest_colour(red->type);
  }
  for (std::size_t k = 0; k < kPlyFixed; ++k) {
    const char* name = c.greatest_colour > 0 && k >= 3 && k < 6 ? kColours[k - 3] : kNames[k];
    const PlyProperty* p = vertex.find(name);
    if (p == nullptr) {
      return {Errc::invalid_file, source + ": element 'vertex' has no property '" + name + "'"};
    }
    c.properties.push_back(p);
  }
  for (const PlyProperty& p : vertex.properties) {
    c.rest_in_file += p.name.starts_with("f_rest_") ? 1 : 0;
  }
  static constexpr std::array<std::size_t, 5> kCounts = {0, 9, 24, 45, 72};
  const auto found = std::find(kCounts.begin(), kCounts.end(), c.rest_in_file);
  if (found == kCounts.end()) {
    return {Errc::invalid_file, source + ": " + std::to_string(c.rest_in_file) +
                                    " properties f_rest_*, must be 0, 9, 24, 45 or 72"};
  }
  c.degree = std::min(kMaxShDegree, static_cast<int>(found - kCounts.begin()));
  c.rest = kCounts[static_cast<std::size_t>(c.degree)];
  // The file is channel-major; in the cloud, the channels of a coefficient are together.
  for (std::size_t k = 0; k < c.rest / 3; ++k) {
    for (std::size_t channel = 0; channel < 3; ++channel) {
      const std::string name = "f_rest_" + std::to_string(channel * (c.rest_in_file / 3) + k);
      const PlyProperty* p = vertex.find(name);
      if (p == nullptr) {
        return {Errc::invalid_file, source + ": element 'vertex' has no property '" + name +
                                        "' among its " + std::to_string(c.rest_in_file) + " f_rest_*"};
      }
      c.properties.push_back(p);
    }
  }
  if (Status s = choose_temporal_columns(vertex, source, c); !s) return s;
  return c;
}

Status choose_temporal_columns(const PlyElement& vertex, const std::string& source, PlyColumns& c) {
  const auto column = [&](const char* name, std::size_t& at) {
    if (const PlyProperty* p = vertex.find(name)) {
      at = c.properties.size();
      c.properties.push_back(p);
    }
  };
  column("t", c.time);
  column("t_scale", c.time_scale);
  for (const PlyProperty& p : vertex.properties) c.motion_count += p.name.starts_with("motion_") ? 1 : 0;
  if (c.motion_count == 0) return {};
  if (c.motion_count % 3 != 0 || c.motion_count > kMotionPlanes) {
    return {Errc::invalid_file, source + ": " + std::to_string(c.motion_count) +
                                    " properties motion_*, must be 0, 3, 6 or 9"};
  }
  c.motion = c.properties.size();
  for (std::size_t k = 0; k < c.motion_count; ++k) {
    const std::string name = "motion_" + std::to_string(k);
    const PlyProperty* p = vertex.find(name);
    if (p == nullptr) {
      return {Errc::invalid_file, source + ": element 'vertex' has no property '" + name +
                                      "' among its " + std::to_string(c.motion_count) + " motion_*"};
    }
    c.properties.push_back(p);
  }
  return {};
}

}  // namespace gsnav::io::detail
