// SPDX-License-Identifier: Apache-2.0
#include "gsnav/device/simulator.hpp"

#include <nanobind/stl/shared_ptr.h>

#include "actions.hpp"
#include "arrays.hpp"
#include "bind.hpp"
#include "fields.hpp"
#include "frames.hpp"
#include "guard.hpp"
#include "world.hpp"

namespace gsnav::python {
namespace {

/// A Simulator that one thread may use at a time.
struct PythonSimulator {
  Simulator sim;
  Busy busy;
};

/// Observations whose images are numpy arrays.
struct PythonObservations {
  StepInfo info;
  PointGoal point_goal;
  double time = 0;
  nb::dict images;
};

nb::dict image_views(std::span<const Observation> images, nb::handle owner) {
  nb::dict out;
  for (const Observation& o : images) {
    const std::vector<std::size_t> shape{static_cast<std::size_t>(o.height),
                                         static_cast<std::size_t>(o.width),
                                         static_cast<std::size_t>(o.channels)};
    out[nb::str(o.uuid.data(), o.uuid.size())] = array_view(o.data.data(), shape, owner);
  }
  return out;
}

/// Runs f(simulator) -> Result<Observations> without the GIL.
template <class F>
PythonObservations observe(nb::handle self, const char* what, const F& f) {
  auto& s = object_of<PythonSimulator>(self);
  const Busy::Hold hold(s.busy, what);
  check_fork(s.sim.device(), what);
  Observations seen;
  {
    const ReleaseGil release;
    seen = f(s.sim).value();
  }
  return {seen, seen.point_goal, seen.time, image_views(seen.images, self)};
}

void make(PythonSimulator* self, const DeviceArg& device, const SceneArg& scene,
          SimulatorConfig config) {
  const Device chosen = device.value();
  check_fork(chosen, "Simulator");
  const ReleaseGil release;
  new (self) PythonSimulator{Simulator::create(chosen, scene.scene, std::move(config)).value(), {}};
}

PythonFrames render(PythonSimulator& s, Camera camera, unsigned outputs) {
  const Busy::Hold hold(s.busy, "Simulator.render");
  check_fork(s.sim.device(), "Simulator.render");
  const Frames<float>* frames = nullptr;
  {
    const ReleaseGil release;
    frames = s.sim.render(camera, outputs).value();
  }
  return python_frames(*frames, true);
}

void bind_observations(nb::module_& m) {
  using O = PythonObservations;
  nb::class_<O> c(m, "Observations",
                  "Result of a reset or an action: images, goal, and outcome of the action.\n\n"
                  "observations[\"rgb\"] is the image of a sensor, float32 [H][W][C], top row first: a "
                  "read-only view. The simulator's next call overwrites it.");
  c.def(
       "__getitem__",
       [](const O& o, const std::string& uuid) -> nb::object {
         const nb::str key(uuid.data(), uuid.size());
         if (o.images.contains(key)) return o.images[key];
         const std::string known = text_of(nb::list(o.images.keys()));
         throw nb::key_error(("no sensor \"" + cut(uuid) + "\"; the sensors are " + known).c_str());
       },
       nb::arg("uuid"),
       nb::sig("def __getitem__(self, uuid: str) -> numpy.typing.NDArray[numpy.float32]"),
       "The image of a sensor.")
      .def_ro(
          "images", &O::images,
          nb::for_getter(nb::sig("def images(self) -> dict[str, numpy.typing.NDArray[numpy.float32]]")),
          "Images by the names of their sensors. Empty if nothing was rendered.")
      .def_ro("point_goal", &O::point_goal, "Goal as seen from the agent.")
      .def_ro("time", &O::time, "Time on the scene's clock, seconds.")
      .def_ro("info", &O::info, "Outcome of the action.")
      .def_prop_ro(
          "reward", [](const O& o) { return o.info.reward; }, "Reward of the action.");
}

void bind_episode_calls(nb::class_<PythonSimulator>& c) {
  c.def(
       "reset",
       [](nb::handle self, PointNavEpisode episode) {
         return observe(self, "Simulator.reset", [&](Simulator& s) { return s.reset(episode); });
       },
       nb::arg("episode"), nb::sig("def reset(self, episode: PointNavEpisode) -> Observations"),
       "Starts an episode and renders the first observations. Raises NothingNavigable if start or goal "
       "is "
       "off the NavMesh.")
      .def(
          "step",
          [](nb::handle self, nb::handle action) {
            VelocityCommand command;
            if (nb::try_cast(action, command, false)) {
              return observe(self, "Simulator.step", [&](Simulator& s) { return s.step(command); });
            }
            const Action chosen = action_from(action, "Simulator.step");
            return observe(self, "Simulator.step", [&](Simulator& s) { return s.step(chosen); });
          },
          nb::arg("action").none(),
          nb::sig("def step(self, action: Action | int | VelocityCommand) -> Observations"),
          "Performs one action for one control period and renders. Action.stop ends the episode. Raises "
          "InvalidArgument for an unknown action, before the first reset, and after the end.")
      .def(
          "observe",
          [](nb::handle self) {
            return observe(self, "Simulator.observe", [](Simulator& s) { return s.observe(); });
          },
          nb::sig("def observe(self) -> Observations"),
          "Renders the sensors at the present time, without acting.");
}

void bind_state(nb::class_<PythonSimulator>& c) {
  using P = PythonSimulator;
  c.def_prop_ro(
       "done", [](P& p) { return locked(p, "Simulator.done", [](Simulator& s) { return s.done(); }); },
       "True if the episode has ended.")
      .def(
          "metrics",
          [](P& p) { return locked(p, "Simulator.metrics", [](Simulator& s) { return s.metrics(); }); },
          "Metrics of the episode so far.")
      .def_prop_ro(
          "clock",
          [](P& p) { return locked(p, "Simulator.clock", [](Simulator& s) { return s.clock(); }); },
          "Time on the scene's clock, seconds.")
      .def_prop_ro(
          "agent",
          [](P& p) {
            return locked(p, "Simulator.agent", [](Simulator& s) { return AgentPose(s.agent()); });
          },
          "A copy of the agent's pose.")
      .def(
          "state",
          [](P& p) {
            return locked(p, "Simulator.state", [](Simulator& s) { return WorldState(s.state()); });
          },
          "A copy of all state that changes during an episode. set_state returns to this moment.")
      .def(
          "set_state",
          [](P& p, const WorldState& state) {
            locked(p, "Simulator.set_state", [&](Simulator& s) { s.set_state(state).throw_if_error(); });
          },
          nb::arg("state"), "Restores a state that state() returned.")
      .def(
          "set_agent",
          [](P& p, const Vec3d& position, double yaw, double pitch) {
            locked(p, "Simulator.set_agent",
                   [&](Simulator& s) { s.set_agent(position, yaw, pitch).throw_if_error(); });
          },
          nb::arg("position"), nb::arg("yaw"), nb::arg("pitch") = 0.0, nb::call_guard<ReleaseGil>(),
          "Moves the agent. Position in metres, angles in radians. Raises NothingNavigable if the "
          "position "
          "is off the NavMesh, InvalidArgument if a value is not finite.")
      .def(
          "set_seed",
          [](P& p, std::uint64_t seed) {
            locked(p, "Simulator.set_seed", [&](Simulator& s) { s.set_seed(seed); });
          },
          nb::arg("seed"), "Seeds the sensors' noise from now on.")
      .def(
          "set_rendering",
          [](P& p, bool on) {
            locked(p, "Simulator.set_rendering", [&](Simulator& s) { s.set_rendering(on); });
          },
          nb::arg("on"), "Turns rendering on or off, from the next action on.")
      .def_prop_ro(
          "render_count",
          [](P& p) {
            return locked(p, "Simulator.render_count", [](Simulator& s) { return s.render_count(); });
          },
          "Number of renders so far.");
}

}  // namespace

void bind_simulator(nb::module_& m) {
  using P = PythonSimulator;
  bind_observations(m);
  nb::class_<P> c(
      m, "Simulator",
      "Navigation simulator for one agent on any device: scene, avatars, sensors and the PointNav "
      "task. One thread may use it at a time; a call during another call raises an error.");
  c.def("__init__", make, nb::arg("device"), nb::arg("scene"), nb::arg("config") = SimulatorConfig{},
        "Creates a simulator that shares `scene`. Raises InvalidArgument naming the field, sensor or "
        "asset.");
  bind_episode_calls(c);
  bind_state(c);
  c.def_prop_ro(
       "world",
       [](nb::handle self) {
         P& p = object_of<P>(self);
         return WorldView{nb::borrow(self), &p.busy, [&p]() -> const World& { return p.sim.world(); }};
       },
       nb::sig("def world(self) -> World"), "The world without images: agent, task and clock.")
      .def_prop_ro(
          "scene",
          [](P& p) {
            // The scene belongs to the simulator: it shares the parts, so copying it is cheap.
            return std::make_shared<SimulatorScene>(p.sim.scene());
          },
          "The scene. It shares the parts of the simulator's scene.")
      .def_prop_ro(
          "config", [](P& p) { return SimulatorConfig(p.sim.config()); }, "A copy of the settings.")
      .def_prop_ro(
          "device", [](P& p) { return p.sim.device(); }, "Device that the simulator runs on.")
      .def("render", render, nb::arg("camera"), nb::arg("outputs") = static_cast<unsigned>(kRgb),
           "Renders any camera at the present time, such as a map. The images are new arrays, [H][W] or "
           "[H][W][3]. `outputs` is a bitmask of Output.");
}

}  // namespace gsnav::python
