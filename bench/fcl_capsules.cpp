// SPDX-License-Identifier: Apache-2.0
#include "fcl_capsules.hpp"

#include <fcl/narrowphase/continuous_collision.h>
#include <fcl/narrowphase/distance.h>

#include <cmath>
#include <memory>

namespace gsnav_bench {

namespace {

using gsnav::Capsule;
using gsnav::MovingCapsule;
using Transform = fcl::Transform3d;

/// FCL's capsule lies along z, centred on the origin.
Transform placement(const Capsule<double>& c) {
  const fcl::Vector3d p(c.p0.x, c.p0.y, c.p0.z), q(c.p1.x, c.p1.y, c.p1.z);
  Transform t = Transform::Identity();
  t.translation() = (p + q) / 2;
  if ((q - p).norm() > 0) {
    t.linear() = Eigen::Quaterniond::FromTwoVectors(fcl::Vector3d::UnitZ(), q - p).toRotationMatrix();
  }
  return t;
}

struct Body {
  std::shared_ptr<fcl::Capsuled> shape;
  Transform begin, end;

  explicit Body(const MovingCapsule<double>& m)
      : shape(std::make_shared<fcl::Capsuled>(m.begin.radius, norm(m.begin.p1 - m.begin.p0))),
        begin(placement(m.begin)),
        end(placement(m.end)) {}
};

std::vector<Body> bodies(const std::vector<MovingCapsule<double>>& motions) {
  std::vector<Body> out;
  for (const auto& m : motions) out.emplace_back(m);
  return out;
}

}  // namespace

struct FclPairs::Pairs {
  std::vector<Body> a, b;
};

FclPairs::FclPairs(const std::vector<MovingCapsule<double>>& a,
                   const std::vector<MovingCapsule<double>>& b)
    : pairs_(new Pairs{bodies(a), bodies(b)}) {}
FclPairs::~FclPairs() = default;

double FclPairs::distance(std::size_t i) const {
  const Body &a = pairs_->a[i], &b = pairs_->b[i];
  fcl::DistanceResultd result;
  return fcl::distance(a.shape.get(), a.begin, b.shape.get(), b.begin, fcl::DistanceRequestd(), result);
}

double FclPairs::contact(std::size_t i) const {
  const Body &a = pairs_->a[i], &b = pairs_->b[i];
  fcl::ContinuousCollisionRequestd request;
  request.ccd_motion_type = fcl::CCDM_TRANS;
  request.ccd_solver_type = fcl::CCDC_CONSERVATIVE_ADVANCEMENT;
  request.toc_err = 1e-4;
  fcl::ContinuousCollisionResultd result;
  fcl::continuousCollide(a.shape.get(), a.begin, a.end, b.shape.get(), b.begin, b.end, request, result);
  return result.is_collide ? result.time_of_contact : 2.0;
}

}  // namespace gsnav_bench
