// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "check_cloud.hpp"
#include "gsnav/detail/io/ply.hpp"
#include "gsnav/detail/scene/spatial_order.hpp"

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
    // Bit for bit, so that images are equal: nothing drifts by being converted.
    CHECK(again.cloud.opacities == first.opacities);
    CHECK(again.cloud.scales == first.scales);
    CHECK(again.cloud.quats == first.quats);
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

TEST_CASE("save_ply: every logit is finite, and opacity 1 is 1 again in float32 and in double") {
  TempFolder folder("ply_logits");
  GaussianCloudBuilder builder(0);
  RawGaussian raw;
  raw.quat = {1, 0, 0, 0};
  for (const double logit :
       {14.0, 16.0, 17.0, 17.5, 25.0, 88.0, std::numeric_limits<double>::infinity()}) {
    raw.opacity_logit = logit;
    builder.add(raw);
  }
  GaussianCloud& cloud = builder.cloud();
  cloud.opacities[0] = 0;  // a writer takes what it is given
  REQUIRE(io::save_ply(folder / "a.ply", cloud).ok());
  const std::string text = read_file(folder / "a.ply");
  const std::size_t header = text.find("end_header\n") + 11;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    float logit = 0;
    std::memcpy(&logit, text.data() + header + 4 * (17 * i + 9), 4);
    CAPTURE(logit);
    CHECK(std::isfinite(logit));
    CHECK(static_cast<float>(1 / (1 + std::exp(-static_cast<double>(logit)))) == cloud.opacities[i]);
    if (cloud.opacities[i] == 1) CHECK(1 / (1 + std::exp(-logit)) == 1.0f);
  }
}

TEST_CASE("save_ply: rows go out in the order in which they were read") {
  TempFolder folder("ply_order");
  PlyFile file;
  file.properties = inria_properties(0);
  file.rows = random_rows(3000, 0, 48);
  GaussianCloud cloud = io::parse_ply(bytes_of(file.text()), "rows").value().cloud;
  const auto means = cloud.means;
  sort_spatially(cloud);
  REQUIRE(cloud.means != means);
  REQUIRE(io::save_ply(folder / "a.ply", cloud).ok());
  CHECK(io::load_ply(folder / "a.ply").value().cloud.means == means);
}

TEST_CASE("save_ply: quaternions come back bit for bit, many of them") {
  TempFolder folder("ply_quats");
  PlyFile file;
  file.properties = inria_properties(0);
  file.rows = random_rows(60000, 0, 47);
  const GaussianCloud first = io::parse_ply(bytes_of(file.text()), "first").value().cloud;
  std::size_t changed = 0;  // by normalising the float32 of a unit quaternion once more
  for (std::size_t i = 0; i < first.size(); ++i) {
    Quatd q{static_cast<double>(first.quats[0][i]), static_cast<double>(first.quats[1][i]),
            static_cast<double>(first.quats[2][i]), static_cast<double>(first.quats[3][i])};
    normalize(q);
    changed += static_cast<float>(q.w) != first.quats[0][i] ||
                       static_cast<float>(q.x) != first.quats[1][i] ||
                       static_cast<float>(q.y) != first.quats[2][i] ||
                       static_cast<float>(q.z) != first.quats[3][i]
                   ? 1
                   : 0;
  }
  CHECK(changed > 100);
  REQUIRE(io::save_ply(folder / "a.ply", first).ok());
  const GaussianCloud again = io::load_ply(folder / "a.ply").value().cloud;
  CHECK(again.quats == first.quats);
  CHECK(again.opacities == first.opacities);
  CHECK(again.scales == first.scales);
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
