// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

#include "casters.hpp"
#include "gsnav/sim/config.hpp"

namespace gsnav::python {

/// Streams of other libraries that may be reading a simulator's images.
class Consumers {
 public:
  explicit Consumers(int device) : device_(device) {}
  /// Notes a stream, numbered as in `__dlpack__`.
  void note(std::intptr_t stream);
  /// Waits until all work on the noted streams is done, and forgets them. Holds no GIL.
  void wait();

 private:
  int device_;
  std::mutex mutex_;
  std::vector<std::intptr_t> streams_;
};

/// Images in the memory of a GPU as a dict of DeviceArray by sensor. The arrays keep `owner` alive,
/// and `owner` keeps the memory.
nb::dict device_images(std::span<const BatchObservation> images, const Device& device,
                       const std::shared_ptr<Consumers>& consumers, nb::handle owner);

/// Copies an array of integers on a GPU to the host, after the work that its library has submitted.
/// @return a numpy array, or a null object if `source` is not on a GPU.
nb::object array_from_device(nb::handle source);

}  // namespace gsnav::python
