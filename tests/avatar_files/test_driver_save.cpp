// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "avatar_files/bodies.hpp"
#include "gsnav/detail/avatar/capsule_track.hpp"
#include "gsnav/detail/demo/humanoid.hpp"
#include "gsnav/detail/io/avatar_file.hpp"
#include "gsnav/detail/io/motion_file.hpp"
#include "gsnav/detail/rigging/capsule_fit.hpp"
#include "support/files.hpp"

using namespace gsnav;
using namespace gsnav_test;

TEST_CASE("a driver and its capsules come back, and the capsules find their joints") {
  const TempFolder folder("driver_save");
  const AvatarAsset person = make_humanoid({.gaussians = 4000});
  const WalkMotion walk = WalkMotion::create(person.skeleton).value();
  io::DriverFrames frames;
  frames.frame_rate = 25;
  frames.joints = person.skeleton.size();
  LocalPose pose;
  for (int t = 0; t < 20; ++t) {
    walk.pose(t / 20.0, 1.0, 0.0, pose);
    auto joints = joints_at(person.skeleton, pose);
    for (auto& m : joints) m.translation += Vec3d{0.05 * t, 0, 2};
    frames.matrices.insert(frames.matrices.end(), joints.begin(), joints.end());
    auto& row = frames.capsules.emplace_back();
    for (const ProxyCapsule& c : person.capsules)
      row.push_back({joints[c.joint] * c.p0, joints[c.joint] * c.p1, c.radius});
  }
  REQUIRE(io::save_driver(folder / "d.npz", frames).ok());
  const auto driver = io::load_driver(folder / "d.npz", person.skeleton);
  CAPTURE(driver.status().message());
  REQUIRE(driver.ok());
  CHECK(driver->clip.frames() == 20);
  CHECK(driver->clip.frame_rate == 25);
  REQUIRE(driver->capsules.size() == 20);
  double worst = 0;
  for (std::size_t t = 0; t < 20; ++t) {
    for (std::size_t c = 0; c < person.capsules.size(); ++c) {
      worst = std::max(worst, norm(driver->capsules[t][c].p0 - frames.capsules[t][c].p0));
    }
  }
  CHECK(worst < 1e-6);
  const TrackedCapsules tracked =
      capsules_from_track(person.skeleton, driver->clip, driver->capsules).value();
  CHECK(tracked.error < 2e-6);
  REQUIRE(tracked.capsules.size() == person.capsules.size());
  for (std::size_t c = 0; c < person.capsules.size(); ++c) {
    // In a pose of the clip: joints that do not move against each other in it are as good as one.
    const Affine3<double>* joints = &frames.matrices[7 * person.skeleton.size()];
    const ProxyCapsule &a = tracked.capsules[c], &b = person.capsules[c];
    CHECK(norm(joints[a.joint] * a.p0 - joints[b.joint] * b.p0) < 1e-5);
    CHECK(a.radius == doctest::Approx(b.radius).epsilon(1e-6));
  }
  CHECK_FALSE(capsules_from_track(person.skeleton, driver->clip, {}).ok());

  const auto fails = [&](auto change, const char* part) {
    io::DriverFrames bad = frames;
    change(bad);
    const Status s = io::save_driver(folder / "bad.npz", bad);
    CAPTURE(s.message());
    CHECK(s.code() == Errc::invalid_argument);
    CHECK(s.message().find(part) != std::string::npos);
  };
  fails([](auto& f) { f.frame_rate = 0; }, "frame_rate");
  fails([](auto& f) { f.matrices.pop_back(); }, "no multiple of 55");
  fails([](auto& f) { f.matrices.clear(); }, "matrices");
  fails([](auto& f) { f.matrices[3].translation.y = NAN; }, "not finite");
  fails([](auto& f) { f.matrices[58].linear = f.matrices[58].linear * 2.0; },
        "frame 1, joint 3 is not rigid");
  fails([](auto& f) { f.matrices[3].linear(1, 1) = NAN; }, "frame 0, joint 3 is not rigid");
  fails([](auto& f) { f.capsules[1][0].radius = -1; }, "negative radius");
  fails([](auto& f) { f.capsules[1][0].p1.x = NAN; }, "not finite");
  fails([](auto& f) { f.capsules.pop_back(); }, "another number of frames");
  fails([](auto& f) { f.capsules[2].pop_back(); }, "different numbers");
  CHECK(io::save_driver("/none/there/d.npz", frames).code() == Errc::file_not_found);
}

TEST_CASE("an avatar's capsules are in its file") {
  const TempFolder folder("avatar_capsules");
  const AvatarAsset person = make_humanoid({.gaussians = 4000});
  REQUIRE(io::save_avatar(folder / "a.npz", person).ok());
  const auto back = io::load_avatar(folder / "a.npz");
  CAPTURE(back.status().message());
  REQUIRE(back.ok());
  REQUIRE(back->asset.capsules.size() == person.capsules.size());
  for (std::size_t c = 0; c < person.capsules.size(); ++c) {
    CHECK(back->asset.capsules[c].joint == person.capsules[c].joint);
    CHECK(back->asset.capsules[c].p0 == person.capsules[c].p0);
    CHECK(back->asset.capsules[c].p1 == person.capsules[c].p1);
    CHECK(back->asset.capsules[c].radius == person.capsules[c].radius);
  }
}
