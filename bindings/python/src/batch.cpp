// SPDX-License-Identifier: Apache-2.0
#include <optional>

#include "actions.hpp"
#include "bind.hpp"
#include "episode_source.hpp"
#include "fields.hpp"
#include "gsnav/device/simulator.hpp"
#include "guard.hpp"
#include "image_pool.hpp"
#include "structured.hpp"
#include "world.hpp"

namespace gsnav::python {
namespace {

/// A BatchSimulator that one thread may use at a time.
struct PythonBatch {
  BatchSimulator sim;
  std::shared_ptr<PythonSource> source;
  std::shared_ptr<ImagePool> pool;  ///< Images are drawn there, or null.
  bool copy = false;                ///< Images are new arrays.
  bool begun = false;               ///< Worlds exist from the first reset on.
  Busy busy;

  PythonBatch(BatchSimulator s, std::shared_ptr<PythonSource> e, std::shared_ptr<ImagePool> p, bool c)
      : sim(std::move(s)), source(std::move(e)), pool(std::move(p)), copy(c) {}
  PythonBatch(const PythonBatch&) = delete;
  PythonBatch& operator=(const PythonBatch&) = delete;
  ~PythonBatch() {
    if (pool != nullptr) pool->close();
  }
};

/// BatchStep whose spans are numpy arrays.
struct PythonStep {
  nb::object rewards, terminated, truncated, infos, point_goals, times, finished, final_metrics,
      final_point_goals;
  nb::dict images, final_images;
};

/// dtypes of structured arrays. They live as long as the process.
struct Types {
  nb::object infos = step_info_dtype(), metrics = metrics_dtype();
};
const Types& types() {
  static const Types* const made = new Types;
  return *made;
}

std::vector<std::size_t> shape_of(const BatchObservation& o) {
  return {o.environments, static_cast<std::size_t>(o.height), static_cast<std::size_t>(o.width),
          static_cast<std::size_t>(o.channels)};
}

/// Arrays by the names of their sensors. `array` makes that of one image.
template <class F>
nb::dict image_arrays(std::span<const BatchObservation> images, const F& array) {
  nb::dict out;
  for (const BatchObservation& o : images) out[nb::str(o.uuid.data(), o.uuid.size())] = array(o);
  return out;
}

nb::object copied(const BatchObservation& o) { return array_copy(o.data, shape_of(o)); }

nb::dict step_images(std::span<const BatchObservation> images, const PythonBatch& b, nb::handle self) {
  return image_arrays(images, [&](const BatchObservation& o) {
    if (!b.copy) return array_view(o.data.data(), shape_of(o), self);
    // Sensors may share an image, but each has an array of its own.
    nb::object own = b.pool != nullptr ? b.pool->array(o.data.data(), shape_of(o)) : nb::object();
    return own.is_valid() ? own : copied(o);
  });
}

nb::object bool_view(std::span<const std::uint8_t> values, nb::handle owner) {
  return array_view(values.data(), {values.size()}, owner).attr("view")("?");
}

/// Arrays of a step. Those with a row per environment are views; others are copies, because their sizes
/// change from step to step.
PythonStep step_arrays(const BatchStep& s, const PythonBatch& b, nb::handle self) {
  static_assert(sizeof(PointGoal) == 2 * sizeof(double));
  PythonStep out;
  const std::size_t n = s.rewards.size();
  out.rewards = array_view(s.rewards.data(), {n}, self);
  out.terminated = bool_view(s.terminated, self);
  out.truncated = bool_view(s.truncated, self);
  out.infos = structured_view(s.infos, types().infos, self);
  out.point_goals = array_view(reinterpret_cast<const double*>(s.point_goals.data()), {n, 2}, self);
  out.times = array_view(s.times.data(), {n}, self);
  std::vector<std::int64_t> finished(s.finished.begin(), s.finished.end());
  const std::size_t ended = finished.size();
  out.finished = array_from(std::move(finished), {ended});
  const auto* const goals = reinterpret_cast<const double*>(s.final_point_goals.data());
  out.final_point_goals = array_copy(std::span(goals, 2 * ended), {ended, 2});
  out.final_metrics = structured_copy(s.final_metrics, types().metrics);
  out.images = step_images(s.images, b, self);
  out.final_images = image_arrays(s.final_images, copied);
  return out;
}

/// Runs f(simulator) -> Result<BatchStep> without the GIL. An exception of the episode source goes on.
template <class F>
PythonStep observe(nb::handle self, PythonBatch& b, const char* what, const F& f) {
  check_fork(b.sim.device(), what);
  b.source->error.reset();
  if (b.pool != nullptr) b.pool->begin();
  std::optional<Result<BatchStep>> result;
  {
    nb::gil_scoped_release release;
    result.emplace(f(b.sim));
  }
  if (!result->ok()) {
    if (b.source->error) {
      nb::python_error error = std::move(*b.source->error);
      b.source->error.reset();
      throw error;
    }
    result->status().throw_if_error();
  }
  return step_arrays(**result, b, self);
}

/// Memory for the images of a batch whose arrays own them. It keeps as many bytes as two steps need, for
/// a caller that holds the arrays of one step while it takes the next. Null if a call may draw only some
/// of the environments: the others would have to be drawn again.
std::shared_ptr<ImagePool> image_pool(const BatchConfig& config, std::size_t environments) {
  if (config.auto_reset == AutoReset::disabled) return nullptr;
  double bytes = 0;
  for (const SensorSpec& s : config.sensors) {
    bytes += 2.0 * sizeof(float) * static_cast<double>(environments) * s.resolution[0] *
             s.resolution[1] * channels_of(s.kind);
  }
  // A size that does not fit is an error of the sensor, which the simulator names.
  return std::make_shared<ImagePool>(bytes > 0 && bytes < 0x1p62 ? static_cast<std::size_t>(bytes) : 0);
}

void make(PythonBatch* self, const DeviceArg& device, const std::vector<SceneArg>& scenes,
          BatchConfig config, std::size_t environments, nb::object next_episode, bool copy) {
  if (!PyCallable_Check(next_episode.ptr())) {
    throw nb::type_error(
        ("BatchSimulator: next_episode must be callable, got " + type_of(next_episode)).c_str());
  }
  const Device chosen = device.value();
  check_fork(chosen, "BatchSimulator");
  std::vector<std::shared_ptr<const SimulatorScene>> shared;
  for (const SceneArg& s : scenes) shared.push_back(s.scene);
  auto source = std::make_shared<PythonSource>(PythonSource{std::move(next_episode), {}});
  EpisodeSource episodes = episode_source(source);
  std::shared_ptr<ImagePool> pool = copy ? image_pool(config, environments) : nullptr;
  if (pool != nullptr) {
    config.image_source = [pool](std::size_t, std::size_t floats) { return pool->take(floats); };
  }
  nb::gil_scoped_release release;
  new (self) PythonBatch(BatchSimulator::create(chosen, std::move(shared), std::move(config),
                                                environments, std::move(episodes))
                             .value(),
                         std::move(source), std::move(pool), copy);
}

PythonStep reset(nb::handle self, nb::handle mask) {
  auto& b = object_of<PythonBatch>(self);
  const Busy::Hold hold(b.busy, "BatchSimulator.reset");
  const std::vector<std::uint8_t> chosen = reset_mask(mask, b.sim.environments());
  PythonStep step =
      observe(self, b, "BatchSimulator.reset", [&](BatchSimulator& sim) { return sim.reset(chosen); });
  b.begun = true;
  return step;
}

PythonStep step(nb::handle self, nb::handle actions) {
  auto& b = object_of<PythonBatch>(self);
  const Busy::Hold hold(b.busy, "BatchSimulator.step");
  const BatchActions chosen = batch_actions(actions, b.sim.environments());
  return std::visit(
      [&](const auto& a) {
        return observe(self, b, "BatchSimulator.step", [&](BatchSimulator& sim) { return sim.step(a); });
      },
      chosen);
}

void check_environment(const PythonBatch& b, std::size_t environment) {
  if (environment >= b.sim.environments()) {
    throw nb::index_error(
        ("environment " + std::to_string(environment) + " of " + std::to_string(b.sim.environments()))
            .c_str());
  }
  if (!b.begun) throw Error(Errc::invalid_argument, "BatchSimulator: call reset() first");
}

WorldView world(nb::handle self, std::size_t environment) {
  auto& b = object_of<PythonBatch>(self);
  check_environment(b, environment);
  return {nb::borrow(self), &b.busy,
          [&b, environment]() -> const World& { return b.sim.world(environment); }};
}

// The episode source may refer to the simulator, for example through an environment that owns both.
// These functions let Python's collector find such cycles.
int traverse(PyObject* self, visitproc visit, void* arg) {
  Py_VISIT(Py_TYPE(self));
  if (!nb::inst_ready(self)) return 0;
  const PythonBatch* const b = nb::inst_ptr<PythonBatch>(self);
  const nb::handle function = b->source->function;
  Py_VISIT(function.ptr());
  return 0;
}
int clear(PyObject* self) {
  if (nb::inst_ready(self)) nb::inst_ptr<PythonBatch>(self)->source->function = nb::none();
  return 0;
}
PyType_Slot slots[] = {{Py_tp_traverse, reinterpret_cast<void*>(traverse)},
                       {Py_tp_clear, reinterpret_cast<void*>(clear)},
                       {0, nullptr}};

void bind_step(nb::module_& m) {
  using S = PythonStep;
  nb::class_<S> c(m, "BatchStep",
                  "Result of a batch step in the form of Gymnasium's VectorEnv. Arrays with one row per "
                  "environment are read-only views; the simulator's next call overwrites them. "
                  "With BatchSimulator(copy=True), images are new arrays.");
  const auto array = [&](const char* name, nb::object S::*member, const char* type, const char* doc) {
    const std::string signature =
        std::string("def ") + name + "(self) -> numpy.typing.NDArray[numpy." + type + "]";
    c.def_prop_ro(
        name, [member](const S& s) { return s.*member; }, nb::sig(signature.c_str()), doc);
  };
  array("rewards", &S::rewards, "float64", "Reward of the action, [N].");
  array("terminated", &S::terminated, "bool_", "True if `stop` ended the episode, [N].");
  array("truncated", &S::truncated, "bool_", "True if the episode reached its limit of actions, [N].");
  array("infos", &S::infos, "void",
        "Outcome of the action, structured [N] with the fields of StepInfo.");
  array("point_goals", &S::point_goals, "float64", "Distance (metres) and angle (radians), [N][2].");
  array("times", &S::times, "float64", "Time on the clock of the environment's scene, seconds, [N].");
  array("finished", &S::finished, "int64", "Environments whose episode ended in this step. A copy.");
  array("final_metrics", &S::final_metrics, "void",
        "Metrics of those episodes, structured with the fields of EpisodeMetrics. A copy.");
  array("final_point_goals", &S::final_point_goals, "float64",
        "Goals at the end of those episodes: distance (metres) and angle (radians), [finished][2]. A "
        "copy.");
  const char* const images = "-> dict[str, numpy.typing.NDArray[numpy.float32]]";
  c.def_prop_ro(
       "images", [](const S& s) { return s.images; },
       nb::sig((std::string("def images(self) ") + images).c_str()),
       "Images by the names of their sensors, float32 [N][H][W][C]. Empty if nothing was rendered.")
      .def_prop_ro(
          "final_images", [](const S& s) { return s.final_images; },
          nb::sig((std::string("def final_images(self) ") + images).c_str()),
          "Last images of the episodes in `finished`, with AutoReset.same_step only. A copy.")
      .def(
          "__getitem__",
          [](const S& s, const std::string& uuid) -> nb::object {
            const nb::str key(uuid.data(), uuid.size());
            if (s.images.contains(key)) return s.images[key];
            const std::string known = text_of(nb::list(s.images.keys()));
            throw nb::key_error(("no sensor \"" + uuid + "\"; the sensors are " + known).c_str());
          },
          nb::arg("uuid"),
          nb::sig("def __getitem__(self, uuid: str) -> numpy.typing.NDArray[numpy.float32]"),
          "The images of a sensor, float32 [N][H][W][C].");
}

}  // namespace

void bind_batch(nb::module_& m) {
  types();
  bind_step(m);
  using P = PythonBatch;
  nb::class_<P>(
      m, "BatchSimulator", nb::type_slots(slots),
      "Navigation simulator for N environments over M scenes, stepped by one call. One thread may "
      "use it at a time; a call during another call raises an error.")
      .def(
          "__init__", make, nb::arg("device"), nb::arg("scenes"), nb::arg("config"),
          nb::arg("environments"), nb::arg("next_episode"), nb::arg("copy") = false,
          nb::sig("def __init__(self, device: Device | str, "
                  "scenes: collections.abc.Sequence[SimulatorScene | OpenedScene], config: BatchConfig, "
                  "environments: int, next_episode: collections.abc.Callable[[int, int], "
                  "BatchEpisode | PointNavEpisode], copy: bool = False) -> None"),
          "Creates a simulator that shares `scenes`.\n\n"
          "`next_episode(environment, count)` is called once for each episode of each environment. It "
          "returns "
          "a BatchEpisode, or a PointNavEpisode in scene 0. Its exceptions reach the caller of reset or "
          "step. After that, reset all environments.\n\n"
          "`copy` False returns images as read-only views. True returns new writable arrays, aligned to "
          "64 bytes. The simulator draws into their memory, and uses it again when they are dead. It "
          "keeps unused memory for the images of up to two steps. With AutoReset.disabled the arrays "
          "are copies of the simulator's images.")
      .def(
          "reset", reset, nb::arg("mask") = nb::none(),
          nb::sig("def reset(self, mask: numpy.typing.NDArray[numpy.bool_] | None = None) -> BatchStep"),
          "Starts the next episode in all environments, or in those whose mask is True, bool [N].")
      .def("step", step, nb::arg("actions").none(),
           nb::sig("def step(self, actions: numpy.typing.NDArray[numpy.integer[typing.Any]] | "
                   "collections.abc.Sequence[Action | int] | collections.abc.Sequence[VelocityCommand]) "
                   "-> BatchStep"),
           "Performs one action per environment and renders. `actions`: integers [N] of any dtype, "
           "stride "
           "and library (DLPack), or a list. Wrong actions are refused before any environment moves.")
      .def_prop_ro(
          "environments", [](const P& p) { return p.sim.environments(); }, "Number of environments, N.")
      .def("world", world, nb::arg("environment"), nb::sig("def world(self, environment: int) -> World"),
           "World of an environment, without images. After the first reset only.")
      .def(
          "scene_of",
          [](P& p, std::size_t environment) {
            const Busy::Hold hold(p.busy, "BatchSimulator.scene_of");
            check_environment(p, environment);
            return p.sim.scene_of(environment);
          },
          nb::arg("environment"), "Index of the scene that an environment is in.")
      .def_prop_ro(
          "render_count",
          [](P& p) {
            const Busy::Hold hold(p.busy, "BatchSimulator.render_count");
            return p.sim.render_count();
          },
          "Number of renders so far.")
      .def_prop_ro(
          "pose_count",
          [](P& p) {
            const Busy::Hold hold(p.busy, "BatchSimulator.pose_count");
            return p.sim.pose_count();
          },
          "Number of times that an avatar was skinned for rendering.")
      .def(
          "set_rendering",
          [](P& p, bool on) {
            const Busy::Hold hold(p.busy, "BatchSimulator.set_rendering");
            p.sim.set_rendering(on);
          },
          nb::arg("on"), "Turns rendering on or off, from the next action on.")
      .def_prop_ro(
          "unused_bytes", [](const P& p) { return p.pool == nullptr ? 0 : p.pool->unused(); },
          "Number of bytes that are kept for the images of later steps (`copy`).")
      .def_prop_ro(
          "device", [](const P& p) { return p.sim.device(); }, "Device that the simulator runs on.");
}

}  // namespace gsnav::python
