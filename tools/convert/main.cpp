// SPDX-License-Identifier: Apache-2.0
// gsnav-convert IN... OUT: edits any scene that the library reads and writes it in any format that it
// writes.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "../common/check_values.hpp"
#include "../common/parse_options.hpp"
#include "../common/scene_options.hpp"
#include "../common/voxel_options.hpp"
#include "compare.hpp"
#include "gsnav/core/text.hpp"
#include "gsnav/io.hpp"
#include "gsnav/io/scene_file.hpp"
#include "gsnav/open.hpp"
#include "gsnav/render.hpp"
#include "gsnav/scene/prepare.hpp"

namespace {

using namespace gsnav;

struct Options {
  std::vector<std::string> inputs, paths;  ///< Those of --scene; IN... OUT.
  std::vector<double> crop, rotate, translate;
  std::string cameras, order = "read", up = "keep";
  double time = 0, density = 1, scale = 1, min_opacity = 0, max_scale = 0;
  int level = 0, degree = kMaxShDegree, views = 6, width = 640, height = 480;
};

int fail(const std::string& message) {
  std::fprintf(stderr, "gsnav-convert: %s\n", printable(message).c_str());
  return 1;
}

/// Adds the Gaussians of a scene, in the frame of its file.
Status add_scene(const std::string& name, const Options& o, GaussianCloud& all) {
  OpenOptions how;
  how.up = "keep";
  how.time = o.time;
  how.level = o.level;
  how.keep_zero_bands = true;
  how.navmesh = "none";
  how.density = o.density;
  const auto scene = open_scene(name, how);
  if (!scene) return scene.status();
  if (scene->scene->assets.empty()) return {Errc::invalid_argument, name + ": has no Gaussians"};
  std::fputs(io::report_text(scene->report).c_str(), stdout);
  const Status s = append(all, *scene->scene->assets.front().cloud);
  return s ? s : Status(s.code(), name + ": " + s.message());
}

Result<GaussianCloud> load(const Options& o) {
  GaussianCloud all;
  for (const std::string& input : o.inputs) {
    if (Status s = add_scene(input, o, all); !s) return s;
  }
  return all;
}

/// Takes the inputs from the names, and checks that a scene can be edited and written with these values.
/// Throws CLI::ValidationError with the option.
void check_options(Options& o) {
  if (o.inputs.size() + o.paths.size() < 2 || o.paths.empty())
    throw CLI::ValidationError("IN... OUT", "an input and an output are needed");
  o.inputs.insert(o.inputs.end(), o.paths.begin(), o.paths.end() - 1);
  const Status out = io::check_scene_output(o.paths.back());
  if (out.code() == Errc::unsupported) throw CLI::ValidationError("OUT", out.message());
  if (!o.rotate.empty() && !(norm(Vec3d{o.rotate[0], o.rotate[1], o.rotate[2]}) > 0))
    throw CLI::ValidationError("--rotate", "the axis is zero");
}

/// Turns the scene upright, crops and prunes. Then rotates, scales and moves, in this order.
Status edit(GaussianCloud& cloud, const Options& o) {
  if (o.up != "keep") {
    const auto turned = upright(o.up == "auto" ? axis_name(guess_up(cloud).up) : o.up);
    if (!turned) return {turned.code(), "--up: " + turned.message()};
    transform(cloud, *turned);
  }
  if (!o.crop.empty()) crop(cloud, gsnav_tools::box_of(o.crop));
  if (o.min_opacity > 0 || o.max_scale > 0) {
    filter_rows(cloud, [&](std::size_t i) {
      bool keep = static_cast<double>(cloud.opacities[i]) >= o.min_opacity;
      for (const auto& axis : cloud.scales) {
        keep = keep && (o.max_scale <= 0 || static_cast<double>(axis[i]) <= o.max_scale);
      }
      return keep;
    });
  }
  limit_sh_degree(cloud, o.degree);
  Similarity by;
  by.scale = o.scale;
  if (!o.rotate.empty()) {
    const Vec3d axis{o.rotate[0], o.rotate[1], o.rotate[2]};
    by.rotation = axis_angle(normalized(axis), o.rotate[3] * std::numbers::pi / 180);
  }
  if (!o.translate.empty()) by.translation = {o.translate[0], o.translate[1], o.translate[2]};
  if (!o.rotate.empty() || !o.translate.empty() || o.scale != 1) transform(cloud, by);
  if (cloud.size() == 0) return {Errc::invalid_argument, "no Gaussian is left"};
  if (!is_finite(cloud))
    return {Errc::invalid_argument,
            "a Gaussian would be moved or scaled beyond float32: --scale, --translate"};
  sort_spatially(cloud);
  return {};
}

std::uintmax_t bytes_of(const std::filesystem::path& out) {
  std::error_code ignored;
  if (out.filename() != "meta.json") return std::filesystem::file_size(out, ignored);
  std::uintmax_t sum = 0;
  for (const auto& entry : std::filesystem::directory_iterator(
           out.parent_path().empty() ? "." : out.parent_path(), ignored)) {
    if (entry.path().filename() == out.filename() || entry.path().extension() == ".webp")
      sum += entry.file_size(ignored);
  }
  return sum;
}

/// Prints how many values the format could not hold.
void print_clamped(const io::ClampedValues& c) {
  const auto line = [](std::uint64_t n, const char* what) {
    if (n != 0) std::printf("  %llu %s\n", static_cast<unsigned long long>(n), what);
  };
  line(c.colours, "colours outside of the format's range, clamped");
  line(c.scales, "scales outside of the format's range, clamped");
  line(c.bands, "SH coefficients outside of the format's range, clamped");
  line(c.lost_bands, "SH coefficients lost: the format has no bands");
}

/// Reads the file back and prints the differences from the cloud, including ties of depth in the order
/// of the rows read.
/// @param rows Rows of the cloud in the order of the file.
Status compare(const GaussianCloud& source, const std::vector<std::uint32_t>& rows,
               const std::string& out, const Options& o) {
  auto back = io::load_scene(out, {.keep_zero_bands = true});
  if (!back) return back.status();
  const GaussianCloud& made = back->cloud;
  if (back->report.read != source.size() || made.size() != source.size()) {
    return {Errc::invalid_file, out + ": " + std::to_string(made.size()) + " of " +
                                    std::to_string(source.size()) + " Gaussians were read back"};
  }
  if (made.filter != source.filter) std::printf("  the mip filter is lost in this format\n");
  const gsnav_convert::FieldErrors e =
      gsnav_convert::largest_field_errors(source, rows, made, rows_as_read(made));
  std::printf(
      "  largest errors: mean %.3g m, scale %.3g %% (%.3g m), rotation %.3g deg, opacity %.3g, colour "
      "%.3g, SH %.3g\n",
      e.mean, 100 * e.scale, e.scale_metres, e.rotation * 180 / std::numbers::pi, e.opacity, e.colour,
      e.bands);
  std::vector<Camera> cameras = views_around(source, guess_up(source).up, o.views, o.width, o.height);
  if (!o.cameras.empty()) {
    auto given = io::load_cameras(o.cameras, o.width, o.height);
    if (!given) return given.status();
    cameras = std::move(*given);
  }
  if (cameras.empty()) return {};
  if (source.sort_order != made.sort_order) {
    const auto by = [](SortOrder order) {
      return order == SortOrder::z_depth ? "depth" : "distance from the camera";
    };
    std::printf("  the format has another order of drawing: by %s, the source by %s\n",
                by(made.sort_order), by(source.sort_order));
  }
  const auto images = gsnav_convert::image_errors(source, made, cameras);
  if (!images) return images.status();
  std::printf("  %zu images of %dx%d: ", cameras.size(), o.width, o.height);
  if (images->largest == 0) {
    std::printf("equal, bit for bit\n");
  } else {
    std::printf("PSNR %.2f dB, the worst %.2f dB, largest difference %.3g\n", images->psnr,
                images->worst, images->largest);
  }
  return {};
}

void add_inputs(CLI::App& app, Options& o) {
  app.add_option(
         "paths", o.paths,
         "IN... OUT; an input is a file, a folder of a SOG or a streamed set, tiles (DIR/2_0,2_1), a "
         "Habitat scene (SET.scene_dataset_config.json#NAME), or default, the embedded flat")
      ->expected(1, -1);
  app.add_option("--scene", o.inputs, "an input, like IN; may be repeated")
      ->allow_extra_args(false)
      ->type_name("SCENE");
  app.add_option("--level", o.level, "level of streamed sets; 0 is the finest")
      ->check(CLI::NonNegativeNumber);
  app.add_option("--time", o.time, "time of a scene that moves (4D Gaussians), seconds");
  app.add_option("--density", o.density, "density of the Gaussians of the embedded flat")
      ->check(CLI::Range(0.05, 20.0))
      ->capture_default_str();
  app.add_option("--up", o.up,
                 "axis of the file that points up: x, y, z, -x, -y or -z; it becomes +Y; auto guesses "
                 "it from the ground; keep leaves the axes of the file")
      ->check(CLI::IsMember({"keep", "auto", "x", "y", "z", "+x", "+y", "+z", "-x", "-y", "-z"}))
      ->capture_default_str();
  gsnav_tools::add_crop_option(
      app, o.crop, "keep Gaussians with their centre in X0 Y0 Z0 X1 Y1 Z1, metres, axes of --up");
}

void add_edits(CLI::App& app, Options& o) {
  app.add_option("--min-opacity", o.min_opacity, "drop Gaussians with a lower opacity")
      ->check(CLI::Range(0.0, 1.0));
  app.add_option("--max-scale", o.max_scale, "drop Gaussians with a larger standard deviation, metres")
      ->check(CLI::NonNegativeNumber);
  app.add_option("--sh", o.degree, "keep SH bands up to this degree")
      ->check(CLI::Range(0, kMaxShDegree));
  app.add_option("--rotate", o.rotate, "then turn about the axis X Y Z by DEGREES")->expected(4);
  app.add_option("--scale", o.scale, "then scale by this factor")->check(CLI::PositiveNumber);
  app.add_option("--translate", o.translate, "then move by X Y Z metres")->expected(3);
}

void add_output(CLI::App& app, Options& o) {
  app.add_option(
         "--order", o.order,
         "order of the Gaussians in the file: read keeps the order of the input, which decides ties of "
         "depth; space makes smaller .sog and .spz files; .compressed.ply is always ordered by space")
      ->check(CLI::IsMember({"read", "space"}))
      ->capture_default_str();
  app.add_option("--cameras", o.cameras,
                 "INRIA cameras.json for the comparison; default: views around the scene");
  app.add_option("--views", o.views, "number of views around the scene; 0 compares no images")
      ->check(CLI::Range(0, 1000));
  app.add_option("--width", o.width, "width of the compared images, pixels")->check(CLI::Range(1, 8192));
  app.add_option("--height", o.height, "height of the compared images, pixels")
      ->check(CLI::Range(1, 8192));
}

/// The scene options that have no effect here.
void refuse_others(CLI::App& app) {
  const char* in_file = "the file to write decides how Gaussians are stored";
  const char* exact = "images are compared in full quality";
  const char* no_navmesh = "scene files hold no NavMesh: gsnav-navmesh builds one";
  const char* no_people = "scene files hold no people: gsnav-avatar makes them";
  gsnav_tools::refuse_scene_options(
      app, {{"--storage", in_file},
            {"--profile", exact},
            {"--lod-error", exact},
            {"--lod-levels", "one level is converted: see --level"},
            {"--visible-sets", "rows are in another order afterwards: gsnav-navmesh makes sets"},
            {"--mesh", "the formats hold Gaussians only"},
            {"--navmesh", no_navmesh},
            {"--cell-size", no_navmesh},
            {"--avatars", no_people},
            {"--seed", no_people},
            {"--device", "images are compared on the processor"}});
}

}  // namespace

int main(int argc, char** argv) {
  Options o;
  CLI::App app{
      "Converts scenes of 3D Gaussians. Several inputs are merged.\nThe extension of OUT chooses the "
      "format: .ply, .compressed.ply, .splat, .spz, .sog, DIR/meta.json or .glb.\nReads the file back "
      "and prints the largest error of each field and of images.\nExample: gsnav-convert apartment.ply "
      "room.spz --crop -4 -3 -4 4 0 4"};
  add_inputs(app, o);
  add_edits(app, o);
  add_output(app, o);
  refuse_others(app);
  const auto status = gsnav_tools::parse_options(app, argc, argv, [&o] {
    gsnav_tools::check_instruction_set();
    check_options(o);
  });
  if (status) return *status;

  const std::string out = o.paths.back();
  if (Status s = io::check_scene_output(out); !s) return fail(s.message());
  auto cloud = load(o);
  if (!cloud) return fail(cloud.message());
  if (Status s = edit(*cloud, o); !s) return fail(s.message());
  // The source keeps its reading order, whatever order the file has.
  std::vector<std::uint32_t> as_read = cloud->row_ids;
  const bool chunks = lower_case(out).ends_with(".compressed.ply");
  if (chunks || o.order == "space") {
    cloud->row_ids.clear();
    std::printf("%s: rows along a curve through space%s: where depths are equal, images differ\n",
                printable(out).c_str(), chunks ? ", as the format's chunks need them" : "");
  }
  for (const std::string& input : o.inputs) {
    std::error_code ignored;
    if (std::filesystem::equivalent(input, out, ignored))
      std::printf("%s: replaces the input\n", printable(out).c_str());
  }
  const std::vector<std::uint32_t> rows = rows_as_read(*cloud);
  if (Status s = io::save_scene(out, *cloud); !s) return fail(s.message());
  cloud->row_ids = std::move(as_read);
  const std::uintmax_t bytes = bytes_of(out);
  std::printf("%s: %zu Gaussians of SH degree %d, %.2f MB, %.1f bytes per Gaussian\n",
              printable(out).c_str(), cloud->size(), cloud->sh_degree, static_cast<double>(bytes) / 1e6,
              static_cast<double>(bytes) / static_cast<double>(cloud->size()));
  print_clamped(io::count_clamped(out, *cloud));
  if (Status s = compare(*cloud, rows, out, o); !s) return fail(s.message());
  return 0;
}
