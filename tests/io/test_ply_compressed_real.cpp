// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cstdio>

#include "check_cloud.hpp"
#include "gsnav/backends/serial.hpp"
#include "gsnav/io/scene_file.hpp"
#include "gsnav/scene/basic_renderer.hpp"
#include "support/compiled_frames.hpp"
#include "support/data.hpp"

using namespace gsnav;
using namespace gsnav_test;

// Rows as another program wrote them to a float32 PLY (@playcanvas/splat-transform 2.7.1).
TEST_CASE("compressed ply: rows of real files as another reader decodes them") {
  struct Expected {
    const char* path;
    std::uint64_t count;
    std::size_t row;
    KnownRow known;
  };
  const char* guitar = "splats/playcanvas/guitar.compressed.ply";
  const char* angel = "splats/statues/angel.compressed.ply";
  const Expected all[] = {
      {guitar,
       90854,
       0,
       {{-0.4724908471107483, -4.07820463180542, -0.16634589433670044},
        {-8.7986421585083, -5.232892990112305, -5.725710391998291},
        {0.7951075434684753, 0.5771594643592834, -0.04631100222468376, -0.18040554225444794},
        0.7646061182022095,
        {0.1326712965965271, -0.8460118174552917, -1.5064527988433838}}},
      {guitar,
       90854,
       300,
       {{-0.480209618806839, -4.113040447235107, -0.013664565049111843},
        {-6.328611850738525, -6.114144802093506, -4.5121846199035645},
        {0.7327098846435547, 0.6573397517204285, -0.1527571827173233, 0.08778353780508041},
        2.8457396030426025,
        {-1.437119483947754, -1.6534985303878784, -1.8024617433547974}}},
      {guitar,
       90854,
       90853,
       {{0.4553929269313812, -0.6415753364562988, 0.7538047432899475},
        {-11.707035064697266, -3.780728340148926, -5.10838508605957},
        {0.6283089518547058, 0.7114118933677673, -0.2177308201789856, -0.22740775346755981},
        -2.1756255626678467,
        {-0.9081723690032959, -1.06472909450531, -1.0610977411270142}}},
      {angel,
       71377,
       0,
       {{0.7873640060424805, -1.667931079864502, -0.6272574067115784},
        {-6.993030548095703, -1.25338876247406, -3.180811643600464},
        {-0.09331320971250534, 0.883675217628479, -0.040781330317258835, -0.4568891227245331},
        -2.219203472137451,
        {1.619536280632019, 1.2163898944854736, 1.3415043354034424}}},
      {angel,
       71377,
       1000,
       {{0.7337534427642822, -0.1384166181087494, -0.597230851650238},
        {-5.659714221954346, -3.4212889671325684, -11.123217582702637},
        {-0.006220880895853043, 0.8286967277526855, 0.06013518199324608, -0.5564232468605042},
        -0.9916401505470276,
        {-1.369307518005371, -1.480520248413086, -1.4110122919082642}}},
      {angel,
       71377,
       71376,
       {{-0.5805789828300476, 1.2193758487701416, 0.3159554898738861},
        {-9.776311874389648, -4.87157678604126, -6.2485480308532715},
        {0.31588250398635864, 0.9359344840049744, 0.007603298872709274, -0.15552201867103577},
        -1.3619623184204102,
        {0.98006272315979, 0.9522595405578613, 0.8549483418464661}}}};
  for (const Expected& e : all) {
    const std::string path = data_file(e.path);
    if (path.empty()) continue;
    CAPTURE(path);
    CAPTURE(e.row);
    const LoadedCloud loaded = io::load_scene(path).value();
    check_consistent(loaded);
    const GaussianCloud& c = loaded.cloud;
    CHECK(loaded.report.read == e.count);
    CHECK(loaded.report.kept == e.count);
    CHECK(c.sh_degree == 0);
    const std::size_t i = place_of(c, e.row);
    check_known(c, i, e.known);
  }
}

TEST_CASE("compressed ply: the statue looks as it does in its SOG") {
  const std::string packed = data_file("splats/statues/angel.compressed.ply");
  const std::string sog = data_file("splats/statues/angel.sog");
  if (packed.empty() || sog.empty()) return;
  const GaussianCloud a = io::load_scene(packed).value().cloud, b = io::load_scene(sog).value().cloud;
  // The two files are turned against each other by half a turn about z.
  const Similarity turn{Quatd{0, 0, 0, 1}, {}, 1.0};
  SerialBackend backend;
  BasicRenderer<float, SerialBackend> renderer(backend);
  const Vec3d centre{0.15, -0.73, -0.1};
  for (const Vec3d& eye : {Vec3d{0.15, -0.73, -5}, Vec3d{5, -1, 0}, Vec3d{-2, -3, 4}}) {
    const Camera camera = Camera::look_at(eye, centre, {0, -1, 0}, 160, 160, 50);
    const auto one = renderer.render(a.set(turn), camera).value().rgb;
    const auto other = renderer.render(b.set(), camera).value().rgb;
    double square = 0, light = 0;
    for (std::size_t k = 0; k < one.size(); ++k) {
      const double d = static_cast<double>(one[k]) - static_cast<double>(other[k]);
      square += d * d;
      light += static_cast<double>(other[k]);
    }
    const double psnr = -10 * std::log10(square / static_cast<double>(one.size()));
    std::printf("angel, compressed PLY against SOG: PSNR %.2f dB\n", psnr);
    CHECK(light / static_cast<double>(one.size()) > 0.02);  // it is in the picture
    CHECK(psnr > 35);
  }
}
