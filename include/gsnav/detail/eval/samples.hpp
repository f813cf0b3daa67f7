// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "gsnav/config.hpp"

namespace gsnav::eval {

/// Values of an image in either precision, read as double. Owns nothing: what it was made from must
/// outlive it. Images are row-major from the top-left pixel, channels inner.
class Samples {
 public:
  Samples() = default;
  /// Views floats or doubles, which must outlive this.
  Samples(std::span<const float> v) noexcept : floats_(v.data()), size_(v.size()) {}
  Samples(std::span<const double> v) noexcept : doubles_(v.data()), size_(v.size()) {}
  Samples(const std::vector<float>& v) noexcept : Samples(std::span<const float>(v)) {}
  Samples(const std::vector<double>& v) noexcept : Samples(std::span<const double>(v)) {}

  /// Number of samples.
  std::size_t size() const noexcept { return size_; }
  /// Sample i as a double.
  double operator[](std::size_t i) const noexcept {
    return doubles_ != nullptr ? doubles_[i] : static_cast<double>(floats_[i]);
  }

 private:
  const float* floats_ = nullptr;
  const double* doubles_ = nullptr;
  std::size_t size_ = 0;
};

}  // namespace gsnav::eval
