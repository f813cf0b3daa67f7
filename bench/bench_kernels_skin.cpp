// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <chrono>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "floor_loops.hpp"
#if defined(GSNAV_HAS_CUDA)
#include "device_time.hpp"
#endif
#include "gsnav/core/buffer.hpp"
#include "gsnav/detail/avatar/skinning_weights.hpp"
#include "gsnav/scene/basic_renderer.hpp"
#include "gsnav/skin/skin.hpp"
#include "kernel_bench.hpp"

using namespace gsnav;

namespace gsnav_bench {

namespace {

std::vector<Affine3<double>> random_joints(Rng& rng) {
  std::vector<Affine3<double>> joints(kJoints);
  for (auto& m : joints) {
    m.linear = rotation_matrix(random_turn(rng, 1));
    m.translation = {rng.uniform(-1, 1), rng.uniform(-1, 1), rng.uniform(-1, 1)};
  }
  return joints;
}

/// One variant of skinning.
struct SkinWork {
  int influences;  ///< per Gaussian
  bool rotations;  ///< rotations are written too, which SH of degree 1 and above need

  /// Bytes that must be read and written for each Gaussian.
  std::size_t bytes() const {
    return (7 + 7 + (rotations ? 4u : 0u)) * sizeof(float) +
           static_cast<std::size_t>(influences) * 2 * sizeof(std::uint16_t);
  }
};

/// One skinning with all its arrays in the backend's memory.
template <class S, class Out, class B>
class SkinningRun {
 public:
  SkinningRun(B& backend, const GaussianCloud& cloud, const SkinWork& work)
      : backend_(&backend),
        arrays_(backend, cloud),
        indices_(backend),
        weights_(backend),
        joints_(backend) {
    const std::size_t n = cloud.size(), k = static_cast<std::size_t>(work.influences);
    Rng rng(3);
    std::vector<Affine3<S>> joints;
    for (const auto& m : random_joints(rng)) joints.push_back(affine_cast<S>(m));
    std::vector<std::uint16_t> indices(k * n), weights(k * n);
    const double share[8] = {0.55, 0.25, 0.125, 0.075, 0.05, 0.04, 0.02, 0.01};
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t j = 0; j < k; ++j)
        indices[k * i + j] = static_cast<std::uint16_t>(rng.below(kJoints));
      round_weights(share, k, &weights[k * i]);
    }
    joints_.upload(joints.data(), joints.size());
    indices_.upload(indices.data(), indices.size());
    weights_.upload(weights.data(), weights.size());
    const ShapeRows view = arrays_.set().gaussians.shape;
    const auto output = [&] {
      out_.emplace_back(backend).resize_discard(n);
      return out_.back().view();
    };
    for (std::size_t j = 0; j < 3; ++j) {
      args_.means[j] = view.means[j];
      args_.means_out[j] = output();
    }
    for (std::size_t j = 0; j < 4; ++j) {
      args_.quats[j] = view.quats[j];
      args_.quats_out[j] = output();
    }
    for (std::size_t j = 0; j < 4 && work.rotations; ++j) args_.rotations_out[j] = output();
    args_.influences = work.influences;
    args_.joint_indices = std::as_const(indices_).view();
    args_.weights = std::as_const(weights_).view();
    args_.joints = std::as_const(joints_).view();
  }
  void run() {
    skin_gaussians(*backend_, args_).throw_if_error();
    backend_->synchronize().throw_if_error();
  }
  const SkinningArgs<S, Out>& args() const noexcept { return args_; }
  /// Output plane k: 0 to 2 are x, y, z of the means; 3 to 6 are w, x, y, z of the quaternions.
  std::vector<Out> plane(std::size_t k) const {
    std::vector<Out> values(out_[k].size());
    out_[k].download(values.data(), values.size());
    backend_->synchronize().throw_if_error();
    return values;
  }

 private:
  B* backend_;
  GaussianArrays<B> arrays_;
  Buffer<std::uint16_t, B> indices_, weights_;
  Buffer<Affine3<S>, B> joints_;
  std::vector<Buffer<Out, B>> out_;
  SkinningArgs<S, Out> args_;
};

template <class S, class B>
using People = std::vector<std::unique_ptr<SkinningRun<S, float, B>>>;

template <class S, class B>
People<S, B> make_people(B& backend, const GaussianCloud& cloud, const SkinWork& work,
                         std::size_t count) {
  People<S, B> people;
  for (std::size_t p = 0; p < count; ++p) {
    people.push_back(std::make_unique<SkinningRun<S, float, B>>(backend, cloud, work));
  }
  return people;
}

/// Reports the largest errors of the first `count` people against float64.
template <class S, class B>
void report_errors(benchmark::State& state, const People<S, B>& people, std::size_t count,
                   const GaussianCloud& cloud, const SkinWork& work) {
  SerialBackend serial;
  SkinningRun<double, double, SerialBackend> truth(serial, cloud, work);
  truth.run();
  double means = 0, quats = 0;
  for (std::size_t p = 0; p < count; ++p) {
    for (std::size_t k = 0; k < 7; ++k) {
      double& worst = k < 3 ? means : quats;
      worst = std::max(worst, error_of(people[p]->plane(k), truth.plane(k)).max);
    }
  }
  state.counters["mean_max_m"] = means;
  state.counters["quat_max"] = quats;
}

/// Number of values whose bits differ from those of the scalar form.
template <class B>
double different_values(const SkinningRun<float, float, B>& skinning, const GaussianCloud& cloud,
                        const SkinWork& work) {
  SerialBackend serial;
  SkinningRun<float, float, SerialBackend> scalar(serial, cloud, work);
  scalar.run();
  double differ = 0;
  for (std::size_t k = 0; k < 7; ++k) {
    const std::vector<float> a = skinning.plane(k), b = scalar.plane(k);
    for (std::size_t i = 0; i < a.size(); ++i) differ += bits_of(a[i]) != bits_of(b[i]) ? 1 : 0;
  }
  return differ;
}

/// Number of threads of a backend on this processor; 0 for a device.
template <class B>
int processor_threads([[maybe_unused]] const B& backend) {
  if constexpr (requires { backend.threads(); }) return backend.threads();
  return is_host_backend<B> ? 1 : 0;
}

struct SkinBody {
  SkinWork work;
  template <class S, class B>
  void operator()(benchmark::State& state, B& backend) const {
    const GaussianCloud cloud = wall(200000, 0);
    // The loop takes one person after the other. Together they exceed the caches, so that each one is
    // read from memory.
    constexpr std::size_t kPeople = 6;
    const People<S, B> people = make_people<S>(backend, cloud, work, kPeople);
    people[0]->run();
    std::size_t next = 0;
    for (auto _ : state) people[next++ % kPeople]->run();
    report_errors<S, B>(state, people, 1, cloud, work);
    if constexpr (std::is_same_v<S, float>) {
      state.counters["bits_differ"] = different_values(*people[0], cloud, work);
    }
    count(state, cloud.size(), work.bytes());
    if (const int threads = processor_threads(backend); threads > 0) {
      // Ratio of the measured time to the time in which the same number of threads stream the same
      // number of bytes from memory.
      const double gigabytes = measure_bandwidth(threads);
      const double seconds = static_cast<double>(cloud.size() * work.bytes()) * 1e-9 / gigabytes;
      state.counters["stream_GB/s"] = gigabytes;
      state.counters["x_stream"] = benchmark::Counter(
          seconds, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
    }
  }
};

#if defined(GSNAV_HAS_CUDA)
/// Ten people in one call. The row's time is that of all ten together on the device. synchronised_us is
/// the time from the call until its work is done.
struct CrowdSkin {
  SkinWork work;
  template <class S, class B>
  void operator()(benchmark::State& state, B& backend) const {
    constexpr std::size_t kPeople = 10;
    const GaussianCloud cloud = wall(200000, 0);
    const People<S, B> people = make_people<S>(backend, cloud, work, kPeople);
    std::vector<SkinningArgs<S>> args;
    for (const auto& person : people) args.push_back(person->args());
    const auto run = [&] { skin_all<S, B, float>(backend, args).throw_if_error(); };
    run();
    backend.synchronize().throw_if_error();
    using Clock = std::chrono::steady_clock;
    DeviceTime device(backend);
    const Clock::time_point begin = Clock::now();
    for (auto _ : state) state.SetIterationTime(1e-6 * device.us(run));
    const std::chrono::duration<double, std::micro> passed = Clock::now() - begin;
    state.counters["synchronised_us"] = passed.count() / static_cast<double>(state.iterations());
    backend.synchronize().throw_if_error();
    report_errors<S, B>(state, people, kPeople, cloud, work);
    count(state, kPeople * cloud.size(), work.bytes());
  }
};
#endif

}  // namespace

void register_skin_kernels() {
  for (const SkinWork& work : {SkinWork{4, false}, SkinWork{4, true}, SkinWork{8, false}}) {
    const std::string variant =
        "influences:" + std::to_string(work.influences) + (work.rotations ? "/rotations" : "");
    add_cpu_rows("skin", variant, SkinBody{work});
    add_cuda_row("skin", variant, SkinBody{work});
#if defined(GSNAV_HAS_CUDA)
    add_cuda_row("skin_crowd", "people:10/" + variant, CrowdSkin{work}, TimedBy::body);
#endif
  }
}

}  // namespace gsnav_bench
