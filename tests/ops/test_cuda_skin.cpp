// SPDX-License-Identifier: Apache-2.0
// Skinning of many avatars by one launch: the bits of the scalar form, whatever the avatars.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <initializer_list>
#include <memory>
#include <vector>

#if defined(GSNAV_HAS_CUDA)
#include "gsnav/backends/serial.hpp"
#include "gsnav/core/buffer.hpp"
#include "gsnav/core/rng.hpp"
#include "gsnav/detail/avatar/skinning_weights.hpp"
#include "gsnav/skin/skin.hpp"
#include "ops/no_gpu.hpp"

using namespace gsnav;
using gsnav_test::no_gpu;

namespace {

struct Body {
  std::size_t size = 0, joints = 55;
  int influences = kInfluences4;
  bool rotations = false;
  std::size_t offset = 0;  ///< of indices and weights in their arrays: 1 leaves them without alignment
};

/// An avatar's arrays on a backend, the same for every backend.
template <class S, class Out, class B>
struct BodyArrays {
  BodyArrays(B& b, const Body& body, std::uint64_t seed) : backend(&b) {
    Rng rng(seed);
    const std::size_t n = body.size, row = static_cast<std::size_t>(body.influences);
    for (std::size_t k = 0; k < 7; ++k) planes.emplace_back(n);
    std::vector<std::uint16_t> joints(row * n + body.offset), weights(row * n + body.offset);
    for (std::size_t i = 0; i < n; ++i) {
      Quatd q{rng.normal(), rng.normal(), rng.normal(), rng.normal()};
      normalize(q);
      const double values[7] = {
          rng.uniform(-1, 1), rng.uniform(-1, 1), rng.uniform(-1, 1), q.w, q.x, q.y, q.z};
      for (std::size_t k = 0; k < 7; ++k) planes[k][i] = static_cast<float>(values[k]);
      double shares[8], sum = 0;
      for (std::size_t k = 0; k < row; ++k)
        sum += shares[k] = k == 0 ? rng.uniform(0.5, 1) : rng.uniform(0, 0.5);
      for (std::size_t k = 0; k < row; ++k) shares[k] /= sum;
      round_weights(shares, row, &weights[body.offset + row * i]);
      for (std::size_t k = 0; k < row; ++k) {
        joints[body.offset + row * i + k] = static_cast<std::uint16_t>(rng.below(body.joints));
      }
    }
    std::vector<Affine3<S>> matrices;
    for (std::size_t j = 0; j < body.joints; ++j) {
      const Vec3d axis = normalized(Vec3d{rng.normal(), rng.normal(), rng.normal()});
      // Some that blend to no orientation.
      const Affine3<double> m{rotation_matrix(axis_angle(axis, rng.uniform(0, j % 5 == 0 ? 3.1 : 1.0))),
                              {rng.uniform(-1, 1), rng.uniform(-1, 1), rng.uniform(-1, 1)}};
      matrices.push_back(affine_cast<S>(m));
    }
    for (std::size_t k = 0; k < 7; ++k) {
      in.push_back(std::make_unique<Buffer<float, B>>(b));
      in.back()->upload(planes[k].data(), n);
    }
    for (int k = 0; k < 11; ++k) {
      out.push_back(std::make_unique<Buffer<Out, B>>(b));
      out.back()->resize_discard(n);
    }
    on_joints = std::make_unique<Buffer<std::uint16_t, B>>(b);
    on_weights = std::make_unique<Buffer<std::uint16_t, B>>(b);
    on_matrices = std::make_unique<Buffer<Affine3<S>, B>>(b);
    on_joints->upload(joints.data(), joints.size());
    on_weights->upload(weights.data(), weights.size());
    on_matrices->upload(matrices.data(), matrices.size());
    for (std::size_t k = 0; k < 3; ++k) {
      args.means[k] = {in[k]->data(), n};
      args.means_out[k] = {out[k]->data(), n};
    }
    for (std::size_t k = 0; k < 4; ++k) {
      args.quats[k] = {in[3 + k]->data(), n};
      args.quats_out[k] = {out[3 + k]->data(), n};
      if (body.rotations) args.rotations_out[k] = {out[7 + k]->data(), n};
    }
    args.influences = body.influences;
    args.joint_indices = {on_joints->data() + body.offset, row * n};
    args.weights = {on_weights->data() + body.offset, row * n};
    args.joints = {on_matrices->data(), body.joints};
    count = body.rotations ? 11 : 7;
  }
  /// All that was written, plane by plane.
  std::vector<Out> results() {
    const std::size_t n = args.size();
    std::vector<Out> all(count * n);
    for (std::size_t k = 0; k < count; ++k) out[k]->download(all.data() + k * n, n);
    REQUIRE(backend->synchronize().ok());
    return all;
  }

  B* backend;
  std::vector<std::vector<float>> planes;
  std::vector<std::unique_ptr<Buffer<float, B>>> in;
  std::vector<std::unique_ptr<Buffer<Out, B>>> out;
  std::unique_ptr<Buffer<std::uint16_t, B>> on_joints, on_weights;
  std::unique_ptr<Buffer<Affine3<S>, B>> on_matrices;
  SkinningArgs<S, Out> args;
  std::size_t count = 0;
};

void check(const std::vector<Body>& bodies) {
  CudaBackend cuda;
  SerialBackend serial;
  std::vector<std::unique_ptr<BodyArrays<float, float, CudaBackend>>> people;
  std::vector<SkinningArgs<float>> args;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    people.push_back(std::make_unique<BodyArrays<float, float, CudaBackend>>(cuda, bodies[i], 100 + i));
    args.push_back(people.back()->args);
  }
  skin_all<float, CudaBackend, float>(cuda, args).throw_if_error();
  std::size_t wrong = 0, values = 0;
  double worst = 0;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    CAPTURE(i);
    const std::vector<float> got = people[i]->results();
    BodyArrays<float, float, SerialBackend> same(serial, bodies[i], 100 + i);
    BodyArrays<double, double, SerialBackend> truth(serial, bodies[i], 100 + i);
    skin_gaussians<float>(serial, same.args).throw_if_error();
    skin_gaussians<double>(serial, truth.args).throw_if_error();
    const std::vector<float> want = same.results();
    const std::vector<double> exact = truth.results();
    REQUIRE(got.size() == want.size());
    for (std::size_t k = 0; k < got.size(); ++k) wrong += got[k] == want[k] ? 0 : 1;
    for (std::size_t k = 0; k < 3 * bodies[i].size; ++k) {
      worst = std::max(worst, std::abs(static_cast<double>(got[k]) - exact[k]));
    }
    values += got.size();
  }
  CHECK(wrong == 0);
  CHECK(worst < 2e-6);  // metres
  CHECK(values > 0);
}

}  // namespace

TEST_CASE("cuda skinning: sizes, numbers of joints, influences, what is written, where arrays begin") {
  if (no_gpu("cuda skinning")) return;
  std::vector<Body> bodies;
  for (const std::size_t size : std::initializer_list<std::size_t>{1, 31, 255, 256, 257, 5000, 70001})
    bodies.push_back({size});
  check(bodies);
  // Joints of which eight copies fit into shared memory, four, two, one and none.
  for (const std::size_t joints : std::initializer_list<std::size_t>{1, 128, 129, 300, 600, 1024, 1025})
    check({{3000, joints}, {0}, {700, 20, 8, true}});
  bodies.clear();
  for (std::size_t i = 0; i < 16; ++i) {
    bodies.push_back({400 + 77 * i, 20 + i, i % 2 == 0 ? 4 : 8, i % 4 < 2, i / 4 % 2});
  }
  check(bodies);
}

TEST_CASE("cuda skinning: more avatars than a launch takes along") {
  if (no_gpu("cuda skinning of crowds")) return;
  std::vector<Body> bodies;
  for (std::size_t i = 0; i < 50; ++i)
    bodies.push_back({1 + 97 * i, 5 + i, i % 9 == 8 ? 8 : 4, i % 3 == 0});
  check(bodies);
  for (std::size_t i = 0; i < 50; ++i) bodies.push_back({300, 60, i % 2 == 0 ? 4 : 8});
  check(bodies);
}
#else
TEST_CASE("cuda skinning") { std::printf("SKIP: cuda skinning: built without CUDA\n"); }
#endif
