// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "gsnav/detail/frame/projection.hpp"
#include "hard_cases/backends.hpp"
#include "hard_cases/truth.hpp"

namespace gsnav_test {

/// A Gaussian for `project`, in float: what every scalar and the truth start from.
struct Sample {
  float position[3]{}, quat[4]{1, 0, 0, 0}, scale[3]{};
  float opacity = 1;

  TruthSplat truth(const gsnav::ProjectionCamera<double>& camera) const {
    TruthSplat t;
    for (int k = 0; k < 3; ++k) {
      t.mean[k] = position[k];
      t.scale[k] = scale[k];
    }
    for (int k = 0; k < 4; ++k) t.quat[k] = quat[k];
    t.opacity = opacity;
    t.eps2d = static_cast<Real>(camera.eps2d);
    t.mip = camera.mip;
    return t;
  }
};

/// What `project` gave for a sample, in double.
struct SampleResult {
  double mean_x, mean_y, a, k, b, log2_opacity, s_max;
  /// a b = kWhitenScale^2 / sqrt(det): the determinant is what the triple says it is.
  Real det() const {
    const Real product = static_cast<Real>(a) * b;
    return std::pow(static_cast<Real>(gsnav::kWhitenScale), 4) / (product * product);
  }
};

/// `project` over the samples in lanes of L; a camera at the origin along +z.
template <class L>
std::vector<SampleResult> project_samples(const gsnav::Camera& camera, const gsnav::GaussianSet& set,
                                          const std::vector<Sample>& samples) {
  using namespace gsnav;
  using S = scalar_of<L>;
  constexpr int kLanes = LaneIo<L>::width;
  const ProjectionCamera<S> projection = make_projection_camera<S>(camera, set);
  std::vector<SampleResult> results(samples.size());
  for (std::size_t first = 0; first < samples.size(); first += kLanes) {
    const auto at = [&](int lane) {
      return std::min(first + static_cast<std::size_t>(lane), samples.size() - 1);
    };
    const auto load = [&](const auto& field) {
      float values[kLanes];
      for (int l = 0; l < kLanes; ++l) values[l] = field(samples[at(l)]);
      return LaneIo<L>::load(values);
    };
    Vec3<L> position, scales;
    for (int k = 0; k < 3; ++k) {
      position[k] = load([k](const Sample& s) { return s.position[k]; });
      scales[k] = load([k](const Sample& s) { return s.scale[k]; });
    }
    Quat<L> quat{load([](const Sample& s) { return s.quat[0]; }),
                 load([](const Sample& s) { return s.quat[1]; }),
                 load([](const Sample& s) { return s.quat[2]; }),
                 load([](const Sample& s) { return s.quat[3]; })};
    if constexpr (std::is_same_v<S, double>) normalize(quat);  // as row_axes does
    const auto axes = splat_axes(projection.rotation, position, quat, scales);
    const auto p =
        project<L, L>(projection, axes, position.z, load([](const Sample& s) { return s.opacity; }));
    double out[7][kLanes];
    LaneIo<L>::store(p.mean_x, out[0]);
    LaneIo<L>::store(p.mean_y, out[1]);
    LaneIo<L>::store(p.a, out[2]);
    LaneIo<L>::store(p.k, out[3]);
    LaneIo<L>::store(p.b, out[4]);
    LaneIo<L>::store(p.log2_opacity, out[5]);
    LaneIo<L>::store(p.s_max, out[6]);
    for (int l = 0; l < kLanes && first + static_cast<std::size_t>(l) < samples.size(); ++l) {
      results[first + static_cast<std::size_t>(l)] = {out[0][l], out[1][l], out[2][l], out[3][l],
                                                      out[4][l], out[5][l], out[6][l]};
    }
  }
  return results;
}

}  // namespace gsnav_test
