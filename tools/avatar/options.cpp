// SPDX-License-Identifier: Apache-2.0
#include "options.hpp"

#include <CLI/CLI.hpp>
#include <charconv>
#include <cmath>

#include "../common/parse_options.hpp"
#include "gsnav/core/printable.hpp"

namespace gsnav_avatar {
namespace {

const char kDescription[] =
    "Makes Gaussian avatars from rigged meshes, lets them walk and draws them. Lengths in metres, Y up. "
    "Exit status: 0, or 1 with "
    "one "
    "line that says what is wrong.";

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

/// FILE or FILE=AMOUNT.
bool parse_target(const std::string& text, std::pair<std::string, double>& out) {
  const std::size_t equals = text.rfind('=');
  out = {text.substr(0, equals), 1.0};
  if (equals == text.npos) return true;
  const auto r = std::from_chars(text.data() + equals + 1, text.data() + text.size(), out.second);
  return r.ec == std::errc{} && r.ptr == text.data() + text.size();
}

void add_clip(CLI::App& app, ClipSource& c) {
  app.add_option(
      "--clip", c.clip,
      "Motion: a .bvh, .amc, .glb or .gltf file (FILE:NAME for one of its clips; joints are found by "
      "the names of "
      "nodes where it has no skin) or a driver's .npz; or the name of a clip of INPUT itself");
  app.add_option("--asf", c.asf, "Skeleton of an .amc");
  app.add_option("--clip-scale", c.scale,
                 "Metres a unit of the clip's file; 0: what the .asf says, for glTF --scale, else 1")
      ->check(CLI::NonNegativeNumber);
  app.add_flag("--clip-z-up", c.z_up, "The .bvh's or .amc's Z points up");
}

void add_mesh(CLI::App& app, MeshCommand& m, bool makehuman) {
  app.add_option("input", m.input,
                 makehuman ? "MakeHuman base mesh (.obj)" : "Rigged glTF 2.0 (.glb, .gltf)")
      ->required();
  app.add_option("--out", m.out, "Avatar to write (.npz, Habitat-GS's keys)")->required();
  if (makehuman) m.scale = 0.1;
  app.add_option("--scale", m.scale, "Metres a unit of INPUT: 0.01 for a rig in centimetres")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  if (!makehuman) {
    app.add_option("--skin", m.skins,
                   "Name or index of a skin to read, any number on one rig; by default all (an error "
                   "where they have "
                   "several rigs)");
  }
  app.add_option("--driver", m.driver,
                 "Driver to write (.npz): the clip at 40 frames a second with its capsules");
  app.add_option("--gaussians", m.gaussians, "About so many")->capture_default_str();
  app.add_option("--seed", m.seed, "Of the places")->capture_default_str();
  app.add_option("--influences", m.influences,
                 "Weights kept a Gaussian: 4, 8 or 0: by their error, 0.2 mm")
      ->check(CLI::IsMember({0, 4, 8}))
      ->capture_default_str();
  app.add_option("--percentile", m.percentile, "Share of a part's Gaussians that its capsule holds")
      ->capture_default_str();
  app.add_option("--shade", m.shade, "Share of the light that surfaces lose which look down, 0 to 1")
      ->capture_default_str();
  app.add_option("--skinning", m.skinning,
                 "linear, stretched (shapes follow the skin) or dual-quaternion")
      ->check(CLI::IsMember({"linear", "stretched", "dual-quaternion"}))
      ->capture_default_str();
  add_clip(app, m.clip);
}

CLI::App* add_walk(CLI::App& app, WalkCommand& walk, std::string& from, std::string& to,
                   std::vector<std::string>& via) {
  CLI::App* walks = app.add_subcommand("walk", "A driver that walks a path on a NavMesh");
  walks->add_option("--avatar", walk.avatar, "Avatar (.npz)")->required();
  CLI::Option* mesh = walks->add_option("--navmesh", walk.navmesh, "NavMesh (.navmesh, .bin)");
  walks->add_flag("--flat", walk.flat, "The generated flat, for an agent of 0.25 m radius")
      ->excludes(mesh);
  walks->add_option("--from", from, "Start: X,Y,Z")->required();
  walks->add_option("--to", to, "End: X,Y,Z")->required();
  walks->add_option("--via", via, "On the way, in order: X,Y,Z; any number");
  walks->add_option("--out", walk.out, "Driver to write (.npz)")->required();
  walks->add_option("--speed", walk.speed, "Metres a second; 0: the clip's own")
      ->check(CLI::NonNegativeNumber);
  walks
      ->add_option("--clearance", walk.clearance,
                   "Metres to keep from the NavMesh's edges where there is room; 0: the shortest path")
      ->check(CLI::Range(0.0, 10.0))
      ->capture_default_str();
  walks->add_option("--fps", walk.frame_rate, "Frames a second")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  walks->add_option("--first-key", walk.first_key, "Where the clip's cycle of two steps begins");
  walks->add_option("--keys", walk.keys, "How many keys the cycle has; 0: found");
  walks->add_flag("--lock-feet,!--no-lock-feet", walk.lock_feet,
                  "Hold feet where they come down (default)");
  add_clip(*walks, walk.clip);
  walks->get_option("--clip")->required();
  return walks;
}

CLI::App* add_strip(CLI::App& app, StripCommand& strip, std::string& eye, std::string& target) {
  CLI::App* strips = app.add_subcommand("strip", "Pictures of a walk from one camera, side by side");
  strips->add_option("--avatar", strip.avatar, "Avatar (.npz)")->required();
  strips->add_option("--driver", strip.driver, "Driver (.npz)")->required();
  CLI::Option* scene = strips->add_option("--scene", strip.scene,
                                          "Gaussians around it: .ply, .sog, a SOG folder, DIR/2_0,2_1");
  strips->add_flag("--flat", strip.flat, "The generated flat around it")->excludes(scene);
  strips->add_flag("--z-up", strip.z_up, "The scene's Z points up");
  strips->add_option("--eye", eye, "Camera: X,Y,Z")->required();
  strips->add_option("--target", target, "What it looks at: X,Y,Z")->required();
  strips->add_option("--frames", strip.frames, "Pictures")
      ->check(CLI::Range(1, 64))
      ->capture_default_str();
  strips->add_option("--width", strip.width, "Of a picture")
      ->check(CLI::Range(16, 1024))
      ->capture_default_str();
  strips->add_option("--height", strip.height, "Of a picture")
      ->check(CLI::Range(16, 4096))
      ->capture_default_str();
  strips->add_option("--fov", strip.fov, "Degrees across a picture")
      ->check(CLI::Range(5.0, 150.0))
      ->capture_default_str();
  strips->add_option("--begin", strip.begin, "Seconds into the driver")->check(CLI::NonNegativeNumber);
  strips->add_option("--end", strip.end, "Seconds; 0: the driver's end")->check(CLI::NonNegativeNumber);
  strips->add_option("--out", strip.out, "Picture to write (.png)")->required();
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
  CLI::App* from_gltf = app.add_subcommand("from-gltf", "An avatar from a rigged glTF file");
  add_mesh(*from_gltf, gltf, false);
  CLI::App* from_makehuman =
      app.add_subcommand("from-makehuman", "An avatar from MakeHuman's base mesh and rig");
  add_mesh(*from_makehuman, human, true);
  from_makehuman->add_option("--skeleton", human.skeleton, "Rig (.mhskel)")->required();
  from_makehuman->add_option("--weights", human.weights,
                             "Weights (.mhw); by default those that the rig names");
  from_makehuman->add_option("--target", targets, "Shape (.target), FILE or FILE=AMOUNT; any number");
  CLI::App* walks = add_walk(app, walk, from, to, via);
  CLI::App* strips = add_strip(app, strip, eye, target);
  if (const auto status = gsnav_tools::parse_options(app, argc, argv)) {
    exit_code = *status;
    return std::nullopt;
  }
  const auto bad = [&](const std::string& text, const char* what) {
    std::fprintf(stderr, "gsnav-avatar: '%s' is no %s\n", gsnav::printable(text).c_str(), what);
    exit_code = gsnav_tools::kUsage;
    return std::nullopt;
  };
  for (const std::string& t : targets) {
    if (!parse_target(t, human.targets.emplace_back())) return bad(t, "FILE or FILE=AMOUNT");
  }
  for (const std::string& t : via) {
    if (!parse_point(t, walk.via.emplace_back())) return bad(t, "point X,Y,Z");
  }
  if (walks->parsed()) {
    if (!walk.flat && walk.navmesh.empty()) {
      std::fprintf(stderr, "gsnav-avatar: walk needs --navmesh or --flat\n");
      exit_code = 1;
      return std::nullopt;
    }
    if (!parse_point(from, walk.from)) return bad(from, "point X,Y,Z");
    if (!parse_point(to, walk.to)) return bad(to, "point X,Y,Z");
    out.walk = walk;
  } else if (strips->parsed()) {
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
