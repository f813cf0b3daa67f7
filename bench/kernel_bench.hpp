// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <benchmark/benchmark.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <type_traits>

#include "error.hpp"
#include "gsnav/backends/openmp.hpp"
#include "gsnav/backends/serial.hpp"
#if defined(GSNAV_HAS_CUDA)
#include "gsnav/backends/cuda.hpp"
#endif
#include "gsnav/core/rng.hpp"
#include "gsnav/math/quat.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"

// Shared by the kernel benchmarks: names of rows, and the backends that they run on.

namespace gsnav_bench {

// One function per family of kernels, called by main.
void register_frame_kernels();    // projection, SH, keys, sort, bin, blend
void register_skin_kernels();     // linear blend skinning
void register_body_kernels();     // polar rotation, forward kinematics
void register_capsule_kernels();  // distance, time of impact

/// Source of a row's time: a clock, or the body's SetIterationTime.
enum class TimedBy { clock, body };

template <class S, class Backend, class Body, class... Args>
void add_timed_row(TimedBy timed_by, const std::string& kernel, const std::string& variant,
                   const std::string& scalar, const char* backend_name, const Body& body,
                   Args... backend_args) {
  const std::string name =
      kernel + "<" + scalar + ", " + backend_name + ">" + (variant.empty() ? "" : "/" + variant);
  auto* const row = benchmark::RegisterBenchmark(name.c_str(), [=](benchmark::State& state) {
    Backend backend(backend_args...);
    body.template operator()<S>(state, backend);
  });
  row->Unit(benchmark::kMicrosecond);
  if (timed_by == TimedBy::body) {
    row->UseManualTime();
  } else {
    row->UseRealTime();
  }
}
template <class S, class Backend, class Body, class... Args>
void add_row(const std::string& kernel, const std::string& variant, const std::string& scalar,
             const char* backend_name, const Body& body, Args... backend_args) {
  add_timed_row<S, Backend>(TimedBy::clock, kernel, variant, scalar, backend_name, body,
                            backend_args...);
}

/// Adds rows for the openmp backend on one thread and on two. `scalar`: name of the scalar type in the
/// row's name.
template <class Body>
void add_openmp_rows(const std::string& kernel, const std::string& variant, const std::string& scalar,
                     const Body& body) {
  for (const int threads : {1, 2}) {
    const std::string with_threads =
        variant + (variant.empty() ? "" : "/") + "threads:" + std::to_string(threads);
    add_row<float, gsnav::OpenMPBackend>(kernel, with_threads, scalar, "OpenMPBackend", body, threads);
  }
}

/// Adds a row for the GPU, if the build has the backend and the machine has a device. Only for bodies
/// whose kernels gsnav::cuda has compiled, since a functor of this program would need nvcc.
template <class Body>
void add_cuda_row([[maybe_unused]] const std::string& kernel,
                  [[maybe_unused]] const std::string& variant, [[maybe_unused]] const Body& body,
                  [[maybe_unused]] TimedBy timed_by = TimedBy::clock) {
#if defined(GSNAV_HAS_CUDA)
  if (gsnav::CudaBackend::device_count() > 0) {
    add_timed_row<float, gsnav::CudaBackend>(timed_by, kernel, variant, "float", "CudaBackend", body);
  }
#endif
}

/// Adds the rows of one kernel: the float64 reference, the same template in float, and openmp. `body` is
/// called as body.operator()<S>(state, backend).
template <class Body>
void add_cpu_rows(const std::string& kernel, const std::string& variant, const Body& body) {
  add_row<double, gsnav::SerialBackend>(kernel, variant, "double", "SerialBackend", body);
  add_row<float, gsnav::SerialBackend>(kernel, variant, "float", "SerialBackend", body);
  add_openmp_rows(kernel, variant, "float", body);
}

/// Counts the items of all iterations, and their bytes if the kernel is bound by them.
inline void count(benchmark::State& state, std::size_t items, std::size_t bytes_per_item = 0) {
  const std::int64_t total =
      static_cast<std::int64_t>(state.iterations()) * static_cast<std::int64_t>(items);
  state.SetItemsProcessed(total);
  if (bytes_per_item > 0) state.SetBytesProcessed(total * static_cast<std::int64_t>(bytes_per_item));
}

/// Times f(i) for i in [0, n).
template <class B, class F>
void time_items(benchmark::State& state, B& backend, std::size_t n, const F& f,
                std::size_t bytes_per_item = 0) {
  for (auto _ : state) {
    backend.parallel_for(n, f);
    benchmark::ClobberMemory();
  }
  count(state, n, bytes_per_item);
}

/// Joints of an SMPL-X body.
inline constexpr std::size_t kJoints = 55;

/// A rotation about a random axis by up to `most` radians.
inline gsnav::Quat<double> random_turn(gsnav::Rng& rng, double most) {
  return gsnav::axis_angle(gsnav::normalized(gsnav::Vec3d{rng.normal(), rng.normal(), rng.normal()}),
                           rng.uniform(0, most));
}

/// A wall of n Gaussians three metres ahead; one in ten is a needle.
inline gsnav::GaussianCloud wall(std::size_t n, int sh_degree) {
  gsnav::Rng rng(1);
  gsnav::GaussianCloudBuilder builder(sh_degree);
  builder.reserve(n);
  std::array<float, 45> rest{};
  for (std::size_t i = 0; i < n;) {
    gsnav::RawGaussian g;
    g.mean = {rng.uniform(-3, 3), rng.uniform(-3, 3), rng.uniform(3, 4)};
    g.quat = {rng.normal(), rng.normal(), rng.normal(), rng.normal()};
    for (int k = 0; k < 3; ++k) g.log_scales[k] = std::log(0.012) + 0.5 * rng.normal();
    if (i % 10 == 0) g.log_scales.x += 3;
    g.opacity_logit = 2 * rng.normal();
    for (float& c : g.sh0) c = static_cast<float>(rng.normal());
    for (float& c : rest) c = static_cast<float>(0.2 * rng.normal());
    g.shN = sh_degree > 0 ? rest.data() : nullptr;
    if (builder.add(g)) ++i;  // the builder drops Gaussians that are too faint to be seen
  }
  return builder.cloud();
}

}  // namespace gsnav_bench
