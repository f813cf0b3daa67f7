// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cmath>
#include <string>

#include "check_refused.hpp"
#include "gsnav/detail/io/cameras_file.hpp"
#include "support/data.hpp"
#include "support/files.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

// Looks along +x of the world, which has z up: right is -y, down is -z.
const std::string kOne =
    R"({"id":0,"img_name":"a","width":1280,"height":960,"position":[1,2,3],
        "rotation":[[0,0,1],[-1,0,0],[0,-1,0]],"fx":800,"fy":700})";

Result<std::vector<Camera>> parse_cameras(const std::string& text, int width = 0, int height = 0) {
  TempFolder folder("cameras");
  write_file(folder / "cameras.json", text);
  return io::load_cameras(folder / "cameras.json", width, height);
}

void check_fails(const std::string& from, const std::string& to, const std::string& part) {
  check_refused(parse_cameras("[" + kOne + "," + replaced(kOne, from, to) + "]"), Errc::invalid_file,
                "cameras.json: camera 1", part);
}

}  // namespace

TEST_CASE("cameras: pose and intrinsics") {
  const Camera c = parse_cameras("[" + kOne + "]").value()[0];
  CHECK(c.width == 1280);
  CHECK(c.height == 960);
  CHECK(c.fx == 800);
  CHECK(c.fy == 700);
  CHECK(c.cx == 640);
  CHECK(c.cy == 480);
  CHECK(c.near_plane == 0.2);
  // A point 5 m ahead, 0.5 m to the right, 0.25 m down.
  const Vec3d p = c.viewmat * Vec3d{1 + 5, 2 - 0.5, 3 - 0.25};
  CHECK(std::fabs(p.x - 0.5) < 1e-12);
  CHECK(std::fabs(p.y - 0.25) < 1e-12);
  CHECK(std::fabs(p.z - 5) < 1e-12);
  CHECK(parse_cameras("[]").value().empty());
}

TEST_CASE("cameras: another size keeps the horizontal field of view") {
  const Camera c = parse_cameras("[" + kOne + "]", 320, 320).value()[0];
  CHECK(c.width == 320);
  CHECK(c.height == 320);
  CHECK(c.fx == 200);
  CHECK(c.fy == 175);
  CHECK(c.cx == 160);
  CHECK(c.cy == 160);
  for (const auto& [w, h] : {std::pair{320, 0}, {0, 240}, {-1, -1}, {70000, 10}}) {
    CHECK(parse_cameras("[" + kOne + "]", w, h).code() == Errc::invalid_argument);
  }
}

TEST_CASE("cameras: errors name the camera and the field") {
  check_fails("\"width\":1280", "\"width\":0", "'width' is '0'");
  check_fails("\"width\":1280", "\"width\":12.5", "'width' is '12.5'");
  check_fails("\"height\":960", "\"height\":1e9", "'height'");
  check_fails("\"height\":960,", "", "'height' is missing");
  check_fails("\"fx\":800", "\"fx\":-800", "'fx'");
  check_fails("\"fy\":700", "\"fy\":\"700\"", "'fy' is '\"700\"'");
  check_fails("\"fx\":800", "\"fx\":null", "'fx' is 'null'");
  check_fails("[1,2,3]", "[1,2]", "'position'");
  check_fails("[1,2,3]", "[1,2,\"3\"]", "'position[2]'");
  check_fails("[1,2,3]", "7", "'position' is '7'");
  check_fails("[-1,0,0]", "[-1,0]", "'rotation[1]'");
  check_fails("[-1,0,0]", "[-1,0,null]", "'rotation[1][2]'");
  check_fails("[0,0,1],", "", "'rotation'");
  check_fails("[-1,0,0]", "[1,0,0]", "'rotation'");      // left-handed
  check_fails("[-1,0,0]", "[-1.01,0,0]", "'rotation'");  // stretched
  check_fails("\"rotation\"", "\"rot\"", "'rotation' is missing");
  for (const char* text : {"", "{", "{}", "7", "[7]", "[[]]", "[null]"}) {
    CAPTURE(text);
    CHECK(parse_cameras(text).code() == Errc::invalid_file);
  }
  CHECK(io::load_cameras("/none/cameras.json").code() == Errc::file_not_found);
}

TEST_CASE("cameras: saved and read again") {
  TempFolder folder("cameras_save");
  std::vector<Camera> cameras;
  for (int i = 0; i < 20; ++i) {
    cameras.push_back(
        Camera::look_at({0.1 * i, 3.0 - i, 1.5}, {5, 0.3 * i, 0.5}, {0, 0, 1}, 640 + i, 480, 60 + i));
    cameras.back().fy *= 1.25;
  }
  REQUIRE(io::save_cameras(folder / "c.json", cameras).ok());
  const std::vector<Camera> again = io::load_cameras(folder / "c.json").value();
  REQUIRE(again.size() == 20);
  for (std::size_t i = 0; i < 20; ++i) {
    CHECK(again[i].width == cameras[i].width);
    CHECK(again[i].height == cameras[i].height);
    CHECK(again[i].fx == cameras[i].fx);
    CHECK(again[i].fy == cameras[i].fy);
    for (int r = 0; r < 3; ++r) {
      CHECK(std::fabs(again[i].viewmat.translation[r] - cameras[i].viewmat.translation[r]) < 1e-12);
      for (int k = 0; k < 3; ++k) {
        CHECK(again[i].viewmat.linear(r, k) == cameras[i].viewmat.linear(r, k));
      }
    }
  }
  cameras[3].cx += 1;
  const Status off = io::save_cameras(folder / "c.json", cameras);
  CHECK(off.code() == Errc::unsupported);
  CHECK(contains(off.message(), "camera 3"));
  CHECK(io::save_cameras(folder / "no/c.json", {}).code() == Errc::file_not_found);
}

TEST_CASE("cameras: the real views stand upright at eye level") {
  const std::string path = data_file("cameras/lacadiere_eye_level.json");
  if (path.empty()) return;
  const std::vector<Camera> cameras = io::load_cameras(path).value();
  CHECK(cameras.size() == 22);
  for (const Camera& c : cameras) {
    CHECK(c.width == 1280);
    CHECK(c.height == 960);
    CHECK(std::fabs(2 * std::atan(640 / c.fx) * 180 / 3.14159265358979 - 75) < 1e-6);
    CHECK(c.position().z > 0);
    CHECK(c.position().z < 2);
    CHECK(c.viewmat.linear(1, 2) < -0.8);  // down in the image is down in the world
  }
}
