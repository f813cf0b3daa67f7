// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>

#include "gsnav/core/status.hpp"
#include "navmesh_format.hpp"
#include "navmesh_stages.hpp"

// One tile of a NavMesh file: where its arrays are, whether they hold what Detour relies on, and a copy
// for Detour.

namespace gsnav::detail::navmesh_tile {

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

inline bool usable(float v) noexcept {
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

/// Errors: invalid_file, unsupported. `link_size` is that of the file's links.
Result<TileLayout> read_layout(std::span<const std::byte> tile, std::size_t link_size,
                               const Where& where);

/// Whether the indices of its arrays stay within them.
Status check_tile(std::span<const std::byte> tile, const TileLayout& t, const Where& where);

/// The tile as Detour wants it in memory: 32-bit links, which it fills itself, and no off-mesh
/// connections.
DetourBytes copy_tile(std::span<const std::byte> tile, const TileLayout& t, int& size);

}  // namespace gsnav::detail::navmesh_tile
