// SPDX-License-Identifier: Apache-2.0
#include "options.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>

#include "../../tools/common/check_values.hpp"
#include "../../tools/common/parse_options.hpp"
#include "../../tools/common/scene_options.hpp"
#include "gsnav/core/text.hpp"
#include "gsnav/version.hpp"
#include "scenes.hpp"

namespace gsnav_report {

using namespace gsnav;

namespace {

std::optional<ImageSize> parse_size(const std::string& text) {
  ImageSize size;
  int used = 0;
  if (std::sscanf(text.c_str(), "%5dx%5d%n", &size.width, &size.height, &used) != 2 ||
      static_cast<std::size_t>(used) != text.size() || size.width < 1 || size.height < 1 ||
      size.width > kMaxImageSide || size.height > kMaxImageSide) {
    return std::nullopt;
  }
  return size;
}

const char kDescription[] =
    "Measures speed against error: renders scenes from several views with every profile, sensor and "
    "backend, "
    "turns each knob by itself, and judges every image by float64 oracles; skinning, capsule sweeps and "
    "kernel "
    "benchmarks likewise. Writes OUT/report.csv (one row per measurement), OUT/images and "
    "OUT/report.html. "
    "References are kept by content hash, so that a second run is fast; Ctrl-C leaves a valid CSV that "
    "--resume continues.";

void add_scenes(CLI::App& app, Options& o, std::vector<std::string>& sizes, std::string& knob_size) {
  app.add_option(
      "scene,--scene", o.scenes,
      "[NAME=]SCENE[:CAMERAS.json]: a scene as in all programs (default, the embedded flat; a file, a "
      "folder, tiles DIR/2_0,2_1; SET.scene_dataset_config.json#NAME), and an INRIA cameras.json in the "
      "axes of the scene's file; without cameras four views from outside. Repeatable");
  app.add_flag("--default", o.default_scene, "The embedded flat, as --scene default");
  app.add_option("--up", o.frame.up,
                 "Axis of the scenes' files that points up, for views from outside: x, y, z, -x, -y or "
                 "-z; auto: guessed from the ground; keep: the axes of the file")
      ->check(CLI::IsMember({"auto", "keep", "x", "y", "z", "+x", "+y", "+z", "-x", "-y", "-z"}))
      ->capture_default_str();
  app.add_option("--time", o.frame.time, "Moment of scenes that move (4D Gaussians), seconds")
      ->capture_default_str();
  app.add_option("--density", o.frame.density,
                 "Density of Gaussians in the embedded flat, relative to the default")
      ->check(CLI::Range(0.05, 20.0))
      ->capture_default_str();
  app.add_option("--flat", o.flats, "Benchmark flats, PLY files with a cameras.json beside them");
  app.add_option(
      "--visible-sets", o.visible_sets,
      "[SCENE=]FILE: visible sets of a scene, written by gsnav-navmesh --visible-sets; adds the profile "
      "visible, which is fast with only the Gaussians that are visible from the view's cell. "
      "Repeatable");
  app.add_option("--views", o.views, "Views per scene, spread over its cameras")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  app.add_option("--sizes", sizes, "Image sizes, WIDTHxHEIGHT,...")
      ->delimiter(',')
      ->capture_default_str();
  app.add_option("--knob-size", knob_size, "Image size of the one-knob-at-a-time rows")
      ->capture_default_str();
  app.add_option("--hfov", o.hfov, "Horizontal field of view, degrees")
      ->check(CLI::Range(1.0, 170.0))
      ->capture_default_str();
  app.add_option("--near", o.near_plane, "Near plane, metres")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  const char* no_navmesh = "views need no NavMesh";
  const char* no_people = "the report measures scenes without people, and skinning by itself";
  gsnav_tools::refuse_scene_options(
      app, {{"--storage", "the report compares storages: see --knobs"},
            {"--profile", "the report compares profiles: see --profiles"},
            {"--lod-error", "the report measures levels at the default error"},
            {"--lod-levels", "the report measures levels that it builds"},
            {"--mesh", "the report measures Gaussians only"},
            {"--navmesh", no_navmesh},
            {"--cell-size", no_navmesh},
            {"--crop", "it limits a NavMesh, and views need none; gsnav-convert crops Gaussians"},
            {"--avatars", no_people},
            {"--seed", no_people},
            {"--device", "the report compares backends: see --backends"}});
}

std::string joined(const std::vector<std::string>& names) {
  std::string out;
  for (const std::string& name : names) out += (out.empty() ? "" : ", ") + name;
  return out;
}

void add_kinds_of_rows(CLI::App& app, Options& o, std::vector<std::string>& oracles) {
  // The names stand in the description, where they have spaces and wrap.
  const auto list = [&app](const char* name, std::vector<std::string>& values,
                           const std::vector<std::string>& known, const char* text) {
    const std::string given = values == known ? "all" : joined(values);
    app.add_option(name, values, std::string(text) + ". Any of " + joined(known) + "; default: " + given)
        ->type_name("NAME")
        ->delimiter(',')
        ->check(CLI::IsMember(known).description(""));
  };
  list("--kinds", o.kinds, {"render", "ledger", "skinning", "sweep", "kernel"}, "Kinds of rows");
  list("--sensors", o.sensors, {"rgbd", "rgb", "depth"}, "Images that are rendered");
  list("--profiles", o.profiles, {"exact", "fast", "lod", "none"},
       "Profiles; lod is judged by photo4, and its tree is kept next to the scene's file; none: no such "
       "rows");
  list("--backends", o.backends, {"openmp", "serial", "cuda"},
       "Backends; all but the first with the first sensor only");
  std::vector<std::string> known_knobs = knob_names();
  known_knobs.emplace_back("none");
  list("--knobs", o.knobs, known_knobs, "Knobs that are turned by themselves; none: no such rows");
  app.add_option("--knob-values", o.knob_values,
                 "Only these values of the knobs, as the CSV has them: packed, 1e-3, ...")
      ->delimiter(',');
  list("--oracles", oracles, oracles,
       "Judges; contract judges all rows, the others those that they have a rule for");
}

void add_run(CLI::App& app, Options& o) {
  app.add_option("--threads", o.threads,
                 "Threads of the openmp backend and of the oracles; 0: OMP_NUM_THREADS")
      ->check(CLI::Range(0, 1024));
  app.add_option("--runs", o.runs, "Timed runs per setting")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  app.add_option("--max-seconds", o.max_seconds, "Time spent on timing one setting, three runs at least")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--benchmarks", o.benchmarks,
                 "JSON of bench_kernels (--benchmark_format=json), for kernel rows")
      ->check(CLI::ExistingFile);
  app.add_option("--out", o.out, "Folder of the report")->capture_default_str();
  app.add_option("--cache", o.cache,
                 "Folder of the references; default OUT/references, `none`: not kept");
  gsnav_tools::check_output_name(
      app.add_option("--docs", o.docs,
                     "Also writes a Markdown page of approximations from the CSV to this file (.md)"),
      gsnav_tools::ends_in({".md"}));
  app.add_option("--commit", o.commit, "Commit that the rows are measured for")->capture_default_str();
  app.add_option("--machine", o.machine,
                 "Machine that the rows are measured on; default: the processor's name");
  app.add_flag("--resume", o.resume,
               "Keeps the rows of OUT/report.csv and makes those that are missing");
  app.add_flag("--acceptance", o.acceptance,
               "Also judge by gsnav's own budgets and targets, which hold for its benchmark scenes");
  app.add_flag("--no-html", o.no_html, "No page, the CSV only");
}

}  // namespace

bool Options::wants(const std::string& kind) const {
  return std::find(kinds.begin(), kinds.end(), kind) != kinds.end();
}

std::optional<Options> parse_options(int argc, char** argv, int& exit_code) {
  Options o;
  o.commit = std::string("v") + std::to_string(GSNAV_VERSION_MAJOR) + "." +
             std::to_string(GSNAV_VERSION_MINOR) + "." + std::to_string(GSNAV_VERSION_PATCH);
  std::vector<std::string> sizes{"256x256", "640x480"}, oracles;
  for (const Oracle q : o.oracles) oracles.emplace_back(to_string(q));
  std::string knob_size = "256x256";

  CLI::App app{kDescription};
  add_scenes(app, o, sizes, knob_size);
  add_kinds_of_rows(app, o, oracles);
  add_run(app, o);
  bool quick = false;
  app.add_flag(
      "--quick", quick,
      "A first look in under a minute: two views of 256x256, RGB-D by OpenMP, profiles exact and "
      "fast, the contract's oracle, three timed runs, nothing else. Options that you name keep their "
      "values");
  if (const auto status =
          gsnav_tools::parse_options(app, argc, argv, gsnav_tools::check_instruction_set)) {
    exit_code = *status;
    return std::nullopt;
  }
  if (quick) {
    const auto not_given = [&app](const char* name) { return app.get_option(name)->count() == 0; };
    if (not_given("--views")) o.views = 2;
    if (not_given("--sizes")) sizes = {"256x256"};
    if (not_given("--kinds")) o.kinds = {"render"};
    if (not_given("--sensors")) o.sensors = {"rgbd"};
    if (not_given("--profiles")) o.profiles = {"exact", "fast"};
    if (not_given("--backends")) o.backends = {"openmp"};
    if (not_given("--knobs")) o.knobs = {"none"};
    if (not_given("--oracles")) oracles = {"contract"};
    if (not_given("--runs")) o.runs = 3;
  }
  const auto fail = [&](const std::string& message) {
    std::fprintf(stderr, "gsnav-report: %s\n", gsnav::printable(message).c_str());
    exit_code = gsnav_tools::kUsage;
    return std::nullopt;
  };
  const auto size_of = [](const std::string& option, const std::string& text) {
    return option + " " + text + ": use WIDTHxHEIGHT, 1 to " + std::to_string(kMaxImageSide);
  };
  o.sizes.clear();
  for (const std::string& text : sizes) {
    const std::optional<ImageSize> size = parse_size(text);
    if (!size) return fail(size_of("--sizes", text));
    o.sizes.push_back(*size);
  }
  const std::optional<ImageSize> size = parse_size(knob_size);
  if (!size) return fail(size_of("--knob-size", knob_size));
  o.knob_size = *size;
  o.oracles.clear();
  for (const std::string& name : oracles) o.oracles.push_back(parse_oracle(name).value());
#if !defined(GSNAV_HAS_CUDA)
  if (std::find(o.backends.begin(), o.backends.end(), "cuda") != o.backends.end()) {
    return fail("--backends cuda: this build has no CUDA backend");
  }
#endif
  if (o.wants("render") && o.scenes.empty() && o.flats.empty() && !o.default_scene) {
    return fail("no scene: name one by --scene, --default or --flat, or leave `render` out of --kinds");
  }
  for (const std::string& text : o.scenes) {
    if (const auto spec = parse_scene(text); spec.code() == gsnav::Errc::invalid_argument)
      return fail(spec.message());
  }
  const std::vector<std::string> values = knob_values();
  for (const std::string& value : o.knob_values) {
    if (std::find(values.begin(), values.end(), value) == values.end())
      return fail("--knob-values " + value + ": no knob has this value; use any of " + joined(values));
  }
  if (o.cache.empty()) o.cache = o.out + "/references";
  if (o.cache == "none") o.cache.clear();
  exit_code = 0;
  return o;
}

}  // namespace gsnav_report
