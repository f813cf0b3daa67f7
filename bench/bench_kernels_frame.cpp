// SPDX-License-Identifier: Apache-2.0
// Kernels of a frame: projection, SH, sort keys, radix sort, binning, blending.
#include <algorithm>
#include <utility>
#include <vector>

#include "frame_stages.hpp"
#include "kernel_bench.hpp"
#include "native_lanes.hpp"

using namespace gsnav;

namespace gsnav_bench {

namespace {

Camera front_camera() {
  Camera camera;
  camera.set_hfov(256, 256, 90);
  return camera;
}

RenderConfig rgb_only() {
  RenderConfig config;
  config.outputs = kRgb;
  return config;
}

template <class T, class F>
std::vector<double> values_of(const std::vector<T>& records, const F& value) {
  std::vector<double> out(records.size());
  std::transform(records.begin(), records.end(), out.begin(),
                 [&](const T& r) { return static_cast<double>(value(r)); });
  return out;
}

struct ProjectBody {
  int sh_degree;
  template <class S, class B>
  void operator()(benchmark::State& state, B& backend) const {
    const GaussianCloud cloud = wall(100000, sh_degree);
    FrameStages<S, B> stages(backend, cloud, front_camera());
    SerialBackend serial;
    const FrameStages<double, SerialBackend> truth(serial, cloud, front_camera());
    for (auto _ : state) stages.project();
    const auto mean_x = [](const auto& g) {
      return static_cast<double>(g.ref_x) - static_cast<double>(g.w1) / static_cast<double>(g.a);
    };
    const auto root_det = [](const auto& g) {
      return static_cast<double>(g.a) * static_cast<double>(g.b);
    };
    const auto geometry = stages.survivors_geometry();
    const auto geometry64 = truth.survivors_geometry();
    state.counters["survivors_differ"] =
        std::abs(static_cast<double>(geometry.size()) - static_cast<double>(geometry64.size()));
    if (geometry.size() == geometry64.size()) {
      std::vector<double> relative = values_of(geometry, root_det);
      const std::vector<double> root_det64 = values_of(geometry64, root_det);
      for (std::size_t i = 0; i < relative.size(); ++i) relative[i] /= root_det64[i];
      const auto red = [](const auto& c) { return c.r; };
      state.counters["mean_px_max"] =
          error_of(values_of(geometry, mean_x), values_of(geometry64, mean_x)).max;
      state.counters["sqrt_det_rel_max"] =
          error_of(relative, std::vector<double>(relative.size(), 1.0)).max;
      state.counters["rgb_max"] =
          error_of(values_of(stages.survivors_colors(), red), values_of(truth.survivors_colors(), red))
              .max;
    }
    count(state, cloud.size());
  }
};

/// Directions and coefficients of n Gaussians.
struct ShInput {
  GaussianCloud cloud;
  std::vector<Vec3<float>> deltas;
  std::vector<double> truth;  // red, green and blue of each Gaussian

  ShInput(std::size_t n, int degree) : cloud(wall(n, degree)) {
    Rng rng(7);
    const ColorRows view = cloud.view().color;
    for (std::size_t i = 0; i < n; ++i) {
      deltas.push_back(
          vec_cast<float>(Vec3d{rng.uniform(-3, 3), rng.uniform(-3, 3), rng.uniform(1, 4)}));
      const SplatColor<double> c = gaussian_color<double>(view, degree, i, vec_cast<double>(deltas[i]));
      truth.insert(truth.end(), {c.r, c.g, c.b});
    }
  }
  std::size_t bytes_per_item(int degree) const {
    return sizeof(float) * static_cast<std::size_t>(3 * sh_coefficient_count(degree) + 6);
  }
};

constexpr std::size_t kShItems = 65536;

struct ShBody {
  int degree;
  template <class S, class B>
  void operator()(benchmark::State& state, B& backend) const {
    const ShInput input(kShItems, degree);
    const ColorRows view = input.cloud.view().color;
    std::vector<SplatColor<S>> colors(kShItems);
    const auto evaluate = [view, deltas = input.deltas.data(), out = colors.data(),
                           d = degree](std::size_t i) {
      out[i] = gaussian_color<S>(view, d, i, vec_cast<S>(deltas[i]));
    };
    time_items(state, backend, kShItems, evaluate, input.bytes_per_item(degree));
    std::vector<double> flat;
    for (const SplatColor<S>& c : colors) {
      for (const S v : {c.r, c.g, c.b}) flat.push_back(static_cast<double>(v));
    }
    state.counters["rgb_max"] = error_of(flat, input.truth).max;
  }
};

/// The same kernel in lanes, with coefficients by planes.
struct ShLanesBody {
  int degree;
  template <class S, class B>
  void operator()(benchmark::State& state, B& backend) const {
    const ShInput input(kShItems, degree);
    const std::size_t n = kShItems,
                      coefficients = static_cast<std::size_t>(sh_coefficient_count(degree));
    const ColorRows view = input.cloud.view().color;
    std::vector<float> in(3 * coefficients * n), deltas(3 * n), colors(3 * n);
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t c = 0; c < 3; ++c) {
        deltas[c * n + i] = input.deltas[i][static_cast<int>(c)];
        in[c * n + i] = view.sh0[3 * i + c];
        for (std::size_t k = 1; k < coefficients; ++k) {
          in[(3 * k + c) * n + i] = view.shN[(i * (coefficients - 1) + k - 1) * 3 + c];
        }
      }
    }
    ShPlanes planes{in.data(), {}, {}, n};
    for (std::size_t c = 0; c < 3; ++c) {
      planes.deltas[c] = deltas.data() + c * n;
      planes.colors[c] = colors.data() + c * n;
    }
    constexpr std::size_t kPiece = 1024;
    for (auto _ : state) {
      backend.parallel_for(
          n / kPiece, [&](std::size_t p) { native_sh(planes, degree, p * kPiece, (p + 1) * kPiece); });
      benchmark::ClobberMemory();
    }
    count(state, n, input.bytes_per_item(degree));
    std::vector<double> flat;
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t c = 0; c < 3; ++c) flat.push_back(static_cast<double>(colors[c * n + i]));
    }
    state.counters["rgb_max"] = error_of(flat, input.truth).max;
  }
};

/// The sort key of each Gaussian; in double, the depth that the key encodes.
struct KeyBody {
  template <class S, class B>
  void operator()(benchmark::State& state, B& backend) const {
    const GaussianCloud cloud = wall(100000, 0);
    const std::size_t n = cloud.size();
    const GaussianRows rows = cloud.view();
    const ShapeRows& view = rows.shape;
    const Camera camera = Camera::look_at({0.1, 0.2, -1}, {0, 0, 3}, {0, 1, 0}, 256, 256, 90);
    const auto projection64 = make_projection_camera<double>(camera, cloud.set());
    const Vec3d offset = (rows.origins.empty() ? Vec3d{} : rows.origins[0]) - projection64.position;
    std::vector<S> depths(n);
    std::vector<std::uint32_t> codes(n);
    const auto depth64 = [&](std::size_t i) {
      const Vec3d mean{view.means[0][i], view.means[1][i], view.means[2][i]};
      return dot(projection64.rotation.row[2], mean + offset) * projection64.scale;
    };
    const auto key = [&](std::size_t i) {
      if constexpr (std::is_same_v<S, double>) {
        depths[i] = depth64(i);
      } else {
        const Vec3d mean{view.means[0][i], view.means[1][i], view.means[2][i]};
        depths[i] = static_cast<float>(depth_key(projection64, mean + offset));
        codes[i] = projection64.key_code(depths[i]);
      }
    };
    time_items(state, backend, n, key, 5 * sizeof(float));
    double relative = 0;
    for (std::size_t i = 0; i < n; ++i) {
      const double truth = depth64(i);
      relative = std::max(relative, std::abs((static_cast<double>(depths[i]) - truth) / truth));
    }
    state.counters["depth_rel_max"] = relative;
  }
};

struct SortInput {
  std::vector<std::uint32_t> keys, values, truth;

  SortInput(std::size_t n, int bits) {
    Rng rng(11);
    const KeyCode code = KeyCode::of(bits, 0.2f);
    for (std::size_t i = 0; i < n; ++i) {
      keys.push_back(code(static_cast<float>(rng.uniform(0.3, 12))));
      values.push_back(static_cast<std::uint32_t>(i));
    }
    truth = values;
    std::stable_sort(truth.begin(), truth.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return keys[a] < keys[b]; });
  }
};

double misplaced(const std::vector<std::uint32_t>& order, const std::vector<std::uint32_t>& truth) {
  double n = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) n += order[i] != truth[i] ? 1 : 0;
  return n;
}

struct SortBody {
  std::size_t n;
  int bits;
  template <class S, class B>
  void operator()(benchmark::State& state, B& backend) const {
    const SortInput input(n, bits);
    Buffer<std::uint32_t, B> keys(backend), values(backend);
    SortScratch<B> scratch(backend);
    for (auto _ : state) {
      state.PauseTiming();
      keys.upload(input.keys.data(), n);
      values.upload(input.values.data(), n);
      backend.synchronize().throw_if_error();
      state.ResumeTiming();
      sort_pairs(backend, keys, values, scratch, bits);
      backend.synchronize().throw_if_error();
    }
    std::vector<std::uint32_t> order(n);
    values.download(order.data(), n);
    backend.synchronize().throw_if_error();
    state.counters["misplaced"] = misplaced(order, input.truth);
    count(state, n);
  }
};

/// The baseline: sorts pairs with std::stable_sort.
struct StableSortBody {
  std::size_t n;
  int bits;
  template <class S, class B>
  void operator()(benchmark::State& state, B&) const {
    const SortInput input(n, bits);
    std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs(n);
    for (auto _ : state) {
      state.PauseTiming();
      for (std::size_t i = 0; i < n; ++i) pairs[i] = {input.keys[i], input.values[i]};
      state.ResumeTiming();
      std::stable_sort(pairs.begin(), pairs.end(),
                       [](const auto& a, const auto& b) { return a.first < b.first; });
    }
    std::vector<std::uint32_t> order;
    for (const auto& p : pairs) order.push_back(p.second);
    state.counters["misplaced"] = misplaced(order, input.truth);
    count(state, n);
  }
};

struct BinBody {
  template <class S, class B>
  void operator()(benchmark::State& state, B& backend) const {
    const GaussianCloud cloud = wall(100000, 0);
    FrameStages<S, B> stages(backend, cloud, front_camera(), rgb_only());
    SerialBackend serial;
    const FrameStages<double, SerialBackend> truth(serial, cloud, front_camera(), rgb_only());
    for (auto _ : state) stages.bin();
    const std::vector<std::uint64_t> offsets = stages.tile_offsets(), offsets64 = truth.tile_offsets();
    double differ = 0;
    for (std::size_t t = 0; t + 1 < offsets.size(); ++t) {
      differ += std::abs(static_cast<double>(offsets[t + 1] - offsets[t]) -
                         static_cast<double>(offsets64[t + 1] - offsets64[t]));
    }
    state.counters["pairs_differ"] = differ;
    count(state, stages.pairs());
  }
};

struct BlendBody {
  Quality quality;
  template <class S, class B>
  void operator()(benchmark::State& state, B& backend) const {
    const GaussianCloud cloud = wall(100000, 0);
    RenderConfig config = rgb_only();
    SerialBackend serial;
    FrameStages<double, SerialBackend> truth(serial, cloud, front_camera(), config);
    truth.blend();
    config.quality = quality;
    FrameStages<S, B> stages(backend, cloud, front_camera(), config);
    for (auto _ : state) stages.blend();
    const ErrorStats e = error_of(stages.image(), truth.image());
    state.counters["rgb_max"] = e.max;
    state.counters["rgb_psnr"] = e.psnr;
    count(state, stages.pixels());
  }
};

}  // namespace

void register_frame_kernels() {
  for (const int degree : {0, 3}) {
    const std::string variant = "degree:" + std::to_string(degree);
    add_cpu_rows("project", variant, ProjectBody{degree});
    add_cuda_row("project", variant, ProjectBody{degree});
  }
  for (int degree = 0; degree <= kMaxShDegree; ++degree) {
    const std::string variant = "degree:" + std::to_string(degree);
    add_cpu_rows("sh", variant, ShBody{degree});
    add_openmp_rows("sh", variant, "float x" + std::to_string(native_width()), ShLanesBody{degree});
  }
  add_cpu_rows("key", "", KeyBody{});
  for (const std::size_t n : {std::size_t{50000}, std::size_t{500000}}) {
    for (const int bits : {32, 22}) {
      const std::string variant = "keys:" + std::to_string(n) + "/bits:" + std::to_string(bits);
      add_row<float, SerialBackend>("stable_sort", variant, "uint32", "SerialBackend",
                                    StableSortBody{n, bits});
      add_row<float, SerialBackend>("sort_pairs", variant, "uint32", "SerialBackend", SortBody{n, bits});
      add_openmp_rows("sort_pairs", variant, "uint32", SortBody{n, bits});
      add_cuda_row("sort_pairs", variant, SortBody{n, bits});
    }
  }
  add_cpu_rows("bin", "", BinBody{});
  add_cuda_row("bin", "", BinBody{});
  add_cpu_rows("blend", "exact", BlendBody{Quality::exact()});
  add_cuda_row("blend", "exact", BlendBody{Quality::exact()});
  add_openmp_rows("blend", "fast", "float", BlendBody{Quality::fast()});
  add_cuda_row("blend", "fast", BlendBody{Quality::fast()});
}

}  // namespace gsnav_bench
