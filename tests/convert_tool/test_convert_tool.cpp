// SPDX-License-Identifier: Apache-2.0
// The program as people run it, and what it measures.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <iterator>
#include <sstream>
#include <string>
#include <vector>

#include "compare.hpp"
#include "gsnav/backends/serial.hpp"
#include "gsnav/demo.hpp"
#include "gsnav/detail/io/cameras_file.hpp"
#include "gsnav/detail/io/ply.hpp"
#include "gsnav/detail/scene/describe_cloud.hpp"
#include "gsnav/detail/scene/edit_cloud.hpp"
#include "gsnav/detail/scene/spatial_order.hpp"
#include "gsnav/detail/scene/views_around.hpp"
#include "gsnav/io/scene_file.hpp"
#include "io/check_turned.hpp"
#include "io/ply_file.hpp"
#include "io/row_clouds.hpp"
#include "support/command.hpp"
#include "support/compiled_frames.hpp"
#include "support/files.hpp"
#include "support/process.hpp"
#include "support/small_disk.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

Outcome run(const TempFolder& folder, const std::string& arguments) {
  return run_command(GSNAV_CONVERT, arguments, folder.path());
}

GaussianCloud load(const TempFolder& folder, const char* name) {
  return io::load_scene((folder / name).string()).value().cloud;
}

/// The number behind `key` in what the program printed.
double number_behind(const std::string& text, const std::string& key) {
  const std::size_t at = text.find(key);
  REQUIRE(at != std::string::npos);
  return std::strtod(text.c_str() + at + key.size(), nullptr);
}

}  // namespace

TEST_CASE("convert: every format, with the error that it adds") {
  const TempFolder folder("convert");
  REQUIRE(io::save_ply(folder / "in.ply", cloud_of_random_rows(800, 3, 3)).ok());
  const GaussianCloud source = load(folder, "in.ply");
  struct Target {
    const char* name;
    double mean, least_psnr;
  };
  // Bounds of the formats: float32, half of 2^-12 m along each axis, 1/2046 of the range in y, ...
  const Target all[] = {{"a.ply", 1e-5, 100}, {"a.glb", 1e-5, 100},           {"a.splat", 1e-5, 10},
                        {"a.spz", 3e-4, 25},  {"a.compressed.ply", 0.05, 25}, {"a.sog", 2e-3, 25}};
  for (const Target& t : all) {
    CAPTURE(t.name);
    const Outcome out =
        run(folder, std::string("in.ply ") + t.name + " --width 64 --height 48 --views 3");
    CAPTURE(out.text);
    REQUIRE(out.ok);
    GaussianCloud made = load(folder, t.name);
    CHECK(made.size() == 800);
    CHECK(number_behind(out.text, "mean ") <= t.mean);
    CHECK(out.text.find("3 images of 64x48") != std::string::npos);
    CHECK((out.says("equal, bit for bit") || t.name != std::string("a.ply")));
    if (out.says("equal")) continue;
    double psnr = number_behind(out.text, "PSNR ");
    CHECK(number_behind(out.text, "the worst ") <= psnr);
    CHECK(out.says("another order of drawing") == (made.sort_order != source.sort_order));
    if (made.sort_order != source.sort_order) {
      // Drawn in the source's order, the images show the format's rounding alone.
      made.sort_order = source.sort_order;
      psnr =
          gsnav_convert::image_errors(source, made, views_around(source, guess_up(source).up, 3, 64, 48))
              .value()
              .psnr;
    }
    CHECK(psnr > t.least_psnr);
  }
}

namespace {

/// Rows on a grid of 1/4 m, so that along each axis hundreds have the same depth, opaque and of random
/// colours.
PlyFile rows_on_a_grid(std::size_t n, unsigned seed) {
  PlyFile file;
  file.properties = inria_properties(0);
  file.rows = random_rows(n, 0, seed);
  for (PlyRow& row : file.rows) {
    for (const char* axis : {"x", "y", "z"})
      row[axis] = std::nearbyint(4 * std::tanh(row[axis])) / 4 + 0.0;
    for (const char* axis : {"scale_0", "scale_1", "scale_2"})
      row[axis] = -3 + 0.3 * std::sin(row[axis]);
    row["opacity"] = 3;
  }
  return file;
}

/// Cameras along the axes, for which a plane of the grid has one depth, and one askew.
std::string cameras_along_axes() {
  std::vector<Camera> cameras;
  for (const Vec3d& eye : {Vec3d{0, 0, -4}, Vec3d{4, 0, 0}, Vec3d{0, 0, 4}, Vec3d{1, -2, 3}}) {
    cameras.push_back(Camera::look_at(eye, {}, {0, -1, 0}, 96, 64, 60));
  }
  const TempFolder folder("convert_cameras");
  REQUIRE(io::save_cameras(folder / "c.json", cameras).ok());
  return read_file(folder / "c.json");
}

}  // namespace

TEST_CASE("convert: from PLY to PLY thousands of ties of depth are drawn the same, bit for bit") {
  const TempFolder folder("convert_ties");
  const PlyFile file = rows_on_a_grid(6000, 21);
  write_file(folder / "in.ply", file.text());
  write_file(folder / "c.json", cameras_along_axes());
  const GaussianCloud source = load(folder, "in.ply");
  // What is drawn depends on who is first: the same rows from last to first are another image.
  PlyFile turned = file;
  std::reverse(turned.rows.begin(), turned.rows.end());
  write_file(folder / "turned.ply", turned.text());
  const auto cameras = io::load_cameras(folder / "c.json").value();
  const auto difference = [&](const char* name) {
    return gsnav_convert::image_errors(source, load(folder, name), cameras).value();
  };
  REQUIRE(difference("turned.ply").largest > 0.1);

  const std::string options = " --cameras c.json --width 96 --height 64";
  Outcome out = run(folder, "in.ply a.ply" + options);
  CAPTURE(out.text);
  REQUIRE(out.ok);
  CHECK(out.says("4 images of 96x64: equal, bit for bit"));
  CHECK(difference("a.ply").largest == 0);
  // The file itself: the rows' positions, byte for byte, in their order.
  const std::string in = read_file(folder / "in.ply"), made = read_file(folder / "a.ply");
  const std::size_t stride = 4 * 17, header = in.find("end_header\n") + 11;
  REQUIRE(made.size() - (made.find("end_header\n") + 11) == 6000 * stride);
  for (std::size_t row = 0; row < 6000; ++row) {
    REQUIRE(made.substr(made.size() - (6000 - row) * stride, 12) ==
            in.substr(header + row * stride, 12));
  }
  // And again the same file.
  REQUIRE(run(folder, "a.ply b.ply --views 0").ok);
  CHECK(read_file(folder / "b.ply") == made);
  // In another order it is another image, and the tool says so.
  out = run(folder, "in.ply s.ply --order space" + options);
  CHECK(out.says("where depths are equal, images differ"));
  CHECK(number_behind(out.text, "PSNR ") < 60);
  CHECK(number_behind(out.text, "largest difference ") > 0.1);
  CHECK(number_behind(out.text, "largest difference ") ==
        doctest::Approx(difference("s.ply").largest).epsilon(0.01));
  // Cropping and merging keep the order of those that are left.
  out = run(folder, "in.ply c.ply --crop -0.6 -2 -2 2 2 2" + options);
  CHECK(out.says("equal, bit for bit"));
  REQUIRE(run(folder, "in.ply turned.ply both.ply --views 0").ok);
  const GaussianCloud both =
      io::load_scene((folder / "both.ply").string(), {.sort = false}).value().cloud;
  const GaussianCloud unsorted =
      io::load_scene((folder / "in.ply").string(), {.sort = false}).value().cloud;
  for (std::size_t i = 0; i < 6000; ++i) {
    REQUIRE(both.mean(i) == unsorted.mean(i));
    REQUIRE(both.mean(12000 - 1 - i) == unsorted.mean(i));
  }
}

TEST_CASE("convert: a format that is drawn in another order is judged as it is drawn") {
  const TempFolder folder("convert_order");
  const PlyFile file = rows_on_a_grid(3000, 23);
  write_file(folder / "in.ply", file.text());
  write_file(folder / "c.json", cameras_along_axes());
  // The truth: each file drawn by its own sort order, which glTF's extension says is the distance.
  const auto cameras = io::load_cameras(folder / "c.json", 96, 64).value();
  const auto drawn = [&](const char* name) {
    const GaussianCloud cloud = load(folder, name);
    SerialBackend backend;
    RenderConfig config;
    config.sort_order = cloud.sort_order;
    std::vector<float> rgb;
    BasicRenderer<float, SerialBackend> renderer(backend, config);
    for (const Camera& c : cameras) {
      const auto frame = renderer.render(cloud.set(), c).value();
      rgb.insert(rgb.end(), frame.rgb.begin(), frame.rgb.end());
    }
    return rgb;
  };
  const auto check = [&](const char* from, const char* to) {
    const Outcome out =
        run(folder, std::string(from) + " " + to + " --cameras c.json --width 96 --height 64");
    CAPTURE(out.text);
    REQUIRE(out.ok);
    CHECK(out.says("another order of drawing"));
    const std::vector<float> a = drawn(from), b = drawn(to);
    double squares = 0;
    for (std::size_t i = 0; i < a.size(); ++i)
      squares += std::pow(static_cast<double>(a[i]) - static_cast<double>(b[i]), 2);
    const double psnr = -10 * std::log10(squares / static_cast<double>(a.size()));
    CHECK(psnr < 60);
    CHECK(number_behind(out.text, "PSNR ") == doctest::Approx(psnr).epsilon(0.001));
  };
  check("in.ply", "made.glb");
  check("made.glb", "back.ply");
}

TEST_CASE("convert: every format but the one of chunks keeps the order of the rows") {
  const TempFolder folder("convert_order");
  write_file(folder / "in.ply", rows_on_a_grid(1500, 22).text());
  const GaussianCloud want = io::load_scene((folder / "in.ply").string(), {.sort = false}).value().cloud;
  for (const char* name : {"a.splat", "a.spz", "a.sog", "a.glb", "a.ply"}) {
    CAPTURE(name);
    REQUIRE(run(folder, std::string("in.ply ") + name + " --views 0").ok);
    const GaussianCloud got = io::load_scene((folder / name).string(), {.sort = false}).value().cloud;
    REQUIRE(got.size() == want.size());
    double farthest = 0, colour = 0;
    for (std::size_t i = 0; i < want.size(); ++i) {
      farthest = std::max(farthest, norm(got.mean(i) - want.mean(i)));
      colour = std::max(
          colour, std::fabs(static_cast<double>(got.sh0[3 * i]) - static_cast<double>(want.sh0[3 * i])));
    }
    CHECK(farthest < 1e-3);  // neighbours of the grid are 0.25 m apart
    CHECK(colour < 2);
  }
  const Outcome out = run(folder, "in.ply a.compressed.ply --views 0");
  CHECK(out.says("as the format's chunks need them"));
}

TEST_CASE("convert: what a format's range clips is counted, and errors are not clipped with it") {
  const TempFolder folder("convert_range");
  PlyFile file;
  file.properties = inria_properties(9);
  file.rows = random_rows(400, 9, 23);
  constexpr double kBasis = 0.28209479177387814;
  std::size_t above = 0, far_above = 0, thin = 0, strong = 0;
  for (std::size_t i = 0; i < file.rows.size(); ++i) {
    PlyRow& row = file.rows[i];
    for (const char* name : {"f_dc_0", "f_dc_1", "f_dc_2"}) row[name] = std::tanh(row[name]);
    for (int k = 0; k < 9; ++k)
      row["f_rest_" + std::to_string(k)] = 0.5 * std::tanh(row["f_rest_" + std::to_string(k)]);
    for (const char* name : {"scale_0", "scale_1", "scale_2"}) row[name] = -4;
    row["opacity"] = 1;
    if (i % 4 == 0) ++above, row["f_dc_1"] = (3.07 - 0.5) / kBasis;  // a drawn colour of 3.07
    if (i % 4 == 0) ++far_above;                                     // beyond SPZ's 0.5 +- 0.94 as well
    if (i % 5 == 0) ++thin, row["scale_2"] = -13;
    if (i % 8 == 1) ++strong, row["f_rest_4"] = 1.75;
  }
  write_file(folder / "in.ply", file.text());
  Outcome out = run(folder, "in.ply a.splat --views 0");
  CAPTURE(out.text);
  REQUIRE(out.ok);
  CHECK(number_behind(out.text, "colour ") == doctest::Approx(2.07).epsilon(0.01));
  CHECK(out.says((std::to_string(above) + " colours outside of the format's range").c_str()));
  CHECK(out.says((std::to_string(9 * 400) + " SH coefficients lost").c_str()));
  CHECK_FALSE(out.says("scales outside"));
  out = run(folder, "in.ply a.spz --views 0");
  CAPTURE(out.text);
  REQUIRE(out.ok);
  CHECK(number_behind(out.text, "colour ") == doctest::Approx(3.07 - 0.5 - kBasis / 0.3).epsilon(0.01));
  CHECK(number_behind(out.text.substr(out.text.find("largest")), ", SH ") ==
        doctest::Approx(0.755).epsilon(0.01));
  CHECK(number_behind(out.text, "scale ") == doctest::Approx(100 * (std::exp(3) - 1)).epsilon(0.01));
  CHECK(out.says((std::to_string(far_above) + " colours outside of the format's range").c_str()));
  CHECK(out.says((std::to_string(thin) + " scales outside of the format's range").c_str()));
  CHECK(out.says((std::to_string(strong) + " SH coefficients outside of the format's range").c_str()));
  out = run(folder, "in.ply a.ply --views 0");
  CHECK_FALSE(out.says("outside"));
  CHECK_FALSE(out.says("lost"));
}

TEST_CASE("convert: a full disk and kill -9 leave the input that is written over") {
  const TempFolder folder("convert_full");
  {
    std::filesystem::create_directory(folder / "disk");
    const SmallDisk disk(folder / "disk", 700);
    if (disk.mounted()) {
      // 472 KB in place: the new file needs as much again.
      REQUIRE(io::save_ply(folder / "disk/in.ply", cloud_of_random_rows(2000, 3, 24)).ok());
      const std::string before = read_file(folder / "disk/in.ply");
      const Outcome out = run(folder, "disk/in.ply disk/in.ply --scale 2 --views 0");
      CAPTURE(out.text);
      CHECK_FALSE(out.ok);
      CHECK(out.says("disk/in.ply: cannot be written: No space left on device"));
      CHECK(read_file(folder / "disk/in.ply") == before);
      CHECK(std::distance(std::filesystem::directory_iterator(folder / "disk"), {}) == 1);
    }
  }
  const std::string path = (folder / "in.ply").string();
  REQUIRE(io::save_ply(path, cloud_of_random_rows(2000, 3, 24)).ok());
  const std::string before = read_file(path);
  for (int trial = 0; trial < 12; ++trial) {
    Process tool({GSNAV_CONVERT, path, path, "--views", "0"}, folder.path());
    ::usleep(static_cast<unsigned>(4000 * trial));
    tool.signal(SIGKILL);
    tool.wait(60);
    CHECK(read_file(path) == before);  // PLY to PLY gives the same bytes, before or after
  }
}

TEST_CASE(
    "convert: control characters of a file name do not reach the terminal by way of an option's error") {
  const TempFolder folder("convert_control");
  const Outcome out = run(folder, "a.ply b.ply --views \"$(printf 'x\\033[31m')\"");
  CAPTURE(out.text);
  CHECK_FALSE(out.ok);
  CHECK(out.text.find('\x1b') == std::string::npos);
  CHECK(out.says("\\x1B[31m"));
}

TEST_CASE("convert: a name that cannot be written is said before anything is read") {
  const TempFolder folder("convert_early");
  const auto says = [&](const std::string& arguments, const char* part) {
    const Outcome out = run(folder, arguments);
    CAPTURE(out.text);
    CHECK_FALSE(out.ok);
    CHECK(out.says(part));
    CHECK_FALSE(out.says("absent.ply"));
  };
  says("absent.ply out.txt", "out.txt: unknown kind of file to write");
  says("absent.ply none/out.ply", "none does not exist");
  says("absent.ply out.ply --bogus", "there is no option --bogus\n");
  std::filesystem::create_directory(folder / "folder.ply");
  says("absent.ply folder.ply", "it is a folder");
}

TEST_CASE("convert: edits, in their order") {
  const TempFolder folder("convert_edit");
  REQUIRE(io::save_ply(folder / "in.ply", cloud_of_random_rows(500, 3, 4)).ok());
  const GaussianCloud source = load(folder, "in.ply");
  const Outcome out =
      run(folder,
          "in.ply a.ply --views 0 --crop -5 -5 -20 5 5 20 --min-opacity 0.3 --max-scale 0.05 --sh 2 "
          "--rotate 0 0 -1 90 --scale 2 --translate -1 -2 30");
  CAPTURE(out.text);
  REQUIRE(out.ok);
  GaussianCloud want = source;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < source.size(); ++i) {
    const Vec3d m = source.mean(i);
    bool keep = std::fabs(m.x) <= 5 && std::fabs(m.y) <= 5 && source.opacities[i] >= 0.3f;
    for (const auto& axis : source.scales) keep = keep && axis[i] <= 0.05f;
    if (!keep) continue;
    // One Gaussian of the source at its place: a quarter turn takes (x, y) to (y, -x).
    const Vec3d moved{2 * m.y - 1, -2 * m.x - 2, 2 * m.z + 30};
    const GaussianCloud made = load(folder, "a.ply");
    std::size_t found = made.size();
    for (std::size_t k = 0; k < made.size(); ++k) {
      if (norm(made.mean(k) - moved) < 1e-4) found = k;
    }
    REQUIRE(found < made.size());
    CHECK(made.sh_degree == 2);
    CHECK(made.opacities[found] == doctest::Approx(source.opacities[i]).epsilon(1e-6));
    const Vec3d d{0.6, -0.48, 0.64}, turned{d.y, -d.x, d.z};
    GaussianCloud low = source;
    limit_sh_degree(low, 2);
    CHECK(norm(colour_of(made, found, turned) - colour_of(low, i, d)) < 1e-5);
    if (++kept == 20) break;
  }
  CHECK(kept == 20);
}

TEST_CASE("convert: the axis that is said to be up points to +Y afterwards") {
  const TempFolder folder("convert_up");
  REQUIRE(io::save_ply(folder / "in.ply", cloud_of_random_rows(40, 0, 4)).ok());
  const GaussianCloud source = load(folder, "in.ply");
  const Outcome out = run(folder, "in.ply a.ply --views 0 --up -z");
  CAPTURE(out.text);
  REQUIRE(out.ok);
  const GaussianCloud made = load(folder, "a.ply");
  for (std::size_t i = 0; i < source.size(); ++i) {
    const Vec3d m = source.mean(i), turned{m.x, -m.z, m.y};
    double nearest = 1e9;
    for (std::size_t k = 0; k < made.size(); ++k)
      nearest = std::min(nearest, norm(made.mean(k) - turned));
    CHECK(nearest < 1e-4);
  }
  CHECK_FALSE(run(folder, "in.ply a.ply --up w").ok);
  // The box is in the axes that --up gives, as in all programs; --scene names an input.
  REQUIRE(run(folder, "--scene in.ply b.ply --views 0 --up -z --crop -100 0 -100 100 100 100").ok);
  const GaussianCloud above = load(folder, "b.ply");
  std::size_t want = 0;
  for (std::size_t i = 0; i < source.size(); ++i) want += source.mean(i).z <= 0 ? 1 : 0;
  CHECK(above.size() == want);
  REQUIRE(want > 0);
  REQUIRE(want < source.size());
  const Outcome same = run(folder, "b.ply b.ply --views 0");
  CHECK(same.says("b.ply: replaces the input"));
}

TEST_CASE("convert: what was read, dropped and repaired is said line by line") {
  const TempFolder folder("convert_report");
  PlyFile file;
  file.properties = inria_properties(45);
  const PlyRow good = {
      {"opacity", 1.0}, {"scale_0", -4.0}, {"scale_1", -4.5}, {"scale_2", -5.0}, {"rot_0", 1.0}};
  const auto add = [&](int n, const PlyRow& changed) {
    for (int i = 0; i < n; ++i) {
      PlyRow row = good;
      for (const auto& [name, value] : changed) row[name] = value;
      file.rows.push_back(row);
    }
  };
  add(1, {{"x", -1}, {"y", -2}, {"z", -3}});
  add(1, {{"x", 4}, {"y", 5}, {"z", 6}});
  add(11, {{"f_rest_2", 0.25}});  // of the first band, all that is in use
  add(5, {{"scale_1", 30}});      // more than any scene has: e^20 m at most
  add(2, {{"y", std::nan("")}});
  add(1, {{"x", HUGE_VAL}, {"f_dc_1", std::nan("")}});
  add(4, {{"rot_0", 0}});
  add(6, {{"opacity", -5.6}});  // 1 / (1 + e^5.6) = 0.0037 < 1/255
  write_file(folder / "in.ply", file.text());
  const Outcome out = run(folder, "in.ply out.ply --views 0");
  CAPTURE(out.text);
  REQUIRE(out.ok);
  std::istringstream printed(out.text);
  const char* const wanted[] = {"in.ply: 18 Gaussians of 31 rows, SH degree 3 (1 in use), 0.0 MB",
                                "  3 dropped: a value that is not finite",
                                "  4 dropped: a zero quaternion",
                                "  6 left out: opacity below 1/255, never visible",
                                "  5 repaired: log-scale clamped to [-20, 20]",
                                "  means from (-1, -2, -3) to (4, 5, 6) m",
                                "  up: -y, the usual axis of such files",
                                "  filter classic, eps2d 0.3, sorted by depth"};
  std::string line;
  for (const char* want : wanted) {
    REQUIRE(std::getline(printed, line));
    CHECK(line == want);
  }
  REQUIRE(std::getline(printed, line));
  CHECK(line.rfind("out.ply: 18 Gaussians of SH degree 3, ", 0) == 0);
  REQUIRE(std::getline(printed, line));
  CHECK(line.rfind("  largest errors: mean ", 0) == 0);
  CHECK_FALSE(std::getline(printed, line));
}

TEST_CASE("convert: tiles are merged, levels chosen") {
  const TempFolder folder("convert_merge");
  REQUIRE(io::save_ply(folder / "a.ply", cloud_of_random_rows(30, 3, 5)).ok());
  REQUIRE(io::save_ply(folder / "b.ply", cloud_of_random_rows(50, 3, 6)).ok());
  REQUIRE(run(folder, "a.ply b.ply out.ply --views 0").ok);
  CHECK(load(folder, "out.ply").size() == 80);
}

TEST_CASE("convert: a SOG folder written again has no bands left of the scene before") {
  const TempFolder folder("convert_again");
  REQUIRE(io::save_ply(folder / "in.ply", cloud_of_random_rows(60, 3, 9)).ok());
  std::filesystem::create_directory(folder / "room");
  REQUIRE(run(folder, "in.ply room/meta.json --views 0").ok);
  CHECK(std::filesystem::exists(folder / "room/shN_labels.webp"));
  REQUIRE(run(folder, "room room/meta.json --sh 0 --views 0").ok);
  CHECK_FALSE(std::filesystem::exists(folder / "room/shN_labels.webp"));
  CHECK_FALSE(std::filesystem::exists(folder / "room/shN_centroids.webp"));
  CHECK(load(folder, "room").sh_degree == 0);
}

TEST_CASE("convert: an input is any scene's name") {
  const TempFolder folder("convert_names");
  REQUIRE(io::save_ply(folder / "room.ply", cloud_of_random_rows(30, 3, 5)).ok());
  write_file(folder / "room.stage_config.json", R"({"render_asset":"room.ply"})");
  write_file(folder / "set.scene_dataset_config.json",
             R"({"stages":{"paths":{".json":["*.stage_config.json"]}}})");
  for (const char* name : {"room.ply", "room.stage_config.json", "set.scene_dataset_config.json#room"}) {
    CAPTURE(name);
    const Outcome out = run(folder, std::string(name) + " out.ply --views 0");
    INFO(out.text);
    REQUIRE(out.ok);
    const GaussianCloud made = load(folder, "out.ply");
    CHECK(made.size() == 30);
    CHECK(made.sh_degree == 3);
  }
  const Outcome out = run(folder, "default out.ply --density 0.1 --views 0");
  INFO(out.text);
  REQUIRE(out.ok);
  CHECK(load(folder, "out.ply").size() == make_default_scene(0.1)->cloud.size());
  write_file(folder / "floor.obj", "v 0 0 0\nv 0 0 4\nv 4 0 4\nf 1 2 3\n");
  const Outcome none = run(folder, "floor.obj out.ply");
  CHECK_FALSE(none.ok);
  CHECK(none.says("floor.obj: has no Gaussians"));
}

TEST_CASE("convert: what cannot be done is said") {
  const TempFolder folder("convert_bad");
  REQUIRE(io::save_ply(folder / "a.ply", cloud_of_random_rows(10, 3, 7)).ok());
  const auto says = [&](const std::string& arguments, const std::string& part) {
    const Outcome out = run(folder, arguments);
    CAPTURE(out.text);
    CHECK(!out.ok);
    CHECK(out.text.find(part) != std::string::npos);
  };
  says("none.ply out.ply", "none.ply");
  says("a.ply out.txt", "unknown kind of file to write");
  says("a.ply none/out.ply", "none does not exist");
  says("a.ply out.ply --crop 100 100 100 101 101 101", "no Gaussian is left");
  says("a.ply out.ply --rotate 0 0 0 90", "the axis is zero");
  says("a.ply out.ply --cameras none.json", "none.json");
  says("a.ply", "IN... OUT: an input and an output are needed");
  says("a.ply out.ply --avatars 3", "--avatars: scene files hold no people");
  says("a.ply out.ply --navmesh auto", "--navmesh: scene files hold no NavMesh");
  // In place: nothing is written before all is known to be right.
  const std::string before = read_file(folder / "a.ply");
  for (const char* edit : {"--scale nan", "--translate nan 0 0", "--rotate 0 0 1 inf",
                           "--rotate nan 0 0 3", "--max-scale nan", "--max-scale -1",
                           "--min-opacity nan", "--scale 1e40", "--translate 1e39 0 0"}) {
    const std::string option(edit, std::string(edit).find(' '));
    CAPTURE(edit);
    says(std::string("a.ply a.ply ") + edit, option);
    CHECK(read_file(folder / "a.ply") == before);
  }
}

TEST_CASE("largest_field_errors: each field by itself") {
  const GaussianCloud source = cloud_of_random_rows(50, 3, 8);
  const auto errors = [&](const auto& change) {
    GaussianCloud made = source;
    change(made);
    const auto rows = rows_as_read(source);
    return gsnav_convert::largest_field_errors(source, rows, made, rows);
  };
  const auto none = errors([](GaussianCloud&) {});
  CHECK(none.mean == 0);
  CHECK(none.bands == 0);
  CHECK(none.rotation < 1e-6);
  CHECK(errors([](GaussianCloud& c) { c.means[1][7] += 0.25f; }).mean ==
        doctest::Approx(0.25).epsilon(1e-5));
  CHECK(errors([](GaussianCloud& c) { c.scales[2][3] *= 1.5f; }).scale ==
        doctest::Approx(0.5).epsilon(1e-5));
  CHECK(errors([](GaussianCloud& c) { c.opacities[3] *= 0.5f; }).opacity ==
        doctest::Approx(static_cast<double>(source.opacities[3]) / 2));
  CHECK(errors([](GaussianCloud& c) { c.shN[100] += 0.125f; }).bands ==
        doctest::Approx(0.125).epsilon(1e-5));
  CHECK(errors([](GaussianCloud& c) { limit_sh_degree(c, 0); }).bands > 0.3);
  // A turn by 0.02 rad about z, and the same quaternion with the other sign.
  const auto turned = errors([](GaussianCloud& c) {
    const Quatd q{static_cast<double>(c.quats[0][5]), static_cast<double>(c.quats[1][5]),
                  static_cast<double>(c.quats[2][5]), static_cast<double>(c.quats[3][5])};
    const Quatd t = q * Quatd{std::cos(0.01), 0, 0, std::sin(0.01)};
    c.quats[0][5] = -static_cast<float>(t.w);
    c.quats[1][5] = -static_cast<float>(t.x);
    c.quats[2][5] = -static_cast<float>(t.y);
    c.quats[3][5] = -static_cast<float>(t.z);
  });
  CHECK(turned.rotation == doctest::Approx(0.02).epsilon(1e-4));
}
