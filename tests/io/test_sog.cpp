// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include "check_cloud.hpp"
#include "gsnav/detail/io/sog.hpp"
#include "sog_file.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

void check_sog(const LoadedCloud& loaded, const SogFile& f) {
  check_consistent(loaded);
  const GaussianCloud& c = loaded.cloud;
  CHECK(c.sh_degree == f.bands);
  REQUIRE(c.size() == SogFile::kCount);
  const auto coefficients = static_cast<std::size_t>((f.bands + 1) * (f.bands + 1) - 1);
  for (std::size_t i = 0; i < c.size(); ++i) {
    const Vec3d mean = c.mean(i);
    for (std::size_t k = 0; k < 3; ++k) {
      CHECK(near(mean[static_cast<int>(k)], f.mean(i, k)));
      CHECK(near(c.scales[k][i], std::exp(1.0L * f.scale_book[f.scales.pixel(i)[k]])));
      CHECK(c.sh0[3 * i + k] == static_cast<float>(f.dc_book[f.sh0.pixel(i)[k]]));
    }
    for (std::size_t k = 0; k < 4; ++k) CHECK(near(c.quats[k][i], f.quat(i, k)));
    CHECK(c.opacities[i] == static_cast<float>(f.sh0.pixel(i)[3] / 255.0L));
    bool rest_ok = true;
    for (std::size_t k = 0; k < 3 * coefficients; ++k) {
      rest_ok =
          rest_ok && c.shN[3 * coefficients * i + k] ==
                         static_cast<float>(f.rest(i, static_cast<int>(k / 3), static_cast<int>(k % 3)));
    }
    CHECK(rest_ok);
  }
}

}  // namespace

TEST_CASE("sog: folder, meta.json and bundles, of every degree") {
  TempFolder folder("sog");
  for (int bands = 0; bands <= 3; ++bands) {
    CAPTURE(bands);
    SogFile f(bands, 7u + static_cast<unsigned>(bands));
    f.make_files();
    f.write_folder(folder / "set");
    check_sog(io::load_sog(folder / "set").value(), f);
    check_sog(io::load_sog(folder / "set/meta.json").value(), f);
    for (const bool deflated : {false, true}) {
      write_file(folder / "a.sog", f.bundle(deflated));
      const LoadedCloud loaded = io::load_sog(folder / "a.sog").value();
      check_sog(loaded, f);
      CHECK(loaded.report.source == (folder / "a.sog").string());
    }
  }
}

TEST_CASE("sog: opacity 0 is dropped, 1/255 and 1 are kept exactly") {
  TempFolder folder("sog_opacity");
  SogFile f(1);
  f.sh0.pixel(4)[3] = 0;
  f.make_files();
  f.write_folder(folder.path());
  const LoadedCloud loaded = io::load_sog(folder.path()).value();
  check_consistent(loaded);
  CHECK(loaded.report.dropped_transparent == 1);
  REQUIRE(loaded.cloud.size() == 12);
  CHECK(loaded.cloud.opacities[0] == 1.0f);
  CHECK(loaded.cloud.opacities[1] == 1.0f / 255.0f);
  CHECK(near(loaded.cloud.mean(4).y, f.mean(5, 1)));
}

TEST_CASE("sog: antialias sets the filter") {
  TempFolder folder("sog_antialias");
  const std::pair<const char*, Filter> cases[] = {{",\"antialias\":true", Filter::mip},
                                                  {",\"antialias\":false", Filter::classic},
                                                  {"", Filter::classic}};
  for (const auto& [extra, filter] : cases) {
    SogFile f(0);
    f.extra = extra;
    f.make_files();
    f.write_folder(folder.path());
    CHECK(io::load_sog(folder.path()).value().cloud.filter == filter);
  }
}

TEST_CASE("sog: version 1 has ranges instead of codebooks and opacity as a logit") {
  TempFolder folder("sog_v1");
  SogFile f(0);
  f.make_files();
  f.files["meta.json"] =
      R"({"means":{"shape":[13,3],"mins":[-2.5,-0.5,1.0],"maxs":[3.0,0.75,4.5],
          "files":["means_l.webp","means_u.webp"]},
          "scales":{"shape":[13,3],"mins":[-9,-8,-7],"maxs":[-1,-2,-3],"files":["scales.webp"]},
          "quats":{"shape":[13,4],"encoding":"quaternion_packed","files":["quats.webp"]},
          "sh0":{"shape":[13,1,4],"mins":[-1,-2,-3,-4],"maxs":[1,2,3,6],"files":["sh0.webp"]}})";
  f.write_folder(folder.path());
  const LoadedCloud loaded = io::load_sog(folder.path()).value();
  check_consistent(loaded);
  REQUIRE(loaded.cloud.size() == 13);
  for (std::size_t i = 0; i < 13; ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      const long double low = -9.0L + static_cast<long double>(k),
                        high = -1.0L - static_cast<long double>(k);
      const long double edge = 1.0L + static_cast<long double>(k);
      CHECK(near(loaded.cloud.mean(i)[static_cast<int>(k)], f.mean(i, k)));
      CHECK(near(loaded.cloud.scales[k][i], std::exp(low + (high - low) * f.scales.pixel(i)[k] / 255)));
      CHECK(near(loaded.cloud.sh0[3 * i + k], -edge + 2 * edge * f.sh0.pixel(i)[k] / 255));
    }
    const long double logit = -4 + 10 * (f.sh0.pixel(i)[3] / 255.0L);
    CHECK(near(loaded.cloud.opacities[i], 1 / (1 + std::exp(-logit))));
  }
}

TEST_CASE("sog: a quaternion that is too long after rounding keeps its three components") {
  TempFolder folder("sog_quat");
  SogFile f(0);
  for (int k = 0; k < 3; ++k) f.quats.pixel(2)[k] = k == 0 ? 255 : 250;
  f.make_files();
  f.write_folder(folder.path());
  const LoadedCloud loaded = io::load_sog(folder.path()).value();
  REQUIRE(loaded.cloud.size() == 13);
  const std::size_t largest = f.quats.pixel(2)[3] - 252u;
  CHECK(loaded.cloud.quats[largest][2] == 0.0f);
}
