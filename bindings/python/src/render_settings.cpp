// SPDX-License-Identifier: Apache-2.0
#include "bind.hpp"
#include "fields.hpp"
#include "gsnav/device/renderer.hpp"

namespace gsnav::python {
namespace {

void bind_enums(nb::module_& m) {
  nb::enum_<Output>(m, "Output", nb::is_flag(), nb::is_arithmetic(),
                    "Images that a render can produce. Combine them with |.")
      .value("kRgb", kRgb, "[H][W][3], not clamped, over the background.")
      .value("kAlpha", kAlpha, "[H][W], 1 - transmittance.")
      .value("kMedianDepth", kMedianDepth, "[H][W] metres, where transmittance falls through 1/2.")
      .value("kExpectedDepth", kExpectedDepth, "[H][W] metres, sum(w z) / sum(w).")
      .value("kAccumulatedDepth", kAccumulatedDepth, "[H][W] metres, sum(w z).")
      .value("kFirstHitDepth", kFirstHitDepth,
             "[H][W] metres, where alpha first reaches first_hit_tau.");
  nb::enum_<SortOrder>(m, "SortOrder", "Key by which Gaussians are sorted.")
      .value("z_depth", SortOrder::z_depth, "Depth of the centre along the view axis.")
      .value("camera_distance", SortOrder::camera_distance, "Distance of the centre from the camera.");
  nb::enum_<Response>(m, "Response", "Response of a 3D Gaussian along a pixel's ray.")
      .value("ewa", Response::ewa, "Linearised on the image plane at the mean; the contract.")
      .value("tangent_plane", Response::tangent_plane, "Linearised on the tangent plane.")
      .value("ray", Response::ray, "Exact: the maximum along the ray.");
  nb::enum_<ColorSpace>(m, "ColorSpace", "Colour space of blending and images.")
      .value("display", ColorSpace::display, "sRGB-encoded.")
      .value("linear", ColorSpace::linear, "Proportional to light, Rec. 709 primaries.");
  nb::enum_<Composite>(m, "Composite", "Rule by which Gaussians and meshes become one image.")
      .value("merged", Composite::merged,
             "Each Gaussian is compared with the mesh's depth at each pixel.")
      .value("hard_depth", Composite::hard_depth, "The rule of Habitat-GS.");
  nb::enum_<Compat>(m, "Compat", "Renderer whose rules a frame follows; for parity tests.")
      .value("none", Compat::none, "gsnav's own rules: the image contract.")
      .value("inria", Compat::inria, "The rules of INRIA's renderer.")
      .value("gsplat", Compat::gsplat, "The rules of gsplat.")
      .value("habitat_gs", Compat::habitat_gs, "The rules of Habitat-GS.");
  nb::enum_<Exponential>(m, "Exponential", "Method of computing the alpha of a Gaussian at a pixel.")
      .value("exact", Exponential::exact, "Only rounding errors.")
      .value("fast", Exponential::fast, "A cubic: alpha within 1.0e-4 relative.");
}

}  // namespace

void bind_render_settings(nb::module_& m) {
  bind_enums(m);
  using Q = Quality;
  Struct<Q>(m, "Quality", "Settings that trade accuracy for speed. The default is the image contract.")
      .field("exponential", &Q::exponential, "Method of the exponential.")
      .field("alpha_min", &Q::alpha_min,
             "Skip a Gaussian at a pixel where its alpha is lower. In (0, 1).")
      .field("max_alpha", &Q::max_alpha, "Upper limit of a Gaussian's alpha, in (0, 1].")
      .field("transmittance_min", &Q::transmittance_min,
             "Stop blending a pixel once its transmittance is lower. In [0, 1).")
      .field("normalize_closed", &Q::normalize_closed, "Treat a closed pixel as opaque.")
      .field("max_sh_degree", &Q::max_sh_degree, "Highest SH degree to evaluate, 0 to 3.")
      .field("key_bits", &Q::key_bits, "Bits of the depth key that sorting compares, 8 to 32.")
      .done()
      .def_static("exact", &Q::exact, "The contract: float32 rounding is the only error.")
      .def_static("fast", &Q::fast, "Faster, within the error budget of the image contract.");
  using R = RenderConfig;
  Struct<R>(m, "RenderConfig", "Settings of one frame: images to make and image quality.")
      .field("outputs", &R::outputs, "Images to make, a bitmask of Output.")
      .field("sort_order", &R::sort_order, "Key by which Gaussians are sorted.")
      .field("response", &R::response, "How a Gaussian spreads over the image.")
      .field("first_hit_tau", &R::first_hit_tau, "Alpha at which first-hit depth is taken, in (0, 1).")
      .field("blend_space", &R::blend_space, "Colour space of blending, images and background.")
      .field("background", &R::background, "Colour behind everything, shape [3].")
      .field("composite", &R::composite, "Rule that combines Gaussians and meshes.")
      .field("quality", &R::quality, "Error budget.")
      .field("compat", &R::compat, "Another renderer's rules, for parity tests.")
      .done();
  using L = LodChoice;
  Struct<L>(m, "LodChoice", "How large an error may be before a finer level is drawn.")
      .field("pixels", &L::pixels, "Largest error of a node, in pixels.")
      .field("grain", &L::grain,
             "Largest product of a node's error and its grain, as a multiple of `pixels`.")
      .field("hysteresis", &L::hysteresis,
             "Hysteresis against flicker, in [0, 1). Simulators ignore it.")
      .field("photo", &L::photo, "Samples per pixel side of the reference image, 1 to 16.")
      .field("bodies_only", &L::bodies_only,
             "Draw levels of bodies, but assets whole. Assets then need no levels.")
      .done();
  using D = DetailChoice;
  Struct<D>(m, "DetailChoice", "Which part of a scene's assets is drawn.")
      .field("lod", &D::lod, "Level of detail. None: the assets as they are.")
      .field("visible_sets", &D::visible_sets,
             "Draw only Gaussians that are visible from the camera's cell.")
      .done();
  using O = RenderOptions;
  Struct<O>(m, "RenderOptions", "Settings of a Renderer.")
      .field("render", &O::render, "Settings of each frame. Its sort order is ignored.")
      .field("detail", &O::detail, "Levels of detail and visible sets to use.")
      .done();
}

}  // namespace gsnav::python
