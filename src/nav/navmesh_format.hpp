// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "gsnav/detail/nav/navmesh_fields.hpp"

namespace gsnav::detail {

// Sizes and offsets of Habitat's `.navmesh`: little endian, a set header, tiles with a header each.
inline constexpr double kMaxCoordinate = 1e6;  ///< metres: float32 has centimetres no more
inline constexpr std::int32_t kSetMagic = 'M' << 24 | 'S' << 16 | 'E' << 8 | 'T';
inline constexpr std::size_t kSetHeader = 40;    ///< magic, version, tile count, dtNavMeshParams
inline constexpr std::size_t kSetSettings = 56;  ///< from version 2: 13 floats and 4 flags
inline constexpr std::size_t kTileHeader = 100;  ///< dtMeshHeader
inline constexpr std::size_t kPoly = 32, kPolyDetail = 12, kBvNode = 16, kOffMesh = 36, kLink = 12;

}  // namespace gsnav::detail
