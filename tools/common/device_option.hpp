// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "gsnav/device/device.hpp"

namespace gsnav_tools {

/// The device that `--backend serial|openmp|cuda` and `--threads` name; 0 threads: all. Errors: as of
/// Device::parse.
inline gsnav::Result<gsnav::Device> device_of(const std::string& backend, int threads) {
  if (backend != "openmp") return gsnav::Device::parse(backend);
  return gsnav::Device::parse(threads > 0 ? "cpu:" + std::to_string(threads) : "cpu");
}

}  // namespace gsnav_tools
