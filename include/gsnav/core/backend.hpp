// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <concepts>
#include <cstddef>

#include "gsnav/config.hpp"
#include "gsnav/core/status.hpp"

namespace gsnav {

/// Tag of memory that the host reads and writes directly. Arrays of the caller are used without a copy.
struct HostSpace {};

/// Source and destination of a copy: host or device memory.
enum class CopyKind {
  host_to_host,     ///< within host memory
  host_to_device,   ///< from host memory to the backend's memory
  device_to_host,   ///< from the backend's memory to host memory
  device_to_device  ///< within the backend's memory
};

namespace detail {
// Stands for any kernel in the concept Backend.
struct NoopFunctor {
  GSNAV_HD void operator()(std::size_t) const noexcept {}
};
}  // namespace detail

/// Interface of a backend: where kernels run and where their arrays lie. Six members and a memory space
/// are required.
///
/// A backend object is a queue. It runs work in the order of the calls, and results are complete after
/// `synchronize()`.
///
/// @code
/// using memory_space = HostSpace;                         // or a tag of its own
/// void* allocate(std::size_t bytes, std::size_t align);   // nullptr when memory is exhausted
/// void  deallocate(void* p, std::size_t bytes) noexcept;
/// void  copy(void* dst, const void* src, std::size_t bytes, CopyKind kind);   // bytes > 0
/// void  fill(void* p, unsigned char byte, std::size_t bytes);
/// template <class F> void parallel_for(std::size_t n, const F& f);   // f(i) for i in [0, n)
/// Status synchronize();
/// @endcode
///
/// Optional members. Without them a generic form is used:
/// - `run(stage, args...)`: runs a stage with the backend's own code. core/stages.hpp is the table of
///   stages.
/// - `sort_pairs(keys, values, keys_alt, values_alt, n, bits)`: sorts stably by the lowest `bits` bits
///   of the keys. Returns true if the result is in the `_alt` arrays.
/// - `concurrency() -> std::size_t`: number of pieces to cut work into. Default: 1.
/// - `one_thread() -> B`: a backend of the same kind that uses only the calling thread. Batches of
///   cameras then run one frame per thread (detail/render/thread_frames.hpp).
/// - `static constexpr bool bins_in_lanes`: true if binning reads BinArgs::entries and spans. The
///   projection then fills ProjectOutputs::words and spans.
/// - `static constexpr exp2_of(Exp2) -> Exp2`: exponential of blending, where it is not the one that
///   RenderConfig::quality asks for.
/// - `batch_renderer`: a type that draws many cameras in one call, or one
///   (detail/render/frame_batch.hpp).
/// - `host_threads() -> ThreadPool&`: threads for the host's part of the work, such as stepping the
///   worlds of a batch (detail/core/host_threads.hpp). Backends that use host memory need none.
/// - `static allocate_host(bytes) -> void*` and `deallocate_host(p)`: host memory for copies that do not
///   wait (detail/core/host_array.hpp). `allocate_host` returns nullptr if there is none.
template <class B>
concept Backend = requires(B& b, void* p, const void* q, std::size_t n, detail::NoopFunctor f) {
  typename B::memory_space;
  { b.allocate(n, n) } -> std::same_as<void*>;
  b.deallocate(p, n);
  b.copy(p, q, n, CopyKind::host_to_host);
  b.fill(p, static_cast<unsigned char>(0), n);
  b.parallel_for(n, f);
  { b.synchronize() } -> std::same_as<Status>;
};

/// True if the host may read and write the backend's memory.
template <class B>
inline constexpr bool is_host_backend = std::is_same_v<typename B::memory_space, HostSpace>;

/// Number of pieces into which work for this backend should be cut, at least 1.
template <Backend B>
std::size_t concurrency_of(const B& b) noexcept {
  if constexpr (requires { b.concurrency(); }) {
    return b.concurrency();
  } else {
    return 1;
  }
}

}  // namespace gsnav
