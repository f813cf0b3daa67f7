// SPDX-License-Identifier: Apache-2.0
#include "image_source.hpp"

#include <string>
#include <utility>

#include "fields.hpp"

namespace gsnav::python {

ImageSource image_source(std::shared_ptr<PythonImageSource> source, const Device& device,
                         const BatchConfig& config) {
  const bool on_gpu = config.images == ImageMemory::backend && device.kind() == DeviceKind::cuda;
  const int index = on_gpu ? device.index() : 0;
  return [source = std::move(source), on_gpu, index](std::size_t sensor,
                                                     std::size_t floats) -> Result<std::span<float>> {
    const HoldGil gil;
    const std::string call =
        "image_source(" + std::to_string(sensor) + ", " + std::to_string(floats) + ")";
    try {
      const nb::object made = source->function(sensor, floats);
      AnyArray<nb::ndarray<float, nb::c_contig>> array;
      if (!nb::try_cast(made, array, false)) {
        return {Errc::invalid_argument,
                call + " returned " + type_of(made) + ": return a writable, contiguous float32 array"};
      }
      const int kind = on_gpu ? nb::device::cuda::value : nb::device::cpu::value;
      if (array.device_type() != kind || (on_gpu && array.device_id() != index)) {
        return {Errc::invalid_argument,
                call + " returned an array on another device: it must be " +
                    (on_gpu ? "on cuda:" + std::to_string(index) : std::string("in host memory"))};
      }
      // Both: the object, and the memory that it has exported.
      source->given.append(made);
      using Memory = decltype(array);
      source->given.append(
          nb::capsule(new Memory(array), [](void* p) noexcept { delete static_cast<Memory*>(p); }));
      return std::span<float>(array.data(), array.size());
    } catch (nb::python_error& e) {
      source->error.emplace(std::move(e));
      return {Errc::invalid_argument, call + " raised an exception"};
    }
  };
}

}  // namespace gsnav::python
