// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cstdlib>
#include <sstream>

#include "check_cloud.hpp"
#include "gsnav/detail/io/ply.hpp"
#include "gsnav/io/scene_file.hpp"
#include "real_scenes.hpp"
#include "row_clouds.hpp"

// Another program's eyes on the same files: npm's @playcanvas/splat-transform decodes them to a float32
// PLY, whose rows are read here without the library's help. GSNAV_SPLAT_TRANSFORM names its cli.mjs.

using namespace gsnav;
using namespace gsnav_test;

namespace {

bool there() {
  if (std::string(GSNAV_SPLAT_TRANSFORM).empty()) {
    std::printf("SKIP: GSNAV_SPLAT_TRANSFORM names no splat-transform\n");
    return false;
  }
  return true;
}

/// Runs `splat-transform -q -w [options] from to`.
void convert(const std::string& from, const std::string& to, const std::string& options = {}) {
  std::string command = "node \"" GSNAV_SPLAT_TRANSFORM "\" -q -w " + options;
  command += " \"" + from + "\" \"" + to + "\" > \"" + to + ".log\" 2>&1";
  CAPTURE(command);
  REQUIRE(std::system(command.c_str()) == 0);
}

/// A binary PLY of floats.
struct Rows {
  std::vector<std::string> names;
  std::vector<float> values;  ///< [N][names]
  std::size_t size() const { return values.size() / names.size(); }
  double at(std::size_t row, const std::string& name) const {
    const auto column = std::find(names.begin(), names.end(), name) - names.begin();
    REQUIRE(column < static_cast<std::ptrdiff_t>(names.size()));
    return static_cast<double>(values[row * names.size() + static_cast<std::size_t>(column)]);
  }
};

Rows rows_of(const std::string& path) {
  const std::string text = read_file(path);
  const std::string end = "end_header\n";
  const std::size_t body = text.find(end) + end.size();
  std::istringstream header(text.substr(0, body));
  Rows rows;
  std::size_t count = 0;
  for (std::string word; header >> word;) {
    if (word == "vertex") header >> count;
    if (word == "property") {
      std::string type, name;
      header >> type >> name;
      REQUIRE(type == "float");
      rows.names.push_back(name);
    }
  }
  REQUIRE(text.size() - body == 4 * count * rows.names.size());
  rows.values.resize(count * rows.names.size());
  std::memcpy(rows.values.data(), text.data() + body, text.size() - body);
  return rows;
}

double opacity_of(const Rows& rows, std::size_t row) {
  return 1 / (1 + std::exp(-rows.at(row, "opacity")));
}

/// The first field in which Gaussian i is not the row within float32's rounding of both programs, with
/// both values; empty where it is.
std::string difference(const GaussianCloud& c, std::size_t i, const Rows& rows, std::size_t row,
                       double rotation) {
  std::string out;
  const auto check = [&out](const std::string& field, double got, double want, double bound) {
    if (out.empty() && !(std::fabs(got - want) <= bound)) {
      out = field + ": " + std::to_string(got) + ", expected " + std::to_string(want);
    }
  };
  check("opacity", static_cast<double>(c.opacities[i]), opacity_of(rows, row), 2e-6);
  const Vec3d mean = c.mean(i);
  const char* axes[] = {"x", "y", "z"};
  for (std::size_t k = 0; k < 3; ++k) {
    const double want = rows.at(row, axes[k]);
    check(axes[k], mean[static_cast<int>(k)], want, 2e-6 * (1 + std::fabs(want)));
    const std::string scale = "scale_" + std::to_string(k), colour = "f_dc_" + std::to_string(k);
    const double size = std::exp(std::clamp(rows.at(row, scale), -20.0, 20.0));  // as loaders here do
    check(scale, static_cast<double>(c.scales[k][i]), size, 2e-5 * size + 1e-9);
    check(colour, static_cast<double>(c.sh0[3 * i + k]), rows.at(row, colour), 2e-5);
  }
  double dot = 0, sum = 0;
  for (std::size_t k = 0; k < 4; ++k) {
    const double q = rows.at(row, "rot_" + std::to_string(k));
    sum += q * q;
    dot += q * static_cast<double>(c.quats[k][i]);
  }
  check("rotation", std::fabs(dot) / std::sqrt(sum), 1, rotation);
  const std::size_t n = c.shN.size() / c.size();
  for (std::size_t k = 0; k < n; ++k) {
    const std::string name = "f_rest_" + std::to_string(k % 3 * (n / 3) + k / 3);
    check(name, static_cast<double>(c.shN[i * n + k]), rows.at(row, name), 2e-5);
  }
  return out;
}

/// Walks both: a row that can never be drawn is not in the cloud; at the threshold either is right.
void check_same(const GaussianCloud& cloud, const Rows& rows, double rotation = 1e-6) {
  std::size_t i = 0;
  for (std::size_t row = 0; row < rows.size(); ++row) {
    const std::string wrong = i < cloud.size() ? difference(cloud, i, rows, row, rotation) : "not there";
    if (wrong.empty()) ++i;
    if (wrong.empty() || opacity_of(rows, row) * 255 < 1 + 1e-4) continue;
    CAPTURE(row);
    REQUIRE(wrong == "");
  }
  CHECK(i == cloud.size());
  CHECK(cloud.size() > 0);
}

GaussianCloud load_in_order(const std::string& path) {
  return io::load_scene(path, {.sort = false}).value().cloud;
}

}  // namespace

TEST_CASE("splat-transform: every real file, field by field") {
  if (!there()) return;
  TempFolder folder("st_real");
  for (const std::string& path : real_scenes()) {
    if (path.ends_with("lod-meta.json")) continue;  // its levels' files are there by themselves
    CAPTURE(path);
    convert(path, (folder / "out.ply").string());
    check_same(load_in_order(path), rows_of((folder / "out.ply").string()));
  }
}

TEST_CASE("splat-transform: reads what is written here as it is read here") {
  if (!there()) return;
  TempFolder folder("st_written");
  for (const int degree : {0, 2, 3}) {
    const GaussianCloud cloud = cloud_of_random_rows(3000, degree, 92);
    for (const std::string name :
         {"a.ply", "a.compressed.ply", "a.splat", "a.spz", "a.sog", "meta.json"}) {
      CAPTURE(degree);
      CAPTURE(name);
      const std::string path = (folder / name).string();
      REQUIRE(io::save_scene(path, cloud).ok());
      convert(path, (folder / "out.ply").string());
      const GaussianCloud read = load_in_order(path);
      CHECK(read.size() == cloud.size());
      // It takes a .splat's quaternion bytes for fractions of 255 around 127.5, not of 128 around 128.
      check_same(read, rows_of((folder / "out.ply").string()), name == "a.splat" ? 1e-4 : 1e-6);
    }
  }
}

TEST_CASE("splat-transform: what it writes is read here") {
  if (!there()) return;
  TempFolder folder("st_writes");
  for (const int degree : {0, 1, 2, 3}) {
    CAPTURE(degree);
    REQUIRE(io::save_ply(folder / "in.ply", cloud_of_random_rows(2000, degree, 93)).ok());
    const std::string in = (folder / "in.ply").string();
    convert(in, (folder / "a.glb").string());
    check_same(load_in_order((folder / "a.glb").string()), rows_of(in));
    for (const char* version : {"3", "4"}) {
      CAPTURE(version);
      const std::string spz = (folder / "a.spz").string(), back = (folder / "back.ply").string();
      convert(in, spz, std::string("--spz-version ") + version);
      convert(spz, back);
      check_same(load_in_order(spz), rows_of(back));
    }
    const std::string packed = (folder / "a.compressed.ply").string(),
                      back = (folder / "back.ply").string();
    convert(in, packed);
    convert(packed, back);
    check_same(load_in_order(packed), rows_of(back));
  }
}
