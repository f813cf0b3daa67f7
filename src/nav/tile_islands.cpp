// SPDX-License-Identifier: Apache-2.0
#include "tile_islands.hpp"

#include <algorithm>
#include <cstring>
#include <utility>
#include <vector>

namespace gsnav::detail {
namespace {

/// Removes the polygons of a tile marked in `drop`. These lie on other islands, so the rest keeps all
/// its neighbours.
void keep_others(TilePolygons& tile, const std::vector<bool>& drop) {
  rcPolyMesh& m = *tile.polys;
  rcPolyMeshDetail& d = *tile.heights;
  const int stride = 2 * m.nvp;
  std::vector<unsigned short> index(static_cast<std::size_t>(m.npolys), 0);
  int kept = 0;
  for (int i = 0; i < m.npolys; ++i) {
    if (!drop[static_cast<std::size_t>(i)])
      index[static_cast<std::size_t>(i)] = static_cast<unsigned short>(kept++);
  }
  kept = 0;
  for (int i = 0; i < m.npolys; ++i) {
    if (drop[static_cast<std::size_t>(i)]) continue;
    unsigned short* to = m.polys + kept * stride;
    std::memmove(to, m.polys + i * stride, static_cast<std::size_t>(stride) * sizeof *to);
    for (int k = m.nvp; k < stride; ++k) {
      if ((to[k] & 0x8000) == 0) to[k] = index[to[k]];
    }
    m.regs[kept] = m.regs[i];
    m.flags[kept] = m.flags[i];
    m.areas[kept] = m.areas[i];
    std::memmove(d.meshes + 4 * kept, d.meshes + 4 * i, 4 * sizeof *d.meshes);
    ++kept;
  }
  m.npolys = d.nmeshes = kept;
}

}  // namespace

bool drop_small_islands(const dtNavMesh& mesh, double least, std::span<TilePolygons> tiles) {
  std::vector<TilePolygons*> of;  // Tiles as Detour numbers them.
  std::vector<std::size_t> first;
  std::size_t count = 0;
  for (TilePolygons& t : tiles) {
    if (t.empty()) continue;
    of.push_back(&t);
    first.push_back(count);
    count += static_cast<std::size_t>(t.polys->npolys);
  }
  std::vector<bool> visited(count, false);
  std::vector<std::vector<bool>> drop(of.size());
  using Poly = std::pair<std::size_t, std::size_t>;  // Tile and polygon.
  std::vector<Poly> island;
  std::vector<std::pair<std::size_t, unsigned short>> regions;
  bool any = false;
  for (std::size_t t = 0; t < of.size(); ++t) {
    for (std::size_t p = 0; p < static_cast<std::size_t>(of[t]->polys->npolys); ++p) {
      if (visited[first[t] + p]) continue;
      visited[first[t] + p] = true;
      island.assign(1, {t, p});
      regions.clear();
      for (std::size_t i = 0; i < island.size(); ++i) {
        const auto [at, poly] = island[i];
        regions.push_back({at, of[at]->polys->regs[poly]});
        const dtMeshTile& tile = *mesh.getTile(static_cast<int>(at));
        for (unsigned l = tile.polys[poly].firstLink; l != DT_NULL_LINK; l = tile.links[l].next) {
          const Poly next{mesh.decodePolyIdTile(tile.links[l].ref),
                          mesh.decodePolyIdPoly(tile.links[l].ref)};
          if (visited[first[next.first] + next.second]) continue;
          visited[first[next.first] + next.second] = true;
          island.push_back(next);
        }
      }
      std::sort(regions.begin(), regions.end());
      regions.erase(std::unique(regions.begin(), regions.end()), regions.end());
      double cells = 0;
      for (const auto& [at, region] : regions) cells += of[at]->region_cells[region];
      if (cells >= least) continue;
      any = true;
      for (const auto& [at, poly] : island) {
        drop[at].resize(static_cast<std::size_t>(of[at]->polys->npolys), false);
        drop[at][poly] = true;
      }
    }
  }
  for (std::size_t t = 0; t < of.size(); ++t) {
    if (!drop[t].empty()) keep_others(*of[t], drop[t]);
  }
  return any;
}

}  // namespace gsnav::detail
