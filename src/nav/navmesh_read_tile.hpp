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

// One tile of a NavMesh file: its layout, the checks that Detour relies on, and a copy for Detour.

namespace gsnav::detail::navmesh_tile {

/// Prefix of an error message, and functions that complete it.
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
}  // False for NaN.

/// Fields of dtMeshHeader, and offsets of the arrays.
struct TileLayout {
  static constexpr const char* kCountNames[] = {"polyCount",       "vertCount",       "maxLinkCount",
                                                "detailMeshCount", "detailVertCount", "detailTriCount",
                                                "bvNodeCount",     "offMeshConCount"};
  std::int32_t polys, verts, links, details, detail_verts, detail_tris, bv_nodes, off_mesh, ground;
  std::size_t at_verts, at_polys, at_details, at_detail_verts, at_detail_tris, at_bv;
};

/// Reads the layout of a tile.
/// @param link_size Size of a link in the file, bytes.
/// @return invalid_file or unsupported.
Result<TileLayout> read_layout(std::span<const std::byte> tile, std::size_t link_size,
                               const Where& where);

/// Checks that all indices are within their arrays.
Status check_tile(std::span<const std::byte> tile, const TileLayout& t, const Where& where);

/// Copies a tile to the form that Detour needs in memory: 32-bit links, which Detour fills in, and no
/// off-mesh connections.
DetourBytes copy_tile(std::span<const std::byte> tile, const TileLayout& t, int& size);

}  // namespace gsnav::detail::navmesh_tile
