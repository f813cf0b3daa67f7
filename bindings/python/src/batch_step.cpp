// SPDX-License-Identifier: Apache-2.0
#include "batch_step.hpp"

#include <nanobind/stl/string.h>

#include <string>

#include "fields.hpp"
#include "structured.hpp"

namespace gsnav::python {

namespace {

/// dtype of metrics, and the arrays of a step that ends no episode. They live as long as the process.
struct Types {
  nb::object metrics = metrics_dtype();
  nb::object no_goals = array_copy(std::span<const double>(), {0, 2});
  nb::object no_metrics = structured_copy(std::span<const EpisodeMetrics>(), metrics);
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
  for (const BatchObservation& o : images) {
    if (o.on_backend == nullptr) out[nb::str(o.uuid.data(), o.uuid.size())] = array(o);
  }
  return out;
}

nb::object copied(const BatchObservation& o) { return array_copy(o.data, shape_of(o)); }

nb::dict step_images(std::span<const BatchObservation> images, const BatchCore& b, nb::handle self,
                     Unfilled& unfilled) {
  return image_arrays(images, [&](const BatchObservation& o) {
    if (!b.copy) return array_view(o.data.data(), shape_of(o), self);
    // Sensors may share an image, but each has an array of its own.
    nb::object own = b.pool != nullptr ? b.pool->array<float>(o.data.data(), shape_of(o)) : nb::object();
    if (own.is_valid()) return own;
    float* data = nullptr;
    own = new_array(shape_of(o), data);
    unfilled.emplace_back(o.data, data);
    return own;
  });
}

nb::object bool_view(std::span<const std::uint8_t> values, nb::handle owner) {
  return array_view(values.data(), {values.size()}, owner).attr("view")("?");
}

nb::object info_view(const PythonStep& s) {
  static const auto* const dtype = new nb::object(step_info_dtype());  // lives as long as the process
  return structured_view(s.info.infos, *dtype, s.owner);
}

nb::object goal_view(const PythonStep& s) {
  static_assert(sizeof(PointGoal) == 2 * sizeof(double));
  const auto* const goals = reinterpret_cast<const double*>(s.info.point_goals.data());
  return array_view(goals, {s.info.point_goals.size(), 2}, s.owner);
}

}  // namespace

PythonStep step_arrays(const BatchStep& s, const BatchCore& b, nb::handle self, Unfilled& unfilled) {
  PythonStep out{s, nb::borrow(self), {}, {}, {}, {}, {}, {}, {}};
  std::vector<std::int64_t> finished(s.finished.begin(), s.finished.end());
  const std::size_t ended = finished.size();
  out.finished = array_from(std::move(finished), {ended});
  const auto* const goals = reinterpret_cast<const double*>(s.final_point_goals.data());
  const Types& t = types();
  out.final_point_goals = ended == 0 ? t.no_goals : array_copy(std::span(goals, 2 * ended), {ended, 2});
  out.final_metrics = ended == 0 ? t.no_metrics : structured_copy(s.final_metrics, t.metrics);
  // Images are views of memory that belongs to the simulator, or to the arrays of the source.
  const nb::object owner = b.images->given.size() == 0
                               ? nb::borrow(self)
                               : nb::object(nb::make_tuple(nb::borrow(self), b.images->given));
  out.images = step_images(s.images, b, owner, unfilled);
  out.final_images = image_arrays(s.final_images, copied);
  out.on_backend = device_images(s.images, b.sim.device(), b.consumers, owner);
  out.final_on_backend = device_images(s.final_images, b.sim.device(), b.consumers, self);
  return out;
}

void bind_step(nb::module_& m) {
  types();
  using S = PythonStep;
  nb::class_<S> c(m, "BatchStep",
                  "Result of a batch step in the form of Gymnasium's VectorEnv. Arrays with one row per "
                  "environment are read-only views; the simulator's next call overwrites them. "
                  "With BatchSimulator(copy=True), images are new arrays.");
  const auto view = [&](const char* name, const char* type, const char* doc, const auto& get) {
    array_property(c, name, type, doc, [get](const S& s) -> nb::object { return get(s); });
  };
  view("rewards", "float64", "Reward of the action, [N].",
       [](const S& s) { return array_view(s.info.rewards.data(), {s.info.rewards.size()}, s.owner); });
  view("terminated", "bool_", "True if `stop` ended the episode, [N].",
       [](const S& s) { return bool_view(s.info.terminated, s.owner); });
  view("truncated", "bool_", "True if the episode reached its limit of actions, [N].",
       [](const S& s) { return bool_view(s.info.truncated, s.owner); });
  view("infos", "void", "Outcome of the action, structured [N] with the fields of StepInfo.", info_view);
  view("point_goals", "float64", "Distance (metres) and angle (radians), [N][2].", goal_view);
  view("times", "float64", "Time on the clock of the environment's scene, seconds, [N].",
       [](const S& s) { return array_view(s.info.times.data(), {s.info.times.size()}, s.owner); });
  const auto array = [&](const char* name, nb::object S::*member, const char* type, const char* doc) {
    array_property(c, name, type, doc, [member](const S& s) { return s.*member; });
  };
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
      .def_prop_ro(
          "on_backend", [](const S& s) { return s.on_backend; },
          nb::sig("def on_backend(self) -> dict[str, DeviceArray]"),
          "Images in the memory of a GPU, with ImageMemory.backend. `images` is then empty.")
      .def_prop_ro(
          "final_on_backend", [](const S& s) { return s.final_on_backend; },
          nb::sig("def final_on_backend(self) -> dict[str, DeviceArray]"),
          "`final_images` in the memory of a GPU. Valid until the next call.")
      .def(
          "__getitem__",
          [](const S& s, const std::string& uuid) -> nb::object {
            const nb::str key(uuid.data(), uuid.size());
            if (s.images.contains(key)) return s.images[key];
            if (s.on_backend.contains(key)) {
              throw nb::key_error(("the images of \"" + uuid +
                                   "\" are in the memory of the GPU: use on_backend[\"" + uuid + "\"]")
                                      .c_str());
            }
            const std::string known = text_of(nb::list(s.images.keys()));
            throw nb::key_error(("no sensor \"" + cut(uuid) + "\"; the sensors are " + known).c_str());
          },
          nb::arg("uuid"),
          nb::sig("def __getitem__(self, uuid: str) -> numpy.typing.NDArray[numpy.float32]"),
          "The images of a sensor, float32 [N][H][W][C].");
}

}  // namespace gsnav::python
