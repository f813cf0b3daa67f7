// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <random>
#include <string>
#include <vector>

#include "avatar_npz.hpp"
#include "ply_file.hpp"

namespace gsnav_test {

/// A PLY of n random 4D Gaussians of SH degree 1 with `motion` (0, 3, 6, 9) numbers of motion each.
inline PlyFile temporal_file(std::size_t n, std::size_t motion, unsigned seed) {
  PlyFile file;
  file.properties = inria_properties(9);
  file.properties.emplace_back("t", "float");
  file.properties.emplace_back("t_scale", "float");
  for (std::size_t k = 0; k < motion; ++k)
    file.properties.emplace_back("motion_" + std::to_string(k), "float");
  file.rows = random_rows(n, 9, seed);
  std::mt19937 generator(seed + 1);
  std::normal_distribution<double> normal;
  const auto draw = [&](double scale) {
    return static_cast<double>(static_cast<float>(scale * normal(generator)));
  };
  for (PlyRow& row : file.rows) {
    row["t"] = draw(1);
    row["t_scale"] = draw(1);
    for (std::size_t k = 0; k < motion; ++k) row["motion_" + std::to_string(k)] = draw(0.5);
  }
  return file;
}

/// The same rows as a network's arrays, whose names begin with `prefix`.
inline TestArrays temporal_arrays(const std::vector<PlyRow>& rows, std::size_t motion,
                                  const std::string& prefix) {
  const auto array = [&](const std::vector<std::string>& names) {
    TestArray a{{rows.size(), names.size()}, {}};
    for (const PlyRow& row : rows) {
      for (const std::string& name : names) a.values.push_back(row.at(name));
    }
    return a;
  };
  TestArrays out;
  out[prefix + "_xyz"] = array({"x", "y", "z"});
  out[prefix + "_opacity"] = array({"opacity"});
  out[prefix + "_scaling"] = array({"scale_0", "scale_1", "scale_2"});
  out[prefix + "_rotation_l"] = array({"rot_0", "rot_1", "rot_2", "rot_3"});
  out[prefix + "_features_dc"] = array({"f_dc_0", "f_dc_1", "f_dc_2"});
  out[prefix + "_features_dc"].shape = {rows.size(), 1, 3};
  std::vector<std::string> rest;  // colour inner here, channel-major in a PLY
  for (int k = 0; k < 3; ++k) {
    for (int channel = 0; channel < 3; ++channel)
      rest.push_back("f_rest_" + std::to_string(3 * channel + k));
  }
  out[prefix + "_features_rest"] = array(rest);
  out[prefix + "_features_rest"].shape = {rows.size(), 3, 3};
  out[prefix + "_t"] = array({"t"});
  out[prefix + "_scaling_t"] = array({"t_scale"});
  std::vector<std::string> moves;
  for (std::size_t k = 0; k < motion; ++k) moves.push_back("motion_" + std::to_string(k));
  if (motion != 0) out[prefix + "_motion"] = array(moves);
  return out;
}

}  // namespace gsnav_test
