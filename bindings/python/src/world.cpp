// SPDX-License-Identifier: Apache-2.0
#include "world.hpp"

#include "arrays.hpp"
#include "bind.hpp"
#include "fields.hpp"
#include "gsnav/sim.hpp"

namespace gsnav::python {
namespace {

/// Calls f(world) while the simulator's flag is held.
template <class F>
auto with(const WorldView& view, const char* what, const F& f) {
  const Busy::Hold hold(*view.busy, what);
  return f(view.of());
}

void bind_state(nb::module_& m) {
  using P = AgentPose;
  Struct<P>(m, "AgentPose", "Position and orientation of the agent.")
      .field("position", &P::position, "World position, metres, Y up, shape [3].")
      .field("yaw", &P::yaw, "Turn about +Y, radians, positive to the left.")
      .field("poly", &P::poly, "Polygon that the agent stands on.")
      .field("pitch", &P::pitch, "Tilt of the sensors, radians, positive upwards.")
      .done()
      .def("forward", &P::forward, "Unit vector that the body faces, on the ground plane, shape [3].");
  using S = StepInfo;
  Struct<S>(m, "StepInfo", "Outcome of one action.")
      .field("collided", &S::collided, "A wall or an avatar stopped or deflected the move.")
      .field("wall_collision", &S::wall_collision, "A wall stopped or deflected the move.")
      .field("capsule_blocked", &S::capsule_blocked, "An avatar stopped or deflected the move.")
      .field("avatar_contact", &S::avatar_contact,
             "Counted by CR: an avatar touched or stopped the move.")
      .field("avatar_touched", &S::avatar_touched, "Counted by H-Coll: agent and avatar touched.")
      .field("pushed_into", &S::pushed_into, "An avatar walked into the agent.")
      .field("moved", &S::moved, "Straight distance between the positions before and after, metres.")
      .field("avatar_clearance", &S::avatar_clearance, "Smallest distance to any avatar, metres.")
      .field("reward", &S::reward, "Reward of the action.")
      .done();
  using G = PointGoal;
  Struct<G>(m, "PointGoal", "Goal in the coordinates of the agent.")
      .field("distance", &G::distance, "Straight distance on the ground plane, metres.")
      .field("angle", &G::angle, "Direction, radians to the left of forward, in (-pi, pi].")
      .done();
  nb::class_<WorldState>(m, "WorldState", "Complete state of a World, a copy.")
      .def_ro("time", &WorldState::time, "Time on the scene's clock, seconds.")
      .def_ro("steps", &WorldState::steps, "Number of actions so far, without `stop`.")
      .def_ro("done", &WorldState::done, "The episode has ended.")
      .def_ro("agent", &WorldState::agent, "Pose of the agent.")
      .def_ro("distance_to_goal", &WorldState::distance_to_goal, "Distance along the surface, metres.");
}

void bind_policies(nb::module_& m) {
  using F = FollowerOptions;
  Struct<F>(m, "FollowerOptions", "Settings of GeodesicFollower.")
      .field("horizon", &F::horizon, "Number of actions to look ahead, >= 1.")
      .field("watch_distance", &F::watch_distance, "Avatars farther than this are ignored, metres.")
      .field("comfort", &F::comfort, "Plans that come nearer to an avatar are penalized, metres.")
      .done();
  nb::class_<GeodesicFollower>(m, "GeodesicFollower",
                               "Policy for demonstrations: follows the shortest path and gives way to "
                               "avatars. Deterministic.")
      .def(
          "__init__",
          [](GeodesicFollower* self, const FollowerOptions& options) {
            check_finite("FollowerOptions.watch_distance", options.watch_distance);
            check_finite("FollowerOptions.comfort", options.comfort);
            new (self) GeodesicFollower(options);
          },
          nb::arg("options") = FollowerOptions{}, "Raises InvalidArgument naming the setting.")
      .def(
          "next",
          [](const GeodesicFollower& f, const WorldView& w) {
            return with(w, "GeodesicFollower.next", [&](const World& world) {
              const ReleaseGil release;
              return f.next(world);
            });
          },
          nb::arg("world"), "The next action: Action.stop at the goal, or if it cannot be reached.");
  nb::class_<RandomPolicy>(m, "RandomPolicy", "Random baseline modelled on Habitat-Lab's RandomAgent.")
      .def(nb::init<std::uint64_t>(), nb::arg("seed") = 0)
      .def(
          "next",
          [](RandomPolicy& p, const WorldView& w) {
            return with(w, "RandomPolicy.next", [&](const World& world) { return p.next(world); });
          },
          nb::arg("world"), "The next action.");
}

}  // namespace

void bind_world(nb::module_& m) {
  bind_state(m);
  using W = WorldView;
  nb::class_<W>(
      m, "World",
      "Agent, task and clock of an environment, without images. It keeps its simulator alive and "
      "shows the present state.")
      .def_prop_ro(
          "done", [](const W& w) { return with(w, "World.done", [](auto& o) { return o.done(); }); },
          "True if the episode has ended.")
      .def(
          "metrics",
          [](const W& w) { return with(w, "World.metrics", [](auto& o) { return o.metrics(); }); },
          "Metrics as if the episode ended now.")
      .def_prop_ro(
          "distance_to_goal",
          [](const W& w) {
            return with(w, "World.distance_to_goal", [](auto& o) { return o.distance_to_goal(); });
          },
          "Distance to the goal along the surface, metres.")
      .def_prop_ro(
          "point_goal",
          [](const W& w) { return with(w, "World.point_goal", [](auto& o) { return o.point_goal(); }); },
          "Goal as seen from the agent.")
      .def_prop_ro(
          "time", [](const W& w) { return with(w, "World.time", [](auto& o) { return o.time(); }); },
          "Time on the scene's clock, seconds.")
      .def_prop_ro(
          "agent", [](const W& w) { return with(w, "World.agent", [](auto& o) { return o.agent(); }); },
          "A copy of the agent's pose.")
      .def_prop_ro(
          "last_step",
          [](const W& w) { return with(w, "World.last_step", [](auto& o) { return o.last_step(); }); },
          "A copy of the outcome of the last action.")
      .def_prop_ro(
          "episode",
          [](const W& w) { return with(w, "World.episode", [](auto& o) { return o.episode(); }); },
          "A copy of the episode.")
      .def(
          "state", [](const W& w) { return with(w, "World.state", [](auto& o) { return o.state(); }); },
          "A copy of the complete state.");
  bind_policies(m);
}

}  // namespace gsnav::python
