// SPDX-License-Identifier: Apache-2.0
#include <chrono>
#include <exception>
#include <functional>
#include <optional>
#include <utility>
#include <variant>

#include "actions.hpp"
#include "batch_core.hpp"
#include "batch_step.hpp"
#include "bind.hpp"
#include "episode_source.hpp"
#include "fields.hpp"
#include "image_source.hpp"
#include "world.hpp"

namespace gsnav::python {
namespace {

/// Runs f(simulator) -> Result<BatchStep> without the GIL. Exceptions of Python's functions go on:
/// `raised`, and those of the sources.
template <class F>
void run(BatchCore& b, const char* what, const std::exception_ptr& raised, const F& f) {
  check_fork(b.sim.device(), what);
  b.source->error.reset();
  b.images->error.reset();
  if (b.images->given.size() != 0) b.images->given = nb::list();
  if (b.pool != nullptr) b.pool->begin();
  std::optional<Result<BatchStep>> result;
  {
    const ReleaseGil release;
    b.consumers->wait();
    result.emplace(f(b.sim));
  }
  if (result->ok()) return;
  if (raised) std::rethrow_exception(raised);
  for (std::optional<nb::python_error>* of_source : {&b.source->error, &b.images->error}) {
    if (!*of_source) continue;
    nb::python_error error = std::move(**of_source);
    of_source->reset();
    throw error;
  }
  result->status().throw_if_error();
}

/// Runs f(simulator, WhileDrawing) -> Result<BatchStep> and returns its BatchStep of Python, unless
/// `dropped`. This object is made, `meanwhile` called with it, and it is dropped, while a GPU draws.
template <class F>
nb::object observe(PythonBatch& batch, const char* what, nb::handle meanwhile, const F& f,
                   bool dropped = false) {
  BatchCore& b = *batch.core;
  if (!meanwhile.is_none() && !PyCallable_Check(meanwhile.ptr())) {
    throw nb::type_error(
        (std::string(what) + ": meanwhile must be callable or None, got " + type_of(meanwhile)).c_str());
  }
  nb::object made;
  Unfilled unfilled;
  std::exception_ptr raised;
  const auto prepare = [&](const BatchStep& s) -> Status {
    const HoldGil gil;
    b.begun = true;
    try {
      made = nb::cast(step_arrays(s, b, batch.owner, unfilled));
      if (!meanwhile.is_none()) meanwhile(made);
      if (dropped && unfilled.empty()) made.reset();
      return {};
    } catch (const std::exception&) {
      raised = std::current_exception();
      return {Errc::invalid_argument, "meanwhile raised an exception"};
    }
  };
  run(b, what, raised, [&](BatchSimulator& sim) { return f(sim, std::cref(prepare)); });
  for (const auto& [image, data] : unfilled) copy_numbers(image, data);
  return made;
}

/// Memory for images that numpy arrays own. The pool keeps the bytes of two steps, because a caller may
/// hold the arrays of one step while it takes the next. Null if images stay on a GPU, or with
/// AutoReset::disabled: a call then draws only some environments, and new memory lacks the others.
std::shared_ptr<ImagePool> image_pool(const Device& device, const BatchConfig& config,
                                      std::size_t environments) {
  if (config.auto_reset == AutoReset::disabled) return nullptr;
  if (config.images == ImageMemory::backend && device.kind() == DeviceKind::cuda) return nullptr;
  double bytes = 0;
  for (const SensorSpec& s : config.sensors) {
    bytes += 2.0 * sizeof(float) * static_cast<double>(environments) * s.resolution[0] *
             s.resolution[1] * channels_of(s.kind);
  }
  // A size that does not fit is an error of the sensor, which the simulator names.
  return std::make_shared<ImagePool>(bytes > 0 && bytes < 0x1p62 ? static_cast<std::size_t>(bytes) : 0);
}

void make(PythonBatch* self, const DeviceArg& device, const std::vector<SceneArg>& scenes,
          BatchConfig config, std::size_t environments, nb::object next_episode, bool copy,
          nb::object images) {
  if (!PyCallable_Check(next_episode.ptr())) {
    throw nb::type_error(
        ("BatchSimulator: next_episode must be callable, got " + type_of(next_episode)).c_str());
  }
  if (!images.is_none() && !PyCallable_Check(images.ptr())) {
    throw nb::type_error(
        ("BatchSimulator: image_source must be callable or None, got " + type_of(images)).c_str());
  }
  if (copy && !images.is_none()) {
    throw Error(Errc::invalid_argument,
                "BatchSimulator: copy = True and image_source both choose memory; give one of them");
  }
  const Device chosen = device.value();
  check_fork(chosen, "BatchSimulator");
  std::vector<std::shared_ptr<const SimulatorScene>> shared;
  for (const SceneArg& s : scenes) shared.push_back(s.scene);
  auto source = std::make_shared<PythonSource>(PythonSource{std::move(next_episode), {}});
  EpisodeSource episodes = episode_source(source);
  std::shared_ptr<ImagePool> pool = copy ? image_pool(chosen, config, environments) : nullptr;
  if (pool != nullptr) {
    config.image_source = [pool](std::size_t, std::size_t floats) { return pool->take(floats); };
  }
  auto held = std::make_shared<PythonImageSource>(PythonImageSource{std::move(images), {}, {}});
  if (!held->function.is_none()) config.image_source = image_source(held, chosen, config);
  const ReleaseGil release;
  auto core =
      std::make_shared<BatchCore>(BatchSimulator::create(chosen, std::move(shared), std::move(config),
                                                         environments, std::move(episodes))
                                      .value(),
                                  std::move(source), std::move(pool), std::move(held), copy);
  const HoldGil gil;
  new (self) PythonBatch(std::move(core));
}

nb::object reset(nb::handle self, nb::handle mask, nb::handle meanwhile) {
  auto& b = object_of<PythonBatch>(self);
  const Busy::Hold hold(b.core->busy, "BatchSimulator.reset");
  const std::vector<std::uint8_t> chosen = reset_mask(mask, b.core->sim.environments());
  return observe(b, "BatchSimulator.reset", meanwhile,
                 [&](BatchSimulator& sim, const WhileDrawing& f) { return sim.reset(chosen, f); });
}

nb::object step(nb::handle self, nb::handle actions, nb::handle meanwhile) {
  auto& b = object_of<PythonBatch>(self);
  const Busy::Hold hold(b.core->busy, "BatchSimulator.step");
  const BatchActions chosen = batch_actions(actions, b.core->sim.environments());
  return std::visit(
      [&](const auto& a) {
        return observe(b, "BatchSimulator.step", meanwhile,
                       [&](BatchSimulator& sim, const WhileDrawing& f) { return sim.step(a, f); });
      },
      chosen);
}

/// Steps with actions that plain_actions takes. Returns false, and does nothing, for others.
bool step_plain(nb::handle self, nb::handle actions, std::size_t count, nb::handle meanwhile) {
  auto& b = object_of<PythonBatch>(self);
  const Busy::Hold hold(b.core->busy, "BatchSimulator.step");
  const auto chosen = plain_actions(actions, b.core->sim.environments(), count);
  if (!chosen) return false;
  const auto act = [&](BatchSimulator& sim, const WhileDrawing& f) { return sim.step(*chosen, f); };
  observe(b, "BatchSimulator.step", meanwhile, act, true);
  return true;
}

/// Seconds of some steps without Python between them: what speed.py compares VectorEnv with.
double time_steps(nb::handle self, const std::vector<nb::object>& steps) {
  auto& b = object_of<PythonBatch>(self);
  const Busy::Hold hold(b.core->busy, "BatchSimulator._time_steps");
  if (steps.empty() || b.core->pool != nullptr || !b.core->images->function.is_none()) {
    throw Error(Errc::invalid_argument,
                "BatchSimulator._time_steps: needs one step, copy = False and no image_source");
  }
  std::vector<BatchActions> chosen;
  for (const nb::object& actions : steps) {
    chosen.push_back(batch_actions(actions, b.core->sim.environments()));
  }
  std::chrono::duration<double> took{};
  run(*b.core, "BatchSimulator._time_steps", {}, [&](BatchSimulator& sim) {
    const auto start = std::chrono::steady_clock::now();
    std::optional<Result<BatchStep>> last;
    for (const BatchActions& actions : chosen) {
      last.emplace(std::visit([&](const auto& a) { return sim.step(a); }, actions));
      if (!last->ok()) break;
    }
    took = std::chrono::steady_clock::now() - start;
    return std::move(*last);
  });
  return took.count();
}

void check_environment(const BatchCore& b, std::size_t environment) {
  if (environment >= b.sim.environments()) {
    throw nb::index_error(
        ("environment " + std::to_string(environment) + " of " + std::to_string(b.sim.environments()))
            .c_str());
  }
  if (!b.begun) throw Error(Errc::invalid_argument, "BatchSimulator: call reset() first");
}

WorldView world(nb::handle self, std::size_t environment) {
  auto& batch = object_of<PythonBatch>(self);
  BatchCore& b = *batch.core;
  check_environment(b, environment);
  return {batch.owner, &b.busy,
          [&b, environment]() -> const World& { return b.sim.world(environment); }};
}

// These functions let Python's collector find cycles through the episode source (BatchCore).
int traverse(PyObject* self, visitproc visit, void* arg) {
  Py_VISIT(Py_TYPE(self));
  if (!nb::inst_ready(self)) return 0;
  const BatchCore& b = *nb::inst_ptr<PythonBatch>(self)->core;
  for (const nb::handle seen : {nb::handle(b.source->function), nb::handle(b.images->function)}) {
    Py_VISIT(seen.ptr());
  }
  return 0;
}
int clear(PyObject* self) {
  if (!nb::inst_ready(self)) return 0;
  nb::inst_ptr<PythonBatch>(self)->forget();
  return 0;
}
PyType_Slot slots[] = {{Py_tp_traverse, reinterpret_cast<void*>(traverse)},
                       {Py_tp_clear, reinterpret_cast<void*>(clear)},
                       {0, nullptr}};

void bind_counts(nb::class_<PythonBatch>& c) {
  using P = PythonBatch;
  c.def_prop_ro(
       "render_count",
       [](P& p) {
         return locked(*p.core, "BatchSimulator.render_count", [](auto& s) { return s.render_count(); });
       },
       "Number of renders so far.")
      .def_prop_ro(
          "pose_count",
          [](P& p) {
            return locked(*p.core, "BatchSimulator.pose_count", [](auto& s) { return s.pose_count(); });
          },
          "Number of times that an avatar was skinned for rendering.")
      .def(
          "set_rendering",
          [](P& p, bool on) {
            locked(*p.core, "BatchSimulator.set_rendering", [on](auto& s) { s.set_rendering(on); });
          },
          nb::arg("on"), "Turns rendering on or off, from the next action on.")
      .def_prop_ro(
          "unused_bytes",
          [](const P& p) { return p.core->pool == nullptr ? 0 : p.core->pool->unused(); },
          "Number of bytes that are kept for the images of later steps (`copy`).");
}

}  // namespace

void bind_batch(nb::module_& m) {
  bind_step(m);
  using P = PythonBatch;
  nb::class_<P> c(
      m, "BatchSimulator", nb::type_slots(slots),
      "Navigation simulator for N environments over M scenes, stepped by one call. One thread may "
      "use it at a time; a call during another call raises an error.");
  c.def("__init__", make, nb::arg("device"), nb::arg("scenes"), nb::arg("config"),
        nb::arg("environments"), nb::arg("next_episode"), nb::arg("copy") = false,
        nb::arg("image_source") = nb::none(),
        nb::sig("def __init__(self, device: Device | str, "
                "scenes: collections.abc.Sequence[SimulatorScene | OpenedScene], config: BatchConfig, "
                "environments: int, next_episode: collections.abc.Callable[[int, int], "
                "BatchEpisode | PointNavEpisode], copy: bool = False, image_source: "
                "collections.abc.Callable[[int, int], typing.Any] | None = None) -> None"),
        "Creates a simulator that shares `scenes`.\n\n"
        "`next_episode(environment, count)` is called once for each episode of each environment. It "
        "returns "
        "a BatchEpisode, or a PointNavEpisode in scene 0. Its exceptions reach the caller of reset or "
        "step. After that, reset all environments.\n\n"
        "`copy` False returns images as read-only views. True returns new writable arrays, aligned to "
        "64 bytes. The simulator draws into their memory, and uses it again when they are dead. It "
        "keeps unused memory for the images of up to two steps. With AutoReset.disabled the arrays "
        "are copies of the simulator's images. Images on a GPU are always views.\n\n"
        "`image_source(sensor, floats)` is called at each step for each sensor, by its index. It "
        "returns an array of at least that many float32 (DLPack) where `config.images` leaves images. "
        "The step draws into it, so a learner can keep images without a copy. Other libraries must "
        "have finished their work on this memory.")
      .def("reset", reset, nb::arg("mask") = nb::none(), nb::arg("meanwhile") = nb::none(),
           nb::sig("def reset(self, mask: numpy.typing.NDArray[numpy.bool_] | None = None, meanwhile: "
                   "collections.abc.Callable[[BatchStep], object] | None = None) -> BatchStep"),
           "Starts the next episode in all environments, or in those whose mask is True, bool [N]. "
           "`meanwhile`: as in step.")
      .def(
          "step", step, nb::arg("actions").none(), nb::arg("meanwhile") = nb::none(),
          nb::sig("def step(self, actions: numpy.typing.NDArray[numpy.integer[typing.Any]] | "
                  "collections.abc.Sequence[Action | int] | collections.abc.Sequence[VelocityCommand], "
                  "meanwhile: collections.abc.Callable[[BatchStep], object] | None = None) "
                  "-> BatchStep"),
          "Performs one action per environment and renders. `actions`: integers [N] of any dtype, "
          "stride "
          "and library (DLPack), or a list. Wrong actions are refused before any environment moves.\n\n"
          "`meanwhile(step)` is called once after the environments have moved, while a GPU draws, so "
          "that "
          "its work takes no time of its own. It gets the BatchStep that the call returns, whose images "
          "are complete only then. On a CPU it is called after drawing. Its exceptions reach the caller "
          "when the images are complete; no reset is needed. It must not call the simulator.")
      .def("_step_plain", step_plain, nb::arg("actions"), nb::arg("count"), nb::arg("meanwhile"),
           nb::sig("def _step_plain(self, actions: object, count: int, "
                   "meanwhile: collections.abc.Callable[[BatchStep], object]) -> bool"),
           "Step of VectorEnv: False, and no step, unless the actions are a contiguous array [N] of "
           "int32 "
           "or int64 below `count`.")
      .def("_time_steps", time_steps, nb::arg("actions"),
           nb::sig("def _time_steps(self, actions: list[typing.Any]) -> float"),
           "Seconds of these steps in C++, for benchmarks.")
      .def_prop_ro(
          "environments", [](const P& p) { return p.core->sim.environments(); },
          "Number of environments, N.")
      .def("world", world, nb::arg("environment"), nb::sig("def world(self, environment: int) -> World"),
           "World of an environment, without images. After the first reset only.")
      .def(
          "scene_of",
          [](P& p, std::size_t environment) {
            return locked(*p.core, "BatchSimulator.scene_of", [&](auto& s) {
              check_environment(*p.core, environment);
              return s.scene_of(environment);
            });
          },
          nb::arg("environment"), "Index of the scene that an environment is in.")
      .def_prop_ro(
          "device", [](const P& p) { return p.core->sim.device(); },
          "Device that the simulator runs on.");
  bind_counts(c);
}

}  // namespace gsnav::python
