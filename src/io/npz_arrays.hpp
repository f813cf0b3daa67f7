// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "gsnav/core/status.hpp"
#include "gsnav/detail/io/npz_file.hpp"
#include "gsnav/math/mat.hpp"

namespace gsnav::io::detail {

/// "[2, 3]".
std::string shape_text(const std::vector<std::size_t>& shape);

/// Reads arrays whose shapes are known, all values finite.
class NpzArrays {
 public:
  static constexpr std::size_t kAny = static_cast<std::size_t>(-1);

  explicit NpzArrays(const NpzFile& file) : file_(file) {}

  const NpzFile& file() const noexcept { return file_; }

  /// `shape` may hold kAny; an empty one admits every shape. Dimensions of 1 at the front and the end of
  /// the file's shape may be more or fewer. Errors name the file, the array and the value.
  Result<NpyArray> read(const std::string& name, const std::vector<std::size_t>& shape) const;

  /// A single number.
  Result<double> number(const std::string& name) const;

 private:
  const NpzFile& file_;
};

/// Rigid transforms from [J,4,4], [1,J,4,4] or [J,16], row-major; `name` is the array's.
/// Errors: invalid_file naming the joint whose matrix is not rigid (1e-3).
Result<std::vector<Affine3<double>>> read_transforms(const NpzArrays& arrays, const std::string& name);

inline constexpr double kRigidTolerance = 1e-3;

/// Whether a map is a rotation and a finite translation (kRigidTolerance).
bool is_rigid(const Affine3<double>& m);

/// The rigid transform in 16 row-major numbers, or false (kRigidTolerance).
bool rigid_transform(const double* m, Affine3<double>& out);

}  // namespace gsnav::io::detail
