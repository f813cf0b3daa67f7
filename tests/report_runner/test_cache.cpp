// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include "cache.hpp"
#include "support/files.hpp"
#include "support/scenes.hpp"

using namespace gsnav_report;
using namespace gsnav_test;

namespace {

Reference sample() {
  Reference r;
  r.width = 3;
  r.height = 2;
  for (int i = 0; i < 18; ++i) r.rgb.push_back(0.1f * static_cast<float>(i));
  r.alpha = {0, 0.25f, 0.5f, 0.75f, 1, 1};
  r.depth = {1, 2, 3, 4, 5, 6};
  r.undecided = {0, 0, 1, 0, 0, 0};
  r.evaluations = 123456789012345ull;
  return r;
}

}  // namespace

TEST_CASE("cache: an entry comes back whole") {
  const TempFolder folder("report_cache");
  const ReferenceCache cache(folder / "references");
  std::string warning;
  CHECK_FALSE(cache.load("h", warning));
  CHECK(warning.empty());
  const Reference r = sample();
  REQUIRE(cache.store("h", r).ok());
  const auto back = cache.load("h", warning);
  REQUIRE(back);
  CHECK(back->width == 3);
  CHECK(back->height == 2);
  CHECK(back->rgb == r.rgb);
  CHECK(back->alpha == r.alpha);
  CHECK(back->depth == r.depth);
  CHECK(back->undecided == r.undecided);
  CHECK(back->undecided_depth.empty());
  CHECK(back->evaluations == r.evaluations);
  CHECK_FALSE(ReferenceCache("").load("h", warning));
  CHECK(ReferenceCache("").store("h", r).ok());
}

TEST_CASE("cache: any damage is noticed") {
  const TempFolder folder("report_cache_damage");
  const ReferenceCache cache(folder / "references");
  REQUIRE(cache.store("h", sample()).ok());
  const std::string whole = read_file(cache.file("h"));
  std::string warning;
  const auto rejected = [&](const std::string& text) {
    write_file(cache.file("h"), text);
    return !cache.load("h", warning) && warning.find(cache.file("h").string()) != std::string::npos;
  };
  for (std::size_t at = 0; at < whole.size(); ++at) {
    CAPTURE(at);
    for (const int bit : {0, 7}) {
      std::string changed = whole;
      changed[at] = static_cast<char>(changed[at] ^ (1 << bit));
      CHECK(rejected(changed));
    }
  }
  for (std::size_t size = 0; size < whole.size(); size += 7) CHECK(rejected(whole.substr(0, size)));
  CHECK(rejected(whole + "x"));
  write_file(cache.file("h"), whole);
  CHECK(cache.load("h", warning));
}

TEST_CASE("hash: every array, the order of values and the camera count") {
  const gsnav::GaussianCloud cloud = random_cloud(1);
  const std::string hash = content_hash(cloud);
  CHECK(content_hash(random_cloud(1)) == hash);
  CHECK(content_hash(random_cloud(2)) != hash);
  auto changed = cloud;
  changed.shN.back() = std::nextafter(changed.shN.back(), 9.0f);
  CHECK(content_hash(changed) != hash);
  changed = cloud;
  std::swap(changed.means[0][3], changed.means[0][4]);
  CHECK(content_hash(changed) != hash);
  changed = cloud;
  changed.filter = gsnav::Filter::mip;
  CHECK(content_hash(changed) != hash);
  changed = cloud;
  changed.color_space = gsnav::ColorSpace::linear;
  CHECK(content_hash(changed) != hash);
  const auto camera_hash = [](const gsnav::Camera& c) {
    Hasher h;
    hash_camera(h, c);
    return h.hex();
  };
  gsnav::Camera a, b;
  CHECK(camera_hash(a) == camera_hash(b));
  b.near_plane = 0.1;
  CHECK(camera_hash(a) != camera_hash(b));
}
