// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <dlpack/dlpack.h>

#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>

#include "gsnav/core/backend.hpp"
#include "gsnav/core/status.hpp"
#include "gsnav/core/view.hpp"

// Exchanges arrays with machine-learning frameworks (PyTorch, JAX, CuPy, TensorFlow) through DLPack,
// without copies. A DLPack tensor carries no stream. If the framework works on another stream than the
// backend, call `backend.hand_over_to(framework_stream)` after the work that fills a tensor. Make the
// framework's stream wait the same way before the memory is written again.

namespace gsnav::interop {

/// DLPack device of a backend's memory: the GPU with its index, or the CPU.
template <Backend B>
DLDevice dlpack_device([[maybe_unused]] const B& backend) noexcept {
  if constexpr (requires {
                  { backend.device() } -> std::convertible_to<int>;
                }) {
    return {kDLCUDA, backend.device()};
  } else {
    static_assert(is_host_backend<B>, "a backend with memory of its own must have device()");
    return {kDLCPU, 0};
  }
}

/// DLPack type of T: an integer or floating-point type of 8 to 64 bits.
template <class T>
constexpr DLDataType dlpack_type() noexcept {
  static_assert(std::is_arithmetic_v<T> && !std::is_same_v<T, bool> && !std::is_same_v<T, long double>);
  const auto code = std::is_floating_point_v<T> ? kDLFloat : std::is_signed_v<T> ? kDLInt : kDLUInt;
  return {static_cast<std::uint8_t>(code), static_cast<std::uint8_t>(8 * sizeof(T)), 1};
}

/// Wraps `data` in a compact, row-major tensor. The consumer must call its deleter once, which releases
/// `owner`.
///
/// @code
/// std::shared_ptr<Frames> frames = ...;
/// DLManagedTensor* t = to_dlpack(frames->rgb.data(), {n, h, w, 3}, dlpack_device(backend), frames);
/// @endcode
///
/// @param data first element; may be null if a size is 0
/// @param owner keeps the memory alive. If null, the caller must keep it alive as long as the tensor.
template <class T, std::size_t N>
DLManagedTensor* to_dlpack(T* data, const std::int64_t (&shape)[N], DLDevice device,
                           std::shared_ptr<const void> owner) {
  struct Holder {
    DLManagedTensor tensor{};
    std::array<std::int64_t, N> shape, strides;
    std::shared_ptr<const void> owner;
  };
  auto holder = std::make_unique<Holder>();
  std::int64_t stride = 1;
  for (std::size_t i = N; i-- > 0;) {
    holder->shape[i] = shape[i];
    holder->strides[i] = stride;
    stride *= shape[i];
  }
  holder->owner = std::move(owner);
  DLManagedTensor& t = holder->tensor;
  t.dl_tensor.data = const_cast<std::remove_const_t<T>*>(data);
  t.dl_tensor.device = device;
  t.dl_tensor.ndim = static_cast<int>(N);
  t.dl_tensor.dtype = dlpack_type<std::remove_const_t<T>>();
  t.dl_tensor.shape = holder->shape.data();
  t.dl_tensor.strides = holder->strides.data();
  t.manager_ctx = holder.get();
  t.deleter = [](DLManagedTensor* self) { delete static_cast<Holder*>(self->manager_ctx); };
  return &holder.release()->tensor;
}

/// View of a tensor that another library owns, for instance to render into it. The tensor must outlive
/// the view.
/// @return invalid_argument naming the field. The tensor must have type T, memory on `device`, aligned
///   data that is not null, and compact, row-major elements.
template <class T>
Result<View<T>> from_dlpack(const DLTensor& tensor, DLDevice device) {
  const BadArgument bad{"DLTensor."};
  const DLDataType want = dlpack_type<std::remove_const_t<T>>();
  if (tensor.dtype.code != want.code || tensor.dtype.bits != want.bits ||
      tensor.dtype.lanes != want.lanes) {
    return bad("dtype has code " + std::to_string(tensor.dtype.code) + ", " +
               std::to_string(tensor.dtype.bits) + " bits and " + std::to_string(tensor.dtype.lanes) +
               " lanes; needed are " + std::to_string(want.code) + ", " + std::to_string(want.bits) +
               " and 1");
  }
  if (tensor.device.device_type != device.device_type || tensor.device.device_id != device.device_id) {
    return bad("device is type " + std::to_string(tensor.device.device_type) + " number " +
               std::to_string(tensor.device.device_id) + "; needed is type " +
               std::to_string(device.device_type) + " number " + std::to_string(device.device_id) +
               " (1: CPU, 2: CUDA)");
  }
  if (tensor.ndim < 0 || (tensor.ndim > 0 && tensor.shape == nullptr)) return bad("shape is missing");
  std::uint64_t count = 1;
  for (int i = tensor.ndim; i-- > 0;) {
    const std::int64_t n = tensor.shape[i];
    if (n < 0) return bad("shape[" + std::to_string(i) + "] is " + std::to_string(n));
    if (tensor.strides != nullptr && n > 1 && static_cast<std::uint64_t>(tensor.strides[i]) != count) {
      return bad("strides[" + std::to_string(i) + "] is " + std::to_string(tensor.strides[i]) +
                 "; elements must be compact and row-major (make the tensor contiguous)");
    }
    if (n != 0 && count > (std::uint64_t{1} << 62) / static_cast<std::uint64_t>(n))
      return bad("shape is too large");
    count *= static_cast<std::uint64_t>(n);
  }
  auto* const data = static_cast<char*>(tensor.data) + (tensor.data == nullptr ? 0 : tensor.byte_offset);
  if (count > 0 && tensor.data == nullptr) return bad("data is null");
  if (reinterpret_cast<std::uintptr_t>(data) % alignof(T) != 0)
    return bad("data is not aligned to its type");
  return View<T>{reinterpret_cast<T*>(data), static_cast<std::size_t>(count)};
}

}  // namespace gsnav::interop
