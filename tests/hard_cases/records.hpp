// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "gsnav/detail/frame/project_chunk.hpp"
#include "gsnav/render/config.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"

namespace gsnav_test {

/// The records that a frame makes of one Gaussian of a cloud (without origins), by the kernel itself.
template <class S>
class RecordMaker {
 public:
  RecordMaker(const gsnav::GaussianCloud& cloud, const gsnav::Camera& camera,
              const gsnav::RenderConfig& config) {
    const gsnav::ProjectionRules rules = gsnav::projection_rules(config);
    args_.gaussians = cloud.view();
    args_.camera = gsnav::make_projection_camera<S>(camera, cloud.set(), rules);
    args_.camera64 = gsnav::make_projection_camera<double>(camera, cloud.set(), rules);
    offset_ = -camera.position();
  }

  /// Returns whether Gaussian i is drawn at all; its records hold until the next call.
  bool project(std::size_t i) {
    gsnav::ViewedSet<S> args = args_;
    gsnav::ShapeRows& g = args.gaussians.shape;
    g.size = 1;
    const auto only_row = [i](auto& planes) {
      for (auto& plane : planes.data) plane += i;
      planes.size = 1;
    };
    only_row(g.means);
    only_row(g.quats);
    only_row(g.scales);
    g.opacities = {g.opacities.data + i, 1};
    args.offsets = {&offset_, 1};
    gsnav::ProjectOutputs<S> out;
    out.geometry = {&geometry_, 1};
    out.perspectives = {&perspective_, 1};
    out.bounds = {&bounds_, 1};
    out.keys = {&key_, 1};
    out.counts = {&count_, 1};
    gsnav::ProjectChunk<S>{args, out}(0);
    return count_ == 1;
  }

  const gsnav::SplatGeometry<S>& geometry() const { return geometry_; }
  const gsnav::SplatPerspective<S>& perspective() const { return perspective_; }
  const gsnav::SplatBounds& bounds() const { return bounds_; }

 private:
  gsnav::ViewedSet<S> args_;
  gsnav::Vec3d offset_;
  gsnav::SplatGeometry<S> geometry_;
  gsnav::SplatPerspective<S> perspective_;
  gsnav::SplatBounds bounds_;
  std::uint32_t key_ = 0, count_ = 0;
};

}  // namespace gsnav_test
