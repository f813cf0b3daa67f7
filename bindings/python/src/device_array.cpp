// SPDX-License-Identifier: Apache-2.0
#include "device_array.hpp"

#include <algorithm>
#include <cstring>
#include <string>
#include <utility>

#include "bind.hpp"
#include "fields.hpp"
#if defined(GSNAV_PYTHON_CUDA)
#include <cuda_runtime_api.h>
#endif

namespace gsnav::python {
namespace {

/// Images of one sensor in the memory of a GPU. They belong to a simulator.
struct DeviceArray {
  nb::object array;  ///< nanobind's array, which exports the memory.
  std::vector<std::size_t> shape;
  std::uintptr_t data = 0;
  int device = 0;
  std::shared_ptr<Consumers> consumers;
};

#if defined(GSNAV_PYTHON_CUDA)
void check(cudaError_t code, const char* what) {
  if (code == cudaSuccess) return;
  throw Error(Errc::backend_failure, std::string(what) + ": " + cudaGetErrorString(code));
}

/// Makes a GPU current while it lives.
class OnDevice {
 public:
  explicit OnDevice(int device) {
    check(cudaGetDevice(&before_), "cudaGetDevice");
    if (before_ != device) check(cudaSetDevice(device), "cudaSetDevice");
  }
  OnDevice(const OnDevice&) = delete;
  OnDevice& operator=(const OnDevice&) = delete;
  ~OnDevice() { cudaSetDevice(before_); }

 private:
  int before_ = 0;
};
#endif

/// Wraps device memory that `owner` keeps alive.
DeviceArray device_array(const float* data, std::vector<std::size_t> shape, int device,
                         std::shared_ptr<Consumers> consumers, nb::handle owner) {
  using Exported = nb::ndarray<nb::array_api, float, nb::device::cuda>;
  DeviceArray a;
  a.array = nb::cast(Exported(const_cast<float*>(data), shape.size(), shape.data(), owner, nullptr,
                              nb::dtype<float>(), nb::device::cuda::value, device));
  a.shape = std::move(shape);
  a.data = reinterpret_cast<std::uintptr_t>(data);
  a.device = device;
  a.consumers = std::move(consumers);
  return a;
}

/// One row along the first axis.
DeviceArray row_of(const DeviceArray& a, std::size_t row) {
  if (a.shape.size() < 2 || row >= a.shape[0]) {
    throw nb::index_error(("DeviceArray: row " + std::to_string(row) + " of " +
                           std::to_string(a.shape.size() < 2 ? 0 : a.shape[0]))
                              .c_str());
  }
  std::vector<std::size_t> shape(a.shape.begin() + 1, a.shape.end());
  std::size_t size = 1;
  for (const std::size_t n : shape) size *= n;
  return device_array(reinterpret_cast<const float*>(a.data) + row * size, std::move(shape), a.device,
                      a.consumers, a.array);
}

nb::tuple shape_of(const DeviceArray& a) {
  nb::list shape;
  for (const std::size_t n : a.shape) shape.append(n);
  return nb::tuple(shape);
}

nb::object to_capsule(const DeviceArray& a, nb::handle stream, const nb::kwargs& others) {
  // The images are complete when `step` returns, so that the consumer's stream need not wait. The next
  // step waits for the work on this stream.
  const std::intptr_t number = stream.is_none() ? 1 : nb::cast<std::intptr_t>(stream);
  if (number == 0) {
    throw nb::value_error("DeviceArray.__dlpack__: stream 0 is ambiguous; use 1 for the default stream");
  }
  if (number > 0) a.consumers->note(number);
  return a.array.attr("__dlpack__")(**others);
}

nb::dict cuda_interface(const DeviceArray& a) {
  a.consumers->note(1);  // Readers of this interface name no stream.
  nb::dict d;
  d["shape"] = shape_of(a);
  d["typestr"] = "<f4";
  d["data"] = nb::make_tuple(a.data, false);
  d["version"] = 2;
  return d;
}

std::string text(const DeviceArray& a) {
  return "DeviceArray(shape=" + text_of(shape_of(a)) +
         ", dtype=float32, device=cuda:" + std::to_string(a.device) + ")";
}

}  // namespace

void Consumers::note(std::intptr_t stream) {
  const std::lock_guard lock(mutex_);
  if (std::find(streams_.begin(), streams_.end(), stream) == streams_.end()) streams_.push_back(stream);
}

void Consumers::wait() {
  std::vector<std::intptr_t> streams;
  {
    const std::lock_guard lock(mutex_);
    streams.swap(streams_);
  }
#if defined(GSNAV_PYTHON_CUDA)
  if (streams.empty()) return;
  const OnDevice current(device_);
  for (const std::intptr_t s : streams) {
    check(cudaStreamSynchronize(reinterpret_cast<cudaStream_t>(s)), "a stream that was given images");
  }
#endif
}

nb::dict device_images(std::span<const BatchObservation> images, const Device& device,
                       const std::shared_ptr<Consumers>& consumers, nb::handle owner) {
  nb::dict out;
  for (const BatchObservation& o : images) {
    if (o.on_backend == nullptr) continue;
    std::vector<std::size_t> shape{o.environments, static_cast<std::size_t>(o.height),
                                   static_cast<std::size_t>(o.width),
                                   static_cast<std::size_t>(o.channels)};
    DeviceArray a = device_array(o.on_backend, std::move(shape), device.index(), consumers, owner);
    out[nb::str(o.uuid.data(), o.uuid.size())] = nb::cast(std::move(a));
  }
  return out;
}

nb::object array_from_device([[maybe_unused]] nb::handle source) {
#if defined(GSNAV_PYTHON_CUDA)
  if (!nb::hasattr(source, "__dlpack_device__")) return {};
  const nb::object device = source.attr("__dlpack_device__")();
  if (nb::cast<int>(device[0]) != nb::device::cuda::value) return {};
  // Stream 1: the default stream waits for the work that fills the array, and cudaMemcpy runs there.
  const nb::object capsule = source.attr("__dlpack__")(nb::arg("stream") = 1);
  const auto array = nb::cast<nb::ndarray<nb::ro, nb::device::cuda>>(capsule);
  if (array.ndim() != 1 || (array.shape(0) > 1 && array.stride(0) != 1)) {
    throw nb::value_error("actions on a GPU: the array must have one dimension and be contiguous");
  }
  const std::size_t bytes = array.nbytes();
  auto* const data = new std::uint8_t[bytes + 1];
  const nb::capsule owner(data, [](void* p) noexcept { delete[] static_cast<std::uint8_t*>(p); });
  {
    const ReleaseGil release;
    const OnDevice current(array.device_id());
    check(cudaMemcpy(data, array.data(), bytes, cudaMemcpyDeviceToHost), "actions on a GPU");
  }
  const std::size_t shape[1] = {array.shape(0)};
  return nb::cast(nb::ndarray<nb::numpy>(data, 1, shape, owner, nullptr, array.dtype()));
#else
  return {};
#endif
}

void bind_device_array(nb::module_& m) {
  using A = DeviceArray;
  nb::class_<A>(
      m, "DeviceArray",
      "Images of one sensor in the memory of a GPU, float32 [N][H][W][C]. Other libraries share the "
      "memory: torch.from_dlpack(array), jax.dlpack.from_dlpack(array), cupy.from_dlpack(array). It is "
      "valid until the simulator's next call, which waits for all work on the stream that was given "
      "to `__dlpack__`. It keeps the simulator alive.")
      .def_prop_ro("shape", shape_of, nb::sig("def shape(self) -> tuple[int, ...]"), "(N, H, W, C).")
      .def(
          "__dlpack_device__",
          [](const A& a) { return nb::make_tuple(nb::device::cuda::value, a.device); },
          nb::sig("def __dlpack_device__(self) -> tuple[int, int]"), "(2, index of the GPU).")
      .def(
          "__dlpack__", to_capsule, nb::kw_only(), nb::arg("stream") = nb::none(), nb::arg("others"),
          nb::sig("def __dlpack__(self, *, stream: int | None = None, **others: typing.Any) -> object"),
          "The memory as a DLPack capsule. `stream`: the consumer's stream; None is the default stream, "
          "and -1 leaves the order to the caller. `others` are the further arguments of the protocol.")
      .def_prop_ro("__cuda_array_interface__", cuda_interface,
                   nb::sig("def __cuda_array_interface__(self) -> dict[str, typing.Any]"),
                   "The memory for libraries without DLPack. Use the default stream with it.")
      .def("__getitem__", row_of, nb::arg("row"), "One row along the first axis, such as one image.")
      .def("__len__", [](const A& a) { return a.shape[0]; })
      .def("__repr__", text);
  m.def(
      "to_host",
      [](nb::handle array) {
        const nb::object copy = array_from_device(array);
        return copy.is_valid() ? copy : nb::borrow(array);
      },
      nb::arg("array").none(), nb::sig("def to_host(array: object) -> object"),
      "A numpy copy of a one-dimensional array on a GPU. Other objects are returned as they are.");
}

}  // namespace gsnav::python
