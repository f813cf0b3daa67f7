// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "gsnav/detail/nav/navmesh_fields.hpp"

namespace gsnav::detail {

// Sizes and offsets of Habitat's `.navmesh` format: little endian, a header for the set, then tiles with
// a header each.
inline constexpr double kMaxCoordinate = 1e6;  ///< Metres. Beyond this, float32 cannot resolve
                                               ///< centimetres.
inline constexpr std::int32_t kSetMagic = 'M' << 24 | 'S' << 16 | 'E' << 8 | 'T';
inline constexpr std::size_t kSetHeader = 40;    ///< Magic number, version, tile count, dtNavMeshParams.
inline constexpr std::size_t kSetSettings = 56;  ///< From version 2 on: 13 floats and 4 flags.
inline constexpr std::size_t kTileHeader = 100;  ///< dtMeshHeader.
inline constexpr std::size_t kPoly = 32, kPolyDetail = 12, kBvNode = 16, kOffMesh = 36, kLink = 12;

}  // namespace gsnav::detail
