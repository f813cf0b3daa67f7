// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "gsnav/core/status.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"
#include "gsnav/scene/packed_cloud.hpp"

namespace gsnav_report {

/// A way to store one field of a cloud in fewer bits. Values in range come back within half a step; the
/// formats named use it.
struct StorageCodec {
  std::string_view name, description;
  double step;       ///< of the stored quantity, uniform; for fp16: relative, at the binade's lower end
  double low, high;  ///< range; beyond it values are clamped (positions: no limit within a 64 m cell)
  double bits;       ///< per value
  int values;        ///< per Gaussian: 3, 4 (stored as 3 and an index), 1, or -1: all of shN
};

/// All codecs that the report measures, by name.
std::span<const StorageCodec> storage_codecs() noexcept;

/// The knob's value that packs all fields at once (scene/packed_cloud.hpp).
inline constexpr std::string_view kPackedStorage = "packed";

/// A cloud that was packed, in floats again, and the bytes that it had; of these, in SH bands from 1 on.
struct PackedThrough {
  gsnav::GaussianCloud cloud;
  std::size_t bytes = 0, band_bytes = 0;
  std::uint64_t read_peak = 0;  ///< most that reading it took; 0: not known
};
PackedThrough through_packing(const gsnav::PackedCloud& packed);
/// The same of what a path names (io::load_packed_scene). Errors: that function's.
gsnav::Result<PackedThrough> read_packed(const std::string& path);

/// `cloud` as it comes back from storage by the codec `name`; all other fields keep their bits.
/// Errors: invalid_argument for an unknown name, with the known ones.
gsnav::Result<gsnav::GaussianCloud> through_storage(const gsnav::GaussianCloud& cloud,
                                                    std::string_view name);

/// Bytes of the cloud's arrays with the codec's field in its stored size.
std::size_t stored_bytes(const gsnav::GaussianCloud& cloud, const StorageCodec& codec) noexcept;

/// The nearest float16 (ties to even, no infinities: clamped to 65504).
float round_to_half(float x) noexcept;

}  // namespace gsnav_report
