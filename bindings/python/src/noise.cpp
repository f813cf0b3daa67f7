// SPDX-License-Identifier: Apache-2.0
// Noise of sensors, as settings and as a function of an image.
#include <string>

#include "arrays.hpp"
#include "bind.hpp"
#include "fields.hpp"
#include "gsnav/sim.hpp"

namespace gsnav::python {
namespace {

template <class T>
using Array = AnyArray<nb::ndarray<const T, nb::c_contig, nb::device::cpu>>;

template <class T>
std::vector<std::size_t> shape_of(const Array<T>& image, const char* rule, bool fits) {
  std::vector<std::size_t> shape;
  std::string text;
  for (std::size_t i = 0; i < image.ndim(); ++i) {
    shape.push_back(image.shape(i));
    text += "[" + std::to_string(image.shape(i)) + "]";
  }
  if (!fits || !is_aligned<T>(image.data())) {
    throw nb::value_error(("with_noise: the image has the shape " + text + ": must be " + rule).c_str());
  }
  return shape;
}

Status check(const NoiseModel& model, bool depth) {
  if (Status s = validate(model, "with_noise"); !s) return s;
  const bool fits = model.kind == NoiseKind::none || is_color_noise(model.kind) != depth;
  if (fits) return {};
  return {Errc::invalid_argument, depth ? "with_noise: noise of colour needs colours of 8 bit"
                                        : "with_noise: redwood_depth needs a depth image of float32"};
}

nb::object noisy_colors(NoiseModel model, std::uint64_t seed, const Array<std::uint8_t>& image) {
  check(model, false).throw_if_error();
  const auto channels = image.ndim() == 3 ? image.shape(2) : 0;
  const auto shape =
      shape_of(image, "[H][W][3] or [H][W][4], contiguous", channels == 3 || channels == 4);
  std::vector<std::uint8_t> out;
  {
    const ReleaseGil release;
    out.assign(image.data(), image.data() + image.size());
    if (model.kind != NoiseKind::none) {
      std::vector<float> colors(3 * (out.size() / channels));
      std::vector<std::uint8_t> bytes(colors.size());
      for (std::size_t i = 0; i < colors.size(); ++i)
        colors[i] = static_cast<float>(out[i / 3 * channels + i % 3]) / 255.0f;
      add_color_noise(model, seed, colors);
      to_bytes(colors, bytes);
      for (std::size_t i = 0; i < bytes.size(); ++i) out[i / 3 * channels + i % 3] = bytes[i];
    }
  }
  return array_from(std::move(out), shape);
}

nb::object noisy_depth(NoiseModel model, std::uint64_t seed, const Array<float>& image) {
  check(model, true).throw_if_error();
  const std::size_t sides = image.ndim();
  const auto shape = shape_of(image, "[H][W] or [H][W][1], contiguous and aligned",
                              (sides == 2 || (sides == 3 && image.shape(2) == 1)) &&
                                  image.shape(0) <= kMaxImageSide && image.shape(1) <= kMaxImageSide);
  std::vector<float> out;
  {
    const ReleaseGil release;
    out.assign(image.data(), image.data() + image.size());
    if (model.kind != NoiseKind::none) {
      const std::vector<float> given(out);  // Other threads may change the image.
      redwood_depth(model, seed, static_cast<int>(shape[0]), static_cast<int>(shape[1]), given, out);
    }
  }
  return array_from(std::move(out), shape);
}

}  // namespace

void bind_noise(nb::module_& m) {
  nb::enum_<NoiseKind>(m, "NoiseKind", "Kind of sensor noise.")
      .value("none", NoiseKind::none, "No noise.")
      .value("gaussian", NoiseKind::gaussian, "Gaussian noise on colour.")
      .value("redwood_depth", NoiseKind::redwood_depth, "Structured-light noise on depth.")
      .value("poisson", NoiseKind::poisson, "Shot noise on colour.")
      .value("speckle", NoiseKind::speckle, "Gaussian noise on colour, in proportion to the colour.")
      .value("salt_and_pepper", NoiseKind::salt_and_pepper, "White and black values in colour.");
  using N = NoiseModel;
  Struct<N>(m, "NoiseModel", "Noise of a sensor. Concepts, simulator has the formulas.")
      .field("kind", &N::kind, "Kind of noise.")
      .field("intensity", &N::intensity, "Factor of the noise, for gaussian and speckle.")
      .field("mean", &N::mean, "Mean before the factor, for gaussian and speckle.")
      .field("sigma", &N::sigma, "Standard deviation before the factor, for gaussian and speckle.")
      .field("multiplier", &N::multiplier, "Factor of both standard deviations, for redwood_depth.")
      .field("amount", &N::amount, "Draws as a fraction of the values, for salt_and_pepper.")
      .field("salt", &N::salt, "Fraction of the draws that are white, for salt_and_pepper.")
      .done();
  m.def("with_noise", noisy_colors, nb::arg("model"), nb::arg("seed"), nb::arg("image").noconvert(),
        nb::sig(
            "def with_noise(model: NoiseModel, seed: int, image: numpy.typing.NDArray[numpy.uint8]) -> "
            "numpy.typing.NDArray[numpy.uint8]"),
        "A copy of colours, uint8 [H][W][3] or [H][W][4], with noise. A fourth channel stays. Raises "
        "InvalidArgument naming the field, ValueError for another shape.");
  m.def(
      "with_noise", noisy_depth, nb::arg("model"), nb::arg("seed"), nb::arg("image").noconvert(),
      nb::sig("def with_noise(model: NoiseModel, seed: int, image: numpy.typing.NDArray[numpy.float32]) "
              "-> numpy.typing.NDArray[numpy.float32]"),
      "A copy of depths, float32 [H][W] or [H][W][1] in metres, with noise. Raises as above.");
}

}  // namespace gsnav::python
