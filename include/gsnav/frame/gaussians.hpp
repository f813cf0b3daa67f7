// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "gsnav/core/view.hpp"
#include "gsnav/math/functions.hpp"
#include "gsnav/math/similarity.hpp"
#include "gsnav/math/vec.hpp"

namespace gsnav {

/// The screen-space filter that an asset was trained with.
enum class Filter : std::uint8_t {
  classic,  ///< eps2d is added to the 2D covariance, opacity stays (INRIA)
  mip,  ///< ... and opacity is multiplied by sqrt(det0 / det) (Mip-Splatting, antialiased), det0 with
        ///< base_eps2d
};

/// Number of SH coefficients per channel up to `degree`.
GSNAV_HD constexpr int sh_coefficient_count(int degree) noexcept { return (degree + 1) * (degree + 1); }

/// Highest SH degree the kernels evaluate.
inline constexpr int kMaxShDegree = 3;

/// How many consecutive Gaussians are culled together and projected as one work item.
inline constexpr std::size_t kProjectChunk = 256;

/// Of a chunk that is only partly in view so many consecutive rows at a time are tested once more.
inline constexpr std::size_t kChunkPart = 64;

/// What a chunk of Gaussians may reach: a bound for all of them, in the asset's frame.
struct ChunkBounds {
  Vec3d low{}, high{};    ///< box of the means, metres
  float scale_max = 0;    ///< largest standard deviation, metres
  float opacity_max = 0;  ///< in [0, 1]
};

/// How the rows of a chunk of kProjectChunk are packed (detail/frame/set_rows.hpp).
struct PackedChunk {
  Vec3<float> low{}, step{};  ///< offset of a mean: low + step code, metres
  float scale_step = 0;       ///< root of a standard deviation: scale_step code
  float sh_steps[3]{};        ///< coefficient of band 1, 2, 3: step code, where these have 8 bits
};

/// Words of 32 bits, one a row, that a chunk takes.
inline constexpr std::size_t kSeenRowWords = kProjectChunk / 32;

/// Which rows of a chunk may be seen: all where there are no words.
struct SeenRows {
  const std::uint32_t* words = nullptr;  ///< [kSeenRowWords]
  /// Of the 32 rows from 32 k on.
  GSNAV_HD std::uint32_t word(std::size_t k) const noexcept { return words == nullptr ? ~0u : words[k]; }
  /// Whether a row may be visible.
  GSNAV_HD bool has(std::size_t row) const noexcept { return (word(row / 32) >> (row % 32) & 1u) != 0; }
  /// Whether any of the kChunkPart rows of a part.
  GSNAV_HD bool any_of_part(std::size_t part) const noexcept {
    static_assert(kChunkPart == 64);
    return (word(2 * part) | word(2 * part + 1)) != 0;
  }
  /// The parts with any: a bit each.
  GSNAV_HD std::uint32_t parts() const noexcept {
    if (words == nullptr) return ~0u;
    std::uint32_t bits = 0;
    for (std::size_t p = 0; p < kProjectChunk / kChunkPart; ++p) bits |= any_of_part(p) ? 1u << p : 0u;
    return bits;
  }
};

/// Where N Gaussians are, how large and how opaque they are: what geometry is computed from. Metres, in
/// the asset's own frame. One of three encodings holds the shapes: quats and scales; axes; codes.
struct ShapeRows {
  std::size_t size = 0;           ///< N
  Planes<const float, 3> means;   ///< x, y, z offsets from the row's origin
  Planes<const float, 4> quats;   ///< w, x, y, z of unit length
  Planes<const float, 3> scales;  ///< standard deviations >= 0
  /// Shapes that are no rotated ellipsoids' (a skinned Gaussian's blended axes): [3 r + c] is row r,
  /// column c of the factor M, Sigma = M M^T. Without quats and scales, or in place of them.
  Planes<const float, 9> axes;
  View<const float> opacities;           ///< in [0, 1], [N]
  View<const std::uint32_t> origin_ids;  ///< [N] into GaussianRows::origins, or empty: all 0
  /// Packed shapes and opacities, [10][N]: kScales, kQuats, kOpacity, kMeans. [7][N] where means are
  /// floats. Without quats, scales and opacities. Host memory only.
  View<const std::uint16_t> codes;
  View<const PackedChunk> chunks;  ///< what codes stand for, [ceil(N / kProjectChunk)]

  /// First code plane of each quantity, and the number of planes.
  static constexpr int kScales = 0, kQuats = 3, kOpacity = 6, kMeans = 7, kCodePlanes = 10;

  /// Whether shapes and opacities are packed. False in device code.
  GSNAV_HD bool packed() const noexcept { return GSNAV_DEVICE_CODE == 0 && !codes.empty(); }
  /// Chunks that the rows make.
  GSNAV_HD std::size_t chunk_count() const noexcept {
    return (size + kProjectChunk - 1) / kProjectChunk;
  }
};

/// The SH coefficients of N Gaussians. One of three encodings holds them: floats; floats and halves;
/// packed.
struct ColorRows {
  int degree = 0;         ///< 0 to 3
  View<const float> sh0;  ///< [N][3], the degree-0 coefficients
  View<const float> shN;  ///< [N][(degree+1)^2 - 1][3], empty for degree 0
  /// The same as IEEE binary16 (detail/math/half.hpp), in place of shN.
  View<const std::uint16_t> shN_half;
  /// Packed degree-0 coefficients as binary16, [N][3], in place of sh0. Host memory only.
  View<const std::uint16_t> sh0_half;
  /// Packed bands, [N][(degree+1)^2 - 1][3], in place of shN and shN_half. Beside sh0_half only.
  View<const std::int8_t> shN_codes;
  View<const PackedChunk> chunks;  ///< steps of shN_codes, [ceil(N / kProjectChunk)]
  /// Rotation of each Gaussian since training (w, x, y, z), or empty: the view direction is turned back
  /// by it before SH is evaluated. Of skinned sets of degree >= 1.
  Planes<const float, 4> rotations;
  /// Highest SH degree that the Gaussians of a chunk use, one a chunk (detail/scene/scene_bands.hpp):
  /// bands above it are not read. In the backend's memory. Empty: degree.
  View<const std::uint8_t> chunk_degrees;

  /// Whether degree-0 coefficients are packed. False in device code.
  GSNAV_HD bool packed() const noexcept { return GSNAV_DEVICE_CODE == 0 && !sh0_half.empty(); }
  /// Values of a row above degree 0.
  GSNAV_HD std::size_t rest() const noexcept {
    return static_cast<std::size_t>(3 * (sh_coefficient_count(degree) - 1));
  }
  /// Degree to which row i is evaluated where `wanted` is asked for.
  GSNAV_HD int degree_of(std::size_t i, int wanted) const noexcept {
    if (chunk_degrees.empty()) return wanted;
    const int used = static_cast<int>(chunk_degrees[i / kProjectChunk]);
    return used < wanted ? used : wanted;
  }
};

/// Read-only arrays of N Gaussians, as kernels see them. Owns nothing.
///
/// A position is `origins[origin_ids[i]] + mean_i`: float32 offsets from origins on a 64 m lattice, so
/// that scenes far from zero lose nothing.
struct GaussianRows {
  ShapeRows shape;            ///< Places, shapes and opacities.
  ColorRows color;            ///< Colours.
  View<const Vec3d> origins;  ///< metres, asset frame; host memory; empty: one origin at zero
  /// Place of each Gaussian before rows were sorted in space, [N]: those of one depth are blended in
  /// that order. Empty: row order.
  View<const std::uint32_t> row_ids;
  /// One a chunk of kProjectChunk rows, [ceil(N / kProjectChunk)]: chunks that cannot be seen are not
  /// touched. Empty: all are.
  View<const ChunkBounds> chunk_bounds;
  /// One for kChunkPart rows, [ceil(N / kChunkPart)]: of chunks at the edge of the view only the parts
  /// that may be seen are touched. Empty: chunks are taken whole.
  View<const ChunkBounds> part_bounds;

  /// Number of rows.
  GSNAV_HD std::size_t size() const noexcept { return shape.size; }
  /// Number of chunks.
  GSNAV_HD std::size_t chunk_count() const noexcept { return shape.chunk_count(); }
};

/// Words of `Selection::seen` that a set of so many chunks has for its chunks.
GSNAV_HD constexpr std::size_t seen_chunk_words(std::size_t chunks) noexcept {
  return (chunks + 31) / 32;
}

/// Which rows of a set are drawn, of a set of `chunks` chunks. In the backend's memory. Owns nothing.
struct Selection {
  /// Numbers of the chunks that are drawn, each once: the selection of a level-of-detail tree
  /// (scene/lod_cut.hpp). Empty: all chunks.
  View<const std::uint32_t> drawn_chunks;
  /// What may be seen from where the camera is; the rest is not drawn (scene/visible_sets.hpp). Empty:
  /// all may. First seen_chunk_words() words: bit c % 32 of word c / 32 for each chunk c. Where it is
  /// longer, as many more: how many bits the words before have; then kSeenRowWords words for each chunk
  /// with a bit, in their order, of which bit r % 32 of word r / 32 is its row r.
  View<const std::uint32_t> seen;

  /// How many chunks are drawn.
  GSNAV_HD std::size_t count(std::size_t chunks) const noexcept {
    return drawn_chunks.empty() ? chunks : drawn_chunks.size;
  }
  /// The chunk that is drawn as the c-th.
  GSNAV_HD std::size_t chunk_id(std::size_t c) const noexcept {
    return drawn_chunks.empty() ? c : drawn_chunks[c];
  }
  /// Whether anything of a chunk, by its number, may be seen from where the camera is.
  GSNAV_HD bool may_be_seen(std::size_t chunk) const noexcept {
    return seen.empty() || (seen[chunk / 32] >> (chunk % 32) & 1u) != 0;
  }
  /// Whether `seen` knows of rows too.
  GSNAV_HD bool has_seen_rows(std::size_t chunks) const noexcept {
    return seen.size > seen_chunk_words(chunks);
  }
  /// Which rows may be seen of a chunk that may be seen.
  GSNAV_HD SeenRows seen_rows(std::size_t chunks, std::size_t chunk) const noexcept {
    if (!has_seen_rows(chunks)) return {};
    const std::size_t words = seen_chunk_words(chunks);
    const std::uint32_t before = seen[chunk / 32] & ((1u << (chunk % 32)) - 1u);
    const std::size_t place = seen[words + chunk / 32] + static_cast<std::size_t>(count_bits(before));
    return {seen.data + 2 * words + place * kSeenRowWords};
  }
};

/// Whether Selection::seen may have so many words for so many chunks: of chunks alone, or of rows too.
GSNAV_HD constexpr bool seen_may_have(std::size_t words, std::size_t chunks) noexcept {
  const std::size_t of_chunks = seen_chunk_words(chunks);
  return words == of_chunks || (words >= 2 * of_chunks && (words - 2 * of_chunks) % kSeenRowWords == 0);
}

/// What the numbers of a colour mean.
enum class ColorSpace : std::uint8_t {
  display,  ///< sRGB-encoded: what screens take, and nearly all captures are trained in
  linear,   ///< proportional to light, Rec. 709 primaries
};

/// One set of Gaussians in the world: a scene tile, an avatar, an object.
struct GaussianSet {
  GaussianRows gaussians;           ///< The arrays.
  Similarity world_from_asset{};    ///< Takes the asset's frame to the world.
  Filter filter = Filter::classic;  ///< Screen-space filter that the Gaussians were trained with.
  float eps2d = 0.3f;               ///< px^2 added to the diagonal of the 2D covariance
  ColorSpace color_space = ColorSpace::display;  ///< of its colours; converted to the frame's after SH
  /// px^2 that the opacities count with already, in [0, eps2d]: the mip filter makes up for the rest. 0:
  /// Mip-Splatting's.
  float base_eps2d = 0;
  Selection selection{};  ///< which rows are drawn

  /// How many chunks are drawn.
  GSNAV_HD std::size_t drawn_chunk_count() const noexcept {
    return selection.count(gaussians.chunk_count());
  }
};

// Larger than what functions of kernels take (docs/architecture.md, "Sizes of arguments").
static_assert(sizeof(void*) != 8 || (sizeof(ShapeRows) <= 256 && sizeof(ColorRows) <= 256));
static_assert(sizeof(void*) != 8 || (sizeof(GaussianRows) <= 480 && sizeof(GaussianSet) <= 592));

}  // namespace gsnav
