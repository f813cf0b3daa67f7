// SPDX-License-Identifier: Apache-2.0
// One row a kernel and backend: time with the error against the same kernel in float64 beside it.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "error.hpp"
#include "gsnav/backends/openmp.hpp"
#include "gsnav/backends/serial.hpp"
#include "gsnav/core/rng.hpp"
#include "gsnav/kernels/capsule.hpp"
#include "gsnav/ops/skin.hpp"
#include "gsnav/scene/renderer.hpp"

using namespace gsnav;

namespace {

/// A wall of n Gaussians three metres ahead, one in ten a needle.
GaussianCloud wall(std::size_t n, int sh_degree) {
  Rng rng(1);
  GaussianCloudBuilder builder(sh_degree);
  builder.reserve(n);
  std::array<float, 45> rest{};
  for (std::size_t i = 0; i < n; ++i) {
    RawGaussian g;
    g.mean = {rng.uniform(-3, 3), rng.uniform(-3, 3), rng.uniform(3, 4)};
    g.quat = {rng.normal(), rng.normal(), rng.normal(), rng.normal()};
    for (int k = 0; k < 3; ++k) g.log_scales[k] = std::log(0.012) + 0.5 * rng.normal();
    if (i % 10 == 0) g.log_scales.x += 3;
    g.opacity_logit = 2 * rng.normal();
    for (float& c : g.sh0) c = static_cast<float>(rng.normal());
    for (float& c : rest) c = static_cast<float>(0.2 * rng.normal());
    g.shN = sh_degree > 0 ? rest.data() : nullptr;
    builder.add(g);
  }
  return builder.cloud();
}

/// Everything the projection of one set writes, in the scalar S.
template <class S>
struct Projection {
  std::vector<SplatGeometry<S>> geometry;
  std::vector<SplatColor<S>> colors;
  std::vector<SplatDepth<S>> depths;
  std::vector<SplatBounds> bounds;
  std::vector<std::uint32_t> keys, counts;
  std::vector<Vec3<float>> offsets_f{Vec3<float>{}};
  std::vector<Vec3d> offsets{Vec3d{}};
  ProjectArgs<S> args;

  explicit Projection(const GaussianCloud& cloud) {
    Camera camera;
    camera.set_hfov(256, 256, 90);
    const GaussianSet set = cloud.set();
    args.gaussians = set.gaussians;
    args.camera = make_projection_camera<S>(camera, set);
    args.camera64 = make_projection_camera<double>(camera, set);
    args.sh_degree = cloud.sh_degree;
    const std::size_t slots = args.chunk_count() * kProjectChunk;
    geometry.resize(slots);
    colors.resize(slots);
    depths.resize(slots);
    bounds.resize(slots);
    keys.resize(slots);
    counts.resize(args.chunk_count());
    args.geometry = view_of(geometry);
    args.colors = view_of(colors);
    args.depths = view_of(depths);
    args.bounds = view_of(bounds);
    args.keys = view_of(keys);
    args.counts = view_of(counts);
    args.offsets = view_of(offsets);
    args.offsets_f = view_of(offsets_f);
  }
  /// Values of the survivors, in order.
  template <class F>
  std::vector<double> survivors(const F& value) const {
    std::vector<double> out;
    for (std::size_t c = 0; c < counts.size(); ++c) {
      for (std::size_t i = 0; i < counts[c]; ++i) value(c * kProjectChunk + i, out);
    }
    return out;
  }
};

template <class S, class B>
void project(benchmark::State& state) {
  const GaussianCloud cloud = wall(100000, static_cast<int>(state.range(0)));
  Projection<S> p(cloud);
  Projection<double> truth(cloud);
  B backend;
  const auto run = [&] {
    if constexpr (requires { backend.project(p.args); }) {
      backend.project(p.args);
    } else {
      backend.parallel_for(p.args.chunk_count(), ProjectChunk<S>{p.args});
    }
  };
  for (auto _ : state) run();
  SerialBackend().parallel_for(truth.args.chunk_count(), ProjectChunk<double>{truth.args});
  const auto mean = [](const auto& q) {
    return q.survivors([&](std::size_t i, std::vector<double>& out) {
      const auto& g = q.geometry[i];
      out.push_back(static_cast<double>(g.ref_x) - static_cast<double>(g.w1) / static_cast<double>(g.a));
    });
  };
  const auto color = [](const auto& q) {
    return q.survivors([&](std::size_t i, std::vector<double>& out) {
      out.push_back(static_cast<double>(q.colors[i].r));
    });
  };
  const auto footprint = [](const auto& q) {
    return q.survivors([&](std::size_t i, std::vector<double>& out) {
      out.push_back(static_cast<double>(q.geometry[i].b * q.geometry[i].a));
    });
  };
  std::vector<double> relative = footprint(p);
  const std::vector<double> footprint_truth = footprint(truth);
  for (std::size_t i = 0; i < relative.size(); ++i) relative[i] /= footprint_truth[i];
  state.counters["mean_px_max"] = gsnav_bench::error_of(mean(p), mean(truth)).max;
  state.counters["rgb_max"] = gsnav_bench::error_of(color(p), color(truth)).max;
  state.counters["sqrt_det_rel_max"] =
      gsnav_bench::error_of(relative, std::vector<double>(relative.size(), 1.0)).max;
  state.SetItemsProcessed(static_cast<std::int64_t>(state.iterations()) *
                          static_cast<std::int64_t>(cloud.size()));
}

template <class S, class B>
void blend(benchmark::State& state) {
  const GaussianCloud cloud = wall(static_cast<std::size_t>(state.range(0)), 0);
  Camera camera;
  camera.set_hfov(256, 256, 90);
  const std::vector<GaussianSet> sets{cloud.set()};
  const std::vector<Camera> cameras{camera};
  // The tile lists are made once; then only the blending runs.
  struct Recorder : B {
    RasterArgs<S> args{};
    void rasterize_tiles(const RasterArgs<S>& a) { args = a; }
  } recorder;
  RenderWorkspace<S, Recorder> workspace(recorder);
  std::vector<S> rgb(3 * 65536), alpha(65536), depth(65536);
  FrameImages<S> images{rgb.data(), alpha.data(), depth.data(), nullptr, nullptr, nullptr};
  render_camera<S>(recorder, workspace, sets, camera, {}, images).throw_if_error();
  B backend;
  for (auto _ : state) detail::rasterize(backend, recorder.args);
  SerialBackend serial;
  Renderer<double, SerialBackend> renderer(serial);
  const auto truth = renderer.render(sets, cameras).value();
  const auto e = gsnav_bench::error_of(rgb, truth.rgb);
  state.counters["rgb_max"] = e.max;
  state.counters["rgb_psnr"] = e.psnr;
}

/// Random rigid joints and weights for n Gaussians; what an avatar of 55 joints asks of skinning.
template <class S, class B>
void skin(benchmark::State& state) {
  const std::size_t n = static_cast<std::size_t>(state.range(0)), joints = 55;
  Rng rng(3);
  const GaussianCloud cloud = wall(n, 0);
  const GaussianView view = cloud.view();
  std::vector<Affine3<double>> matrices(joints);
  for (auto& m : matrices) {
    m.linear = rotation_matrix(
        axis_angle(normalized(Vec3d{rng.normal(), rng.normal(), rng.normal()}), rng.uniform(0, 1)));
    m.translation = {rng.uniform(-1, 1), rng.uniform(-1, 1), rng.uniform(-1, 1)};
  }
  std::vector<std::uint16_t> indices(4 * view.size);
  std::vector<float> weights(4 * view.size);
  for (std::size_t i = 0; i < view.size; ++i) {
    const float w[4] = {0.55f, 0.25f, 0.125f, 0.075f};
    for (std::size_t k = 0; k < 4; ++k) {
      indices[4 * i + k] = static_cast<std::uint16_t>(rng.below(joints));
      weights[4 * i + k] = w[k];
    }
  }
  const auto run = [&]<class T, class Out>(auto& backend, std::vector<std::vector<Out>>& out, bool check) {
    out.assign(7, std::vector<Out>(view.size));
    std::vector<Affine3<T>> converted;
    for (const auto& m : matrices) converted.push_back(affine_cast<T>(m));
    SkinningArgs<T, Out> args;
    for (std::size_t k = 0; k < 3; ++k) {
      args.means[k] = view.means[k];
      args.means_out[k] = view_of(out[k]);
    }
    for (std::size_t k = 0; k < 4; ++k) {
      args.quats[k] = view.quats[k];
      args.quats_out[k] = view_of(out[3 + k]);
    }
    args.joint_indices = view_of(std::as_const(indices));
    args.weights = view_of(std::as_const(weights));
    args.joints = view_of(std::as_const(converted));
    if (check) {
      skin_gaussians(backend, args).throw_if_error();
    } else {
      for (auto _ : state) skin_gaussians(backend, args).throw_if_error();
    }
  };
  B backend;
  SerialBackend serial;
  std::vector<std::vector<float>> out;
  std::vector<std::vector<double>> truth;
  run.template operator()<S, float>(backend, out, false);
  run.template operator()<double, double>(serial, truth, true);
  double mean_max = 0, quat_max = 0;
  for (std::size_t k = 0; k < 7; ++k) {
    double& worst = k < 3 ? mean_max : quat_max;
    worst = std::max(worst, gsnav_bench::error_of(out[k], truth[k]).max);
  }
  state.counters["mean_max_m"] = mean_max;
  state.counters["quat_max"] = quat_max;
  state.SetItemsProcessed(static_cast<std::int64_t>(state.iterations()) * static_cast<std::int64_t>(view.size));
}

struct CapsulePairs {
  std::vector<MovingCapsule<double>> agents, bodies;
  explicit CapsulePairs(std::size_t n) {
    Rng rng(5);
    for (std::size_t i = 0; i < n; ++i) {
      const Vec3d base{rng.uniform(-1, 1), 0, rng.uniform(-1, 1)};
      const double yaw = rng.uniform(0, 6.28);
      const Vec3d move{0.25 * std::cos(yaw), 0, 0.25 * std::sin(yaw)};
      const Capsule<double> a{base + Vec3d{0, 0.1, 0}, base + Vec3d{0, 1.4, 0}, 0.1};
      agents.push_back({a, {a.p0 + move, a.p1 + move, 0.1}});
      const auto point = [&] { return Vec3d{rng.uniform(-1, 1), rng.uniform(0, 1.7), rng.uniform(-1, 1)}; };
      const Vec3d p = point();
      const Vec3d q = p + Vec3d{0.3 * rng.normal(), 0.3 * rng.normal(), 0.3 * rng.normal()};
      const Vec3d v{0.2 * rng.normal(), 0, 0.2 * rng.normal()};
      bodies.push_back({{p, q, 0.08}, {p + v, q + v, 0.08}});
    }
  }
};

template <class S>
MovingCapsule<S> convert(const MovingCapsule<double>& m) {
  const auto c = [](const Capsule<double>& k) {
    return Capsule<S>{vec_cast<S>(k.p0), vec_cast<S>(k.p1), static_cast<S>(k.radius)};
  };
  return {c(m.begin), c(m.end)};
}

template <class S>
void capsule_distance(benchmark::State& state) {
  const CapsulePairs pairs(4096);
  std::vector<Capsule<S>> a, b;
  std::vector<double> truth;
  for (std::size_t i = 0; i < pairs.agents.size(); ++i) {
    a.push_back(convert<S>(pairs.agents[i]).begin);
    b.push_back(convert<S>(pairs.bodies[i]).begin);
    truth.push_back(capsule_gap(pairs.agents[i].begin, pairs.bodies[i].begin).gap);
  }
  std::vector<S> gaps(a.size());
  for (auto _ : state) {
    for (std::size_t i = 0; i < a.size(); ++i) gaps[i] = capsule_gap(a[i], b[i]).gap;
    benchmark::DoNotOptimize(gaps.data());
  }
  state.counters["gap_max_m"] = gsnav_bench::error_of(gaps, truth).max;
  state.SetItemsProcessed(static_cast<std::int64_t>(state.iterations()) *
                          static_cast<std::int64_t>(a.size()));
}

template <class S>
void capsule_sweep(benchmark::State& state) {
  const CapsulePairs pairs(4096);
  std::vector<MovingCapsule<S>> a, b;
  for (std::size_t i = 0; i < pairs.agents.size(); ++i) {
    a.push_back(convert<S>(pairs.agents[i]));
    b.push_back(convert<S>(pairs.bodies[i]));
  }
  std::vector<double> times(a.size());
  for (auto _ : state) {
    for (std::size_t i = 0; i < a.size(); ++i) {
      times[i] = static_cast<double>(sweep(a[i], b[i], SweepRules<S>{}).time);
    }
    benchmark::DoNotOptimize(times.data());
  }
  // The worst overlap at the reported time, measured in double: 0 or less is none.
  double deepest = -1;
  for (std::size_t i = 0; i < times.size(); ++i) {
    const auto at = [&](const MovingCapsule<double>& m) { return lerp(m.begin, m.end, times[i]); };
    const double start = capsule_gap(pairs.agents[i].begin, pairs.bodies[i].begin).gap;
    if (start < 1e-4) continue;
    deepest = std::max(deepest, -capsule_gap(at(pairs.agents[i]), at(pairs.bodies[i])).gap);
  }
  state.counters["overlap_max_m"] = deepest;
  state.SetItemsProcessed(static_cast<std::int64_t>(state.iterations()) *
                          static_cast<std::int64_t>(a.size()));
}

struct OneThread : OpenMPBackend {
  OneThread() : OpenMPBackend(1) {}
};

BENCHMARK(project<float, SerialBackend>)->Arg(0)->Arg(3)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(project<float, OneThread>)->Arg(0)->Arg(3)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(project<float, OpenMPBackend>)->Arg(0)->Arg(3)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(project<double, SerialBackend>)->Arg(0)->Arg(3)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(blend<float, OneThread>)->Arg(100000)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(blend<float, OpenMPBackend>)->Arg(100000)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(blend<float, SerialBackend>)->Arg(100000)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(skin<float, SerialBackend>)->Arg(200000)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(skin<float, OpenMPBackend>)->Arg(200000)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(skin<double, SerialBackend>)->Arg(200000)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(capsule_distance<float>)->UseRealTime();
BENCHMARK(capsule_distance<double>)->UseRealTime();
BENCHMARK(capsule_sweep<float>)->UseRealTime();
BENCHMARK(capsule_sweep<double>)->UseRealTime();

}  // namespace

BENCHMARK_MAIN();
