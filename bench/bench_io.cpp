// SPDX-License-Identifier: Apache-2.0
// Writes a scene in every format and reads it back. Prints one row per format: the file's size, the
// speed, the peak memory beside the memory of the result, and the error that the format adds.
//
//   bench_io [--scene FILE] [--formats ply,spz] [--load] [--markdown] [--folder DIR]
#include <malloc.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <numeric>
#include <string>
#include <vector>

#include "cloud_or_flat.hpp"
#include "compare.hpp"
#include "gsnav/detail/demo/default_scene.hpp"
#include "gsnav/detail/scene/describe_cloud.hpp"
#include "gsnav/detail/scene/spatial_order.hpp"
#include "gsnav/detail/scene/views_around.hpp"
#include "gsnav/io/scene_file.hpp"

namespace {

using namespace gsnav;

double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// Value of a line of /proc/self/status, bytes; 0 where there is no such line.
double memory(const char* key) {
  std::ifstream in("/proc/self/status");
  for (std::string line; std::getline(in, line);) {
    if (line.starts_with(key)) return 1024 * std::strtod(line.c_str() + line.find(':') + 1, nullptr);
  }
  return 0;
}

struct Reading {
  LoadedCloud made;
  double seconds = 1e9, peak = 0;  ///< least of all runs, and of the last run
};

/// Loads a scene three times. `sort`: in spatial order, as it is rendered.
Reading read(const std::string& path, bool sort) {
  Reading out;
  out.made = io::load_scene(path, {.sort = sort}).value();  // brings the file into the cache
  for (int run = 0; run < 3; ++run) {
    out.made = {};
    ::malloc_trim(0);                               // so that freed memory no longer counts
    std::ofstream("/proc/self/clear_refs") << "5";  // resets the peak
    const double before = memory("VmRSS"), start = now();
    out.made = io::load_scene(path, {.sort = sort}).value();
    out.seconds = std::min(out.seconds, now() - start);
    out.peak = memory("VmHWM") - before;
  }
  return out;
}

struct Row {
  double bytes = 0, write = 0, read = 0, peak = 0, result = 0;
  double load = 0, load_peak = 0, loaded = 0;  ///< of the scene in spatial order
  gsnav_convert::FieldErrors fields;
  gsnav_convert::ImageErrors images;
};

Row measure(const GaussianCloud& source, const std::vector<Camera>& cameras, const std::string& path,
            bool load) {
  Row row;
  const double start = now();
  io::save_scene(path, source).throw_if_error();
  row.write = now() - start;
  row.bytes = static_cast<double>(std::filesystem::file_size(path));
  if (load) {
    const Reading sorted = read(path, true);
    row.load = sorted.seconds;
    row.load_peak = sorted.peak;
    row.loaded = static_cast<double>(sorted.made.cloud.bytes());
  }
  Reading reading = read(path, false);
  LoadedCloud& made = reading.made;
  row.read = reading.seconds;
  row.peak = reading.peak;
  row.result = static_cast<double>(made.cloud.bytes());
  // The chunk format is written in the order of the rows in memory, the others in the order of the file
  // that was read.
  std::vector<std::uint32_t> rows = rows_as_read(source);
  if (path.ends_with(".compressed.ply")) std::iota(rows.begin(), rows.end(), 0u);
  row.fields = gsnav_convert::largest_field_errors(source, rows, made.cloud, rows_as_read(made.cloud));
  made.cloud.filter = source.filter;
  if (!cameras.empty()) {
    GaussianCloud sorted = source;
    sort_spatially(sorted);
    sort_spatially(made.cloud);
    row.images = gsnav_convert::image_errors(sorted, made.cloud, cameras).value();
  }
  std::filesystem::remove(path);
  return row;
}

}  // namespace

int main(int argc, char** argv) {
  std::string scene, folder = std::filesystem::temp_directory_path().string();
  std::vector<std::string> formats = {"ply", "glb", "compressed.ply", "splat", "spz", "sog"};
  bool markdown = false, load = false;
  int views = 4;
  CLI::App app{"Speed, memory and error of every format that is written and read."};
  app.add_option("--scene", scene, "Any scene that can be read; the embedded flat if not given");
  app.add_option("--folder", folder, "Where the files are written for a while");
  app.add_option("--formats", formats, "Those to measure")
      ->delimiter(',')
      ->check(CLI::IsMember(formats))
      ->capture_default_str();
  app.add_flag("--load", load, "Also time loading in spatial order, as scenes are rendered");
  app.add_option("--views", views, "Images of 640x480 for the PSNR");
  app.add_flag("--markdown", markdown, "Print the table as docs/notes/speed.md has it");
  CLI11_PARSE(app, argc, argv);
  const auto loaded = gsnav_bench::cloud_or_flat(scene);
  if (!loaded) {
    std::fprintf(stderr, "bench_io: %s\n", loaded.message().c_str());
    return 1;
  }
  const GaussianCloud& source = *loaded;
  const auto cameras = views_around(source, guess_up(source).up, views, 640, 480);
  const double n = static_cast<double>(source.size());
  std::printf("%zu Gaussians of SH degree %d, %.1f MB in memory\n\n", source.size(), source.sh_degree,
              static_cast<double>(source.bytes()) / 1e6);
  const char* const separator = markdown ? " | " : "  ";
  const auto line = [&](const std::vector<std::string>& cells) {
    std::string out = markdown ? "| " : "";
    for (std::size_t k = 0; k < cells.size(); ++k) {
      std::string cell = cells[k];
      if (!markdown) cell.insert(0, std::string(cell.size() < 14 ? 14 - cell.size() : 0, ' '));
      out += (k == 0 ? "" : separator) + cell;
    }
    std::printf("%s%s\n", out.c_str(), markdown ? " |" : "");
  };
  const std::vector<std::string> head = {
      "format", "bytes each", "read MB/s", "read M/s", "write M/s", "peak/result", "mean, m",
      "scale",  "rotation",   "opacity",   "colour",   "SH",        "PSNR, dB"};
  line(head);
  if (markdown) line(std::vector<std::string>(head.size(), "---"));
  const std::string base = folder + "/gsnav_bench_io_" + std::to_string(::getpid());
  std::string loads;
  for (const std::string& format : formats) {
    const std::string extension = "." + format;
    const Row r = measure(source, cameras, base + extension, load);
    const auto number = [](const char* form, double v) {
      char text[32];
      std::snprintf(text, sizeof text, form, v);
      return std::string(text);
    };
    line({extension, number("%.1f", r.bytes / n), number("%.0f", r.bytes / r.read / 1e6),
          number("%.2f", n / r.read / 1e6), number("%.2f", n / r.write / 1e6),
          number("%.2f", r.peak / r.result), number("%.1e", r.fields.mean),
          number("%.1e", r.fields.scale), number("%.1e", r.fields.rotation),
          number("%.1e", r.fields.opacity), number("%.1e", r.fields.colour),
          number("%.1e", r.fields.bands), number("%.1f", r.images.psnr)});
    if (load) {
      loads += extension + ": read in " + number("%.2f s", r.read) + ", loaded in spatial order in " +
               number("%.2f s", r.load) + ", peak/result " + number("%.2f", r.load_peak / r.loaded) +
               "\n";
    }
  }
  if (load) std::printf("\n%s", loads.c_str());
  return 0;
}
