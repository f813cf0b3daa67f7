// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cstddef>
#include <string>

#include "check_cloud.hpp"
#include "gsnav/io/scene_file.hpp"
#include "sog_file.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

PlyFile ply_of(std::size_t n, int rest, unsigned seed) {
  PlyFile file;
  file.properties = inria_properties(rest);
  file.rows = random_rows(n, rest, seed);
  return file;
}

void check_scene_fails(const std::string& spec, Errc code, const std::string& part) {
  const auto result = io::load_scene(spec);
  CAPTURE(spec);
  CAPTURE(result.message());
  CHECK(result.code() == code);
  CHECK(contains(result.message(), part));
}

}  // namespace

TEST_CASE("scene: every kind of path") {
  TempFolder folder("scene");
  const PlyFile ply = ply_of(4, 9, 3);
  for (const char* name : {"a.ply", "b.PLY", "c.gs.ply", "one,two.ply"}) {
    write_file(folder / name, ply.text());
    CHECK(io::load_scene((folder / name).string()).value().cloud.size() == 4);
  }
  SogFile sog(1);
  sog.make_files();
  sog.write_folder(folder / "set");
  write_file(folder / "d.sog", sog.bundle(false));
  for (const char* name : {"set", "set/", "set/meta.json", "d.sog"}) {
    CAPTURE(name);
    CHECK(io::load_scene(folder.path().string() + "/" + name).value().cloud.size() == 13);
  }
}

TEST_CASE("scene: SH bands of zeros alone are not held, and how many bytes that is is reported") {
  TempFolder folder("bands");
  PlyFile file = ply_of(50, 45, 7);
  for (auto& row : file.rows) {
    for (int channel = 0; channel < 3; ++channel) {
      for (int k = 3; k < 15; ++k)
        row["f_rest_" + std::to_string(15 * channel + k)] = k == 3 ? -0.0 : 0.0;
    }
  }
  write_file(folder / "a.ply", file.text());
  const std::string path = (folder / "a.ply").string();
  const LoadedCloud all = io::load_scene(path, {.keep_zero_bands = true}).value();
  CHECK(all.cloud.sh_degree == 3);
  CHECK(all.report.sh_bytes_let_go == 0);
  const std::size_t n = all.cloud.size();
  for (const io::Storage storage : {io::Storage::full, io::Storage::compact}) {
    const LoadedCloud some = io::load_scene(path, {.storage = storage, .most_sh_error = 1e9}).value();
    CHECK(some.cloud.sh_degree == 1);
    CHECK(some.report.sh_degree == 3);
    CHECK(some.report.sh_degree_used == 1);
    CHECK(some.cloud.shN.size() + some.cloud.shN_half.size() == 9 * n);
    CHECK(some.report.sh_bytes_let_go == 36 * 4 * n);
    CHECK(some.report.memory == some.cloud.bytes());
    CHECK(contains(io::report_text(some.report), std::to_string(36 * 4 * n) + " bytes"));
    if (storage == io::Storage::compact) continue;
    for (std::size_t k = 0; k < 9 * n; ++k)
      CHECK(some.cloud.shN[k] == all.cloud.shN[45 * (k / 9) + k % 9]);
  }
  CHECK(io::load_packed_scene(path).value().cloud.rest.sh_degree == 1);
}

TEST_CASE("scene: a comma list merges siblings and sums their reports") {
  TempFolder folder("tiles");
  PlyFile a = ply_of(5, 0, 1), b = ply_of(6, 45, 2), c = ply_of(7, 9, 3);
  b.rows[2]["x"] = 5000;  // away from the first lattice point
  a.rows[4]["y"] = std::numeric_limits<double>::quiet_NaN();
  c.after_rows = "stray";
  write_file(folder / "a.ply", a.text());
  write_file(folder / "b.ply", b.text());
  write_file(folder / "c.ply", c.text());
  const std::string spec = (folder / "a.ply").string() + ",b.ply,c.ply";
  const LoadedCloud scene = io::load_scene(spec).value();
  check_consistent(scene);
  CHECK(scene.report.source == spec);
  CHECK(scene.report.read == 18);
  CHECK(scene.report.dropped_non_finite == 1);
  CHECK(scene.report.sh_degree == 3);
  CHECK(scene.report.bounds.high.x == 5000);
  REQUIRE(scene.report.warnings.size() == 1);
  CHECK(contains(scene.report.warnings[0], (folder / "c.ply").string()));
  REQUIRE(scene.cloud.size() == 17);
  REQUIRE(scene.cloud.sh_degree == 3);
  for (std::size_t i = 0; i < 6; ++i)
    check_gaussian(scene.cloud, place_of(scene.cloud, 4 + i), b.rows[i], 45);
  for (std::size_t i = 0; i < 4; ++i)
    CHECK(near(scene.cloud.mean(place_of(scene.cloud, i)).x, a.rows[i]["x"]));
  for (std::size_t i = 0; i < 7; ++i) {
    const std::size_t at = place_of(scene.cloud, 10 + i);
    CHECK(near(scene.cloud.mean(at).z, c.rows[i]["z"]));
    const float* rest = &scene.cloud.shN[45 * at];
    CHECK(rest[2 * 3 + 1] == static_cast<float>(c.rows[i]["f_rest_5"]));  // green of the third
    CHECK(rest[3 * 3] == 0.0f);                                           // bands it does not have
  }
}

TEST_CASE("scene: SOG folders as tiles") {
  TempFolder folder("sog_tiles");
  SogFile first(0, 4), second(2, 5);
  first.make_files();
  second.make_files();
  first.write_folder(folder / "2_0");
  second.write_folder(folder / "2_1");
  const LoadedCloud scene = io::load_scene((folder / "2_0").string() + ",2_1").value();
  check_consistent(scene);
  REQUIRE(scene.cloud.size() == 26);
  CHECK(near(scene.cloud.mean(place_of(scene.cloud, 3)).x, first.mean(3, 0)));
  CHECK(near(scene.cloud.mean(place_of(scene.cloud, 16)).x, second.mean(3, 0)));
}

TEST_CASE("scene: what cannot be read") {
  TempFolder folder("scene_bad");
  const std::string at = folder.path().string() + "/";
  write_file(folder / "a.ply", ply_of(2, 0, 1).text());
  write_file(folder / "mip.ply", [] {
    PlyFile file = ply_of(2, 0, 1);
    file.comments = "comment SplatRenderMode: mip\n";
    return file.text();
  }());
  write_file(folder / "a.lcc", "x");
  write_file(folder / "plain", "x");
  std::filesystem::create_directories(folder / "empty");
  std::filesystem::create_directories(folder / "streamed");
  write_file(folder / "streamed/lod-meta.json", "{}");
  check_scene_fails(at + "a.lcc", Errc::unsupported, "or a folder");
  check_scene_fails(at + "plain", Errc::unsupported, "a .ply, ");
  check_scene_fails(at + "none.lcc", Errc::file_not_found, "a .ply, ");
  check_scene_fails(at + "none.ply", Errc::file_not_found, "none.ply");
  check_scene_fails(at + "empty", Errc::file_not_found, "no meta.json");
  check_scene_fails(at + "streamed", Errc::invalid_file, "lodLevels");
  check_scene_fails(at + "a.ply,b.ply", Errc::file_not_found, "b.ply");
  check_scene_fails(at + "a.ply,", Errc::invalid_argument, "empty name");
  check_scene_fails(at + "a.ply,a.ply", Errc::invalid_argument, "twice");
  check_scene_fails("", Errc::invalid_argument, "empty name");
  check_scene_fails(at + "a.ply,mip.ply", Errc::invalid_argument, "filters");
}
