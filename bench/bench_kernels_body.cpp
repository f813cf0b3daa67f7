// SPDX-License-Identifier: Apache-2.0
// Kernels of bodies: linear blend skinning, polar rotation, forward kinematics.
#include <algorithm>
#include <chrono>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "floor_loops.hpp"
#if defined(GSNAV_HAS_CUDA)
#include "device_time.hpp"
#endif
#include "gsnav/core/buffer.hpp"
#include "gsnav/detail/avatar/skinning_weights.hpp"
#include "gsnav/detail/skin/fk.hpp"
#include "gsnav/scene/basic_renderer.hpp"
#include "gsnav/skin/skin.hpp"
#include "kernel_bench.hpp"
#include "native_lanes.hpp"

using namespace gsnav;

namespace gsnav_bench {

namespace {

/// Joints of an SMPL-X body.
constexpr std::size_t kJoints = 55;

Quat<double> random_turn(Rng& rng, double most) {
  return axis_angle(normalized(Vec3d{rng.normal(), rng.normal(), rng.normal()}), rng.uniform(0, most));
}

std::vector<Affine3<double>> random_joints(Rng& rng) {
  std::vector<Affine3<double>> joints(kJoints);
  for (auto& m : joints) {
    m.linear = rotation_matrix(random_turn(rng, 1));
    m.translation = {rng.uniform(-1, 1), rng.uniform(-1, 1), rng.uniform(-1, 1)};
  }
  return joints;
}

/// Joints and weights of each Gaussian, and what it is asked for.
struct SkinWork {
  int influences;
  bool rotations;  ///< written too, as SH of degree 1 and above need them

  /// Read and written for each Gaussian, at least.
  std::size_t bytes() const {
    return (7 + 7 + (rotations ? 4u : 0u)) * sizeof(float) +
           static_cast<std::size_t>(influences) * 2 * sizeof(std::uint16_t);
  }
};

/// One skinning with all its arrays in the backend's memory.
template <class S, class Out, class B>
class Skinning {
 public:
  Skinning(B& backend, const GaussianCloud& cloud, const SkinWork& work)
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
  /// Plane k: x y z of the means, then w x y z of the quaternions.
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

/// Threads of a backend on this processor; 0 for a device.
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
    // People in turn, together more than the caches hold: each comes from memory.
    constexpr std::size_t kPeople = 6;
    std::vector<std::unique_ptr<Skinning<S, float, B>>> people;
    for (std::size_t p = 0; p < kPeople; ++p) {
      people.push_back(std::make_unique<Skinning<S, float, B>>(backend, cloud, work));
    }
    Skinning<S, float, B>& skinning = *people[0];
    skinning.run();
    SerialBackend serial;
    Skinning<double, double, SerialBackend> truth(serial, cloud, work);
    truth.run();
    std::size_t next = 0;
    for (auto _ : state) people[next++ % kPeople]->run();
    double worst[2] = {0, 0};  // means, quaternions
    for (std::size_t k = 0; k < 7; ++k) {
      double& w = worst[k < 3 ? 0 : 1];
      w = std::max(w, error_of(skinning.plane(k), truth.plane(k)).max);
    }
    if constexpr (std::is_same_v<S, float>) {  // against the scalar form: values whose bits are not its
      Skinning<float, float, SerialBackend> scalar(serial, cloud, work);
      scalar.run();
      double differ = 0;
      for (std::size_t k = 0; k < 7; ++k) {
        const std::vector<float> a = skinning.plane(k), b = scalar.plane(k);
        for (std::size_t i = 0; i < a.size(); ++i) differ += bits_of(a[i]) != bits_of(b[i]) ? 1 : 0;
      }
      state.counters["bits_differ"] = differ;
    }
    state.counters["mean_max_m"] = worst[0];
    state.counters["quat_max"] = worst[1];
    count(state, cloud.size(), work.bytes());
    if (const int threads = processor_threads(backend); threads > 0) {
      // The time over that in which as many threads stream as many bytes from memory.
      const double gigabytes = measure_bandwidth(threads);
      const double seconds = static_cast<double>(cloud.size() * work.bytes()) * 1e-9 / gigabytes;
      state.counters["stream_GB/s"] = gigabytes;
      state.counters["x_stream"] = benchmark::Counter(
          seconds, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
    }
  }
};

#if defined(GSNAV_HAS_CUDA)
/// Ten people in one call, the time of all together on the device; synchronised_us: that of the call
/// until it is done.
struct CrowdBody {
  SkinWork work;
  template <class S, class B>
  void operator()(benchmark::State& state, B& backend) const {
    constexpr std::size_t kPeople = 10;
    const GaussianCloud cloud = wall(200000, 0);
    std::vector<std::unique_ptr<Skinning<S, float, B>>> people;
    std::vector<SkinningArgs<S>> args;
    for (std::size_t p = 0; p < kPeople; ++p) {
      people.push_back(std::make_unique<Skinning<S, float, B>>(backend, cloud, work));
      args.push_back(people.back()->args());
    }
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
    SerialBackend serial;
    Skinning<double, double, SerialBackend> truth(serial, cloud, work);
    truth.run();
    double worst[2] = {0, 0};  // means, quaternions
    for (const auto& person : people) {
      for (std::size_t k = 0; k < 7; ++k) {
        double& w = worst[k < 3 ? 0 : 1];
        w = std::max(w, error_of(person->plane(k), truth.plane(k)).max);
      }
    }
    state.counters["mean_max_m"] = worst[0];
    state.counters["quat_max"] = worst[1];
    count(state, kPeople * cloud.size(), work.bytes());
  }
};
#endif

/// Blends of four rotations as skinning makes them, all with determinants above its limit.
std::vector<Mat3<double>> blended_matrices(std::size_t n) {
  Rng rng(9);
  std::vector<Mat3<double>> matrices;
  while (matrices.size() < n) {
    Mat3<double> m = rotation_matrix(random_turn(rng, 2)) * 0.55;
    for (const double w : {0.25, 0.125, 0.075}) m = m + rotation_matrix(random_turn(rng, 2)) * w;
    if (determinant(m) > kMinBlendDeterminant) matrices.push_back(m);
  }
  return matrices;
}

constexpr std::size_t kMatrices = 32768;

struct PolarErrors {
  double rotation = 0, orthogonality = 0;

  /// `r` is what came out for the matrix m.
  void add(const Mat3<double>& m, const Mat3<double>& r) {
    const Mat3<double> truth = polar_rotation(m), gram = r * transpose(r);
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        rotation = std::max(rotation, std::abs(r(i, j) - truth(i, j)));
        orthogonality = std::max(orthogonality, std::abs(gram(i, j) - (i == j ? 1.0 : 0.0)));
      }
    }
  }
  void report(benchmark::State& state) const {
    state.counters["rotation_max"] = rotation;
    state.counters["orthogonality_max"] = orthogonality;
  }
};

struct PolarBody {
  template <class S, class B>
  void operator()(benchmark::State& state, B& backend) const {
    const std::vector<Mat3<double>> input = blended_matrices(kMatrices);
    std::vector<Mat3<S>> in(kMatrices), out(kMatrices);
    for (std::size_t i = 0; i < kMatrices; ++i) in[i] = mat_cast<S>(input[i]);
    time_items(state, backend, kMatrices,
               [in = in.data(), out = out.data()](std::size_t i) { out[i] = polar_rotation(in[i]); });
    PolarErrors errors;
    for (std::size_t i = 0; i < kMatrices; ++i)
      errors.add(mat_cast<double>(in[i]), mat_cast<double>(out[i]));
    errors.report(state);
  }
};

struct PolarLanesBody {
  template <class S, class B>
  void operator()(benchmark::State& state, B& backend) const {
    const std::vector<Mat3<double>> input = blended_matrices(kMatrices);
    std::vector<float> in(9 * kMatrices), out(9 * kMatrices);
    const float* from[9];
    float* to[9];
    for (std::size_t k = 0; k < 9; ++k) {
      from[k] = in.data() + k * kMatrices;
      to[k] = out.data() + k * kMatrices;
      for (std::size_t i = 0; i < kMatrices; ++i) {
        in[k * kMatrices + i] =
            static_cast<float>(input[i](static_cast<int>(k / 3), static_cast<int>(k % 3)));
      }
    }
    constexpr std::size_t kPiece = 1024;
    for (auto _ : state) {
      backend.parallel_for(kMatrices / kPiece,
                           [&](std::size_t p) { native_polar(from, to, p * kPiece, (p + 1) * kPiece); });
      benchmark::ClobberMemory();
    }
    count(state, kMatrices);
    const auto matrix = [](const auto& planes, std::size_t i) {
      Mat3<double> m;
      for (int k = 0; k < 9; ++k) m(k / 3, k % 3) = static_cast<double>(planes[k][i]);
      return m;
    };
    PolarErrors errors;
    for (std::size_t i = 0; i < kMatrices; ++i) errors.add(matrix(from, i), matrix(to, i));
    errors.report(state);
  }
};

/// Poses of a tree of joints in the scalar S.
template <class S>
struct Poses {
  std::vector<std::int32_t> parents;
  std::vector<Quat<S>> rotations;
  std::vector<Vec3<S>> translations;
  std::vector<Affine3<S>> inverse_binds, globals, matrices;

  explicit Poses(std::size_t actors) {
    Rng rng(13);
    for (std::size_t j = 0; j < kJoints; ++j) {
      parents.push_back(j == 0 ? -1 : static_cast<std::int32_t>((j - 1) / 2));
      inverse_binds.push_back(
          {Mat3<S>::identity(), vec_cast<S>(Vec3d{rng.uniform(-1, 1), rng.uniform(-1, 1), 0})});
    }
    for (std::size_t i = 0; i < actors * kJoints; ++i) {
      const Quat<double> q = random_turn(rng, 1);
      rotations.push_back(
          {static_cast<S>(q.w), static_cast<S>(q.x), static_cast<S>(q.y), static_cast<S>(q.z)});
      translations.push_back(vec_cast<S>(Vec3d{0.1 * rng.normal(), 0.3, 0.1 * rng.normal()}));
    }
    globals.resize(actors * kJoints);
    matrices.resize(actors * kJoints);
  }
  ForwardKinematics<S> kernel() {
    ForwardKinematicsArgs<S> args;
    args.parents = view_of(std::as_const(parents));
    args.rotations = view_of(std::as_const(rotations));
    args.translations = view_of(std::as_const(translations));
    args.inverse_binds = view_of(std::as_const(inverse_binds));
    args.globals = view_of(globals);
    args.joint_matrices = view_of(matrices);
    return {args};
  }
};

struct KinematicsBody {
  template <class S, class B>
  void operator()(benchmark::State& state, B& backend) const {
    constexpr std::size_t kActors = 256;
    Poses<S> poses(kActors);
    const ForwardKinematics<S> kernel = poses.kernel();
    for (auto _ : state) {
      backend.parallel_for(kActors, kernel);
      benchmark::ClobberMemory();
    }
    count(state, kActors * kJoints);
    Poses<double> truth(kActors);
    SerialBackend().parallel_for(kActors, truth.kernel());
    double position = 0, rotation = 0;
    for (std::size_t i = 0; i < truth.matrices.size(); ++i) {
      const Affine3<double> m = affine_cast<double>(poses.matrices[i]);
      for (int r = 0; r < 3; ++r) {
        position = std::max(position, std::abs(m.translation[r] - truth.matrices[i].translation[r]));
        for (int c = 0; c < 3; ++c) {
          rotation = std::max(rotation, std::abs(m.linear(r, c) - truth.matrices[i].linear(r, c)));
        }
      }
    }
    state.counters["position_max_m"] = position;
    state.counters["rotation_max"] = rotation;
  }
};

}  // namespace

void register_body_kernels() {
  for (const SkinWork& work : {SkinWork{4, false}, SkinWork{4, true}, SkinWork{8, false}}) {
    const std::string variant =
        "influences:" + std::to_string(work.influences) + (work.rotations ? "/rotations" : "");
    add_cpu_rows("skin", variant, SkinBody{work});
    add_cuda_row("skin", variant, SkinBody{work});
#if defined(GSNAV_HAS_CUDA)
    add_cuda_row("skin_crowd", "people:10/" + variant, CrowdBody{work}, TimedBy::body);
#endif
  }
  add_cpu_rows("polar", "", PolarBody{});
  add_openmp_rows("polar", "", "float x" + std::to_string(native_width()), PolarLanesBody{});
  add_cpu_rows("forward_kinematics", "joints:55", KinematicsBody{});
}

}  // namespace gsnav_bench
