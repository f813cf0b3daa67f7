// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "gsnav/core/status.hpp"
#include "gsnav/detail/io/npz_file.hpp"
#include "gsnav/math/mat.hpp"

namespace gsnav::io::detail {

/// A shape as text: "[2, 3]".
std::string shape_text(const std::vector<std::size_t>& shape);

/// Reads arrays of known shapes and checks that all values are finite.
class NpzArrays {
 public:
  static constexpr std::size_t kAny = static_cast<std::size_t>(-1);

  explicit NpzArrays(const NpzFile& file) : file_(file) {}

  const NpzFile& file() const noexcept { return file_; }

  /// Reads an array. `shape` may contain kAny; an empty shape allows every shape. Dimensions of 1 at the
  /// beginning and end of the shape are ignored. Errors name the file, the array and the value.
  Result<NpyArray> read(const std::string& name, const std::vector<std::size_t>& shape) const;

  /// Reads a single number.
  Result<double> number(const std::string& name) const;

 private:
  const NpzFile& file_;
};

/// Reads rigid transforms from an array of shape [J,4,4], [1,J,4,4] or [J,16], row-major. Error:
/// invalid_file naming the joint whose matrix is not rigid (within 1e-3).
Result<std::vector<Affine3<double>>> read_transforms(const NpzArrays& arrays, const std::string& name);

inline constexpr double kRigidTolerance = 1e-3;

/// Whether a map is a rotation and a finite translation (within kRigidTolerance).
bool is_rigid(const Affine3<double>& m);

/// Converts 16 row-major numbers to a rigid transform. Returns false if it is not rigid (within
/// kRigidTolerance).
bool rigid_transform(const double* m, Affine3<double>& out);

}  // namespace gsnav::io::detail
