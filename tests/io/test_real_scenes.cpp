// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "gsnav/backends/serial.hpp"
#include "gsnav/io/scene_file.hpp"
#include "gsnav/scene/basic_renderer.hpp"
#include "real_scenes.hpp"
#include "support/compiled_frames.hpp"
#include "support/sanitized.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

/// Box of the middle nine tenths along each axis.
Aabb<double> middle_of(const GaussianCloud& cloud) {
  Aabb<double> box;
  std::vector<double> along(cloud.size());
  for (int k = 0; k < 3; ++k) {
    for (std::size_t i = 0; i < along.size(); ++i) along[i] = cloud.mean(i)[k];
    std::sort(along.begin(), along.end());
    box.low[k] = along[along.size() / 20];
    box.high[k] = along[along.size() - 1 - along.size() / 20];
  }
  return box;
}

}  // namespace

TEST_CASE("real scenes: every file is read, fits its report and is seen") {
  const std::vector<std::string> scenes = real_scenes();
  if (scenes.empty()) return;
  CHECK(scenes.size() >= 18);
  SerialBackend backend;
  BasicRenderer<float, SerialBackend> renderer(backend);
  for (const std::string& path : scenes) {
    CAPTURE(path);
    const auto loaded = io::load_scene(path);
    CAPTURE(loaded.message());
    REQUIRE(loaded.ok());
    const LoadReport& r = loaded->report;
    const GaussianCloud& cloud = loaded->cloud;
    CHECK(cloud.size() > 0);
    CHECK(r.kept == cloud.size());
    CHECK(r.read == r.kept + r.dropped());
    CHECK(r.memory == cloud.bytes());
    CHECK(r.sh_degree_used <= r.sh_degree);
    CHECK(norm(r.up) == 1);
    for (std::size_t i = 0; i < cloud.size(); i += 97) {
      const Vec3d m = cloud.mean(i);
      for (int k = 0; k < 3; ++k)
        REQUIRE((m[k] >= r.bounds.low[k] - 1e-3 && m[k] <= r.bounds.high[k] + 1e-3));
    }
    // From outside, where there is something in the picture; from within nothing but finite colours is
    // promised.
    const Aabb<double> box = middle_of(cloud);
    const Vec3d centre = (box.low + box.high) * 0.5, size = box.high - box.low;
    for (const double distance : {1.5, 0.0}) {
      if ((distance == 0 || kSanitized) && cloud.size() > 200000) continue;  // time
      const Vec3d eye = centre + Vec3d{0.3, -0.4, 1.0} * (distance * norm(size));
      const Camera camera =
          Camera::look_at(eye, distance > 0 ? centre : centre + Vec3d{1, 0, 0}, {0, -1, 0}, 12, 9, 60);
      const auto frames = renderer.render(cloud.set(), camera).value();
      double covered = 0;
      bool finite = true;
      for (const float a : frames.alpha) covered += static_cast<double>(a);
      for (const float c : frames.rgb) finite = finite && std::isfinite(c);
      CHECK(finite);
      if (distance > 0) CHECK(covered / static_cast<double>(frames.alpha.size()) > 0.01);
    }
  }
}
