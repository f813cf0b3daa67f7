// SPDX-License-Identifier: Apache-2.0
// 4D Gaussians: untested on a real file. These are built by what detail/io/temporal_file.hpp says of the
// formats.
#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <limits>

#include "avatar_npz.hpp"
#include "check_refused.hpp"
#include "gsnav/detail/io/ply.hpp"
#include "gsnav/detail/io/temporal_file.hpp"
#include "gsnav/detail/scene/temporal_edit.hpp"
#include "gsnav/io/scene_file.hpp"
#include "temporal_rows_of.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

/// The mean and the opacity of a row at a time, in long double, by the formulas of MotionRows.
struct ExpectedMoment {
  std::array<long double, 3> mean{};
  long double opacity = 0;

  ExpectedMoment(const PlyRow& r, std::size_t motion, long double t) {
    const ExpectedGaussian base(r);
    const auto at = [&r](const std::string& name) { return static_cast<long double>(r.at(name)); };
    const long double dt = t - at("t"), sigma = std::exp(at("t_scale"));
    opacity = base.opacity * std::exp(-0.5L * dt * dt / (sigma * sigma + 1e-8L));
    const long double powers[] = {dt, dt * dt / 2, dt * dt * dt / 6};
    for (std::size_t k = 0; k < 3; ++k) {
      mean[k] = base.mean[k];
      for (std::size_t m = 0; 3 * m + k < motion; ++m)
        mean[k] += powers[m] * at("motion_" + std::to_string(3 * m + k));
    }
  }
};

void check_moment(const GaussianCloud& cloud, const std::vector<PlyRow>& rows, std::size_t motion,
                  double t) {
  std::size_t i = 0;
  for (const PlyRow& r : rows) {
    const ExpectedMoment want(r, motion, t);
    // Where rounding decides, either is right.
    if (std::fabs(want.opacity - 1 / 255.0L) < 1e-6L) continue;
    if (want.opacity < 1 / 255.0L) continue;
    REQUIRE(i < cloud.size());
    for (std::size_t k = 0; k < 3; ++k) {
      const double size = 1 + std::fabs(static_cast<double>(want.mean[k]));
      CHECK(cloud.mean(i)[static_cast<int>(k)] ==
            doctest::Approx(static_cast<double>(want.mean[k])).epsilon(4e-6 * size));
    }
    CHECK(static_cast<double>(cloud.opacities[i]) ==
          doctest::Approx(static_cast<double>(want.opacity)).epsilon(2e-6));
    ++i;
  }
  CHECK(i == cloud.size());
}

}  // namespace

TEST_CASE(
    "4dgs ply (untested on a real file): every moment by the formulas, whatever the motion's order") {
  for (const std::size_t motion : {0u, 3u, 6u, 9u}) {
    const PlyFile file = temporal_file(200, motion, 5);
    const auto loaded = io::parse_temporal_ply(bytes_of(file.text()), "a.4dgs.ply");
    REQUIRE(loaded.ok());
    CHECK(loaded->scene.size() == 200);
    CHECK(loaded->scene.motion[motion == 0 ? 0 : motion - 1].size() == (motion == 0 ? 0 : 200));
    if (motion < kMotionPlanes) CHECK(loaded->scene.motion[motion].empty());
    CHECK(loaded->report.moving);
    for (const double t : {-1.0, 0.0, 0.7, 3.0})
      check_moment(cloud_at(loaded->scene, t), file.rows, motion, t);
  }
}

TEST_CASE("4dgs ply: sorting changes no moment") {
  const PlyFile file = temporal_file(700, 9, 6);
  auto loaded = io::parse_temporal_ply(bytes_of(file.text()), "a.4dgs.ply").value();
  sort_spatially(loaded.scene);
  std::vector<PlyRow> sorted;
  for (const std::uint32_t row : loaded.scene.cloud.row_ids) sorted.push_back(file.rows[row]);
  check_moment(cloud_at(loaded.scene, 0.5), sorted, 9, 0.5);
}

TEST_CASE("4dgs ply: what is missing is zero, a file without any of it stands") {
  PlyFile file = temporal_file(5, 3, 7);
  const auto without = [&](const std::string& name) {
    PlyFile out = file;
    std::erase_if(out.properties, [&](const auto& p) { return p.first.starts_with(name); });
    return io::parse_temporal_ply(bytes_of(out.text()), "a").value().scene;
  };
  const TemporalCloud no_time = without("t"),
                      no_motion = without("motion_");  // "t" takes t_scale with it
  for (std::size_t i = 0; i < 5; ++i) {
    CHECK(no_time.times[i] == 0);
    CHECK(no_time.sigmas[i] == 1);
    CHECK(static_cast<double>(no_motion.times[i]) == file.rows[i]["t"]);
  }
  CHECK(no_motion.motion[0].empty());
  std::erase_if(file.properties,
                [](const auto& p) { return p.first[0] == 't' || p.first.starts_with("motion_"); });
  const auto still = io::parse_temporal_ply(bytes_of(file.text()), "a").value();
  CHECK_FALSE(still.report.moving);
  CHECK(cloud_at(still.scene, 1e9).size() == 5);
}

TEST_CASE("4dgs ply: rows that are not finite are counted, time scales clamped") {
  PlyFile file = temporal_file(7, 3, 8);
  file.rows[1]["t"] = std::numeric_limits<double>::quiet_NaN();
  file.rows[2]["motion_2"] = std::numeric_limits<double>::infinity();
  file.rows[4]["t_scale"] = std::numeric_limits<double>::quiet_NaN();
  file.rows[5]["t_scale"] = 50;
  const auto loaded = io::parse_temporal_ply(bytes_of(file.text()), "a").value();
  CHECK(loaded.report.dropped_non_finite == 3);
  REQUIRE(loaded.scene.size() == 4);
  REQUIRE(loaded.scene.times.size() == 4);
  const std::size_t kept[] = {0, 3, 5, 6};
  for (std::size_t i = 0; i < 4; ++i) {
    PlyRow& row = file.rows[kept[i]];
    CHECK(static_cast<double>(loaded.scene.times[i]) == row["t"]);
    CHECK(static_cast<double>(loaded.scene.motion[2][i]) == row["motion_2"]);
    CHECK(loaded.scene.cloud.mean(i).x == doctest::Approx(row["x"]));
  }
  REQUIRE(loaded.report.warnings.size() == 1);
  CHECK(loaded.report.warnings[0].find("1 time scales clamped") != std::string::npos);
}

TEST_CASE("4dgs ply: cut off anywhere, motion that makes no sense") {
  const std::string text = temporal_file(3, 3, 9).text();
  for (std::size_t n = 0; n < text.size(); n += 7) {
    CHECK_FALSE(io::parse_temporal_ply(bytes_of(text.substr(0, n)), "a").ok());
  }
  PlyFile file = temporal_file(3, 3, 9);
  file.properties.pop_back();
  check_refused(io::parse_temporal_ply(bytes_of(file.text()), "a"), Errc::invalid_file, "a",
                "2 properties motion_*");
  file.properties.emplace_back("motion_7", "float");
  check_refused(io::parse_temporal_ply(bytes_of(file.text()), "a"), Errc::invalid_file, "a", "motion_2");
}

TEST_CASE("4dgs npz (untested on a real file): a network's arrays are the same scene as its PLY") {
  const TempFolder folder("4dgs");
  for (const std::size_t motion : {3u, 9u}) {
    const PlyFile file = temporal_file(60, motion, 10);
    write_npz(folder / "a.4dgs.npz", temporal_arrays(file.rows, motion, "network.tfgs.fdgs."));
    const auto npz = io::load_temporal(folder / "a.4dgs.npz");
    REQUIRE(npz.ok());
    const auto ply = io::parse_temporal_ply(bytes_of(file.text()), "a").value();
    CHECK(npz->scene.times == ply.scene.times);
    CHECK(npz->scene.sigmas == ply.scene.sigmas);
    CHECK(npz->scene.motion == ply.scene.motion);
    CHECK(npz->scene.cloud.means == ply.scene.cloud.means);
    CHECK(npz->scene.cloud.quats == ply.scene.cloud.quats);
    CHECK(npz->scene.cloud.scales == ply.scene.cloud.scales);
    CHECK(npz->scene.cloud.opacities == ply.scene.cloud.opacities);
    CHECK(npz->scene.cloud.shN == ply.scene.cloud.shN);
  }
}

TEST_CASE("4dgs npz: scale and dilation, and a background that stands") {
  const TempFolder folder("4dgs");
  const PlyFile moving = temporal_file(20, 3, 11), standing = temporal_file(30, 0, 12);
  TestArrays arrays = temporal_arrays(moving.rows, 3, "network.fg_fdgs.");
  for (auto& [name, array] : temporal_arrays(standing.rows, 0, "network.bg_fdgs.")) {
    if (!name.ends_with("_t")) arrays[name] = array;
  }
  arrays["network.bg_fdgs._rotation"] = arrays["network.bg_fdgs._rotation_l"];
  arrays["network.scene_scale"] = {{1}, {2.5}};
  arrays["network.time_dilation"] = {{1}, {4}};
  write_npz(folder / "a.npz", arrays);
  const TemporalCloud scene = io::load_temporal(folder / "a.npz").value().scene;
  REQUIRE(scene.size() == 50);
  for (std::size_t i = 0; i < 20; ++i) {
    PlyRow row = moving.rows[i];
    CHECK(scene.cloud.mean(i).y == doctest::Approx(2.5 * row["y"]).epsilon(1e-6));
    CHECK(static_cast<double>(scene.cloud.scales[1][i]) ==
          doctest::Approx(2.5 * std::exp(row["scale_1"])).epsilon(1e-6));
    CHECK(static_cast<double>(scene.times[i]) == doctest::Approx(4 * row["t"]).epsilon(1e-6));
    CHECK(static_cast<double>(scene.motion[0][i]) ==
          doctest::Approx(2.5 * row["motion_0"]).epsilon(1e-6));
  }
  const GaussianCloud late = cloud_at(scene, 1e6);  // only the background is left
  REQUIRE(late.size() == 30);
  for (std::size_t i = 0; i < 30; ++i) {
    CHECK(late.mean(i).x == doctest::Approx(2.5 * standing.rows[i].at("x")).epsilon(1e-6));
  }
}

TEST_CASE("4dgs npz: what does not fit is named") {
  const TempFolder folder("4dgs");
  const TestArrays good = temporal_arrays(temporal_file(6, 3, 13).rows, 3, "network.tfgs.fdgs.");
  const auto refused = [&](const char* name, const TestArray& array, const char* what) {
    TestArrays arrays = good;
    arrays[name] = array;
    write_npz(folder / "a.npz", arrays);
    check_refused(io::load_temporal(folder / "a.npz"), Errc::invalid_file, "a.npz", what);
  };
  const auto zeros = [](std::vector<std::size_t> shape) {
    std::size_t n = 1;
    for (const std::size_t d : shape) n *= d;
    return TestArray{std::move(shape), std::vector<double>(n, 0.0)};
  };
  refused("network.tfgs.fdgs._xyz", zeros({6, 4}), "_xyz has the shape [6, 4]");
  refused("network.tfgs.fdgs._xyz", zeros({7, 3}), "_opacity has the shape [6, 1], must be [7, 1]");
  refused("network.tfgs.fdgs._motion", zeros({6, 4}), "_motion has the shape [6, 4]");
  refused("network.tfgs.fdgs._motion", zeros({6, 12}), "_motion has the shape [6, 12]");
  refused("network.tfgs.fdgs._t", zeros({5, 1}), "_t has the shape");
  refused("network.tfgs.fdgs._features_rest", zeros({6, 9}), "_features_rest has the shape");
  refused("network.scene_scale", {{1}, {0}}, "scene_scale is 0");
  for (const char* name : {"_xyz", "_opacity", "_scaling", "_rotation_l", "_features_dc"}) {
    TestArrays arrays = good;
    arrays.erase(std::string("network.tfgs.fdgs.") + name);
    write_npz(folder / "a.npz", arrays);
    check_refused(io::load_temporal(folder / "a.npz"), Errc::invalid_file, "a.npz", name);
  }
}

TEST_CASE("4dgs: load_scene gives the moment that is asked for; load_ply says that it does not") {
  const TempFolder folder("4dgs");
  const PlyFile file = temporal_file(90, 6, 14);
  write_file(folder / "a.4dgs.ply", file.text());
  write_npz(folder / "a.4dgs.npz", temporal_arrays(file.rows, 6, "network.tfgs.fdgs."));
  for (const char* name : {"a.4dgs.ply", "a.4dgs.npz"}) {
    const auto scene = io::load_scene(folder / name, {.sort = false, .time = 0.4});
    REQUIRE(scene.ok());
    check_moment(scene->cloud, file.rows, 6, 0.4);
    CHECK(scene->report.moving);
    CHECK(io::report_text(scene->report).find("moving: own times from") != std::string::npos);
  }
  check_refused(io::load_scene(folder / "a.4dgs.ply", {.time = std::numeric_limits<double>::infinity()}),
                Errc::invalid_argument, "a.4dgs.ply", "LoadSceneOptions.time");
  const auto plain = io::load_ply(folder / "a.4dgs.ply");
  REQUIRE(plain.ok());
  REQUIRE(plain->report.warnings.size() == 1);
  CHECK(plain->report.warnings[0].find("each is taken at its own time") != std::string::npos);
  check_refused(io::load_temporal(folder / "a.spz"), Errc::unsupported, "a.spz", ".4dgs.npz");
  check_refused(io::load_temporal(folder / "none.npz"), Errc::file_not_found, "none.npz", "");
}
