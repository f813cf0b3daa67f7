// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "gsnav/core/view.hpp"
#include "gsnav/math/functions.hpp"
#include "gsnav/math/similarity.hpp"
#include "gsnav/math/vec.hpp"

namespace gsnav {

/// Screen-space filter that an asset was trained with.
enum class Filter : std::uint8_t {
  classic,  ///< Adds eps2d to the diagonal of the 2D covariance; keeps the opacity (INRIA).
  mip,  ///< As classic, and multiplies the opacity by sqrt(det0 / det), where det0 is the determinant
        ///< with base_eps2d (Mip-Splatting, antialiased).
};

/// Number of SH coefficients per channel up to `degree`.
GSNAV_HD constexpr int sh_coefficient_count(int degree) noexcept { return (degree + 1) * (degree + 1); }

/// Highest SH degree that kernels evaluate.
inline constexpr int kMaxShDegree = 3;

/// Rows per chunk. The Gaussians of a chunk are culled together and projected as one work item.
inline constexpr std::size_t kProjectChunk = 256;

/// Rows per part. A chunk that straddles the edge of the view is culled again, one part at a time.
inline constexpr std::size_t kChunkPart = 64;

/// Bounds of all Gaussians of a chunk, in the asset's frame.
struct ChunkBounds {
  Vec3d low{},            ///< smallest coordinates of the means, metres
      high{};             ///< largest coordinates of the means, metres
  float scale_max = 0;    ///< largest standard deviation, metres
  float opacity_max = 0;  ///< in [0, 1]
};

/// Constants that decode the packed rows of one chunk (detail/frame/set_rows.hpp).
struct PackedChunk {
  Vec3<float> low{},     ///< offset of a mean with code 0, metres
      step{};            ///< a mean's offset is low + step * code, metres
  float scale_step = 0;  ///< The square root of a standard deviation is scale_step * code.
  float sh_steps[3]{};  ///< A coefficient of band 1, 2 or 3 is its step * code, if bands are stored as 8
                        ///< bits.
};

/// Number of 32-bit words that hold one bit per row of a chunk.
inline constexpr std::size_t kSeenRowWords = kProjectChunk / 32;

/// Rows of a chunk that may be visible, one bit per row. Without words, all rows may be.
struct SeenRows {
  const std::uint32_t* words = nullptr;  ///< [kSeenRowWords], or null
  /// Visibility of the rows 32 k to 32 k + 31, the first row in the lowest bit. All ones without words.
  GSNAV_HD std::uint32_t word(std::size_t k) const noexcept { return words == nullptr ? ~0u : words[k]; }
  /// True if `row` may be visible.
  GSNAV_HD bool has(std::size_t row) const noexcept { return (word(row / 32) >> (row % 32) & 1u) != 0; }
  /// True if any row of a part may be visible.
  GSNAV_HD bool any_of_part(std::size_t part) const noexcept {
    static_assert(kChunkPart == 64);
    return (word(2 * part) | word(2 * part + 1)) != 0;
  }
  /// Bits of the parts that have a row that may be visible. Bit p is part p.
  GSNAV_HD std::uint32_t parts() const noexcept {
    if (words == nullptr) return ~0u;
    std::uint32_t bits = 0;
    for (std::size_t p = 0; p < kProjectChunk / kChunkPart; ++p) bits |= any_of_part(p) ? 1u << p : 0u;
    return bits;
  }
};

/// Place of row i in a list of values per origin. `ids` is [N], or empty if all rows have the first
/// origin.
GSNAV_HD std::size_t origin_id(const View<const std::uint32_t>& ids, std::size_t i) noexcept {
  return ids.empty() ? 0 : ids[i];
}
/// The origin of row i; without `origins` it is zero.
GSNAV_HD Vec3d origin_of(const View<const std::uint32_t>& ids, const View<const Vec3d>& origins,
                         std::size_t i) noexcept {
  return origins.empty() ? Vec3d{} : origins[origin_id(ids, i)];
}

// A new encoding of shapes or bands needs:
// - what a row is read as (detail/frame/set_rows.hpp), by lanes (detail/lanes/project_chunk.hpp,
//   color.hpp) and by batches on a GPU (backends/cuda/src: batch_rows.cuh, batch_regions.cu,
//   batch_state.cuh); most of these are a switch that the compiler checks;
// - the check of its arrays (detail/render/validate_set.hpp);
// - its cloud (scene/packed_cloud.hpp) and all that handles clouds (detail/scene/: content_hash.hpp,
//   describe_cloud.hpp, drop_bands.hpp, edit_cloud.hpp, gaussian_arrays.hpp, lod_build.hpp,
//   packed_rows.hpp, spatial_order.hpp);
// - for tests, its own decoding in the oracle (detail/eval/oracle_rows.hpp);
// - for users: bindings/python/src/cloud.cpp.

/// How shapes are stored.
enum class ShapeEncoding : std::uint8_t {
  ellipsoids,  ///< quats and scales
  factors,     ///< axes
  codes,       ///< packed, with opacities and, where `means` is empty, means
};

/// How the SH coefficients above degree 0 are stored.
enum class BandEncoding : std::uint8_t { floats, halves, codes };

/// Bytes of a number that is stored so.
GSNAV_HD constexpr std::size_t bytes_of(BandEncoding encoding) noexcept {
  return encoding == BandEncoding::codes    ? 1
         : encoding == BandEncoding::halves ? sizeof(std::uint16_t)
                                            : sizeof(float);
}

/// Positions, shapes and opacities of N Gaussians, in metres in the asset's frame. The arrays that are
/// not empty say how shapes are stored: `encoding`.
struct ShapeRows {
  std::size_t size = 0;           ///< number of Gaussians, N
  Planes<const float, 3> means;   ///< x, y, z offsets from the row's origin, metres
  Planes<const float, 4> quats;   ///< unit quaternions w, x, y, z
  Planes<const float, 3> scales;  ///< standard deviations, metres, >= 0
  /// Shapes that are not rotated ellipsoids, such as the blended axes of a skinned Gaussian. Plane 3 r +
  /// c is row r, column c of the factor M of the covariance M M^T. Replaces quats and scales.
  Planes<const float, 9> axes;
  View<const float> opacities;           ///< [N], in [0, 1]
  View<const std::uint32_t> origin_ids;  ///< [N], indices into GaussianRows::origins. Empty: all 0.
  /// Packed shapes, opacities and means, [10][N], in the planes kScales, kQuats, kOpacity and kMeans.
  /// [7][N] if means are floats. Replaces quats, scales and opacities. Host memory only.
  View<const std::uint16_t> codes;
  View<const PackedChunk> chunks;  ///< constants that decode `codes`, [ceil(N / kProjectChunk)]

  static constexpr int kScales = 0,  ///< first plane of `codes` with scales
      kQuats = 3,                    ///< first plane with rotations
      kOpacity = 6,                  ///< plane with opacities
      kMeans = 7,                    ///< first plane with means
      kCodePlanes = 10;              ///< number of planes

  /// Encoding of the shapes. Device code reads no codes.
  GSNAV_HD ShapeEncoding encoding() const noexcept {
    if (GSNAV_DEVICE_CODE == 0 && !codes.empty()) return ShapeEncoding::codes;
    return axes.empty() ? ShapeEncoding::ellipsoids : ShapeEncoding::factors;
  }
  /// Number of chunks that N rows make.
  GSNAV_HD std::size_t chunk_count() const noexcept {
    return (size + kProjectChunk - 1) / kProjectChunk;
  }
};

/// SH coefficients of N Gaussians. The arrays that are not empty say how they are stored: `packed` for
/// degree 0, `band_encoding` above it.
struct ColorRows {
  int degree = 0;         ///< SH degree, 0 to 3
  View<const float> sh0;  ///< [N][3], coefficients of degree 0
  View<const float> shN;  ///< [N][(degree+1)^2 - 1][3], coefficients above degree 0. Empty for degree 0.
  /// shN as IEEE binary16 (detail/math/half.hpp). Replaces shN.
  View<const std::uint16_t> shN_half;
  /// Packed: coefficients of degree 0 as binary16, [N][3]. Replaces sh0. Host memory only.
  View<const std::uint16_t> sh0_half;
  /// Packed: bands above degree 0, [N][(degree+1)^2 - 1][3]. Replaces shN and shN_half. Only together
  /// with sh0_half.
  View<const std::int8_t> shN_codes;
  View<const PackedChunk> chunks;  ///< decoding steps of shN_codes, [ceil(N / kProjectChunk)]
  /// Rotation of each Gaussian since training, w, x, y, z. SH is evaluated at the view direction turned
  /// back by it. Used by skinned sets of degree >= 1. Empty: no rotation.
  Planes<const float, 4> rotations;
  /// Highest SH degree that the Gaussians of each chunk use, one value per chunk
  /// (detail/scene/scene_bands.hpp). Higher bands are not read. In the backend's memory. Empty: `degree`
  /// for all chunks.
  View<const std::uint8_t> chunk_degrees;

  /// True if the coefficients of degree 0 are packed. Always false in device code.
  GSNAV_HD bool packed() const noexcept { return GSNAV_DEVICE_CODE == 0 && !sh0_half.empty(); }
  /// Encoding of the coefficients above degree 0. Device code reads no codes.
  GSNAV_HD BandEncoding band_encoding() const noexcept {
    if (packed() && !shN_codes.empty()) return BandEncoding::codes;
    return shN_half.empty() ? BandEncoding::floats : BandEncoding::halves;
  }
  /// Number of values per row above degree 0.
  GSNAV_HD std::size_t rest() const noexcept {
    return static_cast<std::size_t>(3 * (sh_coefficient_count(degree) - 1));
  }
  /// Degree to which row i is evaluated if degree `wanted` is requested.
  GSNAV_HD int degree_of(std::size_t i, int wanted) const noexcept {
    if (chunk_degrees.empty()) return wanted;
    const int used = static_cast<int>(chunk_degrees[i / kProjectChunk]);
    return used < wanted ? used : wanted;
  }
};

/// Read-only arrays of N Gaussians, in the form in which kernels receive them. It owns nothing.
///
/// The position of Gaussian i is `origins[origin_ids[i]] + mean_i`. Means are float32 offsets from
/// origins on a 64 m lattice, so scenes far from zero keep their precision.
struct GaussianRows {
  ShapeRows shape;            ///< positions, shapes, opacities
  ColorRows color;            ///< SH coefficients
  View<const Vec3d> origins;  ///< Metres, asset frame, in host memory. Empty: one origin at zero.
  /// Index of each Gaussian before rows were sorted in space, [N]. Gaussians of equal depth are blended
  /// in the order of these ids. Empty: row order.
  View<const std::uint32_t> row_ids;
  /// Bounds of each chunk, [ceil(N / kProjectChunk)]. Chunks outside the view are skipped. Empty: no
  /// chunk is skipped.
  View<const ChunkBounds> chunk_bounds;
  /// Bounds of each part, [ceil(N / kChunkPart)]. In chunks at the edge of the view, parts outside the
  /// view are skipped. Empty: chunks are projected whole.
  View<const ChunkBounds> part_bounds;

  /// Number of Gaussians.
  GSNAV_HD std::size_t size() const noexcept { return shape.size; }
  /// Number of chunks.
  GSNAV_HD std::size_t chunk_count() const noexcept { return shape.chunk_count(); }
  /// The origin of row i.
  GSNAV_HD Vec3d origin_of(std::size_t i) const noexcept {
    return gsnav::origin_of(shape.origin_ids, origins, i);
  }
};

/// Number of leading words of `Selection::seen` that hold the bits of `chunks` chunks.
GSNAV_HD constexpr std::size_t seen_chunk_words(std::size_t chunks) noexcept {
  return (chunks + 31) / 32;
}

/// The rows of a set that a frame draws. Arrays are in the backend's memory. It owns nothing. `chunks`
/// is the number of chunks of the set throughout.
struct Selection {
  /// Indices of the chunks to draw, each once, as a level-of-detail tree selects them
  /// (scene/lod_cut.hpp). Empty: all chunks.
  View<const std::uint32_t> drawn_chunks;
  /// Chunks and rows that may be visible from the camera's position; the others are not drawn
  /// (scene/visible_sets.hpp). Empty: all may be visible. The layout is:
  /// 1. seen_chunk_words() words with one bit per chunk: chunk c is bit c % 32 of word c / 32.
  /// 2. Optional: for each of those words, the number of bits set in all words before it.
  /// 3. With 2: kSeenRowWords words per chunk whose bit is set, in the order of chunks. Row r is bit r %
  ///   32 of word r / 32.
  View<const std::uint32_t> seen;

  /// Number of chunks to draw.
  GSNAV_HD std::size_t count(std::size_t chunks) const noexcept {
    return drawn_chunks.empty() ? chunks : drawn_chunks.size;
  }
  /// Index of the c-th chunk to draw.
  GSNAV_HD std::size_t chunk_id(std::size_t c) const noexcept {
    return drawn_chunks.empty() ? c : drawn_chunks[c];
  }
  /// True if some row of the chunk may be visible from the camera's position.
  GSNAV_HD bool may_be_seen(std::size_t chunk) const noexcept {
    return seen.empty() || (seen[chunk / 32] >> (chunk % 32) & 1u) != 0;
  }
  /// True if `seen` has bits per row.
  GSNAV_HD bool has_seen_rows(std::size_t chunks) const noexcept {
    return seen.size > seen_chunk_words(chunks);
  }
  /// Rows that may be visible, of a chunk for which may_be_seen() is true.
  GSNAV_HD SeenRows seen_rows(std::size_t chunks, std::size_t chunk) const noexcept {
    if (!has_seen_rows(chunks)) return {};
    const std::size_t words = seen_chunk_words(chunks);
    const std::uint32_t before = seen[chunk / 32] & ((1u << (chunk % 32)) - 1u);
    const std::size_t place = seen[words + chunk / 32] + static_cast<std::size_t>(count_bits(before));
    return {seen.data + 2 * words + place * kSeenRowWords};
  }
};

/// True if `words` is a valid length of Selection::seen for a set of `chunks` chunks, with or without
/// bits per row.
GSNAV_HD constexpr bool seen_may_have(std::size_t words, std::size_t chunks) noexcept {
  const std::size_t of_chunks = seen_chunk_words(chunks);
  return words == of_chunks || (words >= 2 * of_chunks && (words - 2 * of_chunks) % kSeenRowWords == 0);
}

/// Encoding of colour values.
enum class ColorSpace : std::uint8_t {
  display,  ///< sRGB-encoded, as screens and nearly all training images are
  linear,   ///< proportional to light, Rec. 709 primaries
};

/// One set of Gaussians in the world: a scene, an avatar, an object.
struct GaussianSet {
  GaussianRows gaussians;                        ///< arrays, owned by the caller
  Similarity world_from_asset{};                 ///< placement in the world
  Filter filter = Filter::classic;               ///< screen-space filter of the training
  float eps2d = 0.3f;                            ///< added to the diagonal of the 2D covariance, px^2
  ColorSpace color_space = ColorSpace::display;  ///< Encoding of the set's colours. They are converted
                                                 ///< to the frame's after SH.
  /// Blur (px^2) that the stored opacities already account for, in [0, eps2d]. The mip filter
  /// compensates only for eps2d - base_eps2d. 0 is Mip-Splatting's filter.
  float base_eps2d = 0;
  Selection selection{};  ///< rows to draw

  /// Number of chunks to draw.
  GSNAV_HD std::size_t drawn_chunk_count() const noexcept {
    return selection.count(gaussians.chunk_count());
  }
};

// Larger arguments do not fit what kernel functions accept (docs/architecture.md, "Sizes of arguments").
static_assert(sizeof(void*) != 8 || (sizeof(ShapeRows) <= 256 && sizeof(ColorRows) <= 256));
static_assert(sizeof(void*) != 8 || (sizeof(GaussianRows) <= 480 && sizeof(GaussianSet) <= 592));

}  // namespace gsnav
