// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "gsnav/config.hpp"

namespace gsnav::eval {

/// Read-only view of image values in float or double, read as double. The data must outlive it. Images
/// are row-major from the top-left pixel, with channels innermost.
class Samples {
 public:
  /// No values.
  Samples() = default;
  /// Values in float.
  Samples(std::span<const float> v) noexcept : floats_(v.data()), size_(v.size()) {}
  /// Values in double.
  Samples(std::span<const double> v) noexcept : doubles_(v.data()), size_(v.size()) {}
  /// Values of a vector of float.
  Samples(const std::vector<float>& v) noexcept : Samples(std::span<const float>(v)) {}
  /// Values of a vector of double.
  Samples(const std::vector<double>& v) noexcept : Samples(std::span<const double>(v)) {}

  /// Number of values.
  std::size_t size() const noexcept { return size_; }
  /// Value i in double. `i` must be less than size().
  double operator[](std::size_t i) const noexcept {
    return doubles_ != nullptr ? doubles_[i] : static_cast<double>(floats_[i]);
  }

 private:
  const float* floats_ = nullptr;
  const double* doubles_ = nullptr;
  std::size_t size_ = 0;
};

}  // namespace gsnav::eval
