// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "gsnav/core/status.hpp"

namespace gsnav {

/// Kind of hardware that a program computes on.
enum class DeviceKind : std::uint8_t {
  serial,  ///< one thread of portable code: the reference
  cpu,     ///< all CPU cores and SIMD lanes (OpenMPBackend)
  cuda,    ///< an NVIDIA GPU (CudaBackend)
};

/// Hardware that renderers and simulators run on. A Device is a value that names hardware; it holds no
/// resources. Each object created on it has its own threads or stream.
class Device {
 public:
  /// The serial device.
  Device() = default;

  /// Parses the name of a device:
  ///
  ///     "best"              the first GPU, or else "cpu", or else "serial"
  ///     "cpu", "cpu:4"      all threads (OMP_NUM_THREADS is respected), or four
  ///     "cuda", "cuda:1"    the first GPU, or the second
  ///     "serial"            one thread, portable code
  ///
  /// @return invalid_argument for any other text; unsupported if this build or machine has no such
  ///   device. Both messages list the available devices.
  static Result<Device> parse(std::string_view text);

  /// Names of all devices of this build on this machine in the form that parse accepts, slowest kind
  /// first: "serial", "cpu", "cuda:0".
  static std::vector<std::string> available();

  /// Kind of hardware.
  DeviceKind kind() const noexcept { return kind_; }
  /// Number of CPU threads. 0: OpenMP's default.
  int threads() const noexcept { return threads_; }
  /// Index of the GPU.
  int index() const noexcept { return index_; }

  /// Name in the form that parse accepts: "serial", "cpu", "cpu:4", "cuda:0".
  std::string name() const;
  /// Description for people: "CPU, 4 threads, AVX2" or "NVIDIA H100 80GB HBM3 (cuda:0)". Names the
  /// instruction set in use. On a processor without FMA it says how much slower frames are.
  std::string description() const;

  /// True if both name the same hardware.
  bool operator==(const Device&) const = default;

 private:
  Device(DeviceKind kind, int threads, int index) : kind_(kind), threads_(threads), index_(index) {}

  DeviceKind kind_ = DeviceKind::serial;
  int threads_ = 0;
  int index_ = 0;
};

}  // namespace gsnav
