// SPDX-License-Identifier: Apache-2.0
#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>
#include <utility>

#include "gsnav/detail/core/guarded.hpp"
#include "gsnav/detail/nav/navmesh_file.hpp"
#include "navmesh_read_tile.hpp"

namespace gsnav {
namespace detail {
namespace {

using namespace navmesh_tile;

/// Converts a float32 to the shortest decimal number that rounds to it: 0.05 instead of 0.0500000007. A
/// mesh built with loaded settings therefore equals one built with the saved settings.
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
  // In older files the byte of the fourth flag is padding with any value.
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

/// Creates Detour's mesh. Detour keeps copies of the tiles.
Result<NavMeshPtr> mesh_of(const dtNavMeshParams& params, std::span<const Tile> tiles,
                           const Where& where) {
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
  }
  return mesh;
}

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
      head = 16;  // 64-bit references, and padding after the size.
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

  auto mesh = mesh_of(params, tiles, where);
  if (!mesh) return mesh.status();
  if (version == 1) {
    const std::byte* h = tiles[0].bytes.data();
    settings.agent_height = decimal(load<float>(h + 60));
    settings.agent_radius = decimal(load<float>(h + 64));
    settings.agent_max_climb = decimal(load<float>(h + 68));
    if (const Status s = settings.validate(); !s.ok()) return where.bad(s.message());
  }
  return assemble_navmesh(settings, {}, std::move(*mesh));
}

}  // namespace
}  // namespace detail

Result<NavMesh> parse_navmesh(std::span<const std::byte> bytes, const std::string& name) {
  return detail::guarded([&] { return detail::parse(bytes, {name}); }, name);
}

Result<NavMesh> load_navmesh(const std::filesystem::path& path) {
  std::error_code error;
  // Only regular files: reading a pipe or a device could block forever.
  if (!std::filesystem::is_regular_file(path, error)) {
    return Status(Errc::file_not_found, path.string() + ": is not a file");
  }
  std::ifstream in(path, std::ios::binary);
  const auto size = std::filesystem::file_size(path, error);
  if (!in || error) return Status(Errc::file_not_found, path.string() + ": cannot be opened");
  const auto read = [&]() -> Result<NavMesh> {
    std::vector<std::byte> bytes(size);
    in.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(size));
    if (!in) return Status(Errc::invalid_file, path.string() + ": cannot be read");
    return parse_navmesh(bytes, path.string());
  };
  return detail::guarded(read, path.string());
}

}  // namespace gsnav
