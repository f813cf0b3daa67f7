// SPDX-License-Identifier: Apache-2.0
// Moves and metrics among people for the distribution gsnav-habitat, whose agents and clock are free.
#include <nanobind/stl/shared_ptr.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "arrays.hpp"
#include "bind.hpp"
#include "fields.hpp"
#include "gil.hpp"
#include "gsnav/detail/sim/proximity.hpp"
#include "gsnav/detail/sim/reward.hpp"
#include "gsnav/nav.hpp"
#include "gsnav/sim.hpp"
#include "guard.hpp"

namespace gsnav::python {
namespace {

/// An agent among the people of a scene. The rules are those of step(), closest_approach() and
/// EpisodeTracker. An action is a number of moves.
class AvatarTracker {
 public:
  AvatarTracker(std::shared_ptr<const SimulatorScene> scene, double radius, double height)
      : scene_(std::move(scene)), radius_(radius), height_(height) {
    if (scene_->navmesh == nullptr) fail("scene has no NavMesh");
    if (!is_finite(radius) || radius < 0) fail("radius = " + std::to_string(radius) + ": must be >= 0");
    if (!is_finite(height) || height < 0) fail("height = " + std::to_string(height) + ": must be >= 0");
  }

  void reset() {
    const Busy::Hold hold(busy_, "AvatarTracker.reset");
    tracker_.reset(0.0);
    begun_ = false;
  }

  void begin_action() {
    const Busy::Hold hold(busy_, "AvatarTracker.begin_action");
    if (begun_) tracker_.add(record());
    begun_ = true;
    action_ = {};
    avatars_.clear();
    distances_.clear();
  }

  Vec3d move(const Vec3d& start, const Vec3d& end, double t0, double t1, bool slide) {
    const Busy::Hold hold(busy_, "AvatarTracker.move");
    finite("move: start", start);
    finite("move: end", end);
    check_finite("AvatarTracker.move: t0", t0);
    check_finite("AvatarTracker.move: t1", t1);
    const CapsuleSet bodies = bodies_in(t0, t1);
    const NavMesh& mesh = *scene_->navmesh;
    const std::optional<NavPoint> from = mesh.snap_point(start);
    if (!from) return start;
    const AgentState agent{from->position, radius_, height_, from->poly};
    const StepResult r = step(mesh, agent, end - from->position, bodies, {.slide = slide});
    if (r.blocked_by == BlockedBy::invalid) return start;
    closest_approach(r.path, radius_, height_, bodies, near_now_);
    merge_distances(near_now_, bodies, avatars_, distances_);
    for (const double d : near_now_) action_.avatar_contact = action_.avatar_contact || d <= 0;
    action_.moved += norm(r.position - start);
    action_.wall_collision = action_.wall_collision || r.hit_wall;
    action_.capsule_blocked = action_.capsule_blocked || r.blocked_by == BlockedBy::capsule;
    action_.avatar_contact = action_.avatar_contact || r.pushed_into;
    return r.position;
  }

  void set_capsules(const std::vector<std::array<double, 7>>& rows) {
    const Busy::Hold hold(busy_, "AvatarTracker.set_capsules");
    std::vector<Capsule<double>> standing;
    for (const auto& r : rows) standing.push_back({{r[0], r[1], r[2]}, {r[3], r[4], r[5]}, r[6]});
    CapsuleSet::standing(standing, own_number()).value();  // Checks them.
    standing_ = std::move(standing);
  }

  std::vector<std::array<double, 7>> capsules(double time, std::optional<std::uint32_t> person) const {
    const Busy::Hold hold(busy_, "AvatarTracker.capsules");
    check_finite("AvatarTracker.capsules: time", time);
    const CapsuleSet now = bodies_in(time, time);
    std::vector<std::array<double, 7>> rows;
    for (const DynamicCapsule& c : now.capsules()) {
      const auto& [p, q, radius] = c.motion.begin;
      if (!person || c.avatar == *person) rows.push_back({p.x, p.y, p.z, q.x, q.y, q.z, radius});
    }
    return rows;
  }

  double distance(const Vec3d& base, double time, double radius, double height) const {
    const Busy::Hold hold(busy_, "AvatarTracker.distance");
    finite("distance: position", base);
    check_finite("AvatarTracker.distance: radius", radius);
    check_finite("AvatarTracker.distance: height", height);
    check_finite("AvatarTracker.distance: time", time);
    const CapsuleSet now = bodies_in(time, time);
    return clearance({base, radius > 0 ? radius : radius_, height > 0 ? height : height_}, now, time)
        .distance;
  }

  bool blocked(const Vec3d& start, const Vec3d& end, double time, bool slide, double radius,
               double height) const {
    const Busy::Hold hold(busy_, "AvatarTracker.blocked");
    finite("blocked: start", start);
    check_finite("AvatarTracker.blocked: radius", radius);
    check_finite("AvatarTracker.blocked: height", height);
    finite("blocked: end", end);
    check_finite("AvatarTracker.blocked: time", time);
    const CapsuleSet now = bodies_in(time, time);
    const std::optional<NavPoint> from = scene_->navmesh->snap_point(start);
    if (!from) return false;
    const AgentState agent{from->position, radius > 0 ? radius : radius_, height > 0 ? height : height_,
                           from->poly};
    const StepResult r = step(*scene_->navmesh, agent, end - from->position, now, {.slide = slide});
    return r.blocked_by == BlockedBy::capsule;
  }

  EpisodeMetrics metrics() const {
    const Busy::Hold hold(busy_, "AvatarTracker.metrics");
    EpisodeTracker now = tracker_;
    if (begun_) now.add(record());
    return now.finish(false, 0.0, 0.0, 0.0);
  }

  double action_clearance() const {
    const Busy::Hold hold(busy_, "AvatarTracker.action_clearance");
    double least = std::numeric_limits<double>::infinity();
    for (const double d : distances_) least = min(least, d);
    return least;
  }

  bool action_collided() const {
    const Busy::Hold hold(busy_, "AvatarTracker.action_collided");
    return action_.avatar_contact || action_.capsule_blocked;
  }

 private:
  [[noreturn]] static void fail(const std::string& what) {
    Status(Errc::invalid_argument, "AvatarTracker: " + what).throw_if_error();
    throw std::logic_error(what);
  }

  static void finite(const char* field, const Vec3d& v) {
    if (is_finite(v)) return;
    throw Error(Errc::invalid_argument, std::string("AvatarTracker.") + field + " = (" +
                                            std::to_string(v.x) + ", " + std::to_string(v.y) + ", " +
                                            std::to_string(v.z) + "): must be finite");
  }

  StepRecord record() const {
    StepRecord made = action_;
    made.avatar_distances = distances_;
    return made;
  }

  /// Number of the person that set_capsules stands for.
  std::uint32_t own_number() const { return static_cast<std::uint32_t>(scene_->avatars.size()); }

  CapsuleSet bodies_in(double t0, double t1) const {
    std::vector<DynamicCapsule> capsules;
    append_bodies(*scene_, t0, t1, capsules);
    for (std::size_t i = 0; i < standing_.size(); ++i)
      capsules.push_back({{standing_[i], standing_[i]}, own_number(), static_cast<std::uint32_t>(i)});
    return CapsuleSet::create(std::move(capsules), t0, t1).value();
  }

  std::shared_ptr<const SimulatorScene> scene_;
  double radius_, height_;
  std::vector<Capsule<double>> standing_;  // Those of the last set_capsules().
  EpisodeTracker tracker_;
  bool begun_ = false;
  StepRecord action_{};  // Without distances.
  // Smallest distance to each avatar in this action, metres, sorted by avatar number.
  std::vector<std::uint32_t> avatars_;
  std::vector<double> distances_, near_now_;
  mutable Busy busy_;
};

}  // namespace

void bind_avatar_tracker(nb::module_& m) {
  using A = AvatarTracker;
  nb::class_<A>(
      m, "AvatarTracker",
      "An agent among the people of a scene, with its metrics. It moves by calls of `move`, at any "
      "times on the scene's clock. Use it from one thread at a time.")
      .def(
          "__init__",
          [](A* self, const SceneArg& scene, double radius, double height) {
            new (self) A(scene.scene, radius, height);
          },
          nb::arg("scene"), nb::arg("radius") = 0.1, nb::arg("height") = 1.5,
          "Prepares an agent of a radius and a height in metres. Raises InvalidArgument naming the "
          "value, "
          "or if the scene has no NavMesh.")
      .def("reset", &A::reset, "Begins an episode.")
      .def("begin_action", &A::begin_action, "Ends the action, if there is one, and begins another.")
      .def("move", &A::move, nb::arg("start"), nb::arg("end"), nb::arg("t0"), nb::arg("t1"),
           nb::arg("slide") = true, nb::call_guard<ReleaseGil>(),
           "Walks from a point towards another during [t0, t1], seconds, and stops at walls and people. "
           "Returns the position that is reached, shape [3]: `start` if it is off the NavMesh. "
           "Equal points let the agent stand. Raises InvalidArgument for a value that is not finite, as "
           "all methods do.")
      .def("set_capsules", &A::set_capsules, nb::arg("capsules"), nb::call_guard<ReleaseGil>(),
           "Adds capsules that stand still, rows of x0, y0, z0, x1, y1, z1, radius in metres. They "
           "replace those of the last call, and count as one person more. Raises InvalidArgument for a "
           "value that is not finite or a negative radius.")
      .def(
          "capsules",
          [](const A& a, double time, std::optional<std::uint32_t> person) {
            std::vector<std::array<double, 7>> rows;
            {
              const ReleaseGil release;
              rows = a.capsules(time, person);
            }
            const std::size_t count = rows.size();
            const double* const first = count > 0 ? rows.front().data() : nullptr;
            return array_copy(std::span(first, 7 * count), {count, 7});
          },
          nb::arg("time"), nb::arg("person") = nb::none(),
          nb::sig("def capsules(self, time: float, person: int | None = None) -> "
                  "numpy.typing.NDArray[numpy.float64]"),
          "Capsules of all people or one at a time: float64 [N][7], x0, y0, z0, x1, y1, z1, radius in "
          "metres. Those of set_capsules come last.")
      .def("distance", &A::distance, nb::arg("position"), nb::arg("time"), nb::arg("radius") = -1.0,
           nb::arg("height") = -1.0, nb::call_guard<ReleaseGil>(),
           "Distance in metres from the surface of an agent at a position to the nearest person, "
           "negative "
           "in overlap; infinite without people. A size <= 0 is that of the constructor.")
      .def("blocked", &A::blocked, nb::arg("start"), nb::arg("end"), nb::arg("time"),
           nb::arg("slide") = true, nb::arg("radius") = -1.0, nb::arg("height") = -1.0,
           nb::call_guard<ReleaseGil>(),
           "Whether a person who stands as at a time would stop or deflect a move.")
      .def("metrics", &A::metrics, nb::call_guard<ReleaseGil>(),
           "Metrics of the actions since reset(). Those of a goal are 0, because there is none.")
      .def_prop_ro("action_clearance", &A::action_clearance,
                   "Smallest distance to a person in this action, metres.")
      .def_prop_ro("action_collided", &A::action_collided,
                   "Counted by CR: in this action a person was touched or stopped a move.");
  m.def(
      "step_reward",
      [](const RewardConfig& weights, double before, double after, bool success, double clearance,
         bool human, bool wall) {
        return step_reward(weights, {before, after, success, clearance, human, wall});
      },
      nb::arg("weights"), nb::arg("before"), nb::arg("after"), nb::arg("success"),
      nb::arg("avatar_clearance"), nb::arg("human_collision"), nb::arg("wall_collision"),
      "Reward of one action: distances to the goal before and after it and to the nearest person, "
      "metres.");
}

}  // namespace gsnav::python
