// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cmath>

#include "files.hpp"
#include "gsnav/device/renderer.hpp"
#include "gsnav/io/scene_file.hpp"
#include "gsnav/nav.hpp"
#include "gsnav/open.hpp"

using namespace gsnav;
using namespace gsnav_test;

TEST_CASE("framing camera: stands on the NavMesh at eye height and looks along free floor") {
  OpenOptions o;
  o.density = 0.05;
  o.navmesh = "auto";
  const OpenedScene flat = open_scene("default", o).value();
  const Camera camera = framing_camera(flat, 320, 240, 80).value();
  CHECK(camera.width == 320);
  CHECK(camera.fx == doctest::Approx(160 / std::tan(40 * 3.14159265358979323846 / 180)));
  const Vec3d eye = camera.position();
  const auto under = flat.scene->navmesh->snap_point(eye - Vec3d{0, 1.5, 0}, {{0.01, 0.3, 0.01}});
  REQUIRE(under);
  // Level, and the floor ahead is free for metres.
  const Vec3d ahead = camera.viewmat.linear.row[2];
  CHECK(std::abs(ahead.y) < 0.05);
  const Vec3d there = under->position + 3.0 * ahead;
  const auto way = flat.scene->navmesh->find_path(under->position, there).value();
  CHECK(way.length == doctest::Approx(3).epsilon(0.02));
}

TEST_CASE("framing camera: without a NavMesh a scan is seen from outside, upright") {
  const TempFolder folder("open_framing");
  const std::string file = (folder / "room.ply").string();
  REQUIRE(io::save_ply(file, room_z_up()).ok());
  for (const char* up : {"auto", "keep"}) {
    for (const CloudStorage storage : {CloudStorage::full, CloudStorage::packed}) {
      CAPTURE(up);
      OpenOptions o;
      o.up = up;
      o.storage = storage;
      const OpenedScene room = open_scene(file, o).value();
      const Camera camera = framing_camera(room, 64, 64).value();
      auto renderer = Renderer::create(o.device, room.scene).value();
      const auto frame = renderer.render(camera).value();
      // The middle of what is drawn is in the image, and the floor below the middle.
      double upper = 0, lower = 0;
      for (std::size_t i = 0; i < frame.alpha.size(); ++i)
        (i < frame.alpha.size() / 2 ? upper : lower) += static_cast<double>(frame.alpha[i]);
      CHECK(lower > 400);
      CHECK(lower > upper);
      const auto around = views_around(room, 3, 64, 64).value();
      REQUIRE(around.size() == 3);
      CHECK(norm(around[0].position() - camera.position()) < 1e-9);
    }
  }
}

TEST_CASE("framing camera: triangles alone are framed, and what cannot be is said") {
  const TempFolder folder("open_framing_mesh");
  write_file(folder / "floor.obj", floor_obj(3));
  const OpenedScene floor = open_scene((folder / "floor.obj").string()).value();
  const Camera camera = framing_camera(floor, 64, 48).value();
  CHECK(camera.position().y > 0.5);
  // The floor's middle is at the image's.
  const Vec3d middle = camera.viewmat * Vec3d{};
  CHECK(std::abs(middle.x / middle.z) < 1e-9);
  CHECK(std::abs(middle.y / middle.z) < 1e-9);
  CHECK(framing_camera(floor, 0, 48).code() == Errc::invalid_argument);
  CHECK(framing_camera(floor, 64, 48, 180).code() == Errc::invalid_argument);
  CHECK(framing_camera({}, 64, 48).code() == Errc::invalid_argument);
}
