// SPDX-License-Identifier: Apache-2.0
#include "navmesh_read_tile.hpp"

namespace gsnav::detail::navmesh_tile {
namespace {

constexpr std::int32_t kMaxTileCoordinate = 1 << 24;

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

}  // namespace

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
  // Detail vertices must not be shared: with shared ones, memory could grow to a thousand times the file
  // size.
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
    // A leaf has the index of a polygon, a branch the number of nodes to skip.
    if (v >= 0 ? v >= t.ground : v < -(t.bv_nodes - i)) {
      return where.in("bvNode", static_cast<std::size_t>(i))
          .bad("i", v, "leaves the tree or the polygons");
    }
  }
  return {};
}

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

}  // namespace gsnav::detail::navmesh_tile
