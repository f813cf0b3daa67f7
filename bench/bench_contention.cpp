// SPDX-License-Identifier: Apache-2.0
// Time of a frame while other threads keep cores busy (one thread, or one per core), compared with a
// fair share of the cores.
//
//   [OMP_WAIT_POLICY=active|passive] [GOMP_SPINCOUNT=n] bench_contention [WIDTHxHEIGHT]
//   GSNAV_BENCH_SCENE and GSNAV_BENCH_CAMERAS as for bench_render
//
// With T rendering threads and L busy threads on C cores, a fair scheduler gives the frame T / (T + L)
// of the cores. Without other load the frame has one core per thread, at most C. The fair time follows
// from both, and `of fair share` is the measured time divided by it: 1 is ideal.
//
// A renderer is far above 1 if its threads wait for each other by spinning, or if each of its barriers
// costs a time slice of the scheduler. It is worst beside one busy thread, because the scheduler cannot
// tell a spinning thread from a working one. `empty region` is a parallel region that does nothing.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <span>
#include <thread>
#include <vector>

#include "gsnav/backends/openmp.hpp"
#include "gsnav/scene/basic_renderer.hpp"
#include "samples.hpp"
#include "workload.hpp"

using namespace gsnav;
using gsnav_bench::quantile;

namespace {

constexpr int kFrames = 60;

/// Threads that only add numbers.
class BusyLoad {
 public:
  explicit BusyLoad(unsigned threads) {
    for (unsigned i = 0; i < threads; ++i) {
      threads_.emplace_back([this] {
        std::uint64_t sum = 0;
        while (!stop_.load(std::memory_order_relaxed)) {
          for (int k = 0; k < 10000; ++k) {
            sum += 3;
            asm volatile("" : "+r"(sum));
          }
        }
      });
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  ~BusyLoad() {
    stop_ = true;
    for (std::thread& t : threads_) t.join();
  }
  BusyLoad(const BusyLoad&) = delete;
  BusyLoad& operator=(const BusyLoad&) = delete;

 private:
  std::atomic<bool> stop_{false};
  std::vector<std::thread> threads_;
};

template <class Run>
double ms_of(const Run& run) {
  const auto begin = std::chrono::steady_clock::now();
  run();
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
}

struct Times {
  std::vector<double> frames, regions;
};

Times measure(int threads, const std::vector<Camera>& cameras) {
  OpenMPBackend backend(threads);
  RenderConfig config;
  config.outputs = kRgb;
  config.quality = Quality::fast();
  BasicRenderer<float, OpenMPBackend> renderer(backend, config);
  const GaussianSet set = gsnav_bench::workload().cloud.set();
  Frames<float> frames;
  Times t;
  const auto draw = [&](std::size_t i) {
    renderer.render(std::span(&set, 1), std::span(&cameras[i % cameras.size()], 1), frames)
        .throw_if_error();
  };
  for (std::size_t i = 0; i < cameras.size(); ++i) draw(i);
  for (std::size_t i = 0; i < kFrames; ++i) {
    t.frames.push_back(ms_of([&] { draw(i); }));
    t.regions.push_back(
        ms_of([&] { backend.parallel_for(static_cast<std::size_t>(threads), [](std::size_t) {}); }));
  }
  return t;
}

}  // namespace

int main(int argc, char** argv) {
  int width = 256, height = 256;
  char rest = 0;
  if (argc > 1 && std::sscanf(argv[1], "%dx%d%c", &width, &height, &rest) != 2) {
    std::fprintf(stderr, "bench_contention: %s: a size is WIDTHxHEIGHT, for instance 640x480\n",
                 argv[1]);
    return 2;
  }
  const std::vector<Camera> cameras = gsnav_bench::sized(width, height);
  const unsigned cores = std::max(1u, std::thread::hardware_concurrency());
  const char* policy = std::getenv("OMP_WAIT_POLICY");
  const char* spins = std::getenv("GOMP_SPINCOUNT");
  std::printf("%zu Gaussians, %dx%d, rgb fast, %u cores, OMP_WAIT_POLICY=%s GOMP_SPINCOUNT=%s; ms\n",
              gsnav_bench::workload().cloud.size(), width, height, cores,
              policy != nullptr ? policy : "(unset)", spins != nullptr ? spins : "(unset)");
  std::printf("%7s %4s | %8s %8s %8s | %s\n", "threads", "load", "median", "p99", "region",
              "of fair share: median, p99");
  for (const int threads : {1, 2, static_cast<int>(2 * cores)}) {
    Times alone;
    for (const unsigned load : {0u, 1u, cores}) {
      const BusyLoad busy(load);
      const Times times = measure(threads, cameras);
      if (load == 0) alone = times;
      const double t = threads, l = load, c = cores;
      const double fair = t + l <= c ? 1.0 : std::min(t, c) * (t + l) / (t * c);
      const auto slower = [&](double q) {
        return quantile(times.frames, q) / quantile(alone.frames, q) / fair;
      };
      std::printf("%7d %4u | %8.3f %8.3f %8.4f | %.2f, %.2f\n", threads, load,
                  quantile(times.frames, 0.5), quantile(times.frames, 0.99),
                  quantile(times.regions, 0.5), slower(0.5), slower(0.99));
    }
  }
}
