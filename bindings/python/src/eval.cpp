// SPDX-License-Identifier: Apache-2.0
// Float64 reference images, and the errors of images and depths. The module gsnav.eval has them.
#include "gsnav/eval.hpp"

#include "arrays.hpp"
#include "bind.hpp"
#include "fields.hpp"
#include "gsnav/device/renderer.hpp"
#include "guard.hpp"

namespace gsnav::python {
namespace {

using Array = nb::ndarray<nb::ro, nb::c_contig, nb::device::cpu>;

/// An image of float32 or float64 with its name in messages.
struct Image {
  Array array;
  std::vector<std::size_t> shape;
  std::string name;

  eval::Samples samples() const {
    if (array.dtype() == nb::dtype<double>()) {
      return std::span(static_cast<const double*>(array.data()), array.size());
    }
    return std::span(static_cast<const float*>(array.data()), array.size());
  }
  std::span<const std::uint8_t> mask() const {
    return {static_cast<const std::uint8_t*>(array.data()), array.size()};
  }
};

/// The argument as an image whose dtype has one of the characters `kinds`. Other layouts are copied.
Image image_from(nb::handle source, std::string name, const char* kinds, const char* wanted) {
  const nb::object given = numpy_array(source);
  const std::string type = text_of(given.attr("dtype").attr("char"));
  if (std::string(kinds).find(type) == std::string::npos) {
    throw nb::type_error(
        (name + " has dtype " + text_of(given.attr("dtype")) + ": it must be " + wanted).c_str());
  }
  const nb::object native = given.attr("dtype").attr("newbyteorder")("=");
  const nb::object array = nb::module_::import_("numpy").attr("require")(given, native, "CA");
  Image out{nb::cast<Array>(array), {}, std::move(name)};
  for (std::size_t i = 0; i < out.array.ndim(); ++i) out.shape.push_back(out.array.shape(i));
  return out;
}
Image image_from(nb::handle source, std::string name) {
  return image_from(source, std::move(name), "fd", "float32 or float64");
}

std::string text_of_shape(const std::vector<std::size_t>& shape) {
  std::string text = "(";
  for (const std::size_t n : shape) text += (text.size() > 1 ? ", " : "") + std::to_string(n);
  return text + ")";
}

void check_shape(const Image& image, const std::vector<std::size_t>& shape) {
  if (image.shape == shape) return;
  throw Error(Errc::invalid_argument, image.name + " has shape " + text_of_shape(image.shape) +
                                          ": it must be " + text_of_shape(shape));
}

/// The mask of excluded pixels, or nothing.
std::optional<Image> mask_from(nb::handle source, const char* name,
                               const std::vector<std::size_t>& shape) {
  if (source.is_none()) return {};
  Image mask = image_from(source, name, "?B", "bool");
  check_shape(mask, shape);
  return mask;
}

eval::ImageError image_error(nb::handle reference, nb::handle test, nb::handle excluded) {
  const Image want = image_from(reference, "image_error: reference");
  const Image got = image_from(test, "image_error: test");
  if (want.shape.size() != 2 && want.shape.size() != 3) {
    throw Error(Errc::invalid_argument, want.name + " has shape " + text_of_shape(want.shape) +
                                            ": it must be [H][W] or [H][W][C]");
  }
  check_shape(got, want.shape);
  const auto mask = mask_from(excluded, "image_error: excluded", {want.shape[0], want.shape[1]});
  const std::size_t channels = want.shape.size() == 3 ? want.shape[2] : 1;
  const ReleaseGil release;
  return eval::image_error(want.samples(), got.samples(), channels,
                           mask ? mask->mask() : std::span<const std::uint8_t>())
      .value();
}

eval::DepthError depth_error(nb::handle reference, nb::handle test, nb::handle alpha,
                             nb::handle excluded, eval::DepthErrorOptions options) {
  const Image want = image_from(reference, "depth_error: reference");
  const Image got = image_from(test, "depth_error: test");
  const Image covered = image_from(alpha, "depth_error: reference_alpha");
  check_shape(got, want.shape);
  check_shape(covered, want.shape);
  const auto mask = mask_from(excluded, "depth_error: excluded", want.shape);
  const ReleaseGil release;
  return eval::depth_error(want.samples(), got.samples(), covered.samples(),
                           mask ? mask->mask() : std::span<const std::uint8_t>(), options)
      .value();
}

/// Images of the reference renderer as arrays.
struct PythonOracle {
  std::size_t height = 0, width = 0;
  nb::object rgb, alpha, median_depth, expected_depth, accumulated_depth, first_hit_depth;
  nb::object undecided, undecided_depth, order_flip;
  eval::OracleCounts counts;
};

PythonOracle oracle_arrays(eval::OracleFrames&& f) {
  const std::vector<std::size_t> shape{f.height, f.width};
  const auto image = [&](auto& values) { return array_from(std::move(values), shape); };
  const auto mask = [&](auto& values) { return image(values).attr("view")("?"); };
  PythonOracle out;
  out.height = f.height;
  out.width = f.width;
  out.rgb = array_from(std::move(f.rgb), {f.height, f.width, 3});
  out.alpha = image(f.alpha);
  out.median_depth = image(f.median_depth);
  out.expected_depth = image(f.expected_depth);
  out.accumulated_depth = image(f.accumulated_depth);
  out.first_hit_depth = image(f.first_hit_depth);
  out.undecided = mask(f.undecided);
  out.undecided_depth = mask(f.undecided_depth);
  out.order_flip = mask(f.order_flip);
  out.counts = f.counts;
  return out;
}

/// Static Gaussians of a scene. Throws gsnav::Error if it has anything else to draw.
std::vector<GaussianSet> sets_of(const SimulatorScene& scene) {
  const auto refuse = [](const std::string& part, const char* remedy) {
    throw Error(Errc::unsupported, "SimulatorScene." + part +
                                       ": the reference renderer draws Gaussians "
                                       "that stand still, as floats; " +
                                       remedy);
  };
  if (!scene.avatars.empty())
    refuse("avatars: " + std::to_string(scene.avatars.size()), "open the scene without people");
  if (!scene.meshes.empty())
    refuse("meshes: " + std::to_string(scene.meshes.size()), "open the scene without meshes");
  if (scene.assets.empty()) refuse("assets: none", "open a scene with Gaussians");
  std::vector<GaussianSet> sets;
  for (std::size_t i = 0; i < scene.assets.size(); ++i) {
    const SceneAsset& asset = scene.assets[i];
    if (asset.cloud == nullptr)
      refuse("assets[" + std::to_string(i) + "].cloud: none", "use CloudStorage.full or compact");
    sets.push_back(asset.cloud->set(asset.world_from_asset));
  }
  return sets;
}

PythonOracle draw_oracle(const DeviceArg& device, const SceneArg& scene, Camera camera, int k,
                         eval::OracleConfig config) {
  const Device chosen = device.value();
  check_fork(chosen, k == 0 ? "oracle_render" : "oracle_photo");
  const std::vector<GaussianSet> sets = sets_of(*scene.scene);
  config.rules.sort_order = scene.scene->assets[0].sort_order();
  std::optional<eval::OracleFrames> frames;
  {
    const ReleaseGil release;
    frames = k == 0 ? eval::oracle_render(chosen, sets, camera, config).value()
                    : eval::oracle_photo(chosen, sets, camera, k, config).value();
  }
  return oracle_arrays(std::move(*frames));
}

void bind_oracle_settings(nb::module_& m) {
  using eval::OracleKind, eval::OracleOrder;
  nb::enum_<OracleKind>(m, "OracleKind", "Definition of the reference image.")
      .value("contract", OracleKind::contract, "The image contract.")
      .value("untruncated", OracleKind::untruncated, "Without alpha_min and transmittance_min.")
      .value("ray", OracleKind::ray, "Maximum response along each pixel's ray.");
  nb::enum_<OracleOrder>(m, "OracleOrder", "Order in which the reference renderer blends.")
      .value("own", OracleOrder::own, "The order of the kind.")
      .value("float32_key", OracleOrder::float32_key, "The order of renderers: the float32 key.")
      .value("float64", OracleOrder::float64, "The key without rounding.")
      .value("per_ray", OracleOrder::per_ray, "Per pixel, by the depth along its ray.");
  using P = eval::PixelRect;
  Struct<P>(m, "PixelRect", "Rectangle of pixels [x0, x1) x [y0, y1).")
      .field("x0", &P::x0, "First column.")
      .field("y0", &P::y0, "First row.")
      .field("x1", &P::x1, "Column behind the last.")
      .field("y1", &P::y1, "Row behind the last.")
      .done();
  using C = eval::OracleConfig;
  Struct<C>(m, "OracleConfig", "Settings of the reference renderer.")
      .field("rules", &C::rules,
             "Settings of the image. `outputs`, `sort_order` and `quality.exponential` are ignored. "
             "`response` and `compat` must be those of the contract.")
      .field("kind", &C::kind, "Definition of the image.")
      .field("order", &C::order, "Order of blending.")
      .field("boxed", &C::boxed, "Evaluate each Gaussian only where it may count. False: everywhere.")
      .field("crop", &C::crop, "Part of the image to render. All 0: everything.")
      .done();
  using N = eval::OracleCounts;
  Struct<N>(m, "OracleCounts", "Work that a reference image took.")
      .field("gaussians", &N::gaussians, "Number of Gaussians.")
      .field("visible", &N::visible, "Number of Gaussians whose box intersects the image.")
      .field("listed", &N::listed, "Number of (pixel, Gaussian) pairs that were listed.")
      .field("evaluations", &N::evaluations, "Number of pairs blended, which no renderer can avoid.")
      .field("order_flips", &N::order_flips, "Number of pixels marked in `order_flip`.")
      .done();
}

void bind_oracle_frames(nb::module_& m) {
  using F = PythonOracle;
  nb::class_<F> c(m, "OracleFrames",
                  "Reference images of one camera or its crop, float64 [H][W] or [H][W][3]. Masks are "
                  "bool [H][W].");
  c.def_ro("height", &F::height, "Rows, H.").def_ro("width", &F::width, "Columns, W.");
  c.def_ro("counts", &F::counts, "Work that the images took.");
  const auto array = [&c](const char* name, nb::object F::*member, const char* type, const char* doc) {
    array_property(c, name, type, doc, [member](const F& f) { return f.*member; });
  };
  array("rgb", &F::rgb, "float64", "Colours over the background, not clamped, [H][W][3].");
  array("alpha", &F::alpha, "float64", "1 - transmittance.");
  array("median_depth", &F::median_depth, "float64",
        "Metres, where transmittance falls through 1/2; 0: no return.");
  array("expected_depth", &F::expected_depth, "float64", "Metres, sum(w z) / sum(w).");
  array("accumulated_depth", &F::accumulated_depth, "float64", "Metres, sum(w z).");
  array("first_hit_depth", &F::first_hit_depth, "float64",
        "Metres, where alpha first reaches first_hit_tau; 0: never.");
  array("undecided", &F::undecided, "bool_", "True if float32 may rightly give another colour.");
  array("undecided_depth", &F::undecided_depth, "bool_",
        "True if float32 may rightly give another depth.");
  array("order_flip", &F::order_flip, "bool_",
        "True if the float32 and the float64 key give different orders.");
}

void bind_errors_of_images(nb::module_& m) {
  using E = eval::ImageError;
  Struct<E>(m, "ImageError", "Errors between two images. Values are clamped to [0, 1].")
      .field("max", &E::max, "Largest |test - reference| over all channels.")
      .field("p999", &E::p999, "99.9th percentile of |test - reference|.")
      .field("rmse", &E::rmse, "Root mean square error.")
      .field("psnr", &E::psnr,
             "PSNR for peak 1, dB, with masked pixels. Infinity if the images are equal.")
      .field("over_half_lsb", &E::over_half_lsb, "Fraction of pixels with an error above 1/510.")
      .field("over_lsb", &E::over_lsb, "Fraction of pixels with an error above 1/255.")
      .field("over_2lsb", &E::over_2lsb, "Fraction of pixels with an error above 2/255.")
      .field("excluded", &E::excluded, "Fraction of pixels that the mask excludes.")
      .field("pixels", &E::pixels, "Number of pixels compared, without those excluded.")
      .done();
  using D = eval::DepthError;
  Struct<D>(m, "DepthError",
            "Errors of planar depth, over pixels where both images have a return. Lengths are metres.")
      .field("p50", &D::p50, "Median of |test - reference|.")
      .field("p99", &D::p99, "99th percentile of |test - reference|.")
      .field("max", &D::max, "Largest |test - reference|.")
      .field("abs_rel_p90", &D::abs_rel_p90, "90th percentile of |test - reference| / reference.")
      .field("missing", &D::missing, "Fraction of pixels where only one image has a return.")
      .field("excluded", &D::excluded, "Fraction of pixels that the mask excludes.")
      .field("pixels", &D::pixels, "Number of pixels compared.")
      .done();
  using O = eval::DepthErrorOptions;
  Struct<O>(m, "DepthErrorOptions", "Which pixels depth_error compares.")
      .field("min_alpha", &O::min_alpha, "The alpha of the reference must be above this.")
      .field("max_range", &O::max_range, "Largest depth of the reference, metres.")
      .done();
}

void bind_comparisons(nb::module_& m) {
  m.def("image_error", image_error, nb::arg("reference").none(), nb::arg("test").none(),
        nb::arg("excluded") = nb::none(),
        nb::sig("def image_error(reference: numpy.typing.ArrayLike, test: numpy.typing.ArrayLike, "
                "excluded: numpy.typing.NDArray[numpy.bool_] | None = None) -> ImageError"),
        "Compares two images of float32 or float64, [H][W] or [H][W][C].\n\n"
        "`excluded`, bool [H][W], marks pixels that count in `psnr` alone. Raises InvalidArgument if "
        "shapes differ or are empty.");
  m.def("depth_error", depth_error, nb::arg("reference").none(), nb::arg("test").none(),
        nb::arg("reference_alpha").none(), nb::arg("excluded") = nb::none(),
        nb::arg("options") = eval::DepthErrorOptions{},
        nb::sig("def depth_error(reference: numpy.typing.ArrayLike, test: numpy.typing.ArrayLike, "
                "reference_alpha: numpy.typing.ArrayLike, "
                "excluded: numpy.typing.NDArray[numpy.bool_] | None = None, "
                "options: DepthErrorOptions = ...) -> DepthError"),
        "Compares two depth images of float32 or float64 in metres, of any equal shape. 0, negative "
        "numbers and NaN mean no return. Raises InvalidArgument if shapes differ.");
}

}  // namespace

void bind_eval(nb::module_& m) {
  bind_oracle_settings(m);
  bind_oracle_frames(m);
  bind_errors_of_images(m);
  bind_comparisons(m);
  m.def(
      "oracle_render",
      [](const DeviceArg& device, const SceneArg& scene, const Camera& camera,
         const eval::OracleConfig& config) { return draw_oracle(device, scene, camera, 0, config); },
      nb::arg("device"), nb::arg("scene"), nb::arg("camera"), nb::arg("config") = eval::OracleConfig{},
      "Renders the float64 reference image of a scene's static Gaussians, straight from the definition. "
      "It is slow, and runs on the device's threads (for a GPU, on those of the CPU).\n\n"
      "Raises Unsupported for a scene with people, meshes or packed Gaussians, and InvalidArgument "
      "naming the field.");
  m.def(
      "oracle_photo",
      [](const DeviceArg& device, const SceneArg& scene, const Camera& camera, int k,
         const eval::OracleConfig& config) {
        if (k < 1)
          throw Error(Errc::invalid_argument,
                      "oracle_photo: k = " + std::to_string(k) + ": must be in [1, 16]");
        return draw_oracle(device, scene, camera, k, config);
      },
      nb::arg("device"), nb::arg("scene"), nb::arg("camera"), nb::arg("k"),
      nb::arg("config") = eval::OracleConfig{},
      "Renders the reference image with k times the resolution, 1 to 16, and averages it: the truth of "
      "anti-aliasing, for levels of detail. Raises what oracle_render raises.");
}

}  // namespace gsnav::python
