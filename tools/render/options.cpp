// SPDX-License-Identifier: Apache-2.0
#include "options.hpp"

#include <CLI/CLI.hpp>
#include <charconv>
#include <cstdio>
#include <system_error>

#include "../common/check_values.hpp"
#include "../common/parse_options.hpp"

namespace gsnav_render {
namespace {

std::optional<DepthChoice> parse_depth(const std::string& text) {
  if (text == "median") return DepthChoice{kMedianDepth, 0.5};
  if (text == "expected") return DepthChoice{kExpectedDepth, 0.5};
  if (text == "accumulated") return DepthChoice{kAccumulatedDepth, 0.5};
  if (text == "first") return DepthChoice{kFirstHitDepth, 0.5};
  if (text.rfind("first:", 0) == 0) {
    double tau = 0;
    const char* const end = text.data() + text.size();
    const auto [read, error] = std::from_chars(text.data() + 6, end, tau);
    if (error == std::errc() && read == end && tau > 0 && tau < 1)
      return DepthChoice{kFirstHitDepth, tau};
  }
  return std::nullopt;
}

void add_cameras(CLI::App& app, Options& o) {
  const char* group = "Cameras";
  auto* cameras =
      app.add_option("--cameras", o.cameras,
                     "INRIA cameras.json (camera-to-world, OpenCV axes), in the axes of the scene file")
          ->type_name("FILE")
          ->group(group);
  auto* eye = app.add_option("--eye", o.eye,
                             "position of a single camera: X Y Z metres, world frame (the axes of the "
                             "file with --up keep)")
                  ->expected(3)
                  ->excludes(cameras)
                  ->group(group);
  app.add_option("--target", o.target, "point that the camera of --eye looks at: X Y Z metres")
      ->expected(3)
      ->needs(eye)
      ->group(group);
  app.add_option("--hfov", o.hfov, "horizontal field of view without --cameras, degrees")
      ->check(CLI::Range(1.0, 170.0))
      ->capture_default_str()
      ->group(group);
  app.add_option(
         "--orbit", o.orbit,
         "number of views around the scene, without --cameras and --eye; default: 4, and views of "
         "the rooms for the embedded flat")
      ->check(CLI::Range(1, 1000))
      ->excludes(cameras)
      ->excludes(eye)
      ->group(group);
  app.add_option("--width", o.width,
                 "image width, pixels; default: that of the cameras, else 640; with --height it scales "
                 "the focal lengths of --cameras")
      ->check(CLI::Range(1, kMaxImageSide))
      ->group(group);
  app.add_option("--height", o.height, "image height, pixels; default: that of the cameras, else 480")
      ->check(CLI::Range(1, kMaxImageSide))
      ->group(group);
  app.add_option("--near", o.near_plane, "skip Gaussians whose centre is nearer than this, metres")
      ->check(CLI::PositiveNumber)
      ->capture_default_str()
      ->group(group);
}

void add_images(CLI::App& app, Options& o) {
  app.add_option("--out", o.out, "folder for the images; made if it does not exist")->required();
  app.add_flag("--npy", o.npy, "write NPY arrays only (default: NPY and PNG)");
  app.add_flag("--png", o.png, "write PNG images only (default: NPY and PNG)");
  app.add_option("--depth", o.depth,
                 "kind of depth: median, expected, accumulated, first, or first:TAU with 0 < TAU < 1")
      ->capture_default_str();
  auto* near =
      app.add_option("--depth-near", o.depth_near, "depth PNG: distance of the brightest colour, metres")
          ->check(CLI::NonNegativeNumber);
  auto* far = app.add_option("--depth-far", o.depth_far,
                             "depth PNG: distance of the darkest colour, metres; 0 uses the range of "
                             "each image (2nd to 98th percentile)")
                  ->check(CLI::NonNegativeNumber);
  near->needs(far);
  app.add_option("--max-alpha", o.max_alpha, "largest alpha of one Gaussian at a pixel")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  app.add_option("--composite", o.composite,
                 "how meshes and Gaussians are combined: merged (by depth at each pixel), or hard_depth "
                 "(the rule of Habitat-GS, for comparison)")
      ->check(CLI::IsMember({"merged", "hard_depth"}))
      ->capture_default_str();
  app.add_flag("--ledger", o.ledger, "print what each frame skipped, merged, limited and rounded");
}

/// Reason why the options cannot be combined, or an empty text.
std::string refused(const Options& o) {
  if (!parse_depth(o.depth)) {
    return "--depth " + o.depth + ": use median, expected, accumulated, first or first:TAU, 0 < TAU < 1";
  }
  if ((o.width > 0) != (o.height > 0)) return "--width and --height go together";
  if (o.eye.empty() != o.target.empty()) return "--eye and --target go together";
  if (o.depth_far != 0 && !(o.depth_near < o.depth_far)) return "--depth-near must be below --depth-far";
  return "";
}

}  // namespace

int fail(const std::string& message) { return gsnav_tools::fail("gsnav-render", message); }

std::optional<int> parse_options(int argc, char** argv, Options& o) {
  CLI::App app{
      "Renders RGB, depth and alpha images of a scene of 3D Gaussians.\nChoose cameras by --cameras, by "
      "--eye and --target, or by --orbit (views around the scene).\nWrites NNNN.rgb.npy ([H][W][3] "
      "float32, unclamped), NNNN.depth.npy and NNNN.alpha.npy\n([H][W] float32; metres, 0 = no return), "
      "and RGB and depth as PNG.\nExample: gsnav-render --scene apartment.ply --cameras cameras.json "
      "--out views"};
  o.navmesh = "none";
  o.avatars = 0;
  add_images(app, o);
  add_cameras(app, o);
  gsnav_tools::add_scene_options(app, o, &o.float64);
  const auto check = [&o, &app] {
    if (o.avatars > 0 && o.navmesh == "none") o.navmesh = "auto";
    if (o.navmesh == "none" && app.get_option("--cell-size")->count() > 0)
      throw CLI::ValidationError("--cell-size", "there is no NavMesh; give --navmesh or --avatars too");
    if (const std::string why = refused(o); !why.empty()) throw CLI::ValidationError(why);
    gsnav_tools::check_eye_and_target(o.eye, o.target);
  };
  if (const auto status = gsnav_tools::parse_options(app, argc, argv, check)) return *status;
  if (!o.npy && !o.png) o.npy = o.png = true;
  o.depth_choice = *parse_depth(o.depth);
  return std::nullopt;
}

}  // namespace gsnav_render
