// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/nav/time_planner.hpp"

#include <cmath>
#include <optional>

#include "time_search.hpp"

namespace gsnav {
namespace {

bool follow_each_other(std::span<const CapsuleSet> ticks) noexcept {
  if (ticks.empty()) return false;
  for (std::size_t i = 0; i < ticks.size(); ++i) {
    if (!(ticks[i].t1() > ticks[i].t0())) return false;
    if (i > 0 && std::abs(ticks[i].t0() - ticks[i - 1].t1()) > 1e-6) return false;
  }
  return true;
}

}  // namespace

Vec3d TimedPlan::at(double t) const noexcept {
  for (std::size_t i = 1; i < points.size(); ++i) {
    if (t >= points[i].time) continue;
    const double u = (t - points[i - 1].time) / (points[i].time - points[i - 1].time);
    return lerp(points[i - 1].position, points[i].position, clamp(u, 0.0, 1.0));
  }
  return points.back().position;
}

TimedPlan plan_in_time(const NavMesh& mesh, const AgentState& agent, const Vec3d& goal,
                       std::span<const CapsuleSet> ticks, const TimePlannerOptions& o,
                       const GeodesicField* field) {
  TimedPlan plan;
  const bool valid = is_finite(agent.position) && is_finite(goal) && is_finite(agent.radius) &&
                     is_finite(agent.height) && agent.radius >= 0 && agent.height >= 0 && o.speed > 0 &&
                     is_finite(o.speed) && o.cell > 0 && is_finite(o.cell) && o.margin >= 0 &&
                     is_finite(o.margin) && follow_each_other(ticks);
  if (!valid) return plan;
  plan.status = TimedPlanStatus::unreachable;
  const SurfaceWalk here = mesh.walk({agent.position, agent.poly}, {}, false);
  const auto there = mesh.snap_point(goal, {{0.5, 1.0, 0.5}});
  if (here.points.empty() || !there) return plan;
  const NavPoint start{here.points[0].position, here.points[0].poly};
  const auto path = mesh.path_between(start, *there);
  if (!path) return plan;
  std::optional<GeodesicField> own;
  if (field == nullptr) {
    auto made = GeodesicField::make(mesh, std::span(&there->position, 1), {{0.5, 1.0, 0.5}});
    if (!made) return plan;
    own = std::move(*made);
    field = &*own;
  }
  // If the agent starts nearer to a body than the margin, only avoid contact.
  double margin = o.margin;
  const double gap =
      clearance({start.position, agent.radius, agent.height, start.poly}, ticks[0], ticks[0].t0())
          .distance;
  if (gap < margin + 1e-3) margin = 0;
  const detail::TimedBodies bodies(ticks, agent.radius, agent.height, margin);
  return detail::TimeSearch(mesh, bodies, *field, o).run(start, *there, *path);
}

}  // namespace gsnav
