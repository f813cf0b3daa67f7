// SPDX-License-Identifier: Apache-2.0
#include <DetourAlloc.h>
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <initializer_list>
#include <new>

#include "gsnav/detail/nav/navmesh_file.hpp"
#include "height_mending.hpp"
#include "io/allocations.hpp"
#include "meshes.hpp"
#include "navmesh_impl.hpp"
#include "support/data.hpp"
#include "support/files.hpp"
#include "support/random_cases.hpp"

using namespace gsnav;
using gsnav_test::cases;
using gsnav_test::Soup;

namespace {

/// Detour's own allocations are counted with the others', from before the first.
[[maybe_unused]] const bool counted = [] {
  dtAllocSetCustom([](std::size_t size, dtAllocHint) { return ::operator new(size, std::nothrow); },
                   [](void* p) { ::operator delete(p); });
  return true;
}();

std::vector<std::byte> content_of(const std::string& path) {
  const std::string text = gsnav_test::read_file(path);
  const auto bytes = gsnav_test::bytes_of(text);
  return {bytes.begin(), bytes.end()};
}

NavMesh boxes(const Vec3d& at = {}) {
  Soup soup;
  soup.floor(0, 0, 8, 6);
  soup.box(2, 2, 4, 3, 0, 2);
  soup.box(5, 1, 6, 5, 0, 2);
  for (Vec3d& v : soup.vertices) v += at;
  NavMeshSettings s;
  s.agent_radius = 0.15;
  s.region_min_size = 7;
  s.filter_ledge_spans = false;
  return NavMesh::build(s, soup.vertices, soup.triangles).value();
}

std::vector<std::byte> saved(const NavMesh& mesh, int version = 2) {
  const gsnav_test::TempFolder folder("navmesh_file");
  save_navmesh(mesh, (folder / "a.navmesh").string(), version).throw_if_error();
  return content_of((folder / "a.navmesh").string());
}

/// Boxes on a floor with a ramp, in tiles of 16 cells.
std::vector<std::byte> tiled() {
  Soup soup = gsnav_test::random_boxes(6, 12, 10);
  soup.quad({10, 0, 2}, {10, 0, 6}, {13, 1, 6}, {13, 1, 2});
  NavMeshSettings s;
  s.cell_size = 0.1;
  s.tile_size = 16;
  return saved(NavMesh::build(s, soup.vertices, soup.triangles).value());
}

/// A file of `count` polygons that lie on each other, `length` metres long: triangles of so many height
/// triangles, or the same with each corner twice.
std::vector<std::byte> pile(std::int32_t count, float length, std::int32_t heights = 1,
                            bool twice = false) {
  std::vector<std::byte> b;
  const auto put = [&](const auto& v) {
    const auto* p = reinterpret_cast<const std::byte*>(&v);
    b.insert(b.end(), p, p + sizeof v);
  };
  const auto ints = [&](std::initializer_list<std::int32_t> list) {
    for (const std::int32_t v : list) put(v);
  };
  const auto floats = [&](std::initializer_list<float> list) {
    for (const float v : list) put(v);
  };
  ints({'M' << 24 | 'S' << 16 | 'E' << 8 | 'T', 1, 1});
  floats({0, 0, 0, length, length});
  ints({1, count});
  ints({1, 100 + 36 + 12 + count * (32 + 12 + 4 * heights)});  // reference and size; counts of the tile
  ints({'D' << 24 | 'N' << 16 | 'A' << 8 | 'V', 7, 0, 0, 0, 0, count, 3, 1, count, 0, count * heights, 0,
        0, count});
  floats({1.5f, 0.1f, 0.2f, 0, 0, 0, length, 1, length, 1});
  floats({0, 0, 0, 0, 0, 1, length, 0, 1});
  for (std::int32_t i = 0; i < count; ++i) {
    ints({-1});
    for (const int k : {0, 1, 2, 3, 4, 5}) put(static_cast<std::uint16_t>(twice ? k / 2 : k % 3));
    for (int k = 0; k < 6; ++k) put(std::uint16_t{0});
    put(std::uint16_t{1});
    put(static_cast<std::uint8_t>(twice ? 6 : 3));
    put(std::uint8_t{0});
  }
  b.resize(b.size() + 12);  // a link
  for (std::int32_t i = 0; i < count; ++i) {
    ints({0, i * heights});
    for (const int v : {0, heights, 0, 0}) put(static_cast<std::uint8_t>(v));
  }
  for (std::int32_t i = 0; i < count * heights; ++i) {
    for (const int v : {0, 1, 2, 0}) put(static_cast<std::uint8_t>(twice ? 2 * v : v));
  }
  return b;
}

void patch(std::vector<std::byte>& b, std::size_t at, std::int32_t v) {
  std::memcpy(b.data() + at, &v, 4);
}

/// `tiled()` as a program may write it that samples each tile's heights for itself: every second tile
/// lies `lift` metres higher.
std::vector<std::byte> tiled_with_steps(float lift) {
  std::vector<std::byte> b = tiled();
  const auto at = [&](std::size_t k) {
    std::int32_t v = 0;
    std::memcpy(&v, b.data() + k, 4);
    return static_cast<std::size_t>(v);
  };
  const std::size_t tiles = at(8);
  std::size_t tile = 104;
  for (std::size_t t = 0; t < tiles; ++t, tile += at(tile - 4) + 8) {
    const std::size_t polys = at(tile + 24), vertices = at(tile + 28), links = at(tile + 32),
                      details = at(tile + 36), samples = at(tile + 40);
    const std::size_t first = tile + 100, second = first + 12 * vertices + 32 * polys + 12 * links;
    for (std::size_t i = 0; t % 2 == 1 && i < vertices + samples; ++i) {
      const std::size_t y =
          4 + (i < vertices ? first + 12 * i : second + 12 * details + 12 * (i - vertices));
      float height = 0;
      std::memcpy(&height, b.data() + y, 4);
      height += lift;
      std::memcpy(b.data() + y, &height, 4);
    }
  }
  REQUIRE(tile == b.size() + 8);
  return b;
}

/// Asks what reads most of a mesh.
void use(const NavMesh& mesh) {
  Rng rng(1);
  for (int i = 0; i < 4; ++i) {
    const NavPoint a = mesh.random_point(rng), b = mesh.random_point(rng);
    (void)mesh.snap_point(a.position);
    (void)mesh.path_between(a, b);
    (void)mesh.walk(a, b.position - a.position, true);
    (void)mesh.distance_to_closest_obstacle(a.position);
  }
}

/// Bytes as two digits each.
std::vector<std::byte> bytes_of_hex(const std::string& hex) {
  std::vector<std::byte> out;
  for (std::size_t k = 0; k + 1 < hex.size(); k += 2) {
    out.push_back(static_cast<std::byte>(std::stoi(hex.substr(k, 2), nullptr, 16)));
  }
  return out;
}

}  // namespace

TEST_CASE("navmesh file: a round trip keeps surface, settings and distances") {
  const Vec3d at{120, -7, 33};
  const NavMesh mesh = boxes(at);
  const auto bytes = saved(mesh);
  const NavMesh back = parse_navmesh(bytes, "round").value();
  CHECK(back.polygon_count() == mesh.polygon_count());
  CHECK(back.navigable_area() == doctest::Approx(mesh.navigable_area()).epsilon(1e-5));
  CHECK(back.settings().agent_radius == doctest::Approx(0.15));
  CHECK(back.settings().region_min_size == 7);
  CHECK(back.settings().verts_per_poly == 6);
  CHECK_FALSE(back.settings().filter_ledge_spans);
  CHECK(back.settings().filter_low_hanging_obstacles);
  CHECK(norm(back.bounds().low - mesh.bounds().low) < 1e-4);
  Rng rng(3);
  for (int i = 0; i < 200; ++i) {
    const Vec3d a = mesh.random_point(rng, 0).position, b = mesh.random_point(rng, 0).position;
    REQUIRE(std::abs(back.geodesic_distance(a, b) - mesh.geodesic_distance(a, b)) < 1e-3);
    REQUIRE(std::abs(back.snap_point(a)->position.y - a.y) < 1e-4);
  }
  CHECK(saved(back) == bytes);
  // The format, byte by byte: Habitat reads raw structs.
  CHECK(std::memcmp(bytes.data(), "TESM\2\0\0\0\1\0\0\0", 12) == 0);
  float cell = 0, radius = 0;
  std::memcpy(&cell, bytes.data() + 40, 4);
  std::memcpy(&radius, bytes.data() + 52, 4);
  CHECK(cell == 0.05f);
  CHECK(radius == 0.15f);
  CHECK(std::memcmp(bytes.data() + 104, "VAND\7\0\0\0", 8) == 0);
}

TEST_CASE("navmesh file: version 1, which has no settings, is written and read") {
  const Vec3d at{120, -7, 33};
  const NavMesh mesh = boxes(at);
  const auto bytes = saved(mesh, 1), second = saved(mesh);
  // magic, version, numTiles; orig, tileWidth, tileHeight, maxTiles, maxPolys; tileRef, dataSize; magic
  // and version of the tile, whose agent the settings are taken from.
  const auto int_at = [&](std::size_t k) {
    std::int32_t v = 0;
    std::memcpy(&v, bytes.data() + k, 4);
    return v;
  };
  const auto float_at = [&](std::size_t k) {
    float v = 0;
    std::memcpy(&v, bytes.data() + k, 4);
    return static_cast<double>(v);
  };
  CHECK(std::memcmp(bytes.data(), "TESM\1\0\0\0\1\0\0\0", 12) == 0);
  for (const auto& [k, low] : {std::pair<std::size_t, double>{0, 120}, {4, -7}, {8, 33}}) {
    CHECK(float_at(12 + k) == doctest::Approx(low));
    CHECK(float_at(48 + 72 + k) == doctest::Approx(low));  // bmin
  }
  CHECK(float_at(24) == doctest::Approx(8));
  CHECK(float_at(28) == doctest::Approx(6));
  CHECK(int_at(32) == 1);
  CHECK(int_at(36) == static_cast<int>(mesh.polygon_count()));
  CHECK(int_at(40) != 0);
  CHECK(static_cast<std::size_t>(int_at(44)) == bytes.size() - 48);
  CHECK(std::memcmp(bytes.data() + 48, "VAND\7\0\0\0", 8) == 0);
  CHECK(int_at(48 + 24) == static_cast<int>(mesh.polygon_count()));
  CHECK(float_at(48 + 60) == doctest::Approx(1.5));
  CHECK(float_at(48 + 64) == doctest::Approx(0.15));
  CHECK(float_at(48 + 68) == doctest::Approx(0.2));
  // All else is as in version 2.
  CHECK(bytes.size() + 56 == second.size());
  CHECK(std::equal(bytes.begin() + 8, bytes.begin() + 40, second.begin() + 8));
  CHECK(std::equal(bytes.begin() + 40, bytes.end(), second.begin() + 96));

  const NavMesh back = parse_navmesh(bytes, "v1").value();
  CHECK(back.polygon_count() == mesh.polygon_count());
  CHECK(back.settings().agent_height == doctest::Approx(1.5));
  CHECK(back.settings().agent_radius == doctest::Approx(0.15));
  CHECK(back.settings().agent_max_climb == doctest::Approx(0.2));
  CHECK(back.settings().filter_ledge_spans);  // a default: the mesh was built without
  CHECK(saved(back, 1) == bytes);
  Rng rng(4);
  for (int i = 0; i < 200; ++i) {
    const Vec3d a = mesh.random_point(rng, 0).position, b = mesh.random_point(rng, 0).position;
    REQUIRE(std::abs(back.geodesic_distance(a, b) - mesh.geodesic_distance(a, b)) < 1e-3);
  }
  const gsnav_test::TempFolder folder("navmesh_file");
  for (const int version : {0, 3}) {
    const Status refused = save_navmesh(mesh, folder / "c.navmesh", version);
    CHECK(refused.code() == Errc::invalid_argument);
    CHECK(refused.message().find("version = " + std::to_string(version)) != std::string::npos);
  }
}

TEST_CASE("navmesh file: tiles keep their settings' place in version 1") {
  const auto second = tiled();
  const NavMesh mesh = parse_navmesh(second, "tiles").value();
  const auto bytes = saved(mesh, 1);
  CHECK(bytes.size() + 56 == second.size());
  CHECK(std::equal(bytes.begin() + 40, bytes.end(), second.begin() + 96));
  CHECK(saved(parse_navmesh(bytes, "v1").value(), 1) == bytes);
}

TEST_CASE("navmesh file: 64-bit references and many tiles") {
  const std::string path = gsnav_test::data_file("nav/dotrecast/all_tiles_navmesh.bin");
  if (path.empty()) return;
  const NavMesh mesh = load_navmesh(path).value();
  CHECK(mesh.polygon_count() > 66);
  // Tiles are joined exactly where Detour joins them.
  const NavMesh::Impl& impl = mesh.impl();
  std::vector<bool> reached(mesh.polygon_count(), false);
  std::size_t islands = 0;
  for (PolyId first = 0; first < mesh.polygon_count(); ++first) {
    if (reached[first]) continue;
    ++islands;
    reached[first] = true;
    std::vector<PolyId> queue{first};
    for (std::size_t i = 0; i < queue.size(); ++i) {
      REQUIRE(mesh.island_of(queue[i]) == mesh.island_of(first));
      const dtMeshTile* tile = nullptr;
      const dtPoly* poly = nullptr;
      impl.mesh->getTileAndPolyByRefUnsafe(impl.refs[queue[i]], &tile, &poly);
      for (unsigned l = poly->firstLink; l != DT_NULL_LINK; l = tile->links[l].next) {
        const PolyId next = impl.id_of(tile->links[l].ref);
        if (!reached[next]) queue.push_back(next);
        reached[next] = true;
      }
    }
  }
  CHECK(islands == mesh.island_count());
  CHECK(mesh.island_area(0) > 1000);
  Rng rng(2);
  for (int i = 0; i < 300; ++i) {
    const NavPoint a = mesh.random_point(rng, 0), b = mesh.random_point(rng, 0);
    const double d = mesh.distance_between(a, b);
    REQUIRE(std::isfinite(d));
    REQUIRE(d >= norm(b.position - a.position) - 1e-3);
    REQUIRE(std::abs(d - mesh.distance_between(b, a)) < 1e-4);
  }
  const auto again = saved(mesh);
  const NavMesh back = parse_navmesh(again, "tiles").value();
  CHECK(back.polygon_count() == mesh.polygon_count());
  CHECK(back.island_count() == mesh.island_count());
  CHECK(back.navigable_area() == doctest::Approx(mesh.navigable_area()).epsilon(1e-6));
}

namespace {

/// The largest difference in height between the two sides of an edge within the mesh.
double highest_step(const NavMesh& mesh) {
  const detail::PolyMesh& m = mesh.impl().polys;
  double most = 0;
  for (PolyId p = 0; p < m.polys.size(); ++p) {
    for (std::uint32_t k = 0; k < m.polys[p].count; ++k) {
      const PolyId q = m.neighbours[m.polys[p].first + k];
      if (q == kNoPoly) continue;
      for (int i = 1; i < 64; ++i) {
        const Vec3d at = lerp(m.corner(m.polys[p], k), m.corner(m.polys[p], k + 1), i / 64.0);
        most = max(most, std::abs(m.height(p, at) - m.height(q, at)));
      }
    }
  }
  return most;
}

/// A file of a ramp that two triangles share, each with a height sample on their common side: one has it
/// as a corner of its height triangles, the other as a sliver of no area.
detail::PolyMesh ramp_with_a_sliver() {
  detail::PolyMesh m;
  m.points = {{0, 0, 0}, {4, 1, 0}, {4, 1, 4}, {0, 0, 4}, {2, 0.4, 2}};
  m.corners = {m.points[0], m.points[1], m.points[2], m.points[0], m.points[2], m.points[3]};
  m.neighbours = {kNoPoly, kNoPoly, 1, 0, kNoPoly, kNoPoly};
  m.tris = {{0, 1, 4}, {1, 2, 4}, {0, 2, 3}, {0, 4, 2}};
  m.polys.resize(2);
  m.polys[0].count = m.polys[1].count = 3;
  m.polys[1].first = 3;
  m.polys[0].tri_count = m.polys[1].tri_count = 2;
  m.polys[1].tri_first = 2;
  return m;
}

}  // namespace

TEST_CASE(
    "navmesh file: a side with a height sample is one, also of a triangle that has the sample in a "
    "sliver") {
  detail::PolyMesh m = ramp_with_a_sliver();
  detail::mend_heights(m);
  m.finish();
  for (const double t : {0.1, 0.3, 0.5, 0.8}) {
    const Vec3d at{4 * t, 0, 4 * t};
    const double wanted = t < 0.5 ? 0.8 * t : 0.4 + 1.2 * (t - 0.5);
    CHECK(m.height(0, at) == doctest::Approx(wanted));
    CHECK(m.height(1, at) == doctest::Approx(wanted));
  }
}

namespace {

/// The three lengths of a path: find_path's, geodesic_distance and that of the line through its points.
struct Lengths {
  const NavMesh& mesh;
  double worst = 0, between = 0;

  void add(const NavPoint& a, const NavPoint& b) {
    const NavPath found = mesh.find_path(a.position, b.position).value();
    const double d = mesh.geodesic_distance(a.position, b.position);
    double length = 0;
    for (std::size_t i = 1; i < found.points.size(); ++i)
      length += norm(found.points[i] - found.points[i - 1]);
    worst = max(worst, std::abs(found.length - d));
    // Its points follow the surface to a centimetre, so that the line through them is hardly shorter.
    between = max(between, std::abs(length - d) / max(d, 1.0));
  }
  void check() const {
    MESSAGE("path and distance differ by " << worst << " m at most, the line of the path by "
                                           << between);
    CHECK(worst < 1e-9);
    CHECK(between < 2e-3);
  }
};

}  // namespace

TEST_CASE(
    "navmesh file: one path has one length where tiles of a file lie higher than their neighbours") {
  const NavMesh mesh = parse_navmesh(tiled_with_steps(0.06f), "steps").value();
  CHECK(mesh.polygon_count() > 50);
  CHECK(highest_step(mesh) < 1e-4);
  Rng rng(22);
  Lengths lengths{mesh};
  for (int i = 0; i < cases(2000); ++i) {
    const NavPoint a = mesh.random_point(rng);
    lengths.add(a, mesh.random_point(rng, mesh.island_of(a.poly)));
  }
  lengths.check();
}

TEST_CASE("navmesh file: one path has one length, across the borders of another program's tiles too") {
  const std::string path = gsnav_test::data_file("nav/dotrecast/all_tiles_navmesh.bin");
  if (path.empty()) return;
  const NavMesh mesh = load_navmesh(path).value();
  CHECK(highest_step(mesh) < 1e-4);
  Rng rng(21);
  Lengths lengths{mesh};
  for (int i = 0; i < cases(1000); ++i) {
    const NavPoint a = mesh.random_point(rng);
    lengths.add(a, mesh.random_point(rng, mesh.island_of(a.poly)));
    // Where a ramp of two polygons once had a step.
    const auto c = mesh.random_point_near(rng, {32, -1.2, 1}, 4),
               d = mesh.random_point_near(rng, {32, -1.2, 0.5}, 6);
    if (c && d && mesh.island_of(c->poly) == mesh.island_of(d->poly)) lengths.add(*c, *d);
  }
  lengths.check();
}

TEST_CASE("navmesh file: what is wrong is named") {
  CHECK(load_navmesh("/no/such/file.navmesh").code() == Errc::file_not_found);
  const auto good = saved(boxes());
  const auto message = [&](std::size_t at, std::int32_t v) {
    auto b = good;
    patch(b, at, v);
    const auto r = parse_navmesh(b, "x.navmesh");
    REQUIRE_FALSE(r.ok());
    CHECK(r.message().find("x.navmesh") == 0);
    return r.message();
  };
  const auto names = [](const std::string& m, const char* word) {
    return m.find(word) != std::string::npos;
  };
  CHECK(names(message(0, 7), "magic = 7"));
  CHECK(names(message(4, 3), "version = 3"));
  CHECK(names(message(8, 1 << 30), "numTiles = 1073741824"));
  CHECK(names(message(40, 0x7fc00000), "cellSize"));
  CHECK(names(message(100, -5), "dataSize = -5"));
  CHECK(names(message(104 + 24, 0x7fffffff), "polyCount = 2147483647"));
  CHECK(names(message(104 + 32, 0), "maxLinkCount = 0"));
  CHECK(names(message(104 + 100, 0x7f800000), "vertex 0"));
  for (const std::size_t size :
       {std::size_t{0}, std::size_t{20}, std::size_t{60}, std::size_t{110}, good.size() - 1}) {
    CHECK(parse_navmesh(std::span(good).first(size), "x").code() == Errc::invalid_file);
  }
}

TEST_CASE("navmesh file: a polygon of no area without height triangles has points to draw") {
  // Found by fuzzing: four corners, two of them in one place, a record of no triangles.
  const auto mesh = parse_navmesh(bytes_of_hex("5445534d020000000100000000000000000000000000000000004040"
                                               "000040400100000001000000cdcc4c3dcdcc4c3e0000c03f"
                                               "cdcccc3dcdcc4c3e000034420000a0410000a041000040416666a63f"
                                               "0000c0400000c0400000803f010101000100000018010000"
                                               "56414e44070000000000000000000000000000000000000001000000"
                                               "040000000400000001000000000000000200000002000000"
                                               "00000000010000000000c03fcdcccc3dcdcc4c3e0000000000000000"
                                               "0000000000004040cdcccc3f000040400000a04198000040"
                                               "40000040400100000001003e00000000676636406766364000000000"
                                               "6766364067663640000000009899193eff05000000000000"
                                               "00000300000000000000000000000000000000000100043f00000000"
                                               "00000000010000000000000000000000020000803f010101"
                                               "00010000001801000056414e44070000000000000000000000000000"
                                               "000000000300021100010205020008000200390008003900"
                                               "0000000000000000000000000000000000000000"),
                                  "sliver");
  CAPTURE(mesh.message());
  REQUIRE(mesh.ok());
  Rng rng(1);
  for (int n = 0; n < 100; ++n) {
    const NavPoint p = mesh->random_point(rng);
    CHECK(is_finite(p.position));
    CHECK(p.poly == 0);
  }
}

TEST_CASE(
    "navmesh file: no allocation is over four times the file, whatever its polygons share or cover") {
  std::vector<std::vector<std::byte>> files{saved(boxes())};
  for (const char* name : {"nav/recast/nav_test.obj", "nav/recast/dungeon.obj"}) {
    const std::string path = gsnav_test::data_file(name);
    if (path.empty()) continue;
    const Soup soup = gsnav_test::read_obj(path);
    files.push_back(saved(NavMesh::build({}, soup.vertices, soup.triangles).value()));
  }
  // Tiles, of which each has its own copy in Detour, as small as they may be.
  files.push_back(tiled());
  // Many height triangles for their bytes.
  if (const std::string path = gsnav_test::data_file("nav/recast/undulating.obj"); !path.empty()) {
    const Soup soup = gsnav_test::read_obj(path);
    NavMeshSettings s;
    s.cell_size = gsnav_test::kSanitized ? 0.2 : 0.1;  // a quarter of the polygons where each is slow
    files.push_back(saved(NavMesh::build(s, soup.vertices, soup.triangles).value()));
    s.tile_size = 64;
    files.push_back(saved(NavMesh::build(s, soup.vertices, soup.triangles).value()));
  }
  // Ten thousand polygons, each of which covers all of the mesh, and one that is 100 km long.
  files.push_back(pile(10000, 1.0f));
  files.push_back(pile(1, 1e5f));
  // As many corners, then as many height triangles as a polygon can have.
  for (const std::int32_t count : {1, 5, 1000}) {
    files.push_back(pile(count, 1.0f, 1, true));
    files.push_back(pile(count, 1.0f, 0, true));
    files.push_back(pile(count, 1.0f, 255));
    files.push_back(pile(count, 1.0f, 255, true));
  }
  double most = 0;
  for (const auto& file : files) {
    gsnav_test::reset_largest_allocation();
    const auto mesh = parse_navmesh(file, "x");
    CAPTURE(mesh.message());
    CHECK(mesh.ok());
    CHECK(gsnav_test::largest_allocation() <= 4 * file.size() + 512);
    most = max(most,
               static_cast<double>(gsnav_test::largest_allocation()) / static_cast<double>(file.size()));
  }
  MESSAGE("at most " << most << " times the file");
  // Polygons that share their height triangles.
  auto shared = files[0];
  const auto at = [&](std::size_t k) {
    std::int32_t v = 0;
    std::memcpy(&v, shared.data() + k, 4);
    return v;
  };
  const std::size_t tile = 104, polys = static_cast<std::size_t>(at(tile + 24)),
                    verts = static_cast<std::size_t>(at(tile + 28)),
                    links = static_cast<std::size_t>(at(tile + 32));
  const std::size_t details = tile + 100 + 12 * verts + 32 * polys + 12 * links;
  for (std::size_t i = 0; i < polys; ++i) {
    patch(shared, details + 12 * i + 4, 0);
    shared[details + 12 * i + 9] = static_cast<std::byte>(min<std::int32_t>(at(tile + 44), 255));
  }
  const auto refused = parse_navmesh(shared, "shared.navmesh");
  REQUIRE_FALSE(refused.ok());
  CHECK(refused.message().find("shared.navmesh") == 0);
}

TEST_CASE("navmesh file: polygons that lie on one another have paths, each edge in a fan") {
  // Found by fuzzing: one edge was two others' neighbour.
  const auto mesh = parse_navmesh(bytes_of_hex("5445534d020000000100000000000000000000000000000040000040"
                                               "000040400100000001000000cdcc4c3dc9cc4c3e0000c03f"
                                               "cdcccc3dcdcc4c00000181420000a0410000a041000040416666a63f"
                                               "0000c0400000c040e800803f010108000100000018010000"
                                               "56414e44070000000000000000000000000000000000000001000000"
                                               "040000000400000001000000000000000200000002000000"
                                               "0000000001000000fa00c03fcdcccc3dcdcc4c3e0000000000000000"
                                               "0000000000004040cdcccc3f00004040000060be67ffffbf"
                                               "d4fe0040400001400211000102050207f80002003900080039000000"
                                               "000031bf989bc9c00008400f04000000000000ff00000100"
                                               "02000300000001000000000000000000000000fc0100063f00000000"
                                               "290100000000000000000000000200000000000000000000"
                                               "000300000000000000000000ffffffff000000000000000000000000"
                                               "0002000003000211000102050207f8000200390008003900"
                                               "0000000000001000000000000000000000000000"),
                                  "folded");
  CAPTURE(mesh.message());
  REQUIRE(mesh.ok());
  Rng rng(1);
  for (int n = 0; n < 100; ++n) {
    const NavPoint a = mesh->random_point(rng), b = mesh->random_point(rng);
    const auto path = mesh->path_between(a, b);
    static_cast<void>(path);  // any answer, or none: what the sanitizers let pass
    CHECK(is_finite(a.position));
  }
}

TEST_CASE("navmesh file: mutated and truncated files do no harm") {
  std::vector<std::vector<std::byte>> seeds{saved(boxes()), tiled()};
  const std::string tiles = gsnav_test::data_file("nav/dotrecast/all_tiles_navmesh.bin");
  if (!tiles.empty()) seeds.push_back(content_of(tiles));
  Rng rng(11);
  int read = 0, refused = 0;
  double most = 0;
  for (const auto& seed : seeds) {
    const int rounds = seed.size() < 20000 ? cases(100000) : cases(500);
    for (int i = 0; i < rounds; ++i) {
      auto b = seed;
      for (std::uint64_t k = 1 + rng.below(4); k-- > 0;) {
        const std::size_t at = rng.below(i % 2 ? min<std::size_t>(b.size(), 400) : b.size());
        switch (rng.below(4)) {
          case 0:
            b[at] ^= static_cast<std::byte>(1u << rng.below(8));
            break;
          case 1:
            b[at] = static_cast<std::byte>(rng.below(256));
            break;
          case 2:
            if (at + 4 <= b.size())
              patch(b, at & ~std::size_t{3}, static_cast<std::int32_t>(rng.next()));
            break;
          default:
            if (rng.below(8) == 0) b.resize(at + 1);
        }
      }
      gsnav_test::reset_largest_allocation();
      const auto r = parse_navmesh(b, "fuzz");
      const auto asked = static_cast<double>(gsnav_test::largest_allocation());
      REQUIRE(asked <= 4 * static_cast<double>(b.size()) + 512);  // or a line of what is wrong
      if (r.ok()) most = max(most, asked / static_cast<double>(b.size()));
      (r.ok() ? read : refused) += 1;
      if (r.ok() && (i % 4 == 0)) use(*r);
    }
  }
  MESSAGE(read << " read, " << refused << " refused; no allocation over " << most << " times the file");
  CHECK(refused > 100);
}
