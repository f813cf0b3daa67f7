// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "gsnav/detail/io/npz_file.hpp"

namespace gsnav_test {

/// One array of a file to be written.
struct TestArray {
  std::vector<std::size_t> shape;
  std::vector<double> values;
  bool is_float = true;
};

using TestArrays = std::map<std::string, TestArray>;

inline void write_npz(const std::filesystem::path& path, const TestArrays& arrays) {
  std::vector<std::vector<float>> floats;
  floats.reserve(arrays.size());
  std::vector<gsnav::io::NpzEntry> entries;
  for (const auto& [name, a] : arrays) {
    if (a.is_float) {
      floats.emplace_back(a.values.begin(), a.values.end());
      entries.push_back({name, a.shape, floats.back()});
    } else {
      entries.push_back({name, a.shape, a.values});
    }
  }
  gsnav::io::save_npz(path, entries).throw_if_error();
}

/// `count` 4x4 identities with the translations (x, y, z) added.
inline TestArray identities(std::size_t count, double x = 0, double y = 0, double z = 0) {
  TestArray a{{count, 4, 4}, {}};
  for (std::size_t j = 0; j < count; ++j) {
    for (const double v : {1.0, 0.0, 0.0, x, 0.0, 1.0, 0.0, y, 0.0, 0.0, 1.0, z, 0.0, 0.0, 0.0, 1.0})
      a.values.push_back(v);
  }
  return a;
}

/// A canonical avatar of n Gaussians on a line whose Gaussian i hangs on joint i % joints alone.
inline TestArrays avatar_arrays(std::size_t n, std::size_t joints, std::size_t coefficients = 1) {
  TestArrays out;
  TestArray means{{n, 3}, {}}, scales{{n, 3}, {}}, quats{{n, 4}, {}}, opacities{{n, 1}, {}},
      weights{{n, joints}, {}}, shs{{n, coefficients, 3}, {}};
  for (std::size_t i = 0; i < n; ++i) {
    const auto x = static_cast<double>(i);
    means.values.insert(means.values.end(), {0.125 * x, 1.0, -0.5 * x});
    scales.values.insert(scales.values.end(), {0.01, 0.02 + 0.001 * x, 0.0});
    quats.values.insert(quats.values.end(), {2.0, 0.0, 0.0, 0.5 * x});
    opacities.values.push_back(i == 0 ? 1.0 : 0.5);
    for (std::size_t j = 0; j < joints; ++j) weights.values.push_back(j == i % joints ? 1.0 : 0.0);
    for (std::size_t k = 0; k < 3 * coefficients; ++k)
      shs.values.push_back(-0.25 * static_cast<double>(k) + 0.0625 * x);
  }
  shs.values[0] = -1.5;  // so that it cannot be RGB
  out["means"] = means;
  out["scales"] = scales;
  out["quats"] = quats;
  out["opacities"] = opacities;
  out["lbs_weights"] = weights;
  out["shs"] = shs;
  out["joints_inv_bind_matrix"] = identities(joints);
  return out;
}

}  // namespace gsnav_test
