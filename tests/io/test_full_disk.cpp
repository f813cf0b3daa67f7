// SPDX-License-Identifier: Apache-2.0
// Every writer of io on a disk that is full: what had the name stays, and nothing else is left.
#include <doctest/doctest.h>

#include <functional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "gsnav/detail/io/cameras_file.hpp"
#include "gsnav/detail/io/episode_file.hpp"
#include "gsnav/detail/io/gltf.hpp"
#include "gsnav/detail/io/npz_file.hpp"
#include "gsnav/io/image_file.hpp"
#include "gsnav/io/scene_file.hpp"
#include "row_clouds.hpp"
#include "support/small_disk.hpp"

using namespace gsnav;
using namespace gsnav_test;
namespace fs = std::filesystem;

namespace {

/// Writes something small, or much more than the disk has.
struct Writer {
  std::string name;
  std::function<Status(const fs::path&, bool)> write;
};

std::vector<Writer> all_writers() {
  std::vector<Writer> all;
  static const GaussianCloud small = cloud_of_random_rows(40, 3, 61),
                             large = cloud_of_random_rows(9000, 3, 62);
  for (const char* name :
       {"a.ply", "a.compressed.ply", "a.splat", "a.spz", "a.sog", "a.glb", "meta.json"}) {
    all.push_back(
        {name, [](const fs::path& p, bool much) { return io::save_scene(p, much ? large : small); }});
  }
  static std::vector<float> noise;
  noise.clear();
  for (std::uint32_t i = 0, x = 1; i < 300000; ++i)
    noise.push_back(static_cast<float>((x = x * 1664525 + 1013904223) >> 8) / (1 << 24));
  const auto some = [](bool much) {
    return std::span<const float>(noise).first(much ? 3 * 300 * 300 : 3 * 10 * 10);
  };
  all.push_back({"a.png", [=](const fs::path& p, bool much) {
                   return io::save_png_rgb(p, some(much), much ? 300 : 10, much ? 300 : 10);
                 }});
  all.push_back({"a.npy", [=](const fs::path& p, bool much) {
                   const std::size_t shape[] = {some(much).size()};
                   return io::save_npy(p, some(much), shape);
                 }});
  all.push_back({"a.npz", [=](const fs::path& p, bool much) {
                   io::NpzEntry entry;
                   entry.name = "x";
                   entry.shape = {some(much).size()};
                   entry.values = some(much);
                   return io::save_npz(p, std::span(&entry, 1), false);
                 }});
  all.push_back({"a.json", [](const fs::path& p, bool much) {
                   const std::vector<Camera> cameras(
                       much ? 3000 : 3, Camera::look_at({1, 2, 3}, {}, {0, 1, 0}, 64, 48, 60));
                   return io::save_cameras(p, cameras);
                 }});
  for (const char* name : {"e.json", "e.json.gz"}) {
    all.push_back({name, [](const fs::path& p, bool much) {
                     std::vector<PointNavEpisode> episodes(much ? 30000 : 3);
                     for (std::size_t i = 0; i < episodes.size(); ++i) {
                       episodes[i].id = std::to_string(i);
                       episodes[i].goal_position = {static_cast<double>(noise[i]), 0,
                                                    static_cast<double>(noise[2 * i])};
                     }
                     return io::save_episodes(p, episodes);
                   }});
  }
  return all;
}

std::set<std::pair<std::string, std::string>> contents_of(const fs::path& folder) {
  std::set<std::pair<std::string, std::string>> all;
  for (const auto& entry : fs::directory_iterator(folder)) {
    all.emplace(entry.path().filename().string(), read_file(entry.path()));
  }
  return all;
}

}  // namespace

TEST_CASE("writers: a full disk leaves the file of before, and no other") {
  for (const Writer& w : all_writers()) {
    CAPTURE(w.name);
    const TempFolder folder("full_disk");
    const SmallDisk disk(folder.path(), 160);
    if (!disk.mounted()) return;
    // First where there is none, then over one.
    for (const bool there : {false, true}) {
      CAPTURE(there);
      if (there) REQUIRE(w.write(folder / w.name, false).ok());
      const auto before = contents_of(folder.path());
      const Status s = w.write(folder / w.name, true);
      CHECK(s.code() == Errc::write_failed);
      CAPTURE(s.message());
      CHECK(contains(s.message(), "cannot be written: No space left on device"));
      CHECK(contents_of(folder.path()) == before);
    }
  }
}

TEST_CASE("save_sog: a folder's scene is whole until the new one is") {
  const TempFolder folder("sog_again");
  const auto meta = folder / "meta.json";
  const GaussianCloud first = cloud_of_random_rows(50, 3, 63), second = cloud_of_random_rows(70, 1, 64);
  write_file(folder / "notes.webp", "not of a scene");
  REQUIRE(io::save_scene(meta, first).ok());
  const auto before = contents_of(folder.path());
  CHECK(before.size() == 9);
  REQUIRE(io::save_scene(meta, second).ok());
  const auto after = contents_of(folder.path());
  CHECK(after.size() == 9);  // nothing of the first is left
  CHECK(io::load_scene(folder.path().string()).value().cloud.size() == 70);
  // Whenever the second was stopped, meta.json had named what lay there: no image of the first was
  // touched.
  for (const auto& [name, content] : after) {
    for (const auto& [old_name, old_content] : before) {
      if (name != "meta.json" && name != "notes.webp") CHECK(name != old_name);
    }
  }
  REQUIRE(io::save_scene(meta, first).ok());
  CHECK(contents_of(folder.path()) == before);
  // What a killed writer left goes with the next.
  write_file(folder / "means_l.7.webp", "half");
  REQUIRE(io::save_scene(meta, second).ok());
  CHECK_FALSE(fs::exists(folder / "means_l.7.webp"));
  CHECK(io::load_scene(folder.path().string()).value().cloud.size() == 70);
}
