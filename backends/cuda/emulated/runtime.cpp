// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <new>
#include <vector>

#include "cuda_runtime.h"
#include "settings.hpp"

// Streams, events, graphs and memory of the emulated device. A stream is a queue that is worked off by
// whoever waits.

using gsnav::emulated::Work;

struct CUstream_st {
  std::recursive_mutex mutex;
  std::deque<Work> queue;
  std::uint64_t enqueued = 0, done = 0;
  std::vector<Work>* capture = nullptr;
};
struct CUevent_st {
  CUstream_st* stream = nullptr;
  std::uint64_t at = 0;
};
struct CUgraph_st {
  std::vector<Work> nodes;
};
struct CUgraphExec_st {
  std::shared_ptr<const std::vector<Work>> nodes;
};

namespace {

/// Of a device that researchers have at least.
constexpr std::size_t kDeviceBytes = std::size_t{6} << 30;
constexpr std::size_t kDefaultShared = 48 << 10, kMostShared = 64 << 10;
constexpr std::size_t kAlign = 256;

thread_local cudaError_t last_error = cudaSuccess;

cudaError_t failed(cudaError_t e) {
  if (e != cudaSuccess) last_error = e;
  return e;
}

struct Device {
  std::mutex mutex;
  std::map<const void*, std::size_t> blocks, pinned;
  std::size_t shared = kDefaultShared;  // that launches may ask for; of the kernel that was allowed most
  std::vector<CUstream_st*> streams;
  std::size_t used = 0;
};
Device& device() {
  static auto* const d = new Device;  // outlives what statics of others free
  return *d;
}
CUstream_st& of(cudaStream_t stream) {
  static auto* const legacy = new CUstream_st;
  return stream == nullptr ? *legacy : *stream;
}

void work_off(CUstream_st& s, std::uint64_t until) {
  const std::lock_guard lock(s.mutex);
  while (s.done < until && !s.queue.empty()) {
    const Work work = std::move(s.queue.front());
    s.queue.pop_front();
    work();
    ++s.done;
  }
}
void work_off(CUstream_st& s) { work_off(s, ~std::uint64_t{0}); }

cudaError_t allocate(void** p, std::size_t bytes, std::map<const void*, std::size_t> Device::*kind,
                     bool counts) {
  Device& d = device();
  const std::lock_guard lock(d.mutex);
  if (counts && bytes > kDeviceBytes - d.used) return failed(cudaErrorMemoryAllocation);
  void* const memory =
      std::aligned_alloc(kAlign, (std::max<std::size_t>(bytes, 1) + kAlign - 1) / kAlign * kAlign);
  if (memory == nullptr) return failed(cudaErrorMemoryAllocation);
  // What nobody has written has no meaning: another one with each seed.
  std::memset(memory, gsnav::emulated::seed() % 2 == 0 ? 0xcb : 0x3e, bytes);
  (d.*kind)[memory] = bytes;
  if (counts) d.used += bytes;
  *p = memory;
  return cudaSuccess;
}

cudaError_t release(void* p, std::map<const void*, std::size_t> Device::*kind, bool counts) {
  if (p == nullptr) return cudaSuccess;
  Device& d = device();
  {
    const std::lock_guard lock(d.mutex);
    const auto found = (d.*kind).find(p);
    if (found == (d.*kind).end()) return failed(cudaErrorInvalidValue);
    if (counts) d.used -= found->second;
    (d.*kind).erase(found);
  }
  std::free(p);
  return cudaSuccess;
}

/// Whether [p, p + bytes) lies in one of them.
bool lies_in(const std::map<const void*, std::size_t>& blocks, const void* p, std::size_t bytes) {
  auto after = blocks.upper_bound(p);
  if (after == blocks.begin()) return false;
  --after;
  const auto offset =
      static_cast<std::size_t>(static_cast<const char*>(p) - static_cast<const char*>(after->first));
  return offset + bytes <= after->second;
}

}  // namespace

namespace gsnav::emulated {

cudaError_t enqueue(cudaStream_t stream, Work work) {
  CUstream_st& s = of(stream);
  const std::lock_guard lock(s.mutex);
  if (s.capture != nullptr) {
    s.capture->push_back(std::move(work));
  } else {
    s.queue.push_back(std::move(work));
    ++s.enqueued;
  }
  return cudaSuccess;
}

bool accepts(const Launch& l) {
  const auto fits = [](const dim3& d, std::uint64_t most) {
    return d.x != 0 && d.y != 0 && d.z != 0 && std::uint64_t{d.x} * d.y * d.z <= most;
  };
  std::size_t shared = 0;
  {
    const std::lock_guard lock(device().mutex);
    shared = device().shared;
  }
  const bool good = fits(l.block, 1024) && fits(l.grid, ~std::uint64_t{0}) && l.grid.x <= 0x7fffffffu &&
                    l.grid.y <= 65535 && l.grid.z <= 65535 && l.shared <= shared;
  if (!good) failed(cudaErrorInvalidConfiguration);
  return good;
}

cudaError_t set_attribute(cudaFuncAttribute, int value) {
  if (value < 0 || static_cast<std::size_t>(value) > kMostShared) return failed(cudaErrorInvalidValue);
  Device& d = device();
  const std::lock_guard lock(d.mutex);
  d.shared = std::max(d.shared, static_cast<std::size_t>(value));
  return cudaSuccess;
}

}  // namespace gsnav::emulated

cudaError_t cudaGetLastError() { return std::exchange(last_error, cudaSuccess); }
const char* cudaGetErrorString(cudaError_t error) {
  switch (error) {
    case cudaSuccess:
      return "no error";
    case cudaErrorMemoryAllocation:
      return "out of memory";
    case cudaErrorInvalidConfiguration:
      return "invalid configuration argument";
    case cudaErrorInvalidDevice:
      return "invalid device ordinal";
    case cudaErrorStreamCaptureUnsupported:
      return "operation not permitted when stream is capturing";
    default:
      return "invalid argument";
  }
}
cudaError_t cudaGetDeviceCount(int* count) {
  *count = 1;
  return cudaSuccess;
}
cudaError_t cudaGetDevice(int* device) {
  *device = 0;
  return cudaSuccess;
}
cudaError_t cudaSetDevice(int device) {
  return failed(device == 0 ? cudaSuccess : cudaErrorInvalidDevice);
}
cudaError_t cudaGetDeviceProperties(cudaDeviceProp* properties, int) {
  std::strcpy(properties->name, "emulated on the host");
  return cudaSuccess;
}
cudaError_t cudaDeviceGetAttribute(int* value, cudaDeviceAttr, int) {
  *value = static_cast<int>(gsnav::emulated::processors());
  return cudaSuccess;
}
cudaError_t cudaDeviceGetDefaultMemPool(cudaMemPool_t* pool, int) {
  *pool = nullptr;
  return cudaSuccess;
}
cudaError_t cudaMemPoolSetAttribute(cudaMemPool_t, cudaMemPoolAttr, void*) { return cudaSuccess; }
cudaError_t cudaDeviceSynchronize() {
  std::vector<CUstream_st*> all{&of(nullptr)};
  {
    const std::lock_guard lock(device().mutex);
    all.insert(all.end(), device().streams.begin(), device().streams.end());
  }
  for (CUstream_st* s : all) work_off(*s);
  return cudaSuccess;
}

cudaError_t cudaMemGetInfo(std::size_t* free, std::size_t* total) {
  Device& d = device();
  const std::lock_guard lock(d.mutex);
  *free = kDeviceBytes - d.used;
  *total = kDeviceBytes;
  return cudaSuccess;
}

cudaError_t cudaMallocBytes(void** p, std::size_t bytes) {
  return allocate(p, bytes, &Device::blocks, true);
}
cudaError_t cudaMallocAsyncBytes(void** p, std::size_t bytes, cudaStream_t) {
  return allocate(p, bytes, &Device::blocks, true);
}
cudaError_t cudaMallocHostBytes(void** p, std::size_t bytes) {
  return allocate(p, bytes, &Device::pinned, false);
}
cudaError_t cudaFree(void* p) {
  cudaDeviceSynchronize();
  return release(p, &Device::blocks, true);
}
cudaError_t cudaFreeHost(void* p) {
  cudaDeviceSynchronize();
  return release(p, &Device::pinned, false);
}
cudaError_t cudaFreeAsync(void* p, cudaStream_t stream) {
  if (p == nullptr) return cudaSuccess;
  return gsnav::emulated::enqueue(stream, [p] { release(p, &Device::blocks, true); });
}

cudaError_t cudaMemcpyAsync(void* to, const void* from, std::size_t bytes, cudaMemcpyKind kind,
                            cudaStream_t stream) {
  Device& d = device();
  const bool to_device = kind == cudaMemcpyHostToDevice || kind == cudaMemcpyDeviceToDevice;
  const bool from_device = kind == cudaMemcpyDeviceToHost || kind == cudaMemcpyDeviceToDevice;
  bool pinned_from = false, pinned_to = false;
  {
    const std::lock_guard lock(d.mutex);
    if ((to_device && !lies_in(d.blocks, to, bytes)) ||
        (from_device && !lies_in(d.blocks, from, bytes))) {
      return failed(cudaErrorInvalidValue);
    }
    pinned_from = lies_in(d.pinned, from, bytes);
    pinned_to = lies_in(d.pinned, to, bytes);
  }
  CUstream_st& s = of(stream);
  const std::lock_guard lock(s.mutex);
  if (s.capture == nullptr && !from_device &&
      !pinned_from) {  // pageable memory may change when this returns
    const auto* const bytes_of = static_cast<const unsigned char*>(from);
    return gsnav::emulated::enqueue(stream,
                                    [to, copy = std::vector<unsigned char>(bytes_of, bytes_of + bytes)] {
                                      std::memcpy(to, copy.data(), copy.size());
                                    });
  }
  gsnav::emulated::enqueue(stream, [to, from, bytes] { std::memmove(to, from, bytes); });
  if (s.capture == nullptr && !to_device && !pinned_to) work_off(s);
  return cudaSuccess;
}
cudaError_t cudaMemcpy(void* to, const void* from, std::size_t bytes, cudaMemcpyKind kind) {
  const cudaError_t e = cudaMemcpyAsync(to, from, bytes, kind, nullptr);
  work_off(of(nullptr));
  return e;
}
cudaError_t cudaMemsetAsync(void* to, int byte, std::size_t bytes, cudaStream_t stream) {
  {
    const std::lock_guard lock(device().mutex);
    if (!lies_in(device().blocks, to, bytes)) return failed(cudaErrorInvalidValue);
  }
  return gsnav::emulated::enqueue(stream, [to, byte, bytes] { std::memset(to, byte, bytes); });
}

cudaError_t cudaStreamCreateWithFlags(cudaStream_t* stream, unsigned) {
  *stream = new CUstream_st;
  const std::lock_guard lock(device().mutex);
  device().streams.push_back(*stream);
  return cudaSuccess;
}
cudaError_t cudaStreamCreate(cudaStream_t* stream) { return cudaStreamCreateWithFlags(stream, 0); }
cudaError_t cudaStreamDestroy(cudaStream_t stream) {
  work_off(*stream);
  {
    const std::lock_guard lock(device().mutex);
    std::erase(device().streams, stream);
  }
  delete stream;
  return cudaSuccess;
}
cudaError_t cudaStreamSynchronize(cudaStream_t stream) {
  CUstream_st& s = of(stream);
  if (s.capture != nullptr) return failed(cudaErrorStreamCaptureUnsupported);
  work_off(s);
  return cudaSuccess;
}
cudaError_t cudaStreamWaitEvent(cudaStream_t stream, cudaEvent_t event, unsigned) {
  if (event->stream == nullptr) return cudaSuccess;
  return gsnav::emulated::enqueue(stream,
                                  [waited = event->stream, at = event->at] { work_off(*waited, at); });
}
cudaError_t cudaLaunchHostFunc(cudaStream_t stream, cudaHostFn_t function, void* data) {
  return gsnav::emulated::enqueue(stream, [function, data] { function(data); });
}
cudaError_t cudaEventCreateWithFlags(cudaEvent_t* event, unsigned) {
  *event = new CUevent_st;
  return cudaSuccess;
}
cudaError_t cudaEventCreate(cudaEvent_t* event) { return cudaEventCreateWithFlags(event, 0); }
cudaError_t cudaEventDestroy(cudaEvent_t event) {
  delete event;
  return cudaSuccess;
}
cudaError_t cudaEventRecord(cudaEvent_t event, cudaStream_t stream) {
  CUstream_st& s = of(stream);
  const std::lock_guard lock(s.mutex);
  event->stream = &s;
  event->at = s.enqueued;
  return cudaSuccess;
}
cudaError_t cudaEventSynchronize(cudaEvent_t event) {
  if (event->stream != nullptr) work_off(*event->stream, event->at);
  return cudaSuccess;
}

cudaError_t cudaStreamBeginCapture(cudaStream_t stream, cudaStreamCaptureMode) {
  CUstream_st& s = of(stream);
  if (stream == nullptr || s.capture != nullptr) return failed(cudaErrorStreamCaptureUnsupported);
  s.capture = new std::vector<Work>;
  return cudaSuccess;
}
cudaError_t cudaStreamEndCapture(cudaStream_t stream, cudaGraph_t* graph) {
  CUstream_st& s = of(stream);
  if (s.capture == nullptr) return failed(cudaErrorInvalidValue);
  const std::unique_ptr<std::vector<Work>> captured(std::exchange(s.capture, nullptr));
  *graph = new CUgraph_st{std::move(*captured)};
  return cudaSuccess;
}
cudaError_t cudaGraphInstantiate(cudaGraphExec_t* exec, cudaGraph_t graph, unsigned long long) {
  *exec = new CUgraphExec_st{std::make_shared<const std::vector<Work>>(graph->nodes)};
  return cudaSuccess;
}
cudaError_t cudaGraphLaunch(cudaGraphExec_t exec, cudaStream_t stream) {
  return gsnav::emulated::enqueue(stream, [nodes = exec->nodes] {
    for (const Work& work : *nodes) work();
  });
}
cudaError_t cudaGraphDestroy(cudaGraph_t graph) {
  delete graph;
  return cudaSuccess;
}
cudaError_t cudaGraphExecDestroy(cudaGraphExec_t exec) {
  delete exec;
  return cudaSuccess;
}
