// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include "check_cloud.hpp"
#include "gsnav/io/ply.hpp"

using namespace gsnav;
using namespace gsnav_test;

TEST_CASE("save_ply: what it writes is read back") {
  TempFolder folder("ply_save");
  const int counts[] = {0, 9, 24, 45};
  for (int degree = 0; degree < 4; ++degree) {
    PlyFile file;
    file.properties = inria_properties(counts[degree]);
    file.rows = random_rows(5000, counts[degree], 40u + static_cast<unsigned>(degree));
    file.rows[3]["x"] = 1000.25;  // away from the first lattice point
    file.rows[4]["scale_0"] = -std::numeric_limits<double>::infinity();
    file.rows[5]["opacity"] = std::numeric_limits<double>::infinity();
    file.comments = degree == 2 ? "comment SplatRenderMode: mip\n" : "";
    const GaussianCloud first = io::parse_ply(bytes_of(file.text()), "first").value().cloud;
    const auto path = folder / "saved.ply";
    REQUIRE(io::save_ply(path, first).ok());
    const LoadedCloud again = io::load_ply(path).value();
    check_consistent(again);
    CHECK(again.report.warnings.empty());
    CHECK(again.cloud.filter == (degree == 2 ? Filter::mip : Filter::classic));
    REQUIRE(again.cloud.size() == first.size());
    CHECK(again.cloud.sh0 == first.sh0);
    CHECK(again.cloud.shN == first.shN);
    CHECK(again.cloud.means == first.means);
    CHECK(again.cloud.origin_ids == first.origin_ids);
    CHECK(again.cloud.scales[0][4] == 0.0f);
    CHECK(again.cloud.opacities[5] == 1.0f);
    long double worst = 0;
    for (std::size_t i = 0; i < first.size(); ++i) {
      worst = std::max(worst, std::fabs(1.0L * again.cloud.opacities[i] - first.opacities[i]));
      for (std::size_t k = 0; k < 4; ++k) {
        worst = std::max(worst, std::fabs(1.0L * again.cloud.quats[k][i] - first.quats[k][i]));
      }
      for (std::size_t k = 0; k < 3; ++k) {
        if (first.scales[k][i] == 0.0f) continue;
        worst = std::max(worst, std::fabs(1.0L * again.cloud.scales[k][i] / first.scales[k][i] - 1));
      }
    }
    CHECK(worst < 1e-6L);
  }
}

TEST_CASE("save_ply: INRIA's order and layout, byte by byte") {
  TempFolder folder("ply_layout");
  PlyFile file;
  file.properties = inria_properties(9);
  file.rows = random_rows(1, 9, 6);
  // Values that survive activation and back without rounding.
  file.rows[0]["opacity"] = 0;
  for (const char* s : {"scale_0", "scale_1", "scale_2"}) file.rows[0][s] = 0;
  for (const char* r : {"rot_0", "rot_1", "rot_2", "rot_3"}) file.rows[0][r] = -0.5;
  file.rows[0]["nx"] = 0;
  const std::string text = file.text();
  REQUIRE(io::save_ply(folder / "a.ply", io::parse_ply(bytes_of(text), "a").value().cloud).ok());
  CHECK(read_file(folder / "a.ply") == text);
}

TEST_CASE("save_ply: opacities at the threshold are not lost") {
  TempFolder folder("ply_threshold");
  GaussianCloudBuilder builder(0);
  RawGaussian raw;
  for (int i = 0; i < 1000; ++i) {
    raw.opacity_logit = std::log(1.0 / 254.0) + 1e-9 * i;
    builder.add(raw);
  }
  REQUIRE(builder.cloud().size() == 1000);
  REQUIRE(io::save_ply(folder / "a.ply", builder.cloud()).ok());
  CHECK(io::load_ply(folder / "a.ply").value().cloud.size() == 1000);
}

TEST_CASE("save_ply: double positions, a cloud that contradicts itself, a missing folder") {
  TempFolder folder("ply_options");
  GaussianCloudBuilder builder(0);
  RawGaussian raw;
  raw.mean = {500000.123456, -3.25, 64.5};
  builder.add(raw);
  GaussianCloud& cloud = builder.cloud();
  REQUIRE(io::save_ply(folder / "d.ply", cloud, {.double_positions = true}).ok());
  const GaussianCloud exact = io::load_ply(folder / "d.ply").value().cloud;
  CHECK(exact.mean(0).x == cloud.mean(0).x);
  REQUIRE(io::save_ply(folder / "f.ply", cloud).ok());
  CHECK(io::load_ply(folder / "f.ply").value().cloud.mean(0).x == 500000.125);

  const Status missing = io::save_ply(folder / "no/such/a.ply", cloud);
  CHECK(missing.code() == Errc::file_not_found);
  CHECK(contains(missing.message(), (folder / "no/such").string()));
  cloud.sh0.pop_back();
  CHECK(io::save_ply(folder / "bad.ply", cloud).code() == Errc::invalid_argument);
  CHECK_FALSE(std::filesystem::exists(folder / "bad.ply"));
}
