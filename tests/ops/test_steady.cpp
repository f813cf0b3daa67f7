// SPDX-License-Identifier: Apache-2.0
// A steady frame asks the heap for nothing and reads nothing that its outputs do not need.
#include <doctest/doctest.h>

#include <algorithm>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#if defined(__linux__)
#include <sys/mman.h>
#endif

#include "ops/backends.hpp"
#include "support/heap.hpp"
#include "support/scenes.hpp"

using namespace gsnav;
using namespace gsnav_test;

#if defined(_OPENMP)

namespace {

/// More than one chunk, sort block and bin block, so that every stage has work for every thread.
const GaussianCloud& cloud() {
  static const GaussianCloud c = random_cloud(70, {.count = 20000});
  return c;
}

std::vector<Camera> cameras(std::size_t n) {
  std::vector<Camera> out;
  for (std::size_t i = 0; i < n; ++i) {
    out.push_back(
        Camera::look_at({0.1 * static_cast<double>(i), 0, 0}, {0, 0, 4}, {0, -1, 0}, 193, 130, 70));
  }
  return out;
}

/// Heap calls of each of `frames` calls after the first.
std::vector<std::size_t> calls_of_steady_frames(int threads, const RenderConfig& config,
                                                std::size_t batch, int frames) {
  OpenMPBackend backend(threads);
  BasicRenderer<float, OpenMPBackend> renderer(backend, config);
  const std::vector<GaussianSet> sets{cloud().set()};
  const std::vector<Camera> views = cameras(batch);
  Frames<float> out;
  REQUIRE(renderer.render(sets, views, out).ok());
  std::vector<std::size_t> calls(static_cast<std::size_t>(frames));
  for (std::size_t& c : calls) {
    const std::size_t before = heap_calls();
    const bool ok = renderer.render(sets, views, out).ok();
    c = heap_calls() - before;
    REQUIRE(ok);
  }
  return calls;
}

}  // namespace

TEST_CASE("the heap is watched: a vector is seen") {
  if (!heap_is_watched()) {
    std::printf("SKIP: this build's heap cannot be watched\n");
    return;
  }
  static std::vector<int>* volatile seen = nullptr;  // or a compiler might do without the vector
  const std::size_t before = heap_calls();
  const auto p = std::make_unique<std::vector<int>>(1000);
  seen = p.get();
  CHECK(heap_calls() - before == 2);
  OpenMPBackend backend(1);
  Buffer<float, OpenMPBackend> buffer(backend);
  const std::size_t between = heap_calls();
  buffer.resize_discard(1000);
  CHECK(heap_calls() - between == 1);
  CHECK(seen->size() == 1000);
}

TEST_CASE(
    "a steady frame on the openmp backend asks the heap for nothing, on any number of threads, alone "
    "and in a batch") {
  if (!heap_is_watched()) return;
  for (const int threads : {1, 2, 4}) {
    for (const std::size_t batch : {std::size_t{1}, std::size_t{5}, std::size_t{13}}) {
      for (const Exponential profile : {Exponential::exact, Exponential::fast}) {
        for (const unsigned outputs : {+kRgb, +kMedianDepth, kRgb | kAlpha | kAnyDepth}) {
          RenderConfig config;
          config.quality.exponential = profile;
          config.outputs = outputs;
          CAPTURE(threads);
          CAPTURE(batch);
          CAPTURE(outputs);
          const std::vector<std::size_t> calls = calls_of_steady_frames(threads, config, batch, 3);
          CHECK(calls == std::vector<std::size_t>{0, 0, 0});
        }
      }
    }
  }
}

#if defined(__linux__)

namespace {

/// Memory that ends the process when it is read.
class Forbidden {
 public:
  explicit Forbidden(std::size_t floats) : bytes_(std::max<std::size_t>(1, floats) * sizeof(float)) {
    p_ = mmap(nullptr, bytes_, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    REQUIRE(p_ != MAP_FAILED);
  }
  ~Forbidden() { munmap(p_, bytes_); }
  Forbidden(const Forbidden&) = delete;
  Forbidden& operator=(const Forbidden&) = delete;
  View<const float> view(std::size_t n) const { return {static_cast<const float*>(p_), n}; }

 private:
  std::size_t bytes_;
  void* p_;
};

}  // namespace

TEST_CASE(
    "frames without colour read no SH, and frames of degree 0 only its own: the rest is memory that "
    "cannot be read") {
  const std::size_t n = cloud().size();
  const Forbidden no_sh0(3 * n), no_shN(45 * n);
  const std::vector<Camera> views = cameras(2);
  for (const int threads : {1, 2}) {
    OpenMPBackend backend(threads);
    const auto render = [&](const GaussianSet& set, const RenderConfig& config) {
      BasicRenderer<float, OpenMPBackend> renderer(backend, config);
      return renderer.render(std::span(&set, 1), views).value();
    };
    GaussianSet without_color = cloud().set(), base_only = cloud().set();
    without_color.gaussians.color.sh0 = no_sh0.view(3 * n);
    without_color.gaussians.color.shN = no_shN.view(45 * n);
    base_only.gaussians.color.shN = no_shN.view(45 * n);
    RenderConfig config;
    for (const unsigned outputs : {+kAlpha, +kMedianDepth, kAlpha | kAnyDepth}) {
      config.outputs = outputs;
      const Frames<float> whole = render(cloud().set(), config), spared = render(without_color, config);
      CHECK(whole.alpha == spared.alpha);
      CHECK(whole.median_depth == spared.median_depth);
      CHECK(whole.first_hit_depth == spared.first_hit_depth);
    }
    config.outputs = kRgb;
    config.quality.max_sh_degree = 0;
    CHECK(render(cloud().set(), config).rgb == render(base_only, config).rgb);
  }
}

#endif  // __linux__
#endif  // _OPENMP
