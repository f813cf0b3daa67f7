// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstring>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "cuda_runtime.h"
#include "settings.hpp"
#include "streams.hpp"

// The emulated device with streams, events and graphs.

using gsnav::emulated::enqueue;
using gsnav::emulated::failed;
using gsnav::emulated::stream_of;
using gsnav::emulated::Work;
using gsnav::emulated::work_off;

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

constexpr std::size_t kDefaultShared = 48 << 10, kMostShared = 64 << 10;

thread_local cudaError_t last_error = cudaSuccess;

struct DeviceState {
  std::mutex mutex;
  /// Bytes of shared memory that a launch may request: the maximum allowed for any kernel.
  std::size_t shared = kDefaultShared;
  std::vector<CUstream_st*> streams;
};
DeviceState& device() {
  static auto* const d = new DeviceState;  // Never destroyed, because static objects may use it at exit.
  return *d;
}

}  // namespace

namespace gsnav::emulated {

cudaError_t failed(cudaError_t e) {
  if (e != cudaSuccess) last_error = e;
  return e;
}

CUstream_st& stream_of(cudaStream_t stream) {
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

cudaError_t enqueue(cudaStream_t stream, Work work) {
  CUstream_st& s = stream_of(stream);
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
  DeviceState& d = device();
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
cudaError_t cudaDeviceGetAttribute(int* value, cudaDeviceAttr attribute, int) {
  *value = attribute == cudaDevAttrMultiProcessorCount ? static_cast<int>(gsnav::emulated::processors())
                                                       : static_cast<int>(kMostShared);
  return cudaSuccess;
}
cudaError_t cudaDeviceGetDefaultMemPool(cudaMemPool_t* pool, int) {
  *pool = nullptr;
  return cudaSuccess;
}
cudaError_t cudaMemPoolSetAttribute(cudaMemPool_t, cudaMemPoolAttr, void*) { return cudaSuccess; }
cudaError_t cudaDeviceSynchronize() {
  std::vector<CUstream_st*> all{&stream_of(nullptr)};
  {
    const std::lock_guard lock(device().mutex);
    all.insert(all.end(), device().streams.begin(), device().streams.end());
  }
  for (CUstream_st* s : all) work_off(*s);
  return cudaSuccess;
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
  CUstream_st& s = stream_of(stream);
  if (s.capture != nullptr) return failed(cudaErrorStreamCaptureUnsupported);
  work_off(s);
  return cudaSuccess;
}
cudaError_t cudaStreamWaitEvent(cudaStream_t stream, cudaEvent_t event, unsigned) {
  if (event->stream == nullptr) return cudaSuccess;
  return enqueue(stream, [waited = event->stream, at = event->at] { work_off(*waited, at); });
}
cudaError_t cudaLaunchHostFunc(cudaStream_t stream, cudaHostFn_t function, void* data) {
  return enqueue(stream, [function, data] { function(data); });
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
  CUstream_st& s = stream_of(stream);
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
  CUstream_st& s = stream_of(stream);
  if (stream == nullptr || s.capture != nullptr) return failed(cudaErrorStreamCaptureUnsupported);
  s.capture = new std::vector<Work>;
  return cudaSuccess;
}
cudaError_t cudaStreamEndCapture(cudaStream_t stream, cudaGraph_t* graph) {
  CUstream_st& s = stream_of(stream);
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
  return enqueue(stream, [nodes = exec->nodes] {
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
