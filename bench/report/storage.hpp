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

/// A way to store one field of a cloud in fewer bits, as used by the formats that its description names.
/// Values in range come back within half a step.
struct StorageCodec {
  std::string_view name, description;
  double step;       ///< of the stored quantity, uniform; for fp16 relative, at the binade's lower end
  double low, high;  ///< range; values beyond it are clamped (positions have no limit within a 64 m
                     ///< cell)
  double bits;       ///< per value
  int values;        ///< per Gaussian: 3, 4 (stored as 3 and an index), 1, or -1 for all of shN
};

/// All codecs that the report measures, by name.
std::span<const StorageCodec> storage_codecs() noexcept;

/// Value of the knob `storage` that packs all fields at once (scene/packed_cloud.hpp).
inline constexpr std::string_view kPackedStorage = "packed";
/// SH bands as binary16 (compact_sh), which renderers draw as they are.
inline constexpr std::string_view kCompactStorage = "compact";

/// A packed cloud.
struct StoredPacked {
  gsnav::PackedCloud cloud;
  std::uint64_t read_peak = 0;  ///< peak memory while it was read, bytes; 0: not known
};
/// Bytes of the SH bands from 1 on.
std::size_t band_bytes(const gsnav::PackedCloud& packed) noexcept;
/// Reads the packed cloud of a path (io::load_packed_scene). Errors: those of that function.
gsnav::Result<StoredPacked> read_packed(const std::string& path);

/// `cloud` after being stored by the codec `name` and read back; all other fields keep their bits.
/// Errors: invalid_argument for an unknown name, with the known ones.
gsnav::Result<gsnav::GaussianCloud> through_storage(const gsnav::GaussianCloud& cloud,
                                                    std::string_view name);

/// Bytes of the cloud's arrays with the codec's field in its stored size.
std::size_t stored_bytes(const gsnav::GaussianCloud& cloud, const StorageCodec& codec) noexcept;

/// The nearest float16 (ties to even; values too large are clamped to 65504 instead of infinity).
float round_to_half(float x) noexcept;

}  // namespace gsnav_report
