// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdlib>
#include <cstring>
#include <vector>

#include "gsnav/backends/serial.hpp"
#include "gsnav/scene/basic_renderer.hpp"
#include "support/compiled_frames.hpp"
#if defined(_OPENMP)
#include "gsnav/backends/openmp.hpp"
#endif

namespace gsnav_test {

struct ToySpace {};

/// A third party's backend: the six members and nothing else, in a memory space of its own, run
/// backwards to show that no kernel depends on the order of work items.
class ToyBackend {
 public:
  using memory_space = ToySpace;
  void* allocate(std::size_t bytes, std::size_t align) {
    ++allocations;
    return std::aligned_alloc(align, (bytes + align - 1) / align * align);
  }
  void deallocate(void* p, std::size_t) noexcept { std::free(p); }
  void copy(void* dst, const void* src, std::size_t bytes, gsnav::CopyKind kind) {
    copies_to_host += kind == gsnav::CopyKind::device_to_host ? 1 : 0;
    empty_copies += bytes == 0 ? 1 : 0;
    if (bytes > 0) std::memcpy(dst, src, bytes);
  }
  void fill(void* p, unsigned char byte, std::size_t bytes) { std::memset(p, byte, bytes); }
  template <class F>
  void parallel_for(std::size_t n, const F& f);
  gsnav::Status synchronize() { return {}; }

  int allocations = 0, copies_to_host = 0, empty_copies = 0;
};
template <class F>
void ToyBackend::parallel_for(std::size_t n, const F& f) {
  for (std::size_t i = n; i-- > 0;) f(i);
}
static_assert(gsnav::Backend<ToyBackend>);

/// Renders with a fresh renderer.
template <class S, class B>
gsnav::Frames<S> render(B& backend, const std::vector<gsnav::GaussianSet>& sets,
                        const gsnav::Camera& camera, const gsnav::RenderConfig& config = {}) {
  gsnav::BasicRenderer<S, B> renderer(backend, config);
  return renderer.render(sets, std::vector<gsnav::Camera>{camera}).value();
}

}  // namespace gsnav_test

// Compiled once for all tests (support/compiled_frames.cpp).
GSNAV_TEST_KERNELS(extern, gsnav_test::ToyBackend);
namespace gsnav {
using gsnav_test::ToyBackend;
GSNAV_FRAME_FUNCTIONS(extern, float, ToyBackend);
}  // namespace gsnav
