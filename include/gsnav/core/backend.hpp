// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <concepts>
#include <cstddef>

#include "gsnav/config.hpp"
#include "gsnav/core/status.hpp"

namespace gsnav {

/// Memory that the host reads and writes directly; arrays of the caller are used without a copy.
struct HostSpace {};

/// Which side each end of a copy lies on.
enum class CopyKind { host_to_host, host_to_device, device_to_host, device_to_device };

namespace detail {
struct NoopFunctor {
  GSNAV_HD void operator()(std::size_t) const noexcept {}
};
}  // namespace detail

/// What it takes to run gsnav: six members and a memory space. A backend object is a queue: work is
/// done in the order it was given, and results are there after `synchronize()`.
///
///     using memory_space = HostSpace;                     // or a tag of its own
///     void* allocate(std::size_t bytes, std::size_t align);   // nullptr where there is none
///     void  deallocate(void* p, std::size_t bytes) noexcept;
///     void  copy(void* dst, const void* src, std::size_t bytes, CopyKind kind);
///     void  fill(void* p, unsigned char byte, std::size_t bytes);
///     template <class F> void parallel_for(std::size_t n, const F& f);   // f(i) for i in [0, n)
///     Status synchronize();
///
/// Optional members, each with a generic fallback:
///
/// - `run(stage, args...)`: a stage by code of its own. core/stages.hpp is the table of stages.
/// - `sort_pairs(keys, values, keys_alt, values_alt, n, bits)`: a stable sort by the lowest `bits` of
///   the key. Returns whether the result is in the _alt arrays.
/// - `concurrency() -> std::size_t`: how many pieces to cut work into; 1 by default.
/// - `one_thread() -> B`: a backend of the same kind for the calling thread alone. Batches of cameras
///   are then cut by frames (detail/render/thread_frames.hpp).
/// - `static constexpr bool bins_in_lanes`: binning reads BinArgs::spans, which projection then fills.
/// - `batch_renderer`: a type that draws many cameras by one call (detail/sim/frame_batch.hpp).
/// - `static allocate_host(bytes) -> void*` and `deallocate_host(p)`: host memory that it copies to
///   and from without waiting (detail/core/host_array.hpp); nullptr where there is none.
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

/// True where the host may touch the backend's memory.
template <class B>
inline constexpr bool is_host_backend = std::is_same_v<typename B::memory_space, HostSpace>;

/// How many pieces a backend wants work cut into.
template <Backend B>
std::size_t concurrency_of(const B& b) noexcept {
  if constexpr (requires { b.concurrency(); }) {
    return b.concurrency();
  } else {
    return 1;
  }
}

}  // namespace gsnav
