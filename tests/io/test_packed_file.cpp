// SPDX-License-Identifier: Apache-2.0
// Packed scenes: SH bands that are read apart from the rest of a file give what a cloud that was all
// there gives.
#include <doctest/doctest.h>

#include <cstddef>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "check_cloud.hpp"
#include "gsnav/io/scene_file.hpp"
#include "gsnav/scene/packed_cloud.hpp"
#include "packed_file.hpp"
#include "ply_file.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

/// 3000 rows of degree 3, some of them dropped, one far away.
PlyFile scene_of(int rest, const std::string& type, const std::string& format, double band_scale) {
  PlyFile file;
  file.format = format;
  file.properties = inria_properties(rest, type);
  file.rows = random_rows(3000, rest, 11);
  for (PlyRow& row : file.rows) {
    for (int k = 0; k < rest; ++k) row["f_rest_" + std::to_string(k)] *= band_scale;
  }
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const std::size_t i : {0u, 1u, 700u, 1500u, 2999u}) file.rows[i]["f_rest_4"] = nan;
  for (const std::size_t i : {2u, 1499u, 2998u}) file.rows[i]["opacity"] = -9;
  file.rows[1200]["x"] = 4000;
  return file;
}

void check_same(const PackedCloud& a, const PackedCloud& b) {
  CHECK(a.count == b.count);
  CHECK(a.codes == b.codes);
  CHECK(a.sh0 == b.sh0);
  CHECK(a.shN == b.shN);
  REQUIRE(a.chunks.size() == b.chunks.size());
  for (std::size_t c = 0; c < a.chunks.size(); ++c) {
    CHECK(a.chunks[c].low == b.chunks[c].low);
    CHECK(a.chunks[c].step == b.chunks[c].step);
    CHECK(a.chunks[c].scale_step == b.chunks[c].scale_step);
    for (int k = 0; k < 3; ++k) CHECK(a.chunks[c].sh_steps[k] == b.chunks[c].sh_steps[k]);
  }
  CHECK(a.rest.means == b.rest.means);
  CHECK(a.rest.shN == b.rest.shN);
  CHECK(a.rest.shN_half == b.rest.shN_half);
  CHECK(a.rest.sh_degree == b.rest.sh_degree);
  CHECK(a.rest.origin_ids == b.rest.origin_ids);
  CHECK(a.rest.origins == b.rest.origins);
  CHECK(a.rest.row_ids == b.rest.row_ids);
  CHECK(a.rest.part_bounds.size() == b.rest.part_bounds.size());
  CHECK(a.bytes() == b.bytes());
}

/// Of a file read both ways, against its cloud packed when all of it is there.
void check_file(const PlyFile& file, io::LoadSceneOptions options) {
  TempFolder folder("packed");
  write_file(folder / "a.ply", file.text());
  const std::string path = (folder / "a.ply").string();
  LoadedCloud whole = io::load_scene(path, options).value();
  PackErrors errors;
  const LoadReport before = whole.report;
  const PackedCloud expected = pack_cloud(std::move(whole.cloud), options.pack, &errors);
  for (const std::size_t least : {std::size_t{1}, std::numeric_limits<std::size_t>::max()}) {
    const io::LoadedPackedCloud got = io::detail::load_packed(path, options, least).value();
    check_same(got.cloud, expected);
    const LoadReport& r = got.report;
    CHECK(r.memory == expected.bytes());
    CHECK(r.packed);
    CHECK(r.kept == before.kept);
    CHECK(r.dropped_non_finite == before.dropped_non_finite);
    CHECK(r.dropped_transparent == before.dropped_transparent);
    CHECK(r.sh_degree == before.sh_degree);
    CHECK(r.sh_degree_used == before.sh_degree_used);
    CHECK(r.sh_bytes_let_go == before.sh_bytes_let_go);
    CHECK(r.up == before.up);
    CHECK(r.packing.sh_bits == errors.sh_bits);
    CHECK(r.packing.sh == errors.sh);
    CHECK(r.packing.sh_rms == errors.sh_rms);
    CHECK(r.packing.opacity == errors.opacity);
    CHECK(r.warnings == before.warnings);
  }
}

}  // namespace

TEST_CASE("packed scene: bands that are read apart are the same bits") {
  const io::LoadSceneOptions some{.pack = {.sh = 1}};
  for (const int rest : {9, 24, 45})
    check_file(scene_of(rest, "float", "binary_little_endian", 1), some);
  check_file(scene_of(45, "double", "binary_little_endian", 1), some);
  check_file(scene_of(9, "float", "binary_big_endian", 1), some);
  check_file(scene_of(24, "float", "ascii", 1), some);
  check_file(scene_of(24, "float", "binary_little_endian", 1), {.sort = false, .pack = {.sh = 1}});
  // Means in 16 bits, and bands that need 16 and 32.
  check_file(scene_of(45, "float", "binary_little_endian", 1), {.pack = {.mean = 1e9, .sh = 1}});
  check_file(scene_of(45, "float", "binary_little_endian", 0.5), {.pack = {.sh = 1e-6}});
  check_file(scene_of(45, "float", "binary_little_endian", 1), {.pack = {.sh = 1e-6, .sh_max = 1e-9}});
}

TEST_CASE("packed scene: bands of zeros that are read apart are let go as others are") {
  PlyFile file = scene_of(45, "float", "binary_little_endian", 0.1);
  for (PlyRow& row : file.rows) {
    for (int channel = 0; channel < 3; ++channel) {
      for (int k = 8; k < 15; ++k) row["f_rest_" + std::to_string(15 * channel + k)] = 0;
    }
  }
  check_file(file, {});
  check_file(file, {.keep_zero_bands = true});
  check_file(scene_of(45, "float", "binary_little_endian", 0), {});
}

TEST_CASE("packed cloud: keeps what its colours are") {
  GaussianCloud cloud;
  cloud.color_space = ColorSpace::linear;
  const PackedCloud packed = pack_cloud(std::move(cloud));
  CHECK(packed.set().color_space == ColorSpace::linear);
}
