// SPDX-License-Identifier: Apache-2.0
// The program as people run it.
#include <doctest/doctest.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "csv.hpp"
#include "gsnav/backends/openmp.hpp"
#include "gsnav/detail/io/cameras_file.hpp"
#include "gsnav/detail/io/ply.hpp"
#include "gsnav/detail/io/visible_file.hpp"
#include "gsnav/io/scene_file.hpp"
#include "gsnav/scene/visible_sets.hpp"
#include "lod/two_rooms.hpp"
#include "support/command.hpp"
#include "support/files.hpp"
#include "support/scenes.hpp"

using namespace gsnav;
using namespace gsnav_report;
using namespace gsnav_test;

namespace {

Outcome run(const TempFolder& folder, const std::string& arguments) {
  return run_command(GSNAV_REPORT, arguments, folder.path());
}

/// Writes a small cloud and three cameras in front of it; returns the --scene option.
std::string tiny_scene(const TempFolder& folder) {
  const GaussianCloud cloud = random_cloud(3, {.count = 300, .sh_degree = 1});
  io::save_ply(folder / "tiny.ply", cloud).throw_if_error();
  std::vector<Camera> cameras;
  for (const double x : {-0.5, 0.0, 0.5}) {
    cameras.push_back(Camera::look_at({x, 0, 0}, {0, 0, 4}, {0, -1, 0}, 48, 32, 70));
  }
  io::save_cameras(folder / "cameras.json", cameras).throw_if_error();
  return "--scene tiny=\"" + (folder / "tiny.ply").string() + ":" + (folder / "cameras.json").string() +
         "\"";
}

}  // namespace

TEST_CASE("report: errors name the option and the value") {
  const TempFolder folder("report_errors");
  struct Case {
    std::string arguments;
    std::vector<const char*> parts;
  };
  const Case cases[] = {
      {"", {"--scene", "--default"}},
      {"--default --sizes 64", {"--sizes", "64", "WIDTHxHEIGHT"}},
      {"--default --sizes 0x64", {"--sizes", "0x64"}},
      {"--default --knob-size huge", {"--knob-size", "huge"}},
      {"--default --profiles faster", {"--profiles", "faster"}},
      {"--default --oracles truth", {"--oracles", "truth"}},
      {"--default --runs 0", {"--runs", "0"}},
      {"--scene =x", {"--scene", "=x", "[NAME=]SCENE"}},
      {"nonsense", {"nonsense"}},
      {"--scene a=/none.ply", {"/none.ply"}},
      {"--default --avatars 3", {"--avatars", "without people"}},
      {"--default --profile lod", {"--profile", "see --profiles"}},
      {"--flat /none.ply", {"--flat", "/none.ply"}},
      {"--default --visible-sets a", {"--visible-sets", "[SCENE=]FILE", "embedded_flat"}},
      {"--default --visible-sets b=/none.vis", {"--visible-sets", "b=/none.vis", "embedded_flat"}},
      {"--default --visible-sets embedded_flat=/none.vis", {"--visible-sets", "/none.vis"}},
      {"--kinds kernel --benchmarks /none.json", {"--benchmarks", "/none.json"}}};
  for (const Case& c : cases) {
    CAPTURE(c.arguments);
    const Outcome o = run(folder, c.arguments + " --out \"" + (folder / "out").string() + "\"");
    CAPTURE(o.text);
    CHECK_FALSE(o.ok);
    for (const char* part : c.parts) CHECK(o.text.find(part) != std::string::npos);
  }
  const Outcome help = run(folder, "--help");
  CHECK(help.ok);
  for (const char* option : {"--scene", "--sizes", "--resume", "--cache", "--docs"}) {
    CHECK(help.text.find(option) != std::string::npos);
  }
}

TEST_CASE("report: a tiny scene from nothing, again from the cache, and resumed") {
  const TempFolder folder("report_smoke");
  const std::string out = (folder / "out").string();
  const std::string arguments =
      tiny_scene(folder) + " --views 2 --sizes 48x32 --knob-size 48x32 --runs 1 --kinds " +
      "render,ledger --knobs response,storage --threads 2 --commit c1 --acceptance --out \"" + out +
      "\"";
  Outcome first = run(folder, arguments);
  CAPTURE(first.text);
  REQUIRE(first.ok);
  const std::string csv = read_file(folder / "out/report.csv");
  const std::vector<Row> rows = parse_csv(csv, "report.csv").value();
  int exact = 0, knobs = 0;
  bool picture = false;
  for (const Row& row : rows) {
    if (row.get("kind") != "render") continue;
    knobs += row.get("knob") != "none";
    picture = picture || std::filesystem::exists(folder / ("out/" + row.get("image")));
    CHECK(*row.number("time_p50_ms") > 0);
    CHECK(*row.number("bytes") > 0);
    CHECK(*row.number("row_bytes") == (row.get("sensor") == "depth" ? 44 : 92));
    if (row.get("knob") == "none") {
      CHECK(*row.number("emitting") > 0);
      CHECK(*row.number("touched") >= *row.number("emitting"));
      CHECK(*row.number("gaussians") >= *row.number("touched"));
    }
    if (row.get("knob_value") == "packed") {
      CHECK(*row.number("band_bytes") == 9 * *row.number("gaussians"));
      CHECK(*row.number("cloud_bytes") - *row.number("band_bytes") < 40 * *row.number("gaussians"));
    }
    if (row.get("profile") != "exact" || row.get("knob") != "none" || row.get("oracle") != "contract")
      continue;
    ++exact;
    CAPTURE(row.line());
    CHECK(*row.number("excluded") <= 1e-3);  // of so few pixels one may lie on an edge
    if (row.get("sensor") != "depth") {
      CHECK(*row.number("rgb_max") <= 1.0 / 510);
      CHECK(*row.number("rgb_p999") <= 1e-4);
      CHECK(*row.number("rgb_psnr") >= 85);
      CHECK(*row.number("ssim") > 0.99999);
    }
    if (row.get("sensor") != "rgb") {
      CHECK(*row.number("depth_p99") <= 1e-4);
      CHECK(*row.number("depth_max") <= 1e-3);
    }
  }
  CHECK(exact == 2 * (3 + 1));  // views x (openmp by sensor, serial)
  CHECK(knobs == 2 * (3 * 3 + 14));
  CHECK(picture);
  for (const char* target : {"culling: Gaussians touched", "depth alone: times faster",
                             "depth alone: fewer bytes", "packed: bytes per Gaussian"}) {
    CAPTURE(target);
    CHECK(first.text.find(std::string("tiny, 48x32, openmp: ") + target) != std::string::npos);
  }
  CHECK(std::filesystem::exists(folder / "out/report.html"));

  // Resumed: nothing is left to do. Cut short: only what is missing is made.
  REQUIRE(run(folder, arguments + " --resume").ok);
  CHECK(read_file(folder / "out/report.csv") == csv);
  write_file(folder / "out/report.csv", csv.substr(0, csv.size() / 2));
  REQUIRE(run(folder, arguments + " --resume").ok);
  CHECK(parse_csv(read_file(folder / "out/report.csv"), "report.csv").value().size() == rows.size());

  // A damaged reference is rendered again, with a warning.
  for (const auto& entry : std::filesystem::directory_iterator(folder / "out/references")) {
    std::string bytes = read_file(entry.path());
    bytes.back() = static_cast<char>(bytes.back() ^ 1);
    write_file(entry.path(), bytes);
  }
  const Outcome repaired = run(folder, arguments);
  CHECK(repaired.ok);
  CHECK(repaired.text.find("checksum") != std::string::npos);
  CHECK(parse_csv(read_file(folder / "out/report.csv"), "report.csv").value().size() == rows.size());
}

TEST_CASE("report: visible sets are rows beside fast, and say where no set serves") {
  const TempFolder folder("report_visible");
  const std::filesystem::path ply = folder / "rooms.ply", cameras = folder / "cameras.json",
                              sets = folder / "rooms.vis";
  io::save_ply(ply, two_rooms(1)).throw_if_error();
  const GaussianCloud cloud = io::load_scene(ply.string()).value().cloud;
  VisibleSettings settings;
  settings.face = 64;
  OpenMPBackend backend(2);
  const VisibleSets seen = build_visible_sets(backend, cloud, places_in_rooms(), settings).value();
  io::save_visible_sets(sets, seen, cloud).throw_if_error();
  std::vector<Camera> from;
  for (const double x : {-1.8, 1.6})
    from.push_back(Camera::look_at({x, 1.3, 0.1}, {-x, 1.2, 0.2}, {0, 1, 0}, 48, 32, 90));
  io::save_cameras(cameras, from).throw_if_error();
  const std::string arguments =
      "--scene rooms=\"" + ply.string() + ":" + cameras.string() + "\" --visible-sets \"" +
      sets.string() + "\" --views 2 --sizes 48x32,96x64 --runs 1 --kinds render --knobs none " +
      "--profiles fast --sensors rgbd --backends openmp --oracles contract --no-html --out \"" +
      (folder / "out").string() + "\"";
  const Outcome made = run(folder, arguments);
  CAPTURE(made.text);
  REQUIRE(made.ok);
  const std::vector<Row> rows = parse_csv(read_file(folder / "out/report.csv"), "report.csv").value();
  REQUIRE(rows.size() == 2 * 2 * 2);  // sizes x views x (fast, visible)
  for (const Row& row : rows) {
    if (row.get("profile") != "visible") continue;
    CAPTURE(row.line());
    const auto fast = std::find_if(rows.begin(), rows.end(), [&](const Row& r) {
      return r.get("profile") == "fast" && r.get("view") == row.get("view") &&
             r.get("width") == row.get("width");
    });
    REQUIRE(fast != rows.end());
    const bool served = row.get("width") == "48";
    CHECK((row.get("note").find("no visible set") == std::string::npos) == served);
    CHECK(*row.number("rgb_psnr") >= 65);
    CHECK(*row.number("cloud_bytes") ==
          *fast->number("cloud_bytes") + static_cast<double>(seen.bytes()));
    if (served) {
      CHECK(*row.number("touched") < 0.7 * *fast->number("touched"));  // the other room is not
    } else {
      CHECK(row.get("rgb_psnr") == fast->get("rgb_psnr"));
    }
  }
}
