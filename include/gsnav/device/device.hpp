// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "gsnav/core/status.hpp"

namespace gsnav {

enum class DeviceKind : std::uint8_t {
  serial,  ///< one thread, portable code: the reference
  cpu,     ///< threads and SIMD lanes (OpenMPBackend)
  cuda,    ///< an NVIDIA GPU (CudaBackend)
};

/// What a renderer or a simulator computes on. A value: it names hardware and holds none of it. Each
/// object that is made on it has threads, or a stream, of its own.
class Device {
 public:
  /// The portable device.
  Device() = default;

  /// By name:
  ///
  ///     "best"              the first GPU, or else "cpu", or else "serial"
  ///     "cpu", "cpu:4"      all threads (OMP_NUM_THREADS is respected), or four
  ///     "cuda", "cuda:1"    the first GPU, or the second
  ///     "serial"            one thread, portable code
  ///
  /// Errors: invalid_argument where the text is none of these, and unsupported where this build or this
  /// machine has no such device. Both list the devices that there are.
  static Result<Device> parse(std::string_view text);

  /// Names of the devices of this build on this machine, slowest kind first, as parse takes them:
  /// "serial", "cpu", "cuda:0".
  static std::vector<std::string> available();

  DeviceKind kind() const noexcept { return kind_; }
  /// Of the CPU; 0: as many as OpenMP takes.
  int threads() const noexcept { return threads_; }
  /// Number of the GPU.
  int index() const noexcept { return index_; }

  /// As parse takes it: "serial", "cpu", "cpu:4", "cuda:0".
  std::string name() const;
  /// For people: "CPU, 4 threads, AVX2" or "NVIDIA H100 80GB HBM3 (cuda:0)". The instruction set is the
  /// one in use; on a processor without FMA the text says how much slower frames are.
  std::string description() const;

  bool operator==(const Device&) const = default;

 private:
  Device(DeviceKind kind, int threads, int index) : kind_(kind), threads_(threads), index_(index) {}

  DeviceKind kind_ = DeviceKind::serial;
  int threads_ = 0;
  int index_ = 0;
};

}  // namespace gsnav
