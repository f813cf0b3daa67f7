// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <tuple>
#include <type_traits>
#include <utility>

// Blocks of threads on the host: the environment of device code that a C++ compiler has compiled
// (docs/notes/cuda.md).

struct CUstream_st;

struct dim3 {
  unsigned x = 1, y = 1, z = 1;
  constexpr dim3() = default;
  constexpr dim3(unsigned columns, unsigned rows = 1, unsigned layers = 1)
      : x(columns), y(rows), z(layers) {}
};

namespace gsnav::emulated {

/// Operations of a warp. Each waits until all threads of `mask` have called with the same `what`. Ends
/// the program, with kernel, block and thread, if one of them has ended, does not exist, or is not in
/// its own mask.
void sync_warp(unsigned mask, const char* what);
/// Value of thread `from`. If that thread is not in the mask, a bit pattern that no thread has set.
std::uint64_t value_of_thread(unsigned mask, std::uint64_t value, unsigned from, const char* what);
/// The threads of the mask whose value is not 0, one bit per thread.
unsigned threads_that_have_any(unsigned mask, std::uint64_t value, const char* what);
/// The threads of the mask that have the caller's value.
unsigned threads_that_have_same(unsigned mask, std::uint64_t value, const char* what);

/// Barrier of the block for all threads that have not ended. Returns the sum of their numbers.
int block_barrier(int number);

/// A point where another thread may run.
void interleave();

/// Lets all other threads run as far as they can. A loop that waits for a value from another thread must
/// call it.
void pause();

/// Index of the thread in its warp, and in its block.
unsigned lane();
unsigned thread_rank();

/// Dynamic shared memory of the block, aligned to 16 bytes.
void* dynamic_shared();

struct Launch {
  dim3 grid, block;
  std::size_t shared;
  CUstream_st* stream;
};

/// Runs all blocks of a grid, one after the other, in an order determined by GSNAV_EMULATED_SEED.
void run_grid(const Launch& launch, const char* name, void (*thread)(const void*),
              const void* arguments);

/// Returns false, and sets the error of cudaGetLastError, if a device would reject the launch.
bool accepts(const Launch& launch);

template <class T>
std::uint64_t bits_of_value(const T& value) {
  static_assert(std::is_trivially_copyable_v<T> && sizeof(T) <= sizeof(std::uint64_t));
  std::uint64_t bits = 0;
  std::memcpy(&bits, &value, sizeof(T));
  return bits;
}
template <class T>
T value_of_bits(std::uint64_t bits) {
  T value;
  std::memcpy(&value, &bits, sizeof(T));
  return value;
}

template <class T>
T shuffled(unsigned mask, const T& value, unsigned from, const char* what) {
  return value_of_bits<T>(value_of_thread(mask, bits_of_value(value), from, what));
}

/// Replaces *to by changed(*to) and returns the old value. It is atomic, because one host thread runs
/// all threads of a grid.
template <class T, class F>
T atomically(T* to, F changed) {
  interleave();
  return std::exchange(*to, changed(*to));
}

/// Bits [begin, end) of a key, as used by sorts of the toolkit. There must be fewer than 64.
template <class Key>
std::uint64_t digits_of(Key key, int begin, int end) {
  return std::uint64_t{key} >> begin & ((std::uint64_t{1} << (end - begin)) - 1);
}

}  // namespace gsnav::emulated

inline thread_local constinit dim3 threadIdx, blockIdx, blockDim, gridDim;

#define __global__
#define __device__
#define __host__
#define __forceinline__ inline
#define __noinline__
#define __shared__ static thread_local
#define __grid_constant__
#define __launch_bounds__(...)
#define __align__(n) __attribute__((aligned(n)))

#define GSNAV_VECTOR(type, name, bytes)         \
  struct __attribute__((aligned(bytes))) name { \
    type x, y, z, w;                            \
  };
GSNAV_VECTOR(float, float4, 16)
GSNAV_VECTOR(unsigned, uint4, 16)
GSNAV_VECTOR(unsigned char, uchar4, 4)
#undef GSNAV_VECTOR
struct __attribute__((aligned(8))) uint2 {
  unsigned x, y;
};

inline void __syncthreads() { gsnav::emulated::block_barrier(0); }
inline int __syncthreads_count(int predicate) {
  return gsnav::emulated::block_barrier(predicate != 0 ? 1 : 0);
}
inline int __syncthreads_or(int predicate) { return __syncthreads_count(predicate) != 0 ? 1 : 0; }

inline void __syncwarp(unsigned mask = 0xffffffffu) { gsnav::emulated::sync_warp(mask, "__syncwarp"); }
template <class T>
T __shfl_sync(unsigned mask, T value, int from, int width = 32) {
  const unsigned lane = gsnav::emulated::lane(), w = static_cast<unsigned>(width);
  return gsnav::emulated::shuffled(
      mask, value, (lane & ~(w - 1)) | (static_cast<unsigned>(from) & (w - 1)), "__shfl_sync");
}
template <class T>
T __shfl_up_sync(unsigned mask, T value, unsigned delta, int width = 32) {
  const unsigned lane = gsnav::emulated::lane(), in = lane & (static_cast<unsigned>(width) - 1);
  return gsnav::emulated::shuffled(mask, value, in >= delta ? lane - delta : lane, "__shfl_up_sync");
}
template <class T>
T __shfl_down_sync(unsigned mask, T value, unsigned delta, int width = 32) {
  const unsigned lane = gsnav::emulated::lane(), w = static_cast<unsigned>(width), in = lane & (w - 1);
  return gsnav::emulated::shuffled(mask, value, in + delta < w ? lane + delta : lane,
                                   "__shfl_down_sync");
}
template <class T>
T __shfl_xor_sync(unsigned mask, T value, int bits, int width = 32) {
  const unsigned lane = gsnav::emulated::lane(), w = static_cast<unsigned>(width);
  const unsigned other = lane ^ static_cast<unsigned>(bits);
  return gsnav::emulated::shuffled(mask, value, (other & ~(w - 1)) <= lane ? other : lane,
                                   "__shfl_xor_sync");
}
inline unsigned __ballot_sync(unsigned mask, int predicate) {
  return gsnav::emulated::threads_that_have_any(mask, predicate != 0 ? 1 : 0, "__ballot_sync");
}
inline int __any_sync(unsigned mask, int predicate) { return __ballot_sync(mask, predicate) != 0; }
inline int __all_sync(unsigned mask, int predicate) { return __ballot_sync(mask, predicate) == mask; }
template <class T>
unsigned __match_any_sync(unsigned mask, T value) {
  return gsnav::emulated::threads_that_have_same(mask, gsnav::emulated::bits_of_value(value),
                                                 "__match_any_sync");
}

template <class T>
T atomicAdd(T* to, std::type_identity_t<T> value) {
  return gsnav::emulated::atomically(to, [&](T before) { return static_cast<T>(before + value); });
}
template <class T>
T atomicMax(T* to, std::type_identity_t<T> value) {
  return gsnav::emulated::atomically(to, [&](T before) { return before < value ? value : before; });
}
template <class T>
T atomicMin(T* to, std::type_identity_t<T> value) {
  return gsnav::emulated::atomically(to, [&](T before) { return value < before ? value : before; });
}
inline void __threadfence() { gsnav::emulated::interleave(); }
inline void __nanosleep(unsigned) { gsnav::emulated::pause(); }

inline int __popc(unsigned bits) { return __builtin_popcount(bits); }
inline int __ffs(int bits) { return __builtin_ffs(bits); }
inline int __clz(int bits) { return bits == 0 ? 32 : __builtin_clz(static_cast<unsigned>(bits)); }
inline float __uint_as_float(unsigned bits) { return gsnav::emulated::value_of_bits<float>(bits); }
inline unsigned __float_as_uint(float value) {
  return static_cast<unsigned>(gsnav::emulated::bits_of_value(value));
}
template <class T>
T min(T a, std::type_identity_t<T> b) {
  return b < a ? b : a;
}
template <class T>
T max(T a, std::type_identity_t<T> b) {
  return a < b ? b : a;
}
