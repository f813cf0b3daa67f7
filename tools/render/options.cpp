// SPDX-License-Identifier: Apache-2.0
#include "options.hpp"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>

#include "../common/device_option.hpp"
#include "../common/parse_options.hpp"
#include "gsnav/core/printable.hpp"

namespace gsnav_render {
namespace {

std::optional<DepthChoice> parse_depth(const std::string& text) {
  if (text == "median") return DepthChoice{kMedianDepth, 0.5};
  if (text == "expected") return DepthChoice{kExpectedDepth, 0.5};
  if (text == "accumulated") return DepthChoice{kAccumulatedDepth, 0.5};
  if (text == "first") return DepthChoice{kFirstHitDepth, 0.5};
  if (text.rfind("first:", 0) == 0) {
    try {
      std::size_t used = 0;
      const double tau = std::stod(text.substr(6), &used);
      if (used == text.size() - 6 && tau > 0 && tau < 1) return DepthChoice{kFirstHitDepth, tau};
    } catch (const std::exception&) {
    }
  }
  return std::nullopt;
}

void add_scene_options(CLI::App& app, Options& o) {
  app.add_option("--scene", o.scene,
                 "Any scene of Gaussians that can be read, or a folder's sibling tiles: DIR/2_0,2_1,2_2")
      ->required();
  app.add_option("--time", o.time, "Moment of a scene that moves (4D Gaussians), seconds");
  app.add_option("--storage", o.storage,
                 "full; compact: SH in half of the memory; packed: all in a third (docs/formats.md)")
      ->check(CLI::IsMember({"full", "compact", "packed"}))
      ->capture_default_str();
  app.add_option("--cameras", o.cameras,
                 "INRIA cameras.json (camera-to-world, OpenCV axes); without it --orbit views around "
                 "the scene, upright by "
                 "the guess of which way is up");
  app.add_option("--orbit", o.orbit, "Number of views around the scene where no --cameras are given")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  app.add_option("--out", o.out, "Folder for the images; made where it does not exist")->required();
  app.add_option("--width", o.width, "Image width; with --height, focal lengths scale by it")
      ->check(CLI::Range(1, kMaxImageSide));
  app.add_option("--height", o.height, "Image height")->check(CLI::Range(1, kMaxImageSide));
  app.add_option("--near", o.near_plane,
                 "Gaussians whose centre is not beyond this are not drawn, metres")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
}

void add_drawing_options(CLI::App& app, Options& o) {
  gsnav_tools::add_device_option(app, o.device, &o.float64);
  app.add_option("--profile", o.profile,
                 "exact, fast (docs/accuracy.md), or lod: a level of detail for each part of the scene "
                 "(docs/lod.md)")
      ->check(CLI::IsMember({"exact", "fast", "lod"}))
      ->capture_default_str();
  app.add_option("--lod-error", o.lod_pixels,
                 "Of the profile lod: how far merged Gaussians may be off, pixels")
      ->check(CLI::Range(0.01, 100.0))
      ->capture_default_str();
  app.add_option("--lod-levels", o.lod_levels,
                 "Of the profile lod: shipped, those that a streamed set has, where it has any; built: "
                 "the tree of its finest")
      ->check(CLI::IsMember({"shipped", "built"}))
      ->capture_default_str();
  app.add_option("--visible-sets", o.visible_sets,
                 "Of the profiles fast and lod: file of what is seen from where (gsnav-navmesh writes "
                 "it); the rest is "
                 "not drawn")
      ->check(CLI::ExistingFile);
  app.add_flag("--ledger", o.ledger,
               "Print what each frame skipped, merged, limited and rounded, and by how much");
  app.add_option("--depth", o.depth, "median, expected, accumulated, first or first:TAU")
      ->capture_default_str();
  app.add_option("--max-alpha", o.max_alpha, "Largest alpha of one Gaussian at a pixel")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  app.add_option("--mesh", o.meshes,
                 "Triangle meshes among the Gaussians (.gltf and .glb with colours and textures; .obj "
                 "and .ply grey), in the "
                 "scene's frame, lit from the camera (docs/composition.md)");
  app.add_option("--composite", o.composite, "merged, or hard_depth: Habitat-GS's rule, to compare with")
      ->check(CLI::IsMember({"merged", "hard_depth"}))
      ->capture_default_str();
  app.add_option("--depth-near", o.depth_near, "Depth picture: nearest metre of the colour scale");
  app.add_option("--depth-far", o.depth_far,
                 "Depth picture: farthest; 0: the image's own range (2nd to 98th percentile)");
  app.add_flag("--npy", o.npy, "Write NPY arrays");
  app.add_flag("--png", o.png, "Write PNG pictures (both are written where neither flag is given)");
}

/// Why the options do not go together, or nothing.
std::string refused(const Options& o) {
  if (!parse_depth(o.depth)) {
    return "--depth " + o.depth + ": use median, expected, accumulated, first or first:TAU, 0 < TAU < 1";
  }
  if ((o.width > 0) != (o.height > 0)) return "--width and --height go together";
  return "";
}

}  // namespace

int fail(const std::string& message) {
  std::fprintf(stderr, "gsnav-render: %s\n", printable(message).c_str());
  return 1;
}

std::optional<int> parse_options(int argc, char** argv, Options& o) {
  CLI::App app{
      "Renders a scene of 3D Gaussians from the cameras of an INRIA cameras.json or from around it. "
      "Writes NNNN.rgb.npy "
      "(H, W, 3 float32, unclamped), NNNN.depth.npy and NNNN.alpha.npy (H, W float32; metres, 0 = no "
      "return) and PNG pictures. The scene is used in its own frame: no up axis is applied."};
  add_scene_options(app, o);
  add_drawing_options(app, o);
  if (const auto status = gsnav_tools::parse_options(app, argc, argv)) return *status;
  if (!o.npy && !o.png) o.npy = o.png = true;
  if (const std::string why = refused(o); !why.empty()) return fail(why);
  o.depth_choice = *parse_depth(o.depth);
  return std::nullopt;
}

}  // namespace gsnav_render
