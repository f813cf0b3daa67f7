// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <cstring>
#include <fstream>

#include "gsnav/nav/navmesh_file.hpp"
#include "navmesh_format.hpp"
#include "navmesh_impl.hpp"

namespace gsnav {
namespace {

void put(std::ofstream& out, const void* p, std::size_t n) {
  out.write(static_cast<const char*>(p), static_cast<std::streamsize>(n));
}
void put_float(std::ofstream& out, double v) {
  const auto f = static_cast<float>(v);
  put(out, &f, 4);
}
void put_int(std::ofstream& out, std::int32_t v) { put(out, &v, 4); }

/// The floats of a point at p, moved by d.
void shift(float* p, const Vec3d& d) noexcept {
  for (int c = 0; c < 3; ++c) p[c] = static_cast<float>(static_cast<double>(p[c]) + d[c]);
}

/// The height of corner k of a polygon's height triangle t, which stands at v. On the border of a tile triangles
/// may have been split: there it is that of the nearest corner.
double height_of(const detail::PolyMesh& m, PolyId id, unsigned t, std::size_t k, const float* v) noexcept {
  const detail::PolyMesh::Poly& poly = m.polys[id];
  const auto apart = [&](const Vec3d& p) {
    return std::hypot(p.x - static_cast<double>(v[0]), p.z - static_cast<double>(v[2]));
  };
  const Vec3d* best = &m.tris[poly.tri_first + t][k];
  if (apart(*best) > 0) {
    for (std::uint32_t i = poly.tri_first; i < poly.tri_first + poly.tri_count; ++i) {
      for (const Vec3d& p : m.tris[i]) best = apart(p) < apart(*best) ? &p : best;
    }
  }
  return best->y;
}

/// A tile's bytes in world coordinates with the true heights of the floor, which Detour's own does not have.
std::vector<unsigned char> world_tile(const NavMesh::Impl& impl, const dtMeshTile& tile, PolyId first) {
  std::vector<unsigned char> data(tile.data, tile.data + tile.dataSize);
  const auto floats = [&](const void* inside) {
    return reinterpret_cast<float*>(data.data() + (static_cast<const unsigned char*>(inside) - tile.data));
  };
  float* verts = floats(tile.verts);
  float* detail_verts = tile.header->detailVertCount > 0 ? floats(tile.detailVerts) : nullptr;
  for (int i = 0; i < tile.header->polyCount; ++i) {
    const dtPoly& p = tile.polys[i];
    const dtPolyDetail& d = tile.detailMeshes[i];
    for (unsigned t = 0; t < d.triCount; ++t) {
      for (std::size_t k = 0; k < 3; ++k) {
        const unsigned id = tile.detailTris[4 * (d.triBase + t) + k];
        float* v = id < p.vertCount ? verts + 3 * p.verts[id] : detail_verts + 3 * (d.vertBase + id - p.vertCount);
        v[1] = static_cast<float>(height_of(impl.polys, first + static_cast<PolyId>(i), t, k, v));
      }
    }
  }
  auto* header = reinterpret_cast<dtMeshHeader*>(data.data());
  shift(header->bmin, impl.origin);
  shift(header->bmax, impl.origin);
  for (int i = 0; i < header->vertCount; ++i) shift(verts + 3 * i, impl.origin);
  for (int i = 0; i < header->detailVertCount; ++i) shift(detail_verts + 3 * i, impl.origin);
  return data;
}

}  // namespace

Status save_navmesh(const NavMesh& mesh, const std::filesystem::path& path) {
  const NavMesh::Impl& impl = mesh.impl();
  const dtNavMesh& detour = *impl.mesh;
  std::ofstream out(path, std::ios::binary);
  if (!out) return {Errc::file_not_found, path.string() + ": cannot be made"};
  std::int32_t tiles = 0;
  for (int t = 0; t < detour.getMaxTiles(); ++t) tiles += detour.getTile(t)->header != nullptr ? 1 : 0;
  put_int(out, detail::kSetMagic);
  put_int(out, 2);
  put_int(out, tiles);
  dtNavMeshParams params = *detour.getParams();
  shift(params.orig, impl.origin);
  put(out, &params, sizeof params);
  for (const detail::SettingField& f : detail::kSettingFields) {
    put_float(out, f.value != nullptr ? impl.settings.*f.value : impl.settings.verts_per_poly);
  }
  const bool flags[4] = {impl.settings.filter_low_hanging_obstacles, impl.settings.filter_ledge_spans,
                         impl.settings.filter_walkable_low_height_spans, false};
  for (const bool f : flags) out.put(f ? 1 : 0);
  for (int t = 0; t < detour.getMaxTiles(); ++t) {
    const dtMeshTile& tile = *detour.getTile(t);
    if (tile.header == nullptr) continue;
    const auto data = world_tile(impl, tile, impl.first_poly[static_cast<std::size_t>(t)]);
    const dtTileRef ref = detour.getTileRef(&tile);
    put(out, &ref, 4);
    put_int(out, static_cast<std::int32_t>(data.size()));
    put(out, data.data(), data.size());
  }
  out.flush();
  if (!out) return {Errc::file_not_found, path.string() + ": cannot be written"};
  return {};
}

}  // namespace gsnav
