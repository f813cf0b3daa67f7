// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gsnav/detail/io/ply.hpp"
#include "ply_file.hpp"

namespace gsnav_test {

/// f_rest_* properties of a degree.
inline int rest_of(int degree) { return 3 * ((degree + 1) * (degree + 1) - 1); }

/// What rows with so many f_rest_* properties are once loaded.
inline gsnav::GaussianCloud cloud_of(const std::vector<PlyRow>& rows, int rest) {
  PlyFile file;
  file.properties = inria_properties(rest, "double");
  file.rows = rows;
  return gsnav::io::parse_ply(bytes_of(file.text()), "rows").value().cloud;
}

inline gsnav::GaussianCloud cloud_of_random_rows(std::size_t n, int degree, unsigned seed) {
  return cloud_of(random_rows(n, rest_of(degree), seed), rest_of(degree));
}

}  // namespace gsnav_test
