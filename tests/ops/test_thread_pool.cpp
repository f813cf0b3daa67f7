// SPDX-License-Identifier: Apache-2.0
// The pool does each piece once, whoever calls and whatever else runs, and lets go of its threads.
#include <doctest/doctest.h>

#include "ops/backends.hpp"

#if defined(_OPENMP)

#include <atomic>
#include <chrono>
#include <memory>
#include <new>
#include <thread>

#if defined(__linux__)
#include <sys/wait.h>
#include <unistd.h>
#endif

#include "gsnav/detail/core/run_guarded.hpp"
#include "support/scenes.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

/// Whether parallel_for(n) does each item once. Items write plain memory: their writes must be seen.
template <class B>
bool does_each_once(B& backend, std::size_t n, std::vector<unsigned>& done) {
  done.assign(n, 0);
  backend.parallel_for(n, [&](std::size_t i) { done[i] += static_cast<unsigned>(i) + 1; });
  for (std::size_t i = 0; i < n; ++i) {
    if (done[i] != i + 1) return false;
  }
  return true;
}

}  // namespace

TEST_CASE("parallel_for does each item once, for any size and number of threads") {
  std::vector<unsigned> done;
  for (const int threads : {1, 2, 3, 4, 8, 17}) {
    OpenMPBackend backend(threads);
    CHECK(backend.concurrency() == static_cast<std::size_t>(threads));
    for (std::size_t n = 0; n < 400; ++n) CHECK(does_each_once(backend, n, done));
    for (const std::size_t n : {1000u, 4096u, 65537u, 300000u}) CHECK(does_each_once(backend, n, done));
  }
}

TEST_CASE("jobs follow each other at once and after a rest, in which threads fall asleep") {
  std::vector<unsigned> done;
  OpenMPBackend backend(3);
  for (int round = 0; round < 20; ++round) {
    for (std::size_t k = 0; k < 500; ++k) CHECK(does_each_once(backend, 1 + k % 7, done));
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
}

TEST_CASE("a job within a job, and several callers of one backend or of their own, are safe") {
  OpenMPBackend shared(4);
  SUBCASE("nested, three deep") {
    std::vector<unsigned> done(8 * 9 * 10, 0);
    shared.parallel_for(8, [&](std::size_t a) {
      shared.parallel_for(9, [&, a](std::size_t b) {
        shared.parallel_for(10, [&, a, b](std::size_t c) { ++done[(a * 9 + b) * 10 + c]; });
      });
    });
    CHECK(done == std::vector<unsigned>(8 * 9 * 10, 1));
  }
  SUBCASE("in jobs of another backend") {
    OpenMPBackend inner(3);
    std::atomic<unsigned> wrong{0};
    shared.parallel_for(100, [&](std::size_t i) {
      std::vector<unsigned> done;
      if (!does_each_once(inner, 10 + i, done)) ++wrong;
    });
    CHECK(wrong == 0);
  }
  SUBCASE("from six host threads") {
    std::atomic<unsigned> wrong{0};
    std::vector<std::thread> callers;
    for (int t = 0; t < 6; ++t) {
      callers.emplace_back([&, t] {
        OpenMPBackend own(2), copy = shared;
        std::vector<unsigned> done;
        for (std::size_t k = 0; k < 300; ++k) {
          OpenMPBackend& backend = k % 3 == 0 ? shared : k % 3 == 1 ? own : copy;
          if (!does_each_once(backend, 1 + (k * 37 + static_cast<std::size_t>(t)) % 200, done)) ++wrong;
        }
      });
    }
    for (std::thread& t : callers) t.join();
    CHECK(wrong == 0);
  }
}

TEST_CASE("the caller does not wait for a thread that has begun nothing") {
  // Both threads of one pool sit in pieces of a job that ends last: the other job has its caller alone,
  // whose pool is taken.
  OpenMPBackend backend(2);
  std::atomic<bool> go_on{false};
  std::atomic<int> inside{0};
  std::thread other([&] {
    backend.parallel_for(2, [&](std::size_t) {
      ++inside;
      while (!go_on) std::this_thread::yield();
    });
  });
  while (inside == 0) std::this_thread::yield();
  std::vector<unsigned> done;
  CHECK(does_each_once(backend, 1000, done));
  go_on = true;
  other.join();
}

TEST_CASE("what pieces throw or return becomes one Status, that of the lowest piece") {
  ThreadPool pool(4);
  std::atomic<int> done{0};
  const Status s = detail::run_guarded(pool, 40, [&](std::uint32_t p) {
    ++done;
    if (p == 30) throw std::bad_alloc();
    if (p == 17) throw Error(Errc::invalid_file, "of piece 17");
    return p == 21 ? Status(Errc::unsupported, "of piece 21") : Status();
  });
  CHECK(done == 40);
  CHECK(s.code() == Errc::invalid_file);
  CHECK(s.message() == "of piece 17");
  const auto fails = [](std::uint32_t p) { return p > 0 ? throw std::bad_alloc() : Status(); };
  CHECK(detail::run_guarded(pool, 2, fails).code() == Errc::out_of_memory);
  CHECK(detail::run_guarded(pool, 0, fails).ok());
}

TEST_CASE("backends come and go, used or not, copied or not") {
  std::vector<unsigned> done;
  for (int k = 0; k < 200; ++k) {
    OpenMPBackend unused(5);
    auto first = std::make_unique<OpenMPBackend>(1 + k % 4);
    if (k % 2 == 0) CHECK(does_each_once(*first, 50, done));
    OpenMPBackend copy = *first;
    first.reset();
    CHECK(does_each_once(copy, 50, done));
  }
}

#if defined(__linux__) && !defined(__SANITIZE_THREAD__)
TEST_CASE("after a fork the child renders on, ends and lets go") {
  auto before = std::make_unique<OpenMPBackend>(3);
  std::vector<unsigned> done;
  REQUIRE(does_each_once(*before, 1000, done));
  const pid_t child = fork();
  REQUIRE(child >= 0);
  if (child == 0) {
    OpenMPBackend after(3);
    bool ok = does_each_once(*before, 1000, done) && does_each_once(after, 1000, done);
    before.reset();
    ok = ok && does_each_once(after, 77, done);
    _exit(ok ? 0 : 1);
  }
  int status = -1;
  REQUIRE(waitpid(child, &status, 0) == child);
  CHECK(WIFEXITED(status));
  CHECK(WEXITSTATUS(status) == 0);
  CHECK(does_each_once(*before, 1000, done));
}
#endif

TEST_CASE("frames of two host threads that share a backend, and of 1 to 8 threads, have the same bits") {
  const GaussianCloud cloud = random_cloud(71, {.count = 20000});
  const std::vector<GaussianSet> sets{cloud.set()};
  const Camera camera = Camera::look_at({0, 0, 0}, {0, 0, 4}, {0, -1, 0}, 193, 130, 70);
  RenderConfig config;
  config.outputs = kRgb | kAlpha | kMedianDepth;
  OpenMPBackend one(1);
  const auto expected = render<float>(one, sets, camera, config);
  const auto same = [&](const Frames<float>& f) {
    return f.rgb == expected.rgb && f.alpha == expected.alpha && f.median_depth == expected.median_depth;
  };
  for (int threads = 2; threads <= 8; ++threads) {
    OpenMPBackend backend(threads);
    CHECK(same(render<float>(backend, sets, camera, config)));
  }
  OpenMPBackend shared(3);
  std::atomic<int> right{0};
  const auto draw = [&] {
    for (int k = 0; k < 5; ++k) right += same(render<float>(shared, sets, camera, config)) ? 1 : 0;
  };
  std::thread other(draw);
  draw();
  other.join();
  CHECK(right == 10);
}

#endif  // _OPENMP
