// SPDX-License-Identifier: Apache-2.0
// The file beside an asset that keeps its levels of detail.
#include <doctest/doctest.h>

#include <cstring>
#include <string>

#include "gsnav/backends/serial.hpp"
#include "gsnav/detail/io/lod_file.hpp"
#include "gsnav/detail/scene/lod_build.hpp"
#include "lod_support.hpp"
#include "support/files.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

template <class T>
bool same(const std::vector<T>& a, const std::vector<T>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0;
}

}  // namespace

TEST_CASE("lod file: what is read is what was written") {
  const TempFolder folder("lod_file");
  SerialBackend backend;
  for (const bool far : {false, true}) {
    GaussianCloud cloud = small_wall(1, 3000, 2);
    if (far) {
      cloud.origins = {{0, 0, 0}, {128, 0, -64}};
      cloud.origin_ids.assign(cloud.size(), 1);
      bound_chunks(cloud);
    }
    const LodTree tree = build_lod(backend, cloud).value();
    REQUIRE(io::save_lod(folder / "a.lod", tree, cloud).ok());
    const LodTree read = io::load_lod(folder / "a.lod", cloud).value();
    for (std::size_t k = 0; k < 3; ++k) CHECK(same(read.merged.means[k], tree.merged.means[k]));
    for (std::size_t k = 0; k < 4; ++k) CHECK(same(read.merged.quats[k], tree.merged.quats[k]));
    for (std::size_t k = 0; k < 3; ++k) CHECK(same(read.merged.scales[k], tree.merged.scales[k]));
    CHECK(same(read.merged.opacities, tree.merged.opacities));
    CHECK(same(read.merged.sh0, tree.merged.sh0));
    CHECK(same(read.merged.shN, tree.merged.shN));
    CHECK(read.merged.origin_ids == tree.merged.origin_ids);
    CHECK(read.level_begin == tree.level_begin);
    REQUIRE(read.nodes.size() == tree.nodes.size());
    for (std::size_t i = 0; i < tree.nodes.size(); ++i) {
      CHECK(read.nodes[i].error == tree.nodes[i].error);
      CHECK(read.nodes[i].grain == tree.nodes[i].grain);
      CHECK(read.nodes[i].reach.low.x == tree.nodes[i].reach.low.x);
      CHECK(read.nodes[i].reach.scale_max == tree.nodes[i].reach.scale_max);
    }
    REQUIRE(read.merged.chunk_bounds.size() == tree.merged.chunk_bounds.size());
    for (std::size_t i = 0; i < tree.merged.chunk_bounds.size(); ++i) {
      CHECK(read.merged.chunk_bounds[i].high.y == tree.merged.chunk_bounds[i].high.y);
      CHECK(read.merged.chunk_bounds[i].opacity_max == tree.merged.chunk_bounds[i].opacity_max);
    }
  }
}

TEST_CASE("lod file: truncated, damaged, too long, foreign: each is refused and says why") {
  const TempFolder folder("lod_bad");
  SerialBackend backend;
  const GaussianCloud cloud = small_wall(2, 1500);
  const LodTree tree = build_lod(backend, cloud).value();
  const auto path = folder / "a.lod";
  REQUIRE(io::save_lod(path, tree, cloud).ok());
  const std::string good = read_file(path);
  const auto refused = [&](const std::string& content, Errc code) {
    write_file(path, content);
    const auto r = io::load_lod(path, cloud);
    CHECK(r.code() == code);
    CHECK(contains(r.message(), "a.lod"));
  };
  for (std::size_t n = 0; n < good.size(); n += n < 64 ? 1 : good.size() / 50)
    refused(good.substr(0, n), Errc::invalid_file);
  refused(good + "x", Errc::invalid_file);
  refused(std::string(good.size(), '\0'), Errc::invalid_file);
  for (std::size_t at = 40; at < good.size(); at += good.size() / 40) {
    std::string bad = good;
    bad[at] = static_cast<char>(bad[at] ^ 0x10);
    refused(bad, Errc::invalid_file);
  }
  std::string other = good;
  other[8] = 99;  // version
  refused(other, Errc::invalid_argument);
  write_file(path, good);
  CHECK(io::load_lod(path, small_wall(3, 1500)).code() == Errc::invalid_argument);
  LodSettings settings;
  settings.sh_degree = 0;
  CHECK(io::load_lod(path, cloud, settings).code() == Errc::invalid_argument);
  CHECK(io::load_lod(folder / "none.lod", cloud).code() == Errc::file_not_found);
  CHECK(io::load_lod(folder.path(), cloud).code() == Errc::file_not_found);
}

TEST_CASE("lod file: values that cannot be are refused though the checksum is right") {
  const TempFolder folder("lod_hostile");
  SerialBackend backend;
  const GaussianCloud cloud = small_wall(4, 1500);
  const LodTree tree = build_lod(backend, cloud).value();
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const auto refused = [&](const LodTree& bad, const char* what) {
    REQUIRE(io::save_lod(folder / "a.lod", bad, cloud).ok());
    const auto r = io::load_lod(folder / "a.lod", cloud);
    CHECK(r.code() == Errc::invalid_file);
    CHECK(contains(r.message(), what));
  };
  LodTree bad = tree;
  bad.merged.opacities[7] = 2;
  refused(bad, "row 7: opacity 2");
  bad = tree;
  bad.merged.scales[1][3] = -1;
  refused(bad, "row 3: a scale");
  bad = tree;
  bad.merged.quats[0][5] = nan;
  refused(bad, "row 5: a quaternion");
  bad = tree;
  bad.merged.means[2][0] = nan;
  refused(bad, "a mean");
  bad = tree;
  bad.merged.shN[11] = nan;
  refused(bad, "SH coefficient");
  bad = tree;
  bad.nodes.back().error = -1;
  refused(bad, "a node");
  for (const float grain : {-1.0f, nan}) {
    bad = tree;
    bad.nodes[1].grain = grain;
    refused(bad, "a node");
  }
}

TEST_CASE("lod file: cached beside the asset, by its content") {
  const TempFolder folder("lod_cache");
  SerialBackend backend;
  const GaussianCloud cloud = small_wall(5, 2000), other = small_wall(6, 2000);
  const std::string asset = (folder / "scene.ply").string();
  const auto path = io::lod_path(asset, cloud);
  CHECK(path.parent_path() == folder.path());
  CHECK(path != io::lod_path(asset, other));
  CHECK(path == io::lod_path(asset + ",b,c", cloud));
  const auto build = [&] { return build_lod(backend, cloud); };
  CHECK(io::cached_lod(asset, cloud, {}, build).value().built);
  CHECK(std::filesystem::exists(path));
  const io::CachedLod again = io::cached_lod(asset, cloud, {}, build).value();
  CHECK(!again.built);
  CHECK(again.warning.empty());
  write_file(path, read_file(path).substr(0, 1000));
  const io::CachedLod repaired = io::cached_lod(asset, cloud, {}, build).value();
  CHECK(repaired.built);
  CHECK(contains(repaired.warning, "bytes"));
  CHECK(!io::cached_lod(asset, cloud, {}, build).value().built);
  const io::CachedLod nowhere =
      io::cached_lod((folder / "none/scene.ply").string(), cloud, {}, build).value();
  CHECK(nowhere.built);
  CHECK(contains(nowhere.warning, "does not exist"));
}
