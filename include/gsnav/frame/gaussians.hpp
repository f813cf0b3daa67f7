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

/// How the rows of a chunk of kProjectChunk are packed (detail/frame/packed_gaussians.hpp).
struct PackedChunk {
  Vec3<float> low{}, step{};  ///< offset of a mean: low + step code, metres
  float scale_step = 0;       ///< root of a standard deviation: scale_step code
  float sh_steps[3]{};        ///< coefficient of band 1, 2, 3: step code, where these have 8 bits
};

/// Read-only packed rows: 20 bytes a Gaussian and its bands.
struct PackedRows {
  static constexpr int kScales = 0, kQuats = 3, kOpacity = 6, kMeans = 7, kPlanes = 10;
  View<const std::uint16_t> codes;  ///< [10][N], planes in that order; [7][N] where means are floats
  View<const std::uint16_t> sh0;    ///< [N][3], binary16
  View<const std::int8_t>
      shN;  ///< [N][(degree+1)^2 - 1][3], or empty: shN or shN_half of the view has them
  View<const PackedChunk> chunks;  ///< [ceil(N / kProjectChunk)]
};

/// Words of 32 bits, one a row, that a chunk takes.
inline constexpr std::size_t kSeenRowWords = kProjectChunk / 32;

/// Which rows of a chunk may be seen: all where there are no words.
struct SeenRows {
  const std::uint32_t* words = nullptr;  ///< [kSeenRowWords]
  /// Of the 32 rows from 32 k on.
  GSNAV_HD std::uint32_t word(std::size_t k) const noexcept { return words == nullptr ? ~0u : words[k]; }
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

/// Read-only arrays of N Gaussians, as kernels see them. Owns nothing.
///
/// Metres in the asset's own frame. A position is `origins[origin_ids[i]] + mean_i`: float32 offsets
/// from origins on a 64 m lattice, so that scenes far from zero lose nothing.
struct GaussianView {
  std::size_t size = 0;         ///< N
  View<const float> means[3];   ///< x, y, z offsets, [N] each
  View<const float> quats[4];   ///< w, x, y, z of unit length, [N] each
  View<const float> scales[3];  ///< standard deviations >= 0, [N] each
  View<const float> opacities;  ///< in [0, 1], [N]
  View<const float> sh0;        ///< [N][3], the degree-0 coefficients
  View<const float> shN;        ///< [N][(degree+1)^2 - 1][3], empty for degree 0
  /// The same as IEEE binary16 (detail/math/half.hpp), in place of shN, which is empty then; half of
  /// most of what a Gaussian takes. In host memory only: GaussianArrays gives other backends floats.
  View<const std::uint16_t> shN_half;
  int sh_degree = 0;                     ///< 0 to 3
  View<const std::uint32_t> origin_ids;  ///< [N], or empty: all 0
  View<const Vec3d> origins;             ///< host memory; empty: one origin at zero
  /// Rotation each Gaussian has made since training (w, x, y, z), empty where none has: the view
  /// direction is turned back by it before SH is evaluated. Used for skinned sets of degree >= 1.
  View<const float> sh_rotations[4];
  /// Shapes that are no rotated ellipsoids' (a skinned Gaussian's blended axes): [3 r + c] is row r,
  /// column c of the factor M, Sigma = M M^T, asset frame, metres. They stand in for quats and scales,
  /// which may then be empty; empty where those hold.
  View<const float> axes[9];
  /// Place of each Gaussian before rows were sorted in space, [N]: those of one depth are blended in
  /// that order. Empty: row order.
  View<const std::uint32_t> row_ids;
  /// One a chunk of kProjectChunk rows, [ceil(N / kProjectChunk)]: chunks that cannot be seen are not
  /// touched. Empty: all are.
  View<const ChunkBounds> chunk_bounds;
  /// One for kChunkPart rows, [ceil(N / kChunkPart)]: of chunks at the edge of the view only the parts
  /// that may be seen are touched. Empty: chunks are taken whole.
  View<const ChunkBounds> part_bounds;
  /// In place of quats, scales, opacities, sh0 and mostly means and shN, which are empty then. In host
  /// memory only.
  PackedRows packed;

  /// Which chunks are drawn, by number, each once: a cut of a level-of-detail tree (scene/lod_cut.hpp).
  /// In the backend's memory. Empty: all chunks.
  View<const std::uint32_t> drawn_chunks;

  /// What may be seen from where the camera is; the rest is not drawn (scene/visible_sets.hpp). In the
  /// backend's memory. Empty: all may. First seen_words() words: bit c % 32 of word c / 32 for each
  /// chunk c. Where it is longer, as many more: how many bits the words before have; then kSeenRowWords
  /// words for each chunk with a bit, in their order, of which bit r % 32 of word r / 32 is its row r.
  View<const std::uint32_t> seen;

  /// Highest SH degree that the Gaussians of a chunk use, one a chunk of all_chunks()
  /// (detail/scene/scene_profile.hpp): bands above it are not read. In the backend's memory
  /// (GaussianArrays puts them there). Empty: sh_degree.
  View<const std::uint8_t> chunk_sh_degrees;

  /// Degree to which row i is evaluated where `degree` is asked for.
  GSNAV_HD int degree_of(std::size_t i, int degree) const noexcept {
    if (chunk_sh_degrees.empty()) return degree;
    const int used = static_cast<int>(chunk_sh_degrees[i / kProjectChunk]);
    return used < degree ? used : degree;
  }

  /// Whether anything of a chunk, by its number, may be seen from where the camera is.
  GSNAV_HD bool may_be_seen(std::size_t chunk) const noexcept {
    return seen.empty() || (seen[chunk / 32] >> (chunk % 32) & 1u) != 0;
  }
  /// Words of `seen` that chunks take.
  GSNAV_HD std::size_t seen_words() const noexcept { return (all_chunks() + 31) / 32; }
  GSNAV_HD bool has_seen_rows() const noexcept { return seen.size > seen_words(); }
  /// Whether `seen` may have so many words, of chunks alone or of rows too.
  GSNAV_HD bool seen_may_have(std::size_t words) const noexcept {
    const std::size_t of_chunks = seen_words();
    return words == of_chunks ||
           (words >= 2 * of_chunks && (words - 2 * of_chunks) % kSeenRowWords == 0);
  }
  /// Which rows of a chunk that may be seen may be.
  GSNAV_HD SeenRows seen_rows(std::size_t chunk) const noexcept {
    if (!has_seen_rows()) return {};
    const std::size_t words = seen_words();
    const std::uint32_t before = seen[chunk / 32] & ((1u << (chunk % 32)) - 1u);
    const std::size_t place = seen[words + chunk / 32] + static_cast<std::size_t>(count_bits(before));
    return {seen.data + 2 * words + place * kSeenRowWords};
  }
  /// Chunks that the rows make.
  GSNAV_HD std::size_t all_chunks() const noexcept { return (size + kProjectChunk - 1) / kProjectChunk; }
  /// Chunks that are drawn.
  GSNAV_HD std::size_t chunk_count() const noexcept {
    return drawn_chunks.empty() ? all_chunks() : drawn_chunks.size;
  }
  /// The chunk that is drawn as the c-th.
  GSNAV_HD std::size_t chunk_id(std::size_t c) const noexcept {
    return drawn_chunks.empty() ? c : drawn_chunks[c];
  }
};

/// What the numbers of a colour mean.
enum class ColorSpace : std::uint8_t {
  display,  ///< sRGB-encoded: what screens take, and nearly all captures are trained in
  linear,   ///< proportional to light, Rec. 709 primaries
};

/// One set of Gaussians in the world: a scene tile, an avatar, an object.
struct GaussianSet {
  GaussianView gaussians;
  Similarity world_from_asset{};
  Filter filter = Filter::classic;
  float eps2d = 0.3f;                            ///< px^2 added to the diagonal of the 2D covariance
  ColorSpace color_space = ColorSpace::display;  ///< of its colours; converted to the frame's after SH
  /// px^2 that the opacities count with already, in [0, eps2d]: the mip filter makes up for the rest. 0:
  /// Mip-Splatting's.
  float base_eps2d = 0;
};

}  // namespace gsnav
