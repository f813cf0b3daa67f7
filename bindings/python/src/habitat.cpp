// SPDX-License-Identifier: Apache-2.0
// Calls for the distribution gsnav-habitat: steps from any point, the greedy follower, and sensors at
// any pose.
#include <nanobind/stl/pair.h>
#include <nanobind/stl/shared_ptr.h>

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <future>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "arrays.hpp"
#include "bind.hpp"
#include "fields.hpp"
#include "gsnav/nav.hpp"
#include "gsnav/sim.hpp"
#include "guard.hpp"
#include "image_pool.hpp"

namespace gsnav::python {
namespace {

/// A follower with the mesh that it refers to.
struct PythonGreedy {
  std::shared_ptr<const NavMesh> mesh;
  GreedyGeodesicFollower follower;
  Busy busy;
};

void make(PythonGreedy* self, std::shared_ptr<const NavMesh> mesh, const Vec3d& goal, TaskConfig task,
          double goal_radius) {
  const ReleaseGil release;
  auto follower = GreedyGeodesicFollower::make(*mesh, goal, task, {goal_radius}).value();
  new (self) PythonGreedy{std::move(mesh), std::move(follower), {}};
}

constexpr std::size_t kMostUnused = std::size_t{1} << 28;  ///< Bytes of images to be used again.

/// Sensors at any poses, with the renderer that draws them.
struct PythonFreeSensors {
  FreeSensors sensors;
  Renderer renderer;
  RenderConfig config;
  Busy busy;
  std::shared_ptr<ImagePool> pool;
};

/// Images that sensors show, a bitmask.
unsigned outputs_of(const FreeSensors& sensors) {
  unsigned out = sensors.sensors().empty() ? kRgb : 0;
  for (const SensorSpec& s : sensors.sensors()) {
    out |= s.kind == SensorKind::rgb ? kRgb : s.kind == SensorKind::depth ? kMedianDepth : kAlpha;
  }
  return out;
}

void make_sensors(PythonFreeSensors* self, const DeviceArg& device, const SceneArg& scene,
                  std::vector<SensorSpec> specs, RenderOptions options) {
  const Device chosen = device.value();
  check_fork(chosen, "FreeSensors");
  const ReleaseGil release;
  FreeSensors sensors = FreeSensors::create(std::move(specs)).value();
  options.render.outputs = outputs_of(sensors);
  Renderer renderer = Renderer::create(chosen, scene.scene, options).value();
  new (self) PythonFreeSensors{std::move(sensors),
                               std::move(renderer),
                               options.render,
                               {},
                               std::make_shared<ImagePool>(kMostUnused)};
}

void set_sensors(PythonFreeSensors& self, std::vector<SensorSpec> specs) {
  const Busy::Hold hold(self.busy, "FreeSensors.set_sensors");
  const ReleaseGil release;
  FreeSensors sensors = FreeSensors::create(std::move(specs)).value();
  self.config.outputs = outputs_of(sensors);
  self.renderer.set_config(self.config).throw_if_error();
  self.sensors = std::move(sensors);
  self.pool = std::make_shared<ImagePool>(kMostUnused);
}

void set_background(PythonFreeSensors& self, const Vec3d& background) {
  const Busy::Hold hold(self.busy, "FreeSensors.set_background");
  RenderConfig changed = self.config;
  changed.background = background;
  self.renderer.set_config(changed).throw_if_error();
  self.config = changed;
}

using PosePairs = std::vector<std::pair<Vec3d, Quatd>>;

/// Writes the image of sensor i at a place: colours as bytes with alpha, other kinds as numbers.
void write(const FreeSensors& sensors, std::size_t i, std::size_t place, std::span<float> out) {
  if (sensors.sensors()[i].kind == SensorKind::rgb) {
    const std::span<std::byte> bytes = std::as_writable_bytes(out);
    sensors.write_rgba(i, place, {reinterpret_cast<std::uint8_t*>(bytes.data()), bytes.size()});
  } else {
    sensors.write(i, place, out);
  }
}

/// Blocks with the images of all sensors at all places, those of a place together. Without the GIL.
std::vector<std::span<float>> draw(PythonFreeSensors& self, const std::vector<SensorPose>& poses,
                                   std::size_t places, double time, std::size_t threads) {
  self.sensors
      .render(
          poses,
          [&](std::span<const Camera> cameras, Frames<float>& out) {
            return self.renderer.render(cameras, out, time);
          },
          places)
      .throw_if_error();
  self.pool->begin();
  const std::size_t sensors = self.sensors.sensors().size();
  std::vector<std::span<float>> blocks;  // A pixel of any kind has four bytes.
  for (std::size_t i = 0; i < poses.size(); ++i) {
    blocks.push_back(self.pool->take(self.sensors.pixels(i % sensors)).value());
  }
  std::atomic<std::size_t> next{0};
  const auto work = [&] {
    for (std::size_t i = next++; i < blocks.size(); i = next++) {
      write(self.sensors, i % sensors, i / sensors, blocks[i]);
    }
  };
  std::vector<std::future<void>> others;  // A future passes errors on, and waits when it is destroyed.
  for (std::size_t t = 1; t < std::min(threads, blocks.size()); ++t) {
    others.push_back(std::async(std::launch::async, work));
  }
  work();
  for (std::future<void>& other : others) other.get();
  return blocks;
}

nb::dict named(PythonFreeSensors& self, std::span<const std::span<float>> blocks) {
  nb::dict out;
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    const SensorSpec& spec = self.sensors.sensors()[i];
    const auto rows = static_cast<std::size_t>(spec.resolution[0]);
    const auto columns = static_cast<std::size_t>(spec.resolution[1]);
    out[nb::str(spec.uuid.c_str())] =
        spec.kind == SensorKind::rgb
            ? self.pool->array<std::uint8_t>(blocks[i].data(), {rows, columns, 4})
            : self.pool->array<float>(blocks[i].data(), {rows, columns});
  }
  return out;
}

nb::list draw_places(PythonFreeSensors& self, const std::vector<PosePairs>& places, double time,
                     std::size_t threads) {
  const Busy::Hold hold(self.busy, "FreeSensors.render_places");
  check_fork(self.renderer.device(), "FreeSensors.render_places");
  check_finite("FreeSensors.render_places: time", time);
  const std::size_t sensors = self.sensors.sensors().size();
  std::vector<SensorPose> poses;
  for (const PosePairs& place : places) {
    if (place.size() != sensors) {
      throw Error(Errc::invalid_argument, "FreeSensors: " + std::to_string(place.size()) +
                                              " poses for " + std::to_string(sensors) + " sensors");
    }
    for (const auto& [position, rotation] : place) poses.push_back({position, rotation});
  }
  std::vector<std::span<float>> blocks;
  if (!places.empty()) {
    const ReleaseGil release;
    blocks = draw(self, poses, places.size(), time, threads);
  }
  nb::list out;
  for (std::size_t i = 0; i < places.size(); ++i) {
    out.append(named(self, std::span(blocks).subspan(i * sensors, sensors)));
  }
  return out;
}

using Colors = nb::ndarray<const std::uint8_t, nb::shape<-1, -1, 3>, nb::device::cpu>;

/// Copies an image. numpy copies three bytes at a time, which takes ten times as long.
nb::object packed(const Colors& image) {
  static const auto pool = std::make_shared<ImagePool>(kMostUnused);
  const std::size_t rows = image.shape(0), columns = image.shape(1);
  const std::span<float> block = pool->take((rows * columns * 3 + 3) / 4).value();
  {
    const ReleaseGil release;
    auto* out = reinterpret_cast<std::uint8_t*>(block.data());
    const std::int64_t step = image.stride(1), next = image.stride(2);
    for (std::size_t y = 0; y < rows; ++y) {
      const std::uint8_t* from = image.data() + static_cast<std::int64_t>(y) * image.stride(0);
      for (std::size_t x = 0; x < columns; ++x, from += step, out += 3) {
        out[0] = from[0];
        out[1] = from[next];
        out[2] = from[2 * next];
      }
    }
  }
  return pool->array<std::uint8_t>(block.data(), {rows, columns, 3});
}

nb::object draw_place(PythonFreeSensors& self, const PosePairs& poses, double time) {
  return draw_places(self, {poses}, time, 1)[0];
}

void bind_free_sensors(nb::module_& m) {
  nb::class_<PythonFreeSensors>(
      m, "FreeSensors", "Sensors that are anywhere at each call, and a renderer that draws them.")
      .def("__init__", make_sensors, nb::arg("device"), nb::arg("scene"), nb::arg("sensors"),
           nb::arg("options") = RenderOptions{},
           "Prepares sensors of colour, depth or alpha without noise. Their fields `position` and "
           "`orientation` are ignored. Raises InvalidArgument or Unsupported naming the sensor.")
      .def_static("packed", packed, nb::arg("image").noconvert(),
                  nb::sig("def packed(image: numpy.typing.NDArray[numpy.uint8]) -> "
                          "numpy.typing.NDArray[numpy.uint8]"),
                  "A new array [H][W][3] with adjoining pixels, from colours [H][W][3] of any strides. "
                  "It is faster than numpy for pixels of an image [H][W][4].")
      .def("set_sensors", set_sensors, nb::arg("sensors"),
           "Replaces the sensors and keeps the renderer. Raises what the constructor raises.")
      .def("set_background", set_background, nb::arg("background"), nb::call_guard<ReleaseGil>(),
           "Sets the colour behind everything, red, green and blue in [0, 1]; at first it is "
           "`options.render.background`. Pixels outside of a fisheye lens stay black. Raises "
           "InvalidArgument for a number that is not finite.")
      .def(
          "render", draw_place, nb::arg("poses"), nb::arg("time") = 0.0,
          nb::sig(
              "def render(self, poses: collections.abc.Sequence[tuple[collections.abc.Sequence[float], "
              "collections.abc.Sequence[float]]], time: float = 0.0) -> "
              "dict[str, numpy.typing.NDArray[typing.Any]]"),
          "Renders all sensors at a time in seconds on the scene's clock.\n\n"
          "`poses` has a position in metres and a rotation (w, x, y, z) for each sensor, which looks "
          "along -z "
          "with y up. Returns new arrays by name: colour uint8 [H][W][4] with alpha 255, depth float32 "
          "[H][W] "
          "in metres with 0 for no return, alpha float32 [H][W]. Raises InvalidArgument for a pose that "
          "is not "
          "finite or not of unit length.")
      .def(
          "render_places", draw_places, nb::arg("places"), nb::arg("time") = 0.0, nb::arg("threads") = 1,
          nb::sig("def render_places(self, places: collections.abc.Sequence[collections.abc.Sequence["
                  "tuple[collections.abc.Sequence[float], collections.abc.Sequence[float]]]], "
                  "time: float = 0.0, threads: int = 1) -> "
                  "list[dict[str, numpy.typing.NDArray[typing.Any]]]"),
          "Renders all sensors at many places, with the images of `render` at each.\n\n"
          "A sensor's cameras of all places are drawn in one call, which is faster on a GPU. `places` "
          "has "
          "the `poses` of each. Images become arrays on up to `threads` threads of the CPU. Raises what "
          "`render` raises.");
}

}  // namespace

void bind_habitat(nb::module_& m) {
  m.def(
      "try_step",
      [](const NavMesh& mesh, const Vec3d& start, const Vec3d& end, bool slide, SnapOptions options) {
        return gsnav::try_step(mesh, start, end, slide, options);
      },
      nb::arg("mesh"), nb::arg("start"), nb::arg("end"), nb::arg("slide"),
      nb::arg("options") = SnapOptions{}, nb::call_guard<ReleaseGil>(),
      "Moves from any point towards another along the surface. The start is snapped first. Returns None "
      "if it "
      "cannot be snapped or a coordinate is not finite. `slide`: slide along walls, or stop at the "
      "first.");
  nb::class_<PythonGreedy>(
      m, "GreedyGeodesicFollower",
      "Baseline policy modelled on that of Habitat. It avoids walls and ignores people.")
      .def("__init__", make, nb::arg("mesh"), nb::arg("goal"), nb::arg("task") = TaskConfig{},
           nb::arg("goal_radius") = 0.0,
           "Creates a follower for one goal. `goal_radius` in metres; 0 is three quarters of a step. "
           "Raises "
           "NothingNavigable if the goal is off the mesh.")
      .def(
          "next",
          [](PythonGreedy& g, const Vec3d& position, double yaw) {
            const Busy::Hold hold(g.busy, "GreedyGeodesicFollower.next");
            check_finite("GreedyGeodesicFollower.next: yaw", yaw);
            AgentPose pose;
            pose.position = position;
            pose.yaw = yaw;
            return g.follower.next(pose).value();
          },
          nb::arg("position"), nb::arg("yaw"), nb::call_guard<ReleaseGil>(),
          "Next action from a position in metres and a heading in radians, or Action.stop within the "
          "goal "
          "radius. Raises NothingNavigable if the agent is off the mesh or on another island.")
      .def(
          "reset",
          [](PythonGreedy& g) {
            const Busy::Hold hold(g.busy, "GreedyGeodesicFollower.reset");
            g.follower.reset();
          },
          "Forgets the previous actions.");
  bind_free_sensors(m);
}

}  // namespace gsnav::python
