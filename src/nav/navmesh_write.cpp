// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "gsnav/core/replace_file.hpp"
#include "gsnav/detail/nav/navmesh_file.hpp"
#include "navmesh_format.hpp"
#include "navmesh_impl.hpp"

namespace gsnav {
namespace {

void put_float(OutputFile& out, double v) {
  const auto f = static_cast<float>(v);
  out.write(&f, 4);
}
void put_int(OutputFile& out, std::int32_t v) { out.write(&v, 4); }

void put_settings(OutputFile& out, const NavMeshSettings& s) {
  for (const detail::SettingField& f : detail::kSettingFields) {
    put_float(out, f.value != nullptr ? s.*f.value : s.verts_per_poly);
  }
  for (const bool f :
       {s.filter_low_hanging_obstacles, s.filter_ledge_spans, s.filter_walkable_low_height_spans}) {
    out.write(f ? "\1" : "\0", 1);
  }
  out.write(s.include_static_objects ? "\1" : "\0", 1);
}

/// Moves a point by d.
void shift(float* p, const Vec3d& d) noexcept {
  for (int c = 0; c < 3; ++c) p[c] = static_cast<float>(static_cast<double>(p[c]) + d[c]);
}

/// Data of a tile in world coordinates with the true heights of the floor, which Detour's data lack.
/// @param points Vertices and height samples of the tile, relative to the origin.
std::vector<unsigned char> world_tile(const NavMesh::Impl& impl, const dtMeshTile& tile,
                                      const Vec3d* points) {
  std::vector<unsigned char> data(tile.data, tile.data + tile.dataSize);
  const auto floats = [&](const void* inside) {
    return reinterpret_cast<float*>(data.data() +
                                    (static_cast<const unsigned char*>(inside) - tile.data));
  };
  float* verts = floats(tile.verts);
  float* detail_verts = tile.header->detailVertCount > 0 ? floats(tile.detailVerts) : nullptr;
  auto* header = reinterpret_cast<dtMeshHeader*>(data.data());
  shift(header->bmin, impl.origin);
  shift(header->bmax, impl.origin);
  const auto place = [&](float* list, int count) {
    for (int i = 0; i < count; ++i, ++points) {
      list[3 * i + 1] = static_cast<float>(points->y);
      shift(list + 3 * i, impl.origin);
    }
  };
  place(verts, header->vertCount);
  place(detail_verts, header->detailVertCount);
  return data;
}

}  // namespace

Status save_navmesh(const NavMesh& mesh, const std::filesystem::path& path, int version) {
  if (version != 1 && version != 2) {
    return {Errc::invalid_argument,
            path.string() + ": version = " + std::to_string(version) + " is not 1 or 2"};
  }
  const NavMesh::Impl& impl = mesh.impl();
  for (const Vec3d& p : {impl.bounds.low, impl.bounds.high}) {
    for (int k = 0; k < 3; ++k) {
      if (std::abs(p[k]) < detail::kMaxCoordinate - impl.settings.cell_size - impl.settings.cell_height)
        continue;
      return {Errc::unsupported, path.string() + ": the mesh reaches to " + std::to_string(p[k]) +
                                     " m: a file's float32 has no centimetres beyond 1e6 m"};
    }
  }
  const dtNavMesh& detour = *impl.mesh;
  OutputFile out;
  if (Status s = out.open(path); !s) return s;
  std::int32_t tiles = 0;
  for (int t = 0; t < detour.getMaxTiles(); ++t) tiles += detour.getTile(t)->header != nullptr ? 1 : 0;
  put_int(out, detail::kSetMagic);
  put_int(out, version);
  put_int(out, tiles);
  dtNavMeshParams params = *detour.getParams();
  shift(params.orig, impl.origin);
  out.write(&params, sizeof params);
  if (version == 2) put_settings(out, impl.settings);
  for (int t = 0; t < detour.getMaxTiles(); ++t) {
    const dtMeshTile& tile = *detour.getTile(t);
    if (tile.header == nullptr) continue;
    const auto data =
        world_tile(impl, tile, impl.polys.points.data() + impl.first_point[static_cast<std::size_t>(t)]);
    const dtTileRef ref = detour.getTileRef(&tile);
    out.write(&ref, 4);
    put_int(out, static_cast<std::int32_t>(data.size()));
    out.write(data.data(), data.size());
  }
  return out.commit();
}

}  // namespace gsnav
