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
  Samples() = default;
  Samples(std::span<const float> v) noexcept : floats_(v.data()), size_(v.size()) {}
  Samples(std::span<const double> v) noexcept : doubles_(v.data()), size_(v.size()) {}
  Samples(const std::vector<float>& v) noexcept : Samples(std::span<const float>(v)) {}
  Samples(const std::vector<double>& v) noexcept : Samples(std::span<const double>(v)) {}

  std::size_t size() const noexcept { return size_; }
  double operator[](std::size_t i) const noexcept {
    return doubles_ != nullptr ? doubles_[i] : static_cast<double>(floats_[i]);
  }

 private:
  const float* floats_ = nullptr;
  const double* doubles_ = nullptr;
  std::size_t size_ = 0;
};

}  // namespace gsnav::eval
