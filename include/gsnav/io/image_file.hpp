// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "gsnav/core/status.hpp"

namespace gsnav::io {

// Images are row-major from the top-left pixel, channels inner. Writers need an existing parent folder
// and return file_not_found naming the missing one, or invalid_argument where sizes do not agree.

/// Writes [height][width][3] floats as 8-bit PNG: round(255 x) with x clamped to [0, 1], NaN as 0.
Status save_png_rgb(const std::filesystem::path& path, std::span<const float> rgb, int width,
                    int height);

/// Writes [height][width][3] bytes as 8-bit PNG.
Status save_png_rgb8(const std::filesystem::path& path, std::span<const std::uint8_t> rgb, int width,
                     int height);

/// [height][width][3] bytes as a JPEG in memory; `quality` in [1, 100], colour at half the resolution.
/// Errors: invalid_argument (sizes, quality); unsupported where the build has no libjpeg.
Result<std::vector<std::byte>> encode_jpeg(std::span<const std::uint8_t> rgb, int width, int height,
                                           int quality = 85);

/// Writes [height][width] values as 16-bit grey PNG (millimetres of depth, say), values unchanged.
Status save_png_gray16(const std::filesystem::path& path, std::span<const std::uint16_t> values,
                       int width, int height);

/// Colours depth for people: bright where near, dark where far, evenly spaced in lightness.
/// `depth` [N] in metres, clamped to [near, far]; 0, negative and NaN (no return) are black.
/// Returns [N][3] bytes.
std::vector<std::uint8_t> colorize_depth(std::span<const float> depth, float near, float far);

/// A decoded PNG.
struct PngImage {
  int width = 0, height = 0;           ///< Size in pixels.
  int channels = 0;                    ///< 1 grey, 2 grey alpha, 3 RGB, 4 RGBA
  int bits = 0;                        ///< 8 or 16
  std::vector<std::uint16_t> samples;  ///< [height][width][channels], as stored, no gamma applied
};

/// Reads a PNG (palettes and fewer bits than 8 are expanded). Errors: file_not_found, invalid_file,
/// out_of_memory. Never throws.
Result<PngImage> load_png(const std::filesystem::path& path);

/// Writes values in C order as `.npy` version 1, `<f4` or `<f8`. The product of `shape` must be the
/// number of values.
Status save_npy(const std::filesystem::path& path, std::span<const float> values,
                std::span<const std::size_t> shape);
Status save_npy(const std::filesystem::path& path, std::span<const double> values,
                std::span<const std::size_t> shape);

/// What load_npy returns.
struct NpyArray {
  std::vector<std::size_t> shape;  ///< Lengths of the axes, outermost first.
  std::vector<double> values;      ///< C order, whatever the file's; other types widened, which is exact
  bool is_double = false;          ///< the file holds float64
  std::string descr;               ///< NumPy's name of the file's type, "<f4" say
};

/// Reads `.npy` version 1 to 3: little-endian float16, 32 and 64, integers of 8 to 64 bits and booleans,
/// C and Fortran order, any rank, exactly as many bytes as the shape says.
/// Errors: file_not_found; invalid_file; unsupported (other types, integers that no double holds);
/// out_of_memory.
Result<NpyArray> load_npy(const std::filesystem::path& path);

}  // namespace gsnav::io
