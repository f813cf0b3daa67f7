// SPDX-License-Identifier: Apache-2.0
#include "options.hpp"

#include <CLI/CLI.hpp>
#include <charconv>
#include <cmath>

#include "../common/check_values.hpp"
#include "../common/device_option.hpp"
#include "../common/parse_options.hpp"
#include "gsnav/core/text.hpp"

namespace gsnav_avatar {
namespace {

using gsnav_tools::check_output_name;
using gsnav_tools::ends_in;

const char kDescription[] =
    "Makes Gaussian avatars from rigged meshes, plans their walks and draws them.\nLengths are metres, "
    "Y points up.\nExit status: 0 success; 1 failure, with a message on one line; 2 invalid "
    "options.\nExample: gsnav-avatar from-gltf human.glb --clip Walk --out human.npz --driver walk.npz";

bool parse_point(const std::string& text, gsnav::Vec3d& out) {
  const char *at = text.data(), *end = text.data() + text.size();
  for (int k = 0; k < 3; ++k) {
    const auto r = std::from_chars(at, end, out[k]);
    if (r.ec != std::errc{} || !std::isfinite(out[k])) return false;
    at = r.ptr;
    if (k < 2 && (at == end || *at++ != ',')) return false;
  }
  return at == end;
}

/// Parses FILE or FILE=AMOUNT.
bool parse_target(const std::string& text, std::pair<std::string, double>& out) {
  const std::size_t equals = text.rfind('=');
  out = {text.substr(0, equals), 1.0};
  if (equals == text.npos) return true;
  const auto r = std::from_chars(text.data() + equals + 1, text.data() + text.size(), out.second);
  return r.ec == std::errc{} && r.ptr == text.data() + text.size() && std::isfinite(out.second);
}

void add_clip(CLI::App& app, ClipSource& c) {
  app.add_option(
      "--clip", c.clip,
      "motion: a .bvh, .amc, .glb, .gltf or driver (.npz) file, FILE:NAME for one clip of a glTF file, "
      "or the name of a clip of INPUT; without a skin, joints are found by the names of nodes");
  app.add_option("--asf", c.asf, "skeleton of an .amc file");
  app.add_option(
         "--clip-scale", c.scale,
         "metres per unit of the clip file; 0 takes the unit of the .asf file, --scale for glTF, else 1")
      ->check(CLI::NonNegativeNumber);
  app.add_flag("--clip-z-up", c.z_up, "Z points up in the .bvh or .amc file");
}

void add_mesh(CLI::App& app, MeshCommand& m, bool makehuman) {
  app.add_option("input", m.input,
                 makehuman ? "MakeHuman base mesh (.obj)" : "rigged glTF 2.0 file (.glb, .gltf)")
      ->required();
  check_output_name(
      app.add_option("--out", m.out, "avatar file to write (.npz with the keys of Habitat-GS)")
          ->required(),
      ends_in({".npz"}));
  if (makehuman) m.scale = 0.1;
  app.add_option("--scale", m.scale, "metres per unit of INPUT; 0.01 for a rig in centimetres")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  if (!makehuman) {
    app.add_option("--skin", m.skins,
                   "name or index of a skin to read; may be repeated for skins of one rig; default: all "
                   "skins, which must share a rig");
  }
  check_output_name(
      app.add_option("--driver", m.driver,
                     "driver file to write (.npz): the clip at 40 frames per second, with its capsules"),
      ends_in({".npz"}));
  app.add_option("--gaussians", m.gaussians, "approximate number of Gaussians")->capture_default_str();
  app.add_option("--seed", m.seed, "seed of the positions of the Gaussians")->capture_default_str();
  app.add_option("--influences", m.influences,
                 "number of skinning weights per Gaussian: 4 or 8; 0 takes 4 if that moves no Gaussian "
                 "by more than 0.2 mm, else 8")
      ->check(CLI::IsMember({0, 4, 8}))
      ->capture_default_str();
  app.add_option("--percentile", m.percentile,
                 "share of the Gaussians of a body part that its capsule must hold")
      ->capture_default_str();
  app.add_option("--shade", m.shade, "share of light that downward surfaces lose, 0 to 1")
      ->capture_default_str();
  app.add_option("--skinning", m.skinning,
                 "linear, stretched (shapes follow the skin) or dual-quaternion")
      ->check(CLI::IsMember({"linear", "stretched", "dual-quaternion"}))
      ->capture_default_str();
  add_clip(app, m.clip);
}

CLI::App* add_walk(CLI::App& app, WalkCommand& walk, std::string& from, std::string& to,
                   std::vector<std::string>& via) {
  CLI::App* walks =
      app.add_subcommand("walk", "plan a path on a NavMesh and write a driver that walks along it");
  walks->add_option("--avatar", walk.avatar, "avatar file (.npz)")->required();
  CLI::Option* mesh = walks->add_option("--navmesh", walk.navmesh, "NavMesh (.navmesh, .bin)");
  walks
      ->add_flag("--flat", walk.flat,
                 "walk in the embedded flat, with a NavMesh for an agent of 0.25 m radius")
      ->excludes(mesh);
  walks->add_option("--from", from, "start: X,Y,Z")->required();
  walks->add_option("--to", to, "end: X,Y,Z")->required();
  walks->add_option("--via", via, "point on the way: X,Y,Z; may be repeated, in order");
  check_output_name(walks->add_option("--out", walk.out, "driver file to write (.npz)")->required(),
                    ends_in({".npz"}));
  walks
      ->add_option("--speed", walk.speed,
                   "walking speed, metres per second; 0 takes the speed of the clip")
      ->check(CLI::NonNegativeNumber);
  walks
      ->add_option("--clearance", walk.clearance,
                   "distance to keep from the edges of the NavMesh where there is room, metres; 0 takes "
                   "the shortest path")
      ->check(CLI::Range(0.0, 10.0))
      ->capture_default_str();
  walks->add_option("--fps", walk.frame_rate, "frames per second of the driver")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  walks->add_option("--first-key", walk.first_key, "key at which the cycle of two steps begins");
  walks->add_option("--keys", walk.keys, "number of keys of the cycle; 0 finds it");
  walks->add_flag("--lock-feet,!--no-lock-feet", walk.lock_feet,
                  "hold feet in place while they are on the ground (default)");
  add_clip(*walks, walk.clip);
  walks->get_option("--clip")->required();
  return walks;
}

CLI::App* add_strip(CLI::App& app, StripCommand& strip, std::string& eye, std::string& target) {
  CLI::App* strips = app.add_subcommand("strip", "draw images of a walk from one camera, side by side");
  strips->add_option("--avatar", strip.avatar, "avatar file (.npz)")->required();
  strips->add_option("--driver", strip.driver, "driver file (.npz)")->required();
  CLI::Option* scene = strips->add_option(
      "--scene", strip.scene,
      "scene of Gaussians to draw around the person: .ply, .sog, a SOG folder, DIR/2_0,2_1");
  strips->add_flag("--flat", strip.flat, "draw the embedded flat around the person")->excludes(scene);
  strips->add_flag("--z-up", strip.z_up, "Z points up in the scene");
  strips->add_option("--eye", eye, "position of the camera: X,Y,Z")->required();
  strips->add_option("--target", target, "point that the camera looks at: X,Y,Z")->required();
  strips->add_option("--frames", strip.frames, "number of images")
      ->check(CLI::Range(1, 64))
      ->capture_default_str();
  strips->add_option("--width", strip.width, "width of one image, pixels")
      ->check(CLI::Range(16, 1024))
      ->capture_default_str();
  strips->add_option("--height", strip.height, "height of one image, pixels")
      ->check(CLI::Range(16, 4096))
      ->capture_default_str();
  strips->add_option("--fov", strip.fov, "horizontal field of view, degrees")
      ->check(CLI::Range(5.0, 150.0))
      ->capture_default_str();
  strips->add_option("--begin", strip.begin, "time of the first image, seconds into the driver")
      ->check(CLI::NonNegativeNumber);
  strips
      ->add_option("--end", strip.end, "time of the last image, seconds; 0 takes the end of the driver")
      ->check(CLI::NonNegativeNumber);
  check_output_name(strips->add_option("--out", strip.out, "image file to write (.png)")->required(),
                    ends_in({".png"}));
  return strips;
}

}  // namespace

std::optional<Options> parse_options(int argc, char** argv, int& exit_code) {
  Options out;
  MeshCommand gltf, human;
  WalkCommand walk;
  StripCommand strip;
  std::vector<std::string> targets, via;
  std::string from, to, eye, target;
  CLI::App app{kDescription};
  app.require_subcommand(1);
  CLI::App* from_gltf = app.add_subcommand("from-gltf", "make an avatar from a rigged glTF file");
  add_mesh(*from_gltf, gltf, false);
  CLI::App* from_makehuman =
      app.add_subcommand("from-makehuman", "make an avatar from the base mesh and a rig of MakeHuman");
  add_mesh(*from_makehuman, human, true);
  from_makehuman->add_option("--skeleton", human.skeleton, "rig (.mhskel)")->required();
  from_makehuman->add_option("--weights", human.weights,
                             "weights (.mhw); default: the file that the rig names");
  from_makehuman->add_option("--target", targets,
                             "shape (.target), FILE or FILE=AMOUNT; may be repeated");
  CLI::App* walks = add_walk(app, walk, from, to, via);
  CLI::App* strips = add_strip(app, strip, eye, target);
  if (const auto status =
          gsnav_tools::parse_options(app, argc, argv, gsnav_tools::check_instruction_set)) {
    exit_code = *status;
    return std::nullopt;
  }
  const auto bad = [&](const std::string& text, const char* what) {
    std::fprintf(stderr, "gsnav-avatar: '%s' is not a %s\n", gsnav::printable(text).c_str(), what);
    exit_code = gsnav_tools::kUsage;
    return std::nullopt;
  };
  for (const std::string& t : targets) {
    if (!parse_target(t, human.targets.emplace_back())) return bad(t, "target (FILE or FILE=AMOUNT)");
  }
  for (const std::string& t : via) {
    if (!parse_point(t, walk.via.emplace_back())) return bad(t, "point X,Y,Z");
  }
  if (walks->parsed()) {
    if (!walk.flat && walk.navmesh.empty()) {
      std::fprintf(stderr, "gsnav-avatar: walk needs --navmesh or --flat\n");
      exit_code = gsnav_tools::kUsage;
      return std::nullopt;
    }
    if (!parse_point(from, walk.from)) return bad(from, "point X,Y,Z");
    if (!parse_point(to, walk.to)) return bad(to, "point X,Y,Z");
    out.walk = walk;
  } else if (strips->parsed()) {
    if (strip.end > 0 && strip.begin > strip.end) {
      std::fprintf(stderr, "gsnav-avatar: --begin %g is after --end %g\n", strip.begin, strip.end);
      exit_code = gsnav_tools::kUsage;
      return std::nullopt;
    }
    if (!parse_point(eye, strip.eye)) return bad(eye, "point X,Y,Z");
    if (!parse_point(target, strip.target)) return bad(target, "point X,Y,Z");
    out.strip = strip;
  } else {
    out.makehuman = from_makehuman->parsed();
    out.mesh = out.makehuman ? human : gltf;
  }
  return out;
}

}  // namespace gsnav_avatar
