// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "allocations.hpp"
#include "check_cloud.hpp"
#include "gsnav/core/rng.hpp"
#include "gsnav/detail/io/lod_set.hpp"
#include "gsnav/detail/io/ply.hpp"
#include "gsnav/detail/io/sog.hpp"
#include "gsnav/io/scene_file.hpp"
#include "support/data.hpp"
#include "support/sanitized.hpp"

using namespace gsnav;
using io::LoadedLodSet;
using namespace gsnav_test;

namespace {

/// Writes a SOG of n Gaussians whose x says which they are: base, base + 1, ...
void write_sog(const std::filesystem::path& path, std::size_t n, double base) {
  PlyFile file;
  file.properties = inria_properties(0, "double");
  file.rows = random_rows(n, 0, 91);
  for (std::size_t i = 0; i < n; ++i) file.rows[i]["x"] = base + static_cast<double>(i);
  const GaussianCloud cloud = io::parse_ply(bytes_of(file.text()), "rows").value().cloud;
  std::filesystem::create_directories(path.parent_path());
  REQUIRE(io::save_sog(path, cloud).ok());
}

struct LodFolder {
  TempFolder folder{"lod"};
  std::string files = R"(["0_0/meta.json","1_0.sog","gone/meta.json"])";
  std::string first = R"({"0":{"file":0,"offset":0,"count":6},"1":{"file":1,"offset":0,"count":2}})";
  std::string second = R"({"0":{"file":0,"offset":6,"count":4},"1":{"file":1,"offset":2,"count":1}})";
  std::string extra;

  LodFolder() {
    write_sog(folder / "0_0/meta.json", 10, 0);
    write_sog(folder / "1_0.sog", 3, 100);
    write_sog(folder / "far/meta.json", 2, 200);
  }
  std::string text() const {
    return R"({"lodLevels":3,"filenames":)" + files + extra +
           R"(,"tree":{"bound":{},"children":[{"lods":)" + first + R"(},{"children":[{"lods":)" +
           second + "}]}]}}";
  }
  Result<LoadedCloud> load(const io::LoadLodOptions& options = {}) const {
    write_file(folder / "lod-meta.json", text());
    return io::load_lod_set(folder.path(), options);
  }
  void fails(Errc code, const std::string& part, const io::LoadLodOptions& options = {}) const {
    const auto result = load(options);
    CAPTURE(part);
    CAPTURE(result.message());
    CHECK(result.code() == code);
    CHECK(contains(result.message(), part));
  }
};

std::vector<int> which(const GaussianCloud& cloud) {
  std::vector<int> out;
  for (std::size_t i = 0; i < cloud.size(); ++i)
    out.push_back(static_cast<int>(std::lround(cloud.mean(i).x)));
  return out;
}

}  // namespace

TEST_CASE("lod set: each level, and only its rows") {
  LodFolder set;
  const LoadedCloud fine = set.load().value();
  check_consistent(fine);
  CHECK(which(fine.cloud) == std::vector<int>{0, 1, 2, 3, 4, 5, 6, 7, 8, 9});
  CHECK(fine.report.warnings.empty());
  CHECK(which(set.load({.level = 1}).value().cloud) == std::vector<int>{100, 101, 102});
  // By the file's name and by its folder, as a scene.
  const std::string name = (set.folder / "lod-meta.json").string();
  CHECK(io::load_scene(name).value().cloud.size() == 10);
  CHECK(io::load_scene(set.folder.path().string(), {.level = 1}).value().cloud.size() == 3);
  // Rows in the middle of a file.
  set.first = R"({"0":{"file":0,"offset":2,"count":3}})";
  CHECK(which(set.load().value().cloud) == std::vector<int>{2, 3, 4, 6, 7, 8, 9});
}

TEST_CASE("lod set: levels that are not there") {
  LodFolder set;
  // The coarser one first, else the finer.
  set.first = R"({"0":{"file":2,"offset":0,"count":6},"1":{"file":1,"offset":0,"count":2}})";
  const LoadedCloud mixed = set.load().value();
  CHECK(which(mixed.cloud) == std::vector<int>{6, 7, 8, 9, 100, 101});
  REQUIRE(mixed.report.warnings.size() == 1);
  CHECK(mixed.report.warnings[0] == "level 0 of 1 of 2 nodes is not there: level 1 is read");
  // No entry is another thing: nothing of the node is left there.
  CHECK(set.load({.level = 2}).value().cloud.size() == 0);
  const std::string second = set.second;
  set.second = R"({"0":{"file":0,"offset":6,"count":4},"2":{"file":2,"offset":0,"count":1}})";
  CHECK(which(set.load({.level = 2}).value().cloud) == std::vector<int>{6, 7, 8, 9});
  set.second = second;
  set.first = R"({"0":{"file":2,"offset":0,"count":6}})";
  set.fails(Errc::file_not_found, "gone/meta.json");
  set.first = "{}";
  CHECK(set.load().value().cloud.size() == 4);
  set.fails(Errc::invalid_argument, "level 3 is asked for, the set has 0 to 2", {.level = 3});
  set.fails(Errc::invalid_argument, "level -1", {.level = -1});
}

TEST_CASE("lod set: the environment") {
  LodFolder set;
  set.extra = R"(,"environment":"far/meta.json")";
  CHECK(set.load().value().cloud.size() == 12);
  CHECK(set.load({.environment = false}).value().cloud.size() == 10);
  set.extra = R"(,"environment":null)";
  CHECK(set.load().value().cloud.size() == 10);
  set.extra = R"(,"environment":"nowhere.sog")";
  const LoadedCloud without = set.load().value();
  REQUIRE(without.report.warnings.size() == 1);
  CHECK(contains(without.report.warnings[0], "nowhere.sog is not there"));
  set.extra = R"(,"environment":"../far/meta.json")";
  set.fails(Errc::invalid_file, "environment");
}

TEST_CASE("lod set: what makes no sense") {
  LodFolder set;
  const std::string first = set.first, files = set.files;
  for (const char* bad :
       {R"({"0":{"file":3,"offset":0,"count":1}})", R"({"0":{"file":-1,"offset":0,"count":1}})",
        R"({"0":{"file":0,"offset":-1,"count":1}})", R"({"0":{"file":0,"offset":0}})",
        R"({"0":{"file":0,"offset":0,"count":1e300}})", R"({"0":7})", "[]", "7"}) {
    set.first = bad;
    set.fails(Errc::invalid_file, "lod-meta.json");
  }
  set.first = R"({"0":{"file":0,"offset":0,"count":7}})";
  set.fails(Errc::invalid_file, "two nodes share rows of 0_0/meta.json from 6");
  set.first = R"({"0":{"file":0,"offset":10,"count":1}})";
  set.fails(Errc::invalid_file, "rows 10 and 1 from there on");
  set.first = first;
  for (const char* bad :
       {R"(["../0_0/meta.json","1_0.sog"])", R"(["/etc/passwd","a"])", R"([1,2,3])", "7"}) {
    set.files = bad;
    set.fails(Errc::invalid_file, "filenames");
  }
  set.files = files;
  for (const char* text : {"", "{}", "[]", R"({"lodLevels":0})", R"({"lodLevels":1,"filenames":[]})",
                           R"({"lodLevels":1,"filenames":[],"tree":[]})",
                           R"({"lodLevels":1,"filenames":[],"tree":{"children":7}})"}) {
    write_file(set.folder / "lod-meta.json", text);
    CHECK(io::load_lod_set(set.folder.path()).code() == Errc::invalid_file);
  }
  CHECK(io::load_lod_set(set.folder / "none").code() == Errc::file_not_found);
  // A tree deeper than any stack.
  std::string deep = R"({"lodLevels":1,"filenames":[],"tree":)";
  for (int k = 0; k < 100000; ++k) deep += R"({"children":[)";
  for (int k = 0; k < 100000; ++k) deep += "]}";
  write_file(set.folder / "lod-meta.json", deep + "}");
  const Status refused = io::load_lod_set(set.folder.path()).status();
  CHECK(refused.code() == Errc::unsupported);
  CHECK(refused.message().find("json_depth") != std::string::npos);
}

TEST_CASE("lod set: levels to be drawn by view, each box's own") {
  LodFolder set;
  const LoadedLodSet levels = [&] {
    static_cast<void>(set.load());  // writes the file
    return io::load_lod_levels(set.folder.path()).value().value();
  }();
  CHECK(levels.report.kept == 10);
  REQUIRE(levels.tree.roots.size() == 2);
  REQUIRE(levels.tree.boxes.size() == 4);
  const auto rows = [](const GaussianCloud& cloud, const LodBox& place) {
    std::vector<int> out;
    for (std::size_t i = 0; i < place.rows; ++i) {
      out.push_back(static_cast<int>(std::lround(cloud.mean(place.first_chunk * kProjectChunk + i).x)));
    }
    std::sort(out.begin(), out.end());
    return out;
  };
  const std::vector<LodBox>& places = levels.tree.boxes;
  CHECK(rows(levels.cloud, places[0]) == std::vector<int>{0, 1, 2, 3, 4, 5});
  CHECK(rows(levels.cloud, places[1]) == std::vector<int>{6, 7, 8, 9});
  CHECK(rows(levels.tree.merged, places[2]) == std::vector<int>{100, 101});
  CHECK(rows(levels.tree.merged, places[3]) == std::vector<int>{102});
  CHECK(places[2].finer == 0);
  CHECK(places[3].finer == 1);
  // All masses are within one box: the errors are between the least and the largest distance of the two.
  CHECK(levels.tree.nodes[2].error > 94);
  CHECK(levels.tree.nodes[2].error < 101);
  // As a scene; the environment stays whole.
  set.extra = R"(,"environment":"far/meta.json")";
  static_cast<void>(set.load());
  const auto scene = io::load_shipped_levels(set.folder.path().string()).value();
  REQUIRE(scene.has_value());
  REQUIRE(scene->tree.roots.size() == 3);
  CHECK(rows(scene->cloud, scene->tree.boxes[2]) == std::vector<int>{200, 201});
  CHECK(scene->tree.boxes[scene->tree.roots[2]].finer == LodBox::kNone);
  // From the coarser level on nothing is above, and what is no set ships nothing.
  CHECK(!io::load_shipped_levels(set.folder.path().string(), {.level = 1}).value().has_value());
  CHECK(!io::load_shipped_levels((set.folder / "1_0.sog").string()).value().has_value());
  CHECK(!io::load_shipped_levels((set.folder / "none").string()).value().has_value());
}

TEST_CASE("lod set: levels that make no sense, or are not there") {
  LodFolder set;
  const auto refused = [&](Errc code, const char* part, const io::LoadLodOptions& options = {}) {
    write_file(set.folder / "lod-meta.json", set.text());
    const auto result = io::load_lod_levels(set.folder.path(), options);
    CAPTURE(result.message());
    CHECK(result.code() == code);
    CHECK(contains(result.message(), part));
    CHECK(contains(result.message(), "lod-meta.json"));
  };
  const std::string first = set.first;
  // Two levels of two nodes share rows; the same rows for both levels of one node are one level.
  set.first = R"({"0":{"file":0,"offset":0,"count":6},"1":{"file":0,"offset":5,"count":2}})";
  refused(Errc::invalid_file, "two nodes share rows of 0_0/meta.json from 5");
  set.first = R"({"0":{"file":0,"offset":0,"count":6},"1":{"file":0,"offset":0,"count":6}})";
  write_file(set.folder / "lod-meta.json", set.text());
  CHECK(io::load_lod_levels(set.folder.path()).value().value().tree.boxes.size() == 3);
  for (const char* bad :
       {R"({"0":{"file":0,"offset":0,"count":6},"1":{"file":9,"offset":0,"count":2}})",
        R"({"0":{"file":0,"offset":0,"count":6},"1":{"file":1,"offset":-1,"count":2}})",
        R"({"0":{"file":0,"offset":0,"count":6},"1":{"file":1,"offset":0}})"}) {
    set.first = bad;
    refused(Errc::invalid_file, "level 1");
  }
  set.first = R"({"0":{"file":0,"offset":0,"count":6},"1":{"file":1,"offset":0,"count":9}})";
  write_file(set.folder / "lod-meta.json", set.text());
  CHECK(io::load_lod_levels(set.folder.path()).code() == Errc::invalid_file);
  // A coarser level that is not there is left out.
  set.first = R"({"0":{"file":0,"offset":0,"count":6},"1":{"file":2,"offset":0,"count":2}})";
  write_file(set.folder / "lod-meta.json", set.text());
  CHECK(io::load_lod_levels(set.folder.path()).value().value().tree.boxes.size() == 3);
  set.first = first;
  refused(Errc::invalid_argument, "level 3", {.level = 3});
  write_file(set.folder / "lod-meta.json", "{");
  CHECK(io::load_lod_levels(set.folder.path()).code() == Errc::invalid_file);
  CHECK(io::load_lod_levels(set.folder / "none").code() == Errc::file_not_found);
}

TEST_CASE("lod set: the levels of a damaged set fit their cloud, or it is refused") {
  LodFolder set;
  set.extra = R"(,"environment":"far/meta.json")";
  const std::string text = set.text();
  Rng rng(77);
  int taken = 0;
  const std::string letters = "0123456789{}[],:\"-.eE tf";
  for (int run = 0; run < 1500; ++run) {
    std::string bad = text;
    for (int k = 0; k < 1 + run % 3; ++k) {
      const std::size_t at = static_cast<std::size_t>(rng.uniform() * static_cast<double>(bad.size()));
      if (rng.uniform() < 0.2) {
        bad.erase(at, 1 + static_cast<std::size_t>(rng.uniform() * 20));
      } else {
        bad[at] = letters[static_cast<std::size_t>(rng.uniform() * static_cast<double>(letters.size()))];
      }
    }
    write_file(set.folder / "lod-meta.json", bad);
    const auto read = io::load_lod_levels(set.folder.path());
    if (!read) {
      CHECK(!read.message().empty());
      continue;
    }
    const auto& got = *read;
    if (!got) continue;
    ++taken;
    for (const LodBox& p : got->tree.boxes) {
      const GaussianCloud& of = p.finer == LodBox::kNone ? got->cloud : got->tree.merged;
      CHECK(p.first_chunk + p.chunks <= of.view().chunk_count());
      CHECK(p.rows <= p.chunks * kProjectChunk);
    }
    for (const LodNode& n : got->tree.nodes) CHECK((n.error >= 0 && is_finite(n.error)));
  }
  CHECK(taken > 50);
}

TEST_CASE("lod set: real sets, level by level") {
  const std::string playbot = data_file("splats/playcanvas/playbot/lod-meta.json");
  if (!playbot.empty()) {
    const std::uint64_t counts[] = {250000, 250000, 125000, 31000, 8406, 3000, 1873};  // 0 is not there
    for (int level = 0; level < 7; ++level) {
      const LoadedCloud loaded = io::load_lod_set(playbot, {.level = level}).value();
      check_consistent(loaded);
      CHECK(loaded.report.read == counts[level]);
      CHECK(loaded.report.warnings.size() == (level == 0 ? 1 : 0));
    }
    CHECK(io::load_lod_levels(playbot).value().value().report.read == 250000);
  }
  const std::string showroom = data_file("splats/lacadiere_showroom");
  if (!showroom.empty()) {
    CHECK(io::load_lod_set(showroom, {.level = 3}).value().report.read == 746973);
    if (kSanitized) return;  // half a minute; the levels of the other set are taken there too
    CHECK(io::load_lod_set(showroom, {.level = 2}).value().report.read == 1495636);
    const LoadedLodSet levels = io::load_lod_levels(showroom).value().value();
    CHECK(levels.report.read == 1495636);
    CHECK(levels.tree.roots.size() == 362);
    CHECK(levels.tree.boxes.size() == 362 + 356);
  }
}
