// SPDX-License-Identifier: Apache-2.0
// Builds in tiles. Each tile includes a border of the agent's radius plus three cells, so that erosion
// and filters see the same context as in a single tile. The walkable cells are therefore
// those of a single tile.
#include <algorithm>
#include <atomic>
#include <exception>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "gsnav/detail/core/guarded.hpp"
#include "gsnav/detail/core/list_by_group.hpp"
#include "gsnav/detail/core/thread_pool.hpp"
#include "navmesh_stages.hpp"
#include "tile_islands.hpp"
#include "triangle_heights.hpp"

namespace gsnav::detail {
namespace {

constexpr int kBesideRadius = 3;  // Cells of the border in addition to the agent's radius.

/// Tiles over a box, on one lattice of cells.
struct NavTiles {
  const NavMeshSettings& settings;
  Aabb<double> box;
  int border = 0, nx = 0, nz = 0;  ///< `border` in cells; `nx` and `nz` are numbers of tiles.
  int width = 0, depth = 0;        ///< Size of the box in cells.

  NavTiles(const NavMeshSettings& s, const Aabb<double>& b)
      : settings(s), box(b), border(VoxelSettings(s).radius + kBesideRadius) {
    width = max(1, cells_up(b.high.x - b.low.x, s.cell_size));
    depth = max(1, cells_up(b.high.z - b.low.z, s.cell_size));
    nx = (width + s.tile_size - 1) / s.tile_size;
    nz = (depth + s.tile_size - 1) / s.tile_size;
  }
  std::size_t count() const noexcept {
    return static_cast<std::size_t>(nx) * static_cast<std::size_t>(nz);
  }
  double side() const noexcept { return settings.tile_size * settings.cell_size; }
  /// Box of a tile, enlarged by `cells` on each side.
  Aabb<double> box_of(std::size_t tile, int cells) const noexcept {
    const auto columns = static_cast<std::size_t>(nx);
    const double x = static_cast<double>(tile % columns), z = static_cast<double>(tile / columns);
    const double rim = cells * settings.cell_size;
    return {{box.low.x + x * side() - rim, box.low.y, box.low.z + z * side() - rim},
            {box.low.x + (x + 1) * side() + rim, box.high.y, box.low.z + (z + 1) * side() + rim}};
  }
  /// Clears cells of a tile and its border that lie outside the box. A triangle that ends at the
  /// boundary of the box touches one cell more.
  void clip(std::size_t tile, rcHeightfield& field) const noexcept {
    const auto columns = static_cast<std::size_t>(nx);
    const int x0 = static_cast<int>(tile % columns) * settings.tile_size - border;
    const int z0 = static_cast<int>(tile / columns) * settings.tile_size - border;
    for (int z = 0; z < field.height; ++z) {
      for (int x = 0; x < field.width; ++x) {
        const bool inside = x0 + x >= 0 && z0 + z >= 0 && x0 + x < width && z0 + z < depth;
        if (!inside) field.spans[x + z * field.width] = nullptr;  // The field keeps its pools.
      }
    }
  }
  TilePlace place_of(std::size_t tile) const noexcept {
    TilePlace out{static_cast<int>(tile % static_cast<std::size_t>(nx)),
                  static_cast<int>(tile / static_cast<std::size_t>(nx)),
                  {},
                  {}};
    const Aabb<double> own = box_of(tile, 0);
    for (int k = 0; k < 3; ++k) {
      out.low[k] = static_cast<float>(own.low[k]);
      out.high[k] = static_cast<float>(own.high[k]);
    }
    return out;
  }
};

/// Triangles of each tile with its border, in the order of the input, because spans depend on that
/// order.
struct TriangleLists {
  std::vector<std::size_t> first;
  std::vector<std::uint32_t> triangles;

  TriangleLists(const NavTiles& grid, std::span<const Vec3d> vertices,
                std::span<const NavMesh::Triangle> triangles_in, const Vec3d& origin, ThreadPool& pool) {
    const double rim = (grid.border + 1) * grid.settings.cell_size;
    const auto index = [&](double v, int n) {
      return static_cast<std::uint32_t>(clamp(v / grid.side(), 0.0, static_cast<double>(n - 1)));
    };
    struct TileReach {
      std::uint32_t x0, x1, z0, z1;
    };
    std::vector<TileReach> reach(triangles_in.size());
    const double x = origin.x + grid.box.low.x, z = origin.z + grid.box.low.z;
    constexpr std::size_t kChunk = 4096;
    pool.run(static_cast<std::uint32_t>((reach.size() + kChunk - 1) / kChunk),
             [&](std::uint32_t chunk) noexcept {
               for (std::size_t i = chunk * kChunk; i < min((chunk + 1) * kChunk, reach.size()); ++i) {
                 const NavMesh::Triangle& t = triangles_in[i];
                 const Vec3d &a = vertices[t[0]], &b = vertices[t[1]], &c = vertices[t[2]];
                 reach[i] = {index(min(a.x, min(b.x, c.x)) - x - rim, grid.nx),
                             index(max(a.x, max(b.x, c.x)) - x + rim, grid.nx),
                             index(min(a.z, min(b.z, c.z)) - z - rim, grid.nz),
                             index(max(a.z, max(b.z, c.z)) - z + rim, grid.nz)};
               }
             });
    list_by_group(reach.size(), grid.count(), first, triangles, [&](std::size_t i, const auto& f) {
      const TileReach& r = reach[i];
      for (std::uint32_t row = r.z0; row <= r.z1; ++row) {
        for (std::uint32_t column = r.x0; column <= r.x1; ++column)
          f(column + static_cast<std::size_t>(grid.nx) * row);
      }
    });
  }
};

/// Detour's mesh of the tiles that have polygons, in order.
Result<NavMeshPtr> link_tiles(const NavTiles& grid, std::span<const TilePolygons> tiles) {
  const auto no_memory = [] {
    return Status(Errc::out_of_memory, "NavMesh: not enough memory for the tiles");
  };
  dtNavMeshParams params{};
  for (const TilePolygons& t : tiles) {
    if (t.empty()) continue;
    ++params.maxTiles;
    params.maxPolys = max(params.maxPolys, t.polys->npolys);
  }
  for (int k = 0; k < 3; ++k) params.orig[k] = static_cast<float>(grid.box.low[k]);
  params.tileWidth = params.tileHeight = static_cast<float>(grid.side());
  NavMeshPtr mesh(dtAllocNavMesh());
  if (mesh == nullptr) return no_memory();
  if (dtStatusFailed(mesh->init(&params))) {
    return Status(Errc::unsupported, "NavMesh: " + std::to_string(params.maxTiles) + " tiles of up to " +
                                         std::to_string(params.maxPolys) +
                                         " polygons are more than Detour can number; raise tile_size");
  }
  for (std::size_t i = 0; i < tiles.size(); ++i) {
    if (tiles[i].empty()) continue;
    int size = 0;
    auto tile = make_tile(grid.settings, tiles[i], grid.place_of(i), size);
    if (!tile.ok()) return tile.status();
    if (dtStatusFailed(mesh->addTile(tile->get(), size, DT_TILE_FREE_DATA, 0, nullptr)))
      return no_memory();
    (void)tile->release();  // NOLINT: Detour frees it
  }
  // Detour provides for three neighbours per border edge and silently omits further ones.
  for (int t = 0; t < params.maxTiles; ++t) {
    const dtMeshTile& tile = *std::as_const(*mesh).getTile(t);
    if (tile.linksFreeList != DT_NULL_LINK) continue;
    return Status(Errc::unsupported, "NavMesh: tile " + std::to_string(tile.header->x) + ", " +
                                         std::to_string(tile.header->y) +
                                         " touches more polygons than Detour links");
  }
  return mesh;
}

/// Progress of tiles for the thread that builds. Once it threw, all threads end their tiles.
class CallingProgress {
 public:
  CallingProgress(const Progress& progress, std::size_t tiles) : progress_(progress), tiles_(tiles) {}

  /// Function for the stages of a tile, on any thread. It throws if the build shall end.
  Progress of_tile() {
    if (!progress_) return {};
    return [this](double share) { tell(share); };
  }
  void tile_is_done() {
    ++done_;
    if (progress_) tell(0);
  }
  bool stopped() const noexcept { return stopped_; }
  /// Throws what the progress function threw, once no thread is at work.
  void rethrow() const {
    if (error_) std::rethrow_exception(error_);
  }

 private:
  void tell(double share) {
    if (std::this_thread::get_id() == caller_ && !stopped_) {
      try {
        progress_(min((static_cast<double>(done_) + share) / static_cast<double>(tiles_), 1.0));
      } catch (...) {
        error_ = std::current_exception();
        stopped_ = true;
      }
    }
    if (stopped_) throw Error(Errc::out_of_memory, "stopped");  // rethrow() replaces it
  }

  const Progress& progress_;
  const std::size_t tiles_;
  const std::thread::id caller_ = std::this_thread::get_id();
  std::atomic<std::size_t> done_{0};
  std::atomic<bool> stopped_{false};
  std::exception_ptr error_;
};

/// Builds the polygons of one tile.
Result<TilePolygons> build_tile(const NavTiles& grid, const TriangleLists& lists, std::size_t tile,
                                std::span<const Vec3d> vertices,
                                std::span<const NavMesh::Triangle> triangles, const Vec3d& origin,
                                const TileHooks& hooks, const Progress& progress) {
  std::vector<NavMesh::Triangle> own;
  for (std::size_t i = lists.first[tile]; i < lists.first[tile + 1]; ++i)
    own.push_back(triangles[lists.triangles[i]]);
  if (own.empty() && !hooks.fill) return TilePolygons{};
  RecastLog log;
  const Aabb<double> wide = grid.box_of(tile, grid.border);
  auto field = make_heightfield(log, grid.settings, wide.low, wide.high);
  if (!field.ok()) return field.status();
  if (hooks.fill) {
    const int columns = grid.nx, at = static_cast<int>(tile), side = grid.settings.tile_size;
    const int x0 = at % columns * side - grid.border, z0 = at / columns * side - grid.border;
    if (Status s = hooks.fill(log, x0, z0, **field); !s.ok()) return s;
  }
  if (Status s = rasterise(log, grid.settings, vertices, own, origin, **field, progress); !s.ok())
    return s;
  grid.clip(tile, **field);
  return build_polygons(log, grid.settings, **field, grid.border, {}, progress);
}

}  // namespace

Result<NavMesh> build_in_tiles(const NavMeshSettings& settings, std::span<const Vec3d> vertices,
                               std::span<const NavMesh::Triangle> triangles, const Vec3d& origin,
                               const Aabb<double>& box, int threads, const TileHooks& hooks) {
  if (Status s = check_grid(settings, box.low, box.high); !s.ok()) return s;
  const NavTiles grid(settings, box);
  const int most = static_cast<int>(std::clamp<unsigned>(std::thread::hardware_concurrency(), 1, 16));
  ThreadPool pool(threads > 0 ? threads : most);
  const TriangleLists lists(grid, vertices, triangles, origin, pool);
  std::vector<TilePolygons> tiles(grid.count());
  std::vector<Status> failed(tiles.size() + 1);
  std::optional<TriangleHeights> heights;
  // Largest pieces first, so that no thread is left with one at the end. Piece 0 computes the heights.
  // It reads all triangles, with about a twentieth of a tile's work for each.
  std::vector<std::pair<std::size_t, std::uint32_t>> work{{triangles.size() / 20, 0}};
  for (std::size_t i = 0; i < tiles.size(); ++i) {
    work.emplace_back(lists.first[i + 1] - lists.first[i], static_cast<std::uint32_t>(i + 1));
  }
  std::sort(work.begin(), work.end(), std::greater<>());
  std::mutex lock;
  std::size_t done = 0;
  std::atomic<bool> ended{false};  // hooks.progress threw: no tile is begun any more.
  CallingProgress calling(hooks.calling_progress, tiles.size());
  const auto piece = [&](std::uint32_t turn) noexcept {
    const std::uint32_t i = work[turn].second;
    if (calling.stopped() || ended) return;
    failed[i] = guarded([&] {
      if (i == 0) {
        if (!hooks.height) heights.emplace(vertices, triangles, origin, box);
        return Status();
      }
      auto made = build_tile(grid, lists, i - 1, vertices, triangles, origin, hooks, calling.of_tile());
      if (!made.ok()) return made.status();
      tiles[i - 1] = std::move(*made);
      calling.tile_is_done();
      if (!hooks.progress) return Status();
      const std::lock_guard held(lock);
      const Status told = guarded([&] {
        hooks.progress(static_cast<double>(++done) / static_cast<double>(tiles.size()));
        return Status();
      });
      if (!told) ended = true;
      return told;
    });
  };
  pool.run(static_cast<std::uint32_t>(tiles.size() + 1), piece);
  calling.rethrow();
  WalkableAreas areas;
  for (const Status& s : failed) {
    if (s.code() == Errc::out_of_memory) return {s.code(), "NavMesh, tiles: " + s.message()};
    if (!s.ok()) return s;
  }
  for (const TilePolygons& t : tiles) areas.add(t.areas);
  if (!(areas.eroded > 0)) return nothing_navigable("no walkable cell is left", settings, areas);

  const auto some = [&] {
    return std::any_of(tiles.begin(), tiles.end(), [](const auto& t) { return !t.empty(); });
  };
  const auto too_small = [&] {
    return nothing_navigable("every region is smaller than region_min_size", settings, areas);
  };
  if (!some()) return too_small();
  auto mesh = link_tiles(grid, tiles);
  if (!mesh.ok()) return mesh.status();
  const double least = max(settings.region_min_size * settings.region_min_size,
                           hooks.least_area / (settings.cell_size * settings.cell_size));
  if (drop_small_islands(**mesh, least, tiles)) {
    if (!some()) return too_small();
    mesh = link_tiles(grid, tiles);
    if (!mesh.ok()) return mesh.status();
  }
  if (hooks.height) return assemble_navmesh(settings, origin, std::move(*mesh), hooks.height);
  return assemble_navmesh(settings, origin, std::move(*mesh),
                          [&](const Vec3d& p) { return floor_below(*heights, settings, p); });
}

}  // namespace gsnav::detail
