// SPDX-License-Identifier: Apache-2.0
// A backend with six members, and a check that its images have the bits of SerialBackend.
// usage: custom_backend
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <thread>
#include <vector>

#include "gsnav/backends/serial.hpp"
#include "gsnav/demo.hpp"
#include "gsnav/scene/basic_renderer.hpp"

// [snippet: backend]
/// Runs each parallel region on four new threads.
struct MyBackend {
  using memory_space = gsnav::HostSpace;
  void* allocate(std::size_t bytes, std::size_t align) {
    return std::aligned_alloc(align, (bytes + align - 1) / align * align);
  }
  void deallocate(void* p, std::size_t) noexcept { std::free(p); }
  void copy(void* to, const void* from, std::size_t n, gsnav::CopyKind) { std::memcpy(to, from, n); }
  void fill(void* p, unsigned char byte, std::size_t bytes) { std::memset(p, byte, bytes); }
  void parallel_for(std::size_t n, const auto& f) {
    const auto share = [&f, n](std::size_t t) {
      for (std::size_t i = t; i < n; i += 4) f(i);
    };
    std::vector<std::jthread> threads;
    for (std::size_t t = 0; t < 4; ++t) threads.emplace_back(share, t);
  }
  gsnav::Status synchronize() { return {}; }
};
static_assert(gsnav::Backend<MyBackend>);
// [/snippet]

int main() try {
  // [snippet: use]
  const auto scene = gsnav::make_default_scene(0.1).value();
  const auto camera = gsnav::indoor_views(scene, {.count = 1, .width = 160, .height = 120}).value()[0];
  MyBackend mine;
  gsnav::SerialBackend serial;
  gsnav::BasicRenderer renderer(mine);
  gsnav::BasicRenderer reference(serial);
  const bool same = renderer.render(scene.cloud.set(), camera).value().rgb ==
                    reference.render(scene.cloud.set(), camera).value().rgb;
  // [/snippet]
  return std::puts(same ? "the same bits" : "other bits"), same ? 0 : 1;
} catch (const std::exception& e) {
  return std::fprintf(stderr, "%s\n", e.what()), 1;
}
