// SPDX-License-Identifier: Apache-2.0
// Kernels of the joints of a body: polar rotation and forward kinematics.
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "gsnav/detail/skin/fk.hpp"
#include "gsnav/skin/lbs.hpp"
#include "kernel_bench.hpp"
#include "native_lanes.hpp"

using namespace gsnav;

namespace gsnav_bench {

namespace {

/// Blends of four rotations as skinning makes them. All have determinants above the limit of
/// polar_rotation.
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

  /// Adds the errors of `r`, the computed polar rotation of the matrix m.
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
  std::vector<Affine3<S>> globals;

  explicit Poses(std::size_t actors) {
    Rng rng(13);
    for (std::size_t j = 0; j < kJoints; ++j) {
      parents.push_back(j == 0 ? -1 : static_cast<std::int32_t>((j - 1) / 2));
    }
    for (std::size_t i = 0; i < actors * kJoints; ++i) {
      const Quat<double> q = random_turn(rng, 1);
      rotations.push_back(
          {static_cast<S>(q.w), static_cast<S>(q.x), static_cast<S>(q.y), static_cast<S>(q.z)});
      translations.push_back(vec_cast<S>(Vec3d{0.1 * rng.normal(), 0.3, 0.1 * rng.normal()}));
    }
    globals.resize(actors * kJoints);
  }
  /// Callable that poses actor a.
  auto kernel() {
    return [parents = view_of(std::as_const(parents)), rotations = rotations.data(),
            translations = translations.data(), globals = globals.data()](std::size_t a) noexcept {
      const std::size_t at = a * kJoints;
      forward_kinematics<S>(parents, {rotations + at, kJoints}, {translations + at, kJoints},
                            {globals + at, kJoints});
    };
  }
};

struct KinematicsBody {
  template <class S, class B>
  void operator()(benchmark::State& state, B& backend) const {
    constexpr std::size_t kActors = 256;
    Poses<S> poses(kActors);
    const auto kernel = poses.kernel();
    for (auto _ : state) {
      backend.parallel_for(kActors, kernel);
      benchmark::ClobberMemory();
    }
    count(state, kActors * kJoints);
    Poses<double> truth(kActors);
    SerialBackend().parallel_for(kActors, truth.kernel());
    double position = 0, rotation = 0;
    for (std::size_t i = 0; i < truth.globals.size(); ++i) {
      const Affine3<double> m = affine_cast<double>(poses.globals[i]);
      for (int r = 0; r < 3; ++r) {
        position = std::max(position, std::abs(m.translation[r] - truth.globals[i].translation[r]));
        for (int c = 0; c < 3; ++c) {
          rotation = std::max(rotation, std::abs(m.linear(r, c) - truth.globals[i].linear(r, c)));
        }
      }
    }
    state.counters["position_max_m"] = position;
    state.counters["rotation_max"] = rotation;
  }
};

}  // namespace

void register_body_kernels() {
  add_cpu_rows("polar", "", PolarBody{});
  add_openmp_rows("polar", "", "float x" + std::to_string(native_width()), PolarLanesBody{});
  add_cpu_rows("forward_kinematics", "joints:55", KinematicsBody{});
}

}  // namespace gsnav_bench
