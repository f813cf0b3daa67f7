// SPDX-License-Identifier: Apache-2.0
#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>
#include <new>

#include "gsnav/detail/nav/navmesh_file.hpp"
#include "navmesh_format.hpp"
#include "navmesh_stages.hpp"

namespace gsnav {
namespace detail {
namespace {

constexpr std::int32_t kMaxTileCoordinate = 1 << 24;

/// What a message starts with, and how it ends.
struct Where {
  std::string text;
  Status bad(const std::string& what) const { return {Errc::invalid_file, text + ": " + what}; }
  template <class T>
  Status bad(const char* field, T value, const std::string& why) const {
    return bad(std::string(field) + " = " + std::to_string(value) + " " + why);
  }
  Where in(const char* part, std::size_t i) const {
    return {text + ": " + part + " " + std::to_string(i)};
  }
};

template <class T>
T load(const std::byte* p) noexcept {
  T v;
  std::memcpy(&v, p, sizeof v);
  return v;
}

bool usable(float v) noexcept {
  return std::abs(static_cast<double>(v)) <= kMaxCoordinate;
}  // false for NaN

/// The fields of dtMeshHeader and where its arrays start.
struct TileLayout {
  static constexpr const char* kCountNames[] = {"polyCount",       "vertCount",       "maxLinkCount",
                                                "detailMeshCount", "detailVertCount", "detailTriCount",
                                                "bvNodeCount",     "offMeshConCount"};
  std::int32_t polys, verts, links, details, detail_verts, detail_tris, bv_nodes, off_mesh, ground;
  std::size_t at_verts, at_polys, at_details, at_detail_verts, at_detail_tris, at_bv;
};

Result<TileLayout> read_layout(std::span<const std::byte> tile, std::size_t link_size,
                               const Where& where) {
  if (tile.size() < kTileHeader) return where.bad("dataSize", tile.size(), "is less than a tile header");
  const std::byte* p = tile.data();
  if (load<std::int32_t>(p) != DT_NAVMESH_MAGIC)
    return where.bad("magic", load<std::int32_t>(p), "is not DNAV");
  if (load<std::int32_t>(p + 4) != DT_NAVMESH_VERSION) {
    return Status(Errc::unsupported, where.text +
                                         ": version = " + std::to_string(load<std::int32_t>(p + 4)) +
                                         ", only " + std::to_string(DT_NAVMESH_VERSION) + " is known");
  }
  for (const std::size_t k : {8u, 12u, 16u}) {
    const auto v = load<std::int32_t>(p + k);
    if (v < -kMaxTileCoordinate || v > kMaxTileCoordinate) {
      return where.bad(k == 8 ? "x" : (k == 12 ? "y" : "layer"), v, "is no tile of a mesh");
    }
  }
  for (std::size_t k = 60; k < kTileHeader; k += 4) {
    if (!usable(load<float>(p + k)))
      return where.bad("header float", (k - 60) / 4, "is not finite or too large");
  }
  std::int32_t count[8];
  const std::size_t sizes[8] = {kPoly, 12, link_size, kPolyDetail, 12, 4, kBvNode, kOffMesh};
  std::uint64_t total = kTileHeader;
  for (std::size_t k = 0; k < 8; ++k) {
    count[k] = load<std::int32_t>(p + 24 + 4 * k);
    if (count[k] < 0 || static_cast<std::uint64_t>(count[k]) > tile.size() / sizes[k]) {
      return where.bad(TileLayout::kCountNames[k], count[k],
                       "does not fit a tile of " + std::to_string(tile.size()) + " bytes");
    }
    total += static_cast<std::uint64_t>(count[k]) * sizes[k];
  }
  if (total > tile.size()) {
    return where.bad("dataSize", tile.size(), "is less than its counts need, " + std::to_string(total));
  }
  TileLayout t{count[0], count[1], count[2], count[3], count[4], count[5], count[6], count[7],
               0,        0,        0,        0,        0,        0,        0};
  t.ground = t.polys - t.off_mesh;
  if (t.ground < 0) return where.bad("offMeshConCount", t.off_mesh, "is more than polyCount");
  if (t.polys > 0 && t.links == 0) return where.bad("maxLinkCount", t.links, "is not positive");
  if (t.details != t.ground)
    return where.bad("detailMeshCount", t.details, "is not the count of ground polygons");
  const auto bytes = [](std::int32_t n, std::size_t size) { return static_cast<std::size_t>(n) * size; };
  t.at_verts = kTileHeader;
  t.at_polys = t.at_verts + bytes(t.verts, 12);
  t.at_details = t.at_polys + bytes(t.polys, kPoly) + bytes(t.links, link_size);
  t.at_detail_verts = t.at_details + bytes(t.details, kPolyDetail);
  t.at_detail_tris = t.at_detail_verts + bytes(t.detail_verts, 12);
  t.at_bv = t.at_detail_tris + bytes(t.detail_tris, 4);
  return t;
}

Status check_poly(const std::byte* tile, const TileLayout& t, std::int32_t i, const Where& where) {
  const auto poly = [&](std::int32_t k) {
    return tile + t.at_polys + static_cast<std::size_t>(k) * kPoly;
  };
  const auto corners = [&](const std::byte* q) { return static_cast<std::size_t>(q[30]); };
  const std::byte* p = poly(i);
  const std::size_t n = corners(p);
  if (n < 3 || n > DT_VERTS_PER_POLYGON) return where.bad("vertCount", n, "is not 3 to 6");
  if ((static_cast<unsigned>(p[31]) >> 6) != DT_POLYTYPE_GROUND) {
    return where.bad("type", static_cast<unsigned>(p[31]) >> 6, "is not ground");
  }
  for (std::size_t k = 0; k < n; ++k) {
    const auto v = load<std::uint16_t>(p + 4 + 2 * k);
    if (v >= t.verts) return where.bad("vertex", v, "of " + std::to_string(t.verts));
    const auto nei = load<std::uint16_t>(p + 16 + 2 * k);
    if (nei == 0 || (nei & DT_EXT_LINK) != 0) continue;
    if (nei > t.ground || nei == i + 1)
      return where.bad("neighbour", nei, "of " + std::to_string(t.ground));
    const std::byte* q = poly(nei - 1);
    bool back = false;
    for (std::size_t m = 0; m < corners(q) && m < DT_VERTS_PER_POLYGON; ++m) {
      back = back || load<std::uint16_t>(q + 16 + 2 * m) == i + 1;
    }
    if (!back) return where.bad("neighbour", nei, "does not know this polygon");
  }
  const std::byte* d = tile + t.at_details + static_cast<std::size_t>(i) * kPolyDetail;
  const auto vert_base = load<std::uint32_t>(d), tri_base = load<std::uint32_t>(d + 4);
  const auto vert_count = static_cast<unsigned>(d[8]), tri_count = static_cast<unsigned>(d[9]);
  if (std::uint64_t{vert_base} + vert_count > static_cast<std::uint64_t>(t.detail_verts)) {
    return where.bad("detail vertBase", vert_base,
                     "+ " + std::to_string(vert_count) + " is past detailVertCount");
  }
  if (std::uint64_t{tri_base} + tri_count > static_cast<std::uint64_t>(t.detail_tris)) {
    return where.bad("detail triBase", tri_base,
                     "+ " + std::to_string(tri_count) + " is past detailTriCount");
  }
  for (unsigned k = 0; k < 3 * tri_count; ++k) {
    const std::size_t at = t.at_detail_tris + 4 * (tri_base + std::size_t{k / 3}) + k % 3;
    const auto v = static_cast<unsigned>(tile[at]);
    if (v >= n + vert_count)
      return where.bad("detail triangle's vertex", v, "of " + std::to_string(n + vert_count));
  }
  return {};
}

Status check_tile(std::span<const std::byte> tile, const TileLayout& t, const Where& where) {
  for (const auto& [name, at, count] :
       {std::tuple{"vertex", t.at_verts, t.verts},
        std::tuple{"detail vertex", t.at_detail_verts, t.detail_verts}}) {
    for (std::size_t k = 0; k < 3 * static_cast<std::size_t>(count); ++k) {
      if (!usable(load<float>(tile.data() + at + 4 * k))) {
        return where.bad(std::string(name) + " " + std::to_string(k / 3) +
                         " is not finite or beyond 1000 km");
      }
    }
  }
  std::uint64_t detail_verts = 0, detail_tris = 0;
  for (std::int32_t i = 0; i < t.ground; ++i) {
    const Status s = check_poly(tile.data(), t, i, where.in("polygon", static_cast<std::size_t>(i)));
    if (!s.ok()) return s;
    const std::byte* d = tile.data() + t.at_details + static_cast<std::size_t>(i) * kPolyDetail;
    detail_verts += static_cast<unsigned>(d[8]);
    detail_tris += static_cast<unsigned>(d[9]);
  }
  // Polygons that share them could ask for a thousand times the file.
  if (detail_verts > static_cast<std::uint64_t>(t.detail_verts)) {
    return where.bad("detailVertCount", t.detail_verts,
                     "is less than the polygons have, " + std::to_string(detail_verts));
  }
  if (detail_tris > static_cast<std::uint64_t>(t.detail_tris)) {
    return where.bad("detailTriCount", t.detail_tris,
                     "is less than the polygons have, " + std::to_string(detail_tris));
  }
  for (std::int32_t i = 0; i < t.bv_nodes; ++i) {
    const auto v =
        load<std::int32_t>(tile.data() + t.at_bv + static_cast<std::size_t>(i) * kBvNode + 12);
    // A leaf names a polygon, a branch how many nodes to skip.
    if (v >= 0 ? v >= t.ground : v < -(t.bv_nodes - i)) {
      return where.in("bvNode", static_cast<std::size_t>(i))
          .bad("i", v, "leaves the tree or the polygons");
    }
  }
  return {};
}

/// The tile as Detour wants it in memory: 32-bit links, which it fills itself, and no off-mesh
/// connections.
DetourBytes copy_tile(std::span<const std::byte> tile, const TileLayout& t, int& size) {
  const auto bytes = [](std::int32_t n, std::size_t each) { return static_cast<std::size_t>(n) * each; };
  const std::size_t polys = bytes(t.ground, kPoly), links = bytes(t.links, kLink);
  const std::size_t rest = t.at_bv + bytes(t.bv_nodes, kBvNode) - t.at_details;
  const std::size_t total = t.at_polys + polys + links + rest;
  DetourBytes out(static_cast<unsigned char*>(dtAlloc(total, DT_ALLOC_PERM)));
  if (out == nullptr) return out;
  std::memcpy(out.get(), tile.data(), t.at_polys + polys);
  std::memset(out.get() + t.at_polys + polys, 0, links);
  std::memcpy(out.get() + t.at_polys + polys + links, tile.data() + t.at_details, rest);
  const std::int32_t none = 0;
  std::memcpy(out.get() + 24, &t.ground, 4);
  std::memcpy(out.get() + 52, &none, 4);      // offMeshConCount
  std::memcpy(out.get() + 56, &t.ground, 4);  // offMeshBase
  size = static_cast<int>(total);
  return out;
}

/// The shortest decimal number that is this float32: 0.05 and not 0.0500000007, so that a mesh built
/// with settings that were loaded is the mesh built with those that were saved.
double decimal(float v) noexcept {
  char text[32];
  const auto written = std::to_chars(text, text + sizeof text, v);
  double out = static_cast<double>(v);
  std::from_chars(text, written.ptr, out);
  return out;
}

Status read_settings(const std::byte* p, const Where& where, NavMeshSettings& s) {
  for (std::size_t k = 0; k < kSettingCount; ++k) {
    const double v = decimal(load<float>(p + 4 * k));
    if (!std::isfinite(v)) return where.bad(kSettingFields[k].name, v, "is not finite");
    if (kSettingFields[k].value != nullptr) {
      s.*kSettingFields[k].value = v;
    } else {
      s.verts_per_poly = static_cast<int>(clamp(v, -1.0, 100.0));
    }
  }
  // Older files have a byte of padding for the fourth flag, of any value.
  s.filter_low_hanging_obstacles = p[52] != std::byte{0};
  s.filter_ledge_spans = p[53] != std::byte{0};
  s.filter_walkable_low_height_spans = p[54] != std::byte{0};
  s.include_static_objects = p[55] == std::byte{1};
  if (const Status valid = s.validate(); !valid.ok()) return where.bad(valid.message());
  return {};
}

struct Tile {
  std::span<const std::byte> bytes;
  TileLayout layout{};
};

Result<NavMesh> parse(std::span<const std::byte> file, const Where& where) {
  if (file.size() < kSetHeader) return where.bad("size", file.size(), "is less than a header");
  const std::byte* p = file.data();
  if (load<std::int32_t>(p) != kSetMagic)
    return where.bad("magic", load<std::int32_t>(p), "is not MSET");
  const auto version = load<std::int32_t>(p + 4), count = load<std::int32_t>(p + 8);
  if (version != 1 && version != 2) {
    return Status(Errc::unsupported,
                  where.text + ": version = " + std::to_string(version) + " is not 1 or 2");
  }
  NavMeshSettings settings;
  std::size_t at = kSetHeader;
  if (version == 2) {
    if (file.size() < at + kSetSettings)
      return where.bad("size", file.size(), "ends within the settings");
    if (const Status s = read_settings(p + at, where, settings); !s.ok()) return s;
    at += kSetSettings;
  }
  if (count < 0 || static_cast<std::uint64_t>(count) > (file.size() - at) / kTileHeader) {
    return where.bad("numTiles", count,
                     "does not fit a file of " + std::to_string(file.size()) + " bytes");
  }
  dtNavMeshParams params{};
  std::memcpy(params.orig, p + 12, 12);
  params.tileWidth = load<float>(p + 24);
  params.tileHeight = load<float>(p + 28);
  for (const float v :
       {params.orig[0], params.orig[1], params.orig[2], params.tileWidth, params.tileHeight}) {
    if (!usable(v)) return where.bad("params are not finite or too large");
  }

  std::vector<Tile> tiles;
  std::size_t head = 8, link = kLink;
  for (std::int32_t i = 0; i < count; ++i) {
    const Where here = where.in("tile", static_cast<std::size_t>(i));
    if (file.size() - at < 16) return here.bad("the file ends within its header");
    if (i == 0 && load<std::int32_t>(p + at + 8) != DT_NAVMESH_MAGIC && file.size() - at >= 20 &&
        load<std::int32_t>(p + at + 16) == DT_NAVMESH_MAGIC) {
      head = 16;  // 64-bit references, and padding after the size
      link = 16;
    }
    const auto size = load<std::int32_t>(p + at + head - (head == 16 ? 8u : 4u));
    at += head;
    if (size < 0 || static_cast<std::size_t>(size) > file.size() - at) {
      return here.bad("dataSize", size, "with " + std::to_string(file.size() - at) + " bytes left");
    }
    Tile tile{file.subspan(at, static_cast<std::size_t>(size)), {}};
    at += tile.bytes.size();
    const auto layout = read_layout(tile.bytes, link, here);
    if (!layout) return layout.status();
    tile.layout = *layout;
    if (const Status s = check_tile(tile.bytes, tile.layout, here); !s.ok()) return s;
    params.maxPolys = max(params.maxPolys, tile.layout.ground);
    if (tile.layout.ground > 0) tiles.push_back(tile);
  }
  if (tiles.empty()) return Status(Errc::nothing_navigable, where.text + ": there are no polygons");
  params.maxTiles = static_cast<int>(tiles.size());
  if (version == 2 && tiles.size() > 1) {
    const double cells = static_cast<double>(params.tileWidth) / settings.cell_size;
    settings.tile_size = cells > 15.5 && cells < 16384.5 ? static_cast<int>(std::lround(cells)) : 0;
  }

  NavMeshPtr mesh(dtAllocNavMesh());
  if (mesh == nullptr) return Status(Errc::out_of_memory, where.text + ": not enough memory");
  if (dtStatusFailed(mesh->init(&params))) {
    return Status(Errc::unsupported, where.text + ": " + std::to_string(tiles.size()) +
                                         " tiles of up to " + std::to_string(params.maxPolys) +
                                         " polygons are more than 32-bit references name");
  }
  for (std::size_t i = 0; i < tiles.size(); ++i) {
    int size = 0;
    DetourBytes data = copy_tile(tiles[i].bytes, tiles[i].layout, size);
    if (data == nullptr) return Status(Errc::out_of_memory, where.text + ": not enough memory");
    if (dtStatusFailed(mesh->addTile(data.get(), size, DT_TILE_FREE_DATA, 0, nullptr))) {
      return where.in("tile", i).bad("its x, y and layer are taken by another tile");
    }
    (void)data.release();  // NOLINT: Detour frees it
    if (i == 0 && version == 1) {
      const std::byte* h = tiles[0].bytes.data();
      settings.agent_height = decimal(load<float>(h + 60));
      settings.agent_radius = decimal(load<float>(h + 64));
      settings.agent_max_climb = decimal(load<float>(h + 68));
      if (const Status s = settings.validate(); !s.ok()) return where.bad(s.message());
    }
  }
  return assemble_navmesh(settings, {}, std::move(mesh));
}

}  // namespace
}  // namespace detail

Result<NavMesh> parse_navmesh(std::span<const std::byte> bytes, const std::string& name) {
  try {
    return detail::parse(bytes, {name});
  } catch (const std::bad_alloc&) {
    return Status(Errc::out_of_memory, name + ": not enough memory");
  }
}

Result<NavMesh> load_navmesh(const std::filesystem::path& path) {
  std::error_code error;
  // Folders, pipes and devices are refused: reading one could wait for ever.
  if (!std::filesystem::is_regular_file(path, error)) {
    return Status(Errc::file_not_found, path.string() + ": is not a file");
  }
  std::ifstream in(path, std::ios::binary);
  const auto size = std::filesystem::file_size(path, error);
  if (!in || error) return Status(Errc::file_not_found, path.string() + ": cannot be opened");
  try {
    std::vector<std::byte> bytes(size);
    in.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(size));
    if (!in) return Status(Errc::invalid_file, path.string() + ": cannot be read");
    return parse_navmesh(bytes, path.string());
  } catch (const std::bad_alloc&) {
    return Status(Errc::out_of_memory, path.string() + ": not enough memory");
  }
}

}  // namespace gsnav
