// SPDX-License-Identifier: Apache-2.0
// The file beside an asset that keeps what is seen from where.
#include <doctest/doctest.h>

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <utility>

#include "gsnav/backends/openmp.hpp"
#include "gsnav/detail/io/visible_file.hpp"
#include "gsnav/scene/visible_sets.hpp"
#include "support/files.hpp"
#include "two_rooms.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

const GaussianCloud& rooms() {
  static const GaussianCloud cloud = two_rooms(2, 200);
  return cloud;
}
VisibleSettings coarse() {
  VisibleSettings s;
  s.face = 24;
  s.near_sigma = 1;
  return s;
}
const VisibleSets& sets() {
  static const VisibleSets made = [] {
    OpenMPBackend backend(2);
    return build_visible_sets(backend, rooms(), places_in_rooms(), coarse()).value();
  }();
  return made;
}

}  // namespace

TEST_CASE("visible sets file: what is read is what was written, whatever the colours") {
  const TempFolder folder("visible_file");
  REQUIRE(io::save_visible_sets(folder / "a.vis", sets(), rooms()).ok());
  GaussianCloud other_colors = rooms();
  other_colors.sh0[5] += 1;
  for (const GaussianCloud* cloud : {&rooms(), &std::as_const(other_colors)}) {
    const VisibleSets read = io::load_visible_sets(folder / "a.vis", *cloud).value();
    CHECK(read.cell == sets().cell);
    CHECK(read.focal == sets().focal);
    CHECK(read.near_plane == sets().near_plane);
    CHECK(read.near_sigma == 1);
    CHECK(read.min_weight == sets().min_weight);
    CHECK(read.cloud_chunks == sets().cloud_chunks);
    CHECK(read.viewpoints == places_in_rooms().size());
    CHECK(read.keys == sets().keys);
    CHECK(read.ends == sets().ends);
    CHECK(read.bits == sets().bits);
  }
}

TEST_CASE("visible sets file: truncated, damaged, too long, foreign: each is refused and says why") {
  const TempFolder folder("visible_bad");
  const auto path = folder / "a.vis";
  REQUIRE(io::save_visible_sets(path, sets(), rooms()).ok());
  const std::string good = read_file(path);
  const auto refused = [&](const std::string& content, Errc code) {
    write_file(path, content);
    const auto r = io::load_visible_sets(path, rooms());
    CHECK(r.code() == code);
    CHECK(contains(r.message(), "a.vis"));
  };
  for (std::size_t n = 0; n < good.size(); n += n < 128 ? 1 : good.size() / 50)
    refused(good.substr(0, n), Errc::invalid_file);
  refused(good + "x", Errc::invalid_file);
  refused(std::string(good.size(), '\0'), Errc::invalid_file);
  for (std::size_t at = 32; at < good.size(); at += at < 112 ? 1 : good.size() / 60) {
    std::string bad = good;
    bad[at] = static_cast<char>(bad[at] ^ 0x10);
    refused(bad, Errc::invalid_file);
  }
  std::string other = good;
  other[8] = 99;  // version
  refused(other, Errc::invalid_argument);
  // Counts whose sum of bytes would be right if it were not for its 64 bits.
  std::string huge = good;
  for (std::size_t k = 80; k < 104; ++k) huge[k] = '\xff';
  refused(huge, Errc::invalid_file);
  write_file(path, good);
  CHECK(io::load_visible_sets(path, two_rooms(3, 200)).code() == Errc::invalid_argument);
  CHECK(io::load_visible_sets(folder / "none.vis", rooms()).code() == Errc::file_not_found);
}

TEST_CASE("visible sets file: values that cannot be are refused though the checksum is right") {
  const TempFolder folder("visible_hostile");
  const auto refused = [&](auto change, const char* what) {
    VisibleSets bad = sets();
    change(bad);
    REQUIRE(io::save_visible_sets(folder / "a.vis", bad, rooms()).ok());
    const auto r = io::load_visible_sets(folder / "a.vis", rooms());
    CHECK(r.code() == Errc::invalid_file);
    CHECK(contains(r.message(), what));
  };
  refused([](auto& v) { v.cell = -1; }, "cell");
  refused([](auto& v) { v.focal = 0; }, "focal");
  refused([](auto& v) { v.near_plane = 0; }, "near_plane");
  refused([](auto& v) { v.near_sigma = -1; }, "near_sigma");
  refused([](auto& v) { v.min_weight = 2; }, "min_weight");
  refused([](auto& v) { std::swap(v.keys[0], v.keys[1]); }, "cell 1");
  REQUIRE(sets().cloud_chunks % 32 != 0);
  const auto of_cell = [](auto& v, std::size_t cell) {
    return v.bits.data() + (cell == 0 ? 0 : v.ends[cell - 1]);
  };
  refused([&](auto& v) { of_cell(v, 1)[v.words() - 1] |= 0x80000000u; }, "cell 1: a chunk");
  refused([&](auto& v) { of_cell(v, 1)[2 * v.words() - 1] += 1; },
          "cell 1: chunks that are not counted");
  refused([](auto& v) { v.ends[1] -= 1; }, "cell 1: not as many rows");
  refused([](auto& v) { std::swap(v.ends[0], v.ends[1]); }, "cell");
  refused([](auto& v) { v.ends[2] = ~std::uint64_t{0}; }, "cell 2: its end");
  refused([](auto& v) { v.bits.push_back(0); }, "words of no cell");
  refused(
      [](auto& v) {
        v.ends.back() -= kSeenRowWords;
        v.bits.resize(v.bits.size() - kSeenRowWords);
      },
      "not as many rows");
  // The last row of the last chunk that a cell sees there, which has fewer.
  REQUIRE(rooms().size() % kProjectChunk != 0);
  for (std::size_t c = 0; c < sets().cells(); ++c) {
    const std::size_t last = sets().cloud_chunks - 1;
    if ((sets().seen_from(c)[last / 32] >> (last % 32) & 1) == 0) continue;
    refused([&](auto& v) { v.bits[v.ends[c] - 1] |= 0x80000000u; }, "a row that the scene");
    return;
  }
  FAIL("no cell sees the last chunk");
}

TEST_CASE("visible sets file: of chunks alone") {
  const TempFolder folder("visible_chunks");
  OpenMPBackend backend(2);
  VisibleSettings settings = coarse();
  settings.rows = 0;
  const std::vector<Vec3d> eyes = places_in_rooms();
  const VisibleSets made =
      build_visible_sets(backend, rooms(), std::span(eyes).first(4), settings).value();
  REQUIRE(io::save_visible_sets(folder / "a.vis", made, rooms()).ok());
  const VisibleSets read = io::load_visible_sets(folder / "a.vis", rooms()).value();
  CHECK(read.ends == made.ends);
  CHECK(read.bits == made.bits);
}

TEST_CASE("visible sets file: cached beside the asset, by all that they are made of") {
  const TempFolder folder("visible_cache");
  OpenMPBackend backend(2);
  const std::string asset = (folder / "scene.ply").string();
  const auto eyes = places_in_rooms();
  const auto path = io::visible_sets_path(asset, rooms(), eyes, coarse());
  CHECK(path.parent_path() == folder.path());
  VisibleSettings other = coarse();
  other.min_weight *= 2;
  CHECK(path != io::visible_sets_path(asset, rooms(), eyes, other));
  other = coarse();
  other.rows = 4;
  CHECK(path != io::visible_sets_path(asset, rooms(), eyes, other));
  CHECK(path != io::visible_sets_path(asset, rooms(), std::span(eyes).first(9), coarse()));
  CHECK(path != io::visible_sets_path(asset, rooms(), eyes, coarse(), {{}, {1, 0, 0}, 1}));
  CHECK(path != io::visible_sets_path(asset, two_rooms(3, 200), eyes, coarse()));
  const auto build = [&] { return build_visible_sets(backend, rooms(), eyes, coarse()); };
  CHECK(io::cached_visible_sets(asset, rooms(), eyes, coarse(), {}, build).value().built);
  CHECK(std::filesystem::exists(path));
  CHECK_FALSE(io::cached_visible_sets(asset, rooms(), eyes, coarse(), {}, build).value().built);
  write_file(path, read_file(path).substr(0, 500));
  const auto repaired = io::cached_visible_sets(asset, rooms(), eyes, coarse(), {}, build).value();
  CHECK(repaired.built);
  CHECK(contains(repaired.warning, "bytes"));
  CHECK_FALSE(io::cached_visible_sets(asset, rooms(), eyes, coarse(), {}, build).value().built);
  std::filesystem::remove(path);
  const auto refuse = [] {
    VisibleSets sets;
    sets.refused_share = 0.95;
    return Result<VisibleSets>(std::move(sets));
  };
  const auto refused = io::cached_visible_sets(asset, rooms(), eyes, coarse(), {}, refuse).value();
  CHECK(refused.sets.refused_share == 0.95);
  CHECK(refused.warning.empty());
  CHECK_FALSE(std::filesystem::exists(path));
}
