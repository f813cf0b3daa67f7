// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/sim/task.hpp"

#include "arrays.hpp"
#include "bind.hpp"
#include "fields.hpp"
#include "gsnav/sim.hpp"

namespace gsnav::python {
namespace {

void bind_actions(nb::module_& m) {
  nb::enum_<Action>(m, "Action", nb::is_arithmetic(), "Discrete action. Values are those of Habitat.")
      .value("stop", Action::stop, "Ends the episode.")
      .value("move_forward", Action::move_forward, "Moves forward by TaskConfig.forward_step.")
      .value("turn_left", Action::turn_left, "Turns left by TaskConfig.turn_angle.")
      .value("turn_right", Action::turn_right, "Turns right by TaskConfig.turn_angle.")
      .value("look_up", Action::look_up, "Tilts the sensors up, not the body.")
      .value("look_down", Action::look_down, "Tilts the sensors down, not the body.");
  using V = VelocityCommand;
  Struct<V>(m, "VelocityCommand", "Continuous action: velocities for one control period.")
      .field("linear", &V::linear, "Forward velocity, m/s.")
      .field("angular", &V::angular, "Turn rate, rad/s, positive to the left.")
      .field("stop", &V::stop, "Ends the episode, like Action.stop.")
      .field("lateral", &V::lateral, "Sideways velocity, m/s, positive to the left.")
      .done();
  using R = RewardConfig;
  Struct<R>(m, "RewardConfig",
            "Weights of the reward of one action: progress (g_before - g_after) + slack + success S - "
            "proximity i - collision C - wall W, where g is the distance to the goal in metres.")
      .field("progress", &R::progress, "Per metre of progress.")
      .field("slack", &R::slack, "Per action.")
      .field("success", &R::success, "Once, for success.")
      .field("proximity", &R::proximity, "Per action completely inside a person's space.")
      .field("collision", &R::collision, "Per action that collides with a person.")
      .field("wall", &R::wall, "Per action that runs into a wall.")
      .done();
  using T = TaskConfig;
  Struct<T>(m, "TaskConfig", "Body of the agent, effects of its actions, and when an episode ends.")
      .field("agent_radius", &T::agent_radius, "Radius of the agent, metres.")
      .field("agent_height", &T::agent_height, "Height of the agent, metres.")
      .field("forward_step", &T::forward_step, "Length of one move_forward, metres.")
      .field("turn_angle", &T::turn_angle, "Angle of one turn, degrees.")
      .field("tilt_angle", &T::tilt_angle, "Angle of one look_up or look_down, degrees.")
      .field("allow_sliding", &T::allow_sliding, "Slide along walls and avatars.")
      .field("control_period", &T::control_period, "Duration of an action, seconds.")
      .field("substeps", &T::substeps, "Parts of a control period. In each, bodies move linearly.")
      .field("max_steps", &T::max_steps, "Number of actions after which the episode is cut off.")
      .field("success_distance", &T::success_distance,
             "Largest distance to the goal at which `stop` is a success (exclusive), metres.")
      .field("skin", &T::skin, "Gap that a stopped move keeps from an avatar, metres.")
      .field("reward", &T::reward, "Weights of the reward.")
      .done()
      .def_static("pointnav_v2", &T::pointnav_v2,
                  "Settings of Habitat's PointNav v2 challenge, without its actuation noise.")
      .def_static("avatar_pointnav", &T::avatar_pointnav,
                  "PointNav among people, with penalties for coming near them.");
}

using Image = AnyArray<nb::ndarray<const float, nb::c_contig, nb::device::cpu>>;

std::vector<std::size_t> shape_of(const Image& image) {
  std::vector<std::size_t> shape;
  for (std::size_t i = 0; i < image.ndim(); ++i) shape.push_back(image.shape(i));
  return shape;
}

/// The numbers of an image. Throws ValueError if they are not aligned.
std::span<const float> numbers(const Image& image, const char* what) {
  if (!is_aligned<float>(image.data())) {
    throw nb::value_error((std::string(what) + ": the array is not aligned; pass a copy of it").c_str());
  }
  return {image.data(), image.size()};
}

nb::object colors_to_bytes(const Image& rgb) {
  const std::span<const float> colors = numbers(rgb, "to_bytes");
  std::vector<std::uint8_t> bytes(rgb.size());
  {
    const ReleaseGil release;
    to_bytes(colors, bytes);
  }
  return array_from(std::move(bytes), shape_of(rgb));
}

void bind_sensors(nb::module_& m) {
  nb::enum_<SensorKind>(m, "SensorKind", "Kind of image that a sensor produces.")
      .value("rgb", SensorKind::rgb, "Colour, float32 [H][W][3], 0 to 1 and above.")
      .value("depth", SensorKind::depth, "Median depth, float32 [H][W][1], metres; 0: no return.")
      .value("alpha", SensorKind::alpha, "Covered fraction of the pixel, float32 [H][W][1].")
      .value("semantic", SensorKind::semantic,
             "Id of the object that covers most of the pixel; 0: none.")
      .value("normal", SensorKind::normal, "Unit normal of the mesh, float32 [H][W][3].");
  nb::enum_<SensorModel>(m, "SensorModel", "Camera model of a sensor.")
      .value("pinhole", SensorModel::pinhole, "Perspective projection.")
      .value("equirectangular", SensorModel::equirectangular, "Full sphere.")
      .value("fisheye", SensorModel::fisheye, "Double sphere model.");
  using F = FisheyeLens;
  Struct<F>(m, "FisheyeLens", "Parameters of the double sphere model.")
      .field("alpha", &F::alpha, "Parameter of the model.")
      .field("xi", &F::xi, "Parameter of the model.")
      .field("focal_length", &F::focal_length,
             "Focal lengths in pixels. 0: chosen by the sensor's hfov.")
      .field("principal_point_offset", &F::principal_point_offset,
             "Offset from the image centre, pixels.")
      .done();
  using S = SensorSpec;
  Struct<S>(m, "SensorSpec",
            "A camera fixed to the agent. Conventions and defaults are those of Habitat.")
      .field("uuid", &S::uuid, "Name of the observation, unique per agent.")
      .field("kind", &S::kind, "Quantity that the sensor measures.")
      .field("model", &S::model, "Camera model.")
      .field("resolution", &S::resolution, "Height and width in pixels.")
      .field("hfov", &S::hfov, "Horizontal field of view, degrees.")
      .field("position", &S::position, "Position relative to the agent's base, metres, shape [3].")
      .field("orientation", &S::orientation, "Euler angles about X, then Y, then Z, radians, shape [3].")
      .field("near_plane", &S::near_plane, "Near plane, metres.")
      .field("near_sigma", &S::near_sigma, "See Camera.near_sigma.")
      .field("far_plane", &S::far_plane,
             "Far plane, metres. Depth beyond it is no return. Infinity: no limit.")
      .field("fisheye", &S::fisheye, "Lens of SensorModel.fisheye.")
      .field("cube_size", &S::cube_size,
             "Pixels of the cube that other models are resampled from; 0: auto.")
      .field("noise", &S::noise, "Noise that is added to the image.")
      .done()
      .def(
          "validate", [](const S& s) { validate(s).throw_if_error(); },
          "Raises InvalidArgument naming the field that is out of range.");
  m.def("rgbd_sensors", &rgbd_sensors, nb::arg("height") = 256, nb::arg("width") = 256,
        nb::arg("hfov") = 90.0, nb::arg("position") = Vec3d{0.0, 1.5, 0.0},
        "An RGB and a depth sensor (\"rgb\", \"depth\") at the same position. They share one render.");
  m.def(
      "copy_image", [](const Image& i) { return array_copy(numbers(i, "copy_image"), shape_of(i)); },
      nb::arg("image"),
      nb::sig("def copy_image(image: numpy.typing.NDArray[numpy.float32]) -> "
              "numpy.typing.NDArray[numpy.float32]"),
      "A writable copy of an image, float32 of any shape, aligned to 64 bytes: JAX takes it without a "
      "copy.");
  m.def(
      "to_bytes", colors_to_bytes, nb::arg("rgb"),
      nb::sig(
          "def to_bytes(rgb: numpy.typing.NDArray[numpy.float32]) -> numpy.typing.NDArray[numpy.uint8]"),
      "Converts display-referred colours, float32 of any shape, to 8 bit: round(255 clamp(c, 0, 1)).");
}

}  // namespace

void bind_task(nb::module_& m) {
  bind_actions(m);
  bind_sensors(m);
}

void bind_settings(nb::module_& m) {
  using C = SimulatorConfig;
  Struct<C>(m, "SimulatorConfig", "Settings of a simulator.")
      .field("task", &C::task, "Agent, actions and rules of the task.")
      .field("sensors", &C::sensors,
             "Sensors of the agent. Reading gives a new list; assign to change it.")
      .field("render", &C::render, "How sensors render. Leave `outputs` at its default.")
      .field("lod", &C::lod, "Level of detail, or None.")
      .field("visible_sets", &C::visible_sets,
             "Render only Gaussians that are visible from the camera's cell.")
      .field("rendering", &C::rendering, "False: simulate without rendering.")
      .field("seed", &C::seed, "Seed of the sensor noise.")
      .done();
  nb::enum_<AutoReset>(m, "AutoReset", "Treatment of an environment whose episode has ended.")
      .value("next_step", AutoReset::next_step,
             "The next step ignores its action and begins an episode.")
      .value("same_step", AutoReset::same_step, "The step that ends an episode begins the next one.")
      .value("disabled", AutoReset::disabled, "The environment waits for reset(mask).");
  nb::enum_<ImageMemory>(m, "ImageMemory", "Where a batch returns its images.")
      .value("host", ImageMemory::host, "In host memory, as numpy arrays.")
      .value("backend", ImageMemory::backend, "In the memory of the device, as DeviceArray on a GPU.");
  using B = BatchConfig;
  Struct<B, C>(m, "BatchConfig",
               "Settings of a batch of environments: those of SimulatorConfig and three more.")
      .field("task", &B::task, "Agent, actions and rules of the task.")
      .field("sensors", &B::sensors,
             "Sensors of the agent. Reading gives a new list; assign to change it.")
      .field("render", &B::render, "How sensors render. Leave `outputs` at its default.")
      .field("lod", &B::lod, "Level of detail, or None.")
      .field("visible_sets", &B::visible_sets,
             "Render only Gaussians that are visible from the camera's cell.")
      .field("rendering", &B::rendering, "False: simulate without rendering.")
      .field("seed", &B::seed, "Seed of the sensor noise; environment e has seed + e.")
      .field("auto_reset", &B::auto_reset, "When an environment that is done begins its next episode.")
      .field("pose_slots", &B::pose_slots, "Number of poses of avatars that are held at once, >= 1.")
      .field("images", &B::images, "Where images are returned.")
      .done();
}

}  // namespace gsnav::python
