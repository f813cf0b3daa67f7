// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <array>

#include "check_cloud.hpp"
#include "gsnav/detail/io/sog.hpp"
#include "gsnav/io/scene_file.hpp"
#include "support/data.hpp"

using namespace gsnav;
using namespace gsnav_test;

TEST_CASE("sog: real files hold what their descriptions say") {
  struct Expected {
    const char* path;
    std::uint64_t count;
    int degree;
  };
  const Expected all[] = {{"splats/fyoxy_ruin_300k_sh3", 300000, 3},
                          {"splats/playcanvas/playbot/1_0", 250000, 2},
                          {"splats/playcanvas/playbot/6_0/meta.json", 1873, 2},
                          {"splats/playcanvas/playcanvas-logo_sogv1", 307128, 0},
                          {"splats/playcanvas/flipbook/monkey_0025.sog", 31658, 0},
                          {"splats/playcanvas/wave/wave_0001.sog", 4225, 0},
                          {"splats/statues/angel.sog", 71359, 0},
                          {"splats/lacadiere_showroom/environment.sog", 35445, 0}};
  for (const Expected& e : all) {
    const std::string path = data_file(e.path);
    if (path.empty()) continue;
    CAPTURE(path);
    const LoadedCloud loaded = io::load_sog(path).value();
    check_consistent(loaded);
    CHECK(loaded.report.read == e.count);
    CHECK(loaded.report.kept > e.count * 99 / 100);
    CHECK(loaded.cloud.sh_degree == e.degree);
  }
}

// Rows as another program wrote them to a float32 PLY (@playcanvas/splat-transform 2.7.1).
TEST_CASE("sog: rows of real files as another reader decodes them") {
  struct Expected {
    const char* path;
    std::int64_t row;  ///< from the end where negative
    KnownRow known;
    std::array<double, 4> rest;  ///< f_rest_0, 14, 15, 44
  };
  const char* ruin = "splats/fyoxy_ruin_300k_sh3";
  const char* showroom = "splats/lacadiere_showroom/2_0";
  const char* logo = "splats/playcanvas/playcanvas-logo_sogv1";
  const Expected all[] = {
      {ruin,
       0,
       {{-927.9485473632812, -344.177734375, -1616.4649658203125},
        {-15.554340362548828, 1.0010414123535156, 2.378142833709717},
        {0.9658171534538269, -0.07487013190984726, 0.24124819040298462, 0.058232322335243225},
        -2.6390573978424072,
        {1.3971354961395264, 1.231111764907837, 0.7939056158065796}},
       {-0.00553925009444356, -0.0002503755094949156, -0.003146722912788391, -0.05689091235399246}},
      {ruin,
       2,
       {{-46.2906379699707, -219.8770294189453, -59.38213348388672},
        {-0.1792486608028412, -3.7426984310150146, 0.5250349044799805},
        {0.7805744409561157, -0.6183717846870422, -0.030502645298838615, -0.08596199750900269},
        -3.9120230674743652,
        {1.7292855978012085, 1.297569990158081, 0.6166535019874573}},
       {0.036214448511600494, -0.09031446278095245, 0.03143709897994995, -0.052104536443948746}},
      {ruin,
       -1,
       {{8256.595703125, 8107.697265625, 21678.341796875},
        {-20 /* clamped */, -0.3058238625526428, 0.5250349044799805},
        {0.9684885144233704, -0.16360509395599365, 0.18024291098117828, 0.052686385810375214},
        -3.567518711090088,
        {1.3971354961395264, 1.2642618417739868, 0.766139566898346}},
       {-0.00553925009444356, -0.0002503755094949156, -0.003146722912788391, -0.05689091235399246}},
      {showroom,
       268000,
       {{-4.196390628814697, -13.247079849243164, -0.04888695478439331},
        {-3.409316301345825, -3.8395843505859375, -6.09791374206543},
        {0.9789754748344421, -0.052686385810375214, -0.15251322090625763, 0.12478355318307877},
        0.4382549226284027,
        {0.3948807120323181, -0.06739604473114014, -0.3839292824268341}},
       {}},
      {showroom,
       -1,
       {{0.4363689124584198, -11.545939445495605, 0.09160059690475464},
        {-4.127828598022461, -6.621490001678467, -4.691490650177002},
        {0.9485293030738831, 0.21351851522922516, 0.04159451648592949, -0.2301563322544098},
        0.5719616413116455,
        {0.9069091081619263, 1.3461307287216187, 1.7856088876724243}},
       {}},
      {logo,
       0,
       {{-1.1952922344207764, -2.550771951675415, -0.46837547421455383},
        {-11.245482444763184, -5.20742130279541, -9.329840660095215},
        {0.2745237946510315, -0.21351851522922516, 0.7236064672470093, -0.5961880683898926},
        1.1734257936477661,
        {0.9152413606643677, 0.04087364301085472, -0.2966105341911316}},
       {}},
      {logo,
       -1,
       {{1.3563364744186401, -0.0019729638006538153, 0.46060022711753845},
        {-9.988637924194336, -5.485799312591553, -9.37803840637207},
        {0.15805916488170624, 0.5961880683898926, -0.4242640733718872, 0.6630061268806458},
        0.8698495030403137,
        {0.8299717903137207, 0.3682219386100769, -0.3412407636642456}},
       {}}};
  for (const Expected& e : all) {
    const std::string path = data_file(e.path);
    if (path.empty()) continue;
    CAPTURE(path);
    CAPTURE(e.row);
    const GaussianCloud c = io::load_sog(path).value().cloud;
    const auto i =
        static_cast<std::size_t>(e.row < 0 ? static_cast<std::int64_t>(c.size()) + e.row : e.row);
    check_known(c, i, e.known);
    if (c.sh_degree != 3) continue;
    // Channel-major in their file: the first and last coefficient of red, the first of green, ...
    const std::size_t ours[] = {0, 3 * 14, 1, 3 * 14 + 2};
    for (std::size_t k = 0; k < 4; ++k) CHECK(near(c.shN[45 * i + ours[k]], e.rest[k]));
  }
}

TEST_CASE("sog: the indoor scene stands where its description says") {
  const std::string path = data_file("splats/lacadiere_showroom/2_0");
  if (path.empty()) return;
  const LoadedCloud scene = io::load_scene(path + ",2_1,2_2").value();
  check_consistent(scene);
  CHECK(scene.report.read == 1495636);
  CHECK(scene.report.kept == 1495636);
  CHECK(scene.cloud.sh_degree == 0);
  // The floor: of all slabs 0.1 m thick, the fullest one below eye level is at z = -0.75.
  std::vector<int> slabs(40, 0);
  std::vector<double> x, y;
  for (std::size_t i = 0; i < scene.cloud.size(); ++i) {
    const Vec3d m = scene.cloud.mean(i);
    if (m.z >= -2 && m.z < 0.5) ++slabs[static_cast<std::size_t>((m.z + 2) * 10)];
    if (m.z > -1 && m.z < 2.5) {
      x.push_back(m.x);
      y.push_back(m.y);
    }
  }
  const auto fullest = std::max_element(slabs.begin(), slabs.end()) - slabs.begin();
  CHECK(std::fabs(-2 + 0.1 * (static_cast<double>(fullest) + 0.5) + 0.75) < 0.11);
  const auto extent = [](std::vector<double>& v) {
    std::sort(v.begin(), v.end());
    return v[v.size() * 98 / 100] - v[v.size() * 2 / 100];
  };
  const double wide = extent(x), deep = extent(y);
  CAPTURE(wide);
  CAPTURE(deep);
  CHECK(wide > 15);
  CHECK(wide < 35);
  CHECK(deep > 15);
  CHECK(deep < 35);
}
