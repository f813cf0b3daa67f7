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

// Images are row-major from the top-left pixel, with the channels of a pixel together. The folder of a
// written file must exist: writers return file_not_found naming the missing folder, or invalid_argument
// where sizes do not agree.

/// Writes [height][width][3] floats as an 8-bit PNG: round(255 x), with x clamped to [0, 1] and NaN as
/// 0.
Status save_png_rgb(const std::filesystem::path& path, std::span<const float> rgb, int width,
                    int height);

/// Writes [height][width][3] bytes as an 8-bit PNG.
Status save_png_rgb8(const std::filesystem::path& path, std::span<const std::uint8_t> rgb, int width,
                     int height);

/// Encodes [height][width][3] bytes as a JPEG in memory, with colour at half the resolution.
/// @param quality in [1, 100].
/// @return the file's bytes, or invalid_argument (sizes, quality), or unsupported in builds without
/// libjpeg.
Result<std::vector<std::byte>> encode_jpeg(std::span<const std::uint8_t> rgb, int width, int height,
                                           int quality = 85);

/// Maps depth to colours for viewing: bright where near, dark where far, evenly spaced in lightness.
/// @param depth [N] in metres, clamped to [near, far]. 0, negative values and NaN (no return) become
/// black.
/// @return [N][3] bytes.
std::vector<std::uint8_t> colorize_depth(std::span<const float> depth, float near, float far);

/// A decoded PNG.
struct PngImage {
  int width = 0, height = 0;           ///< Pixels.
  int channels = 0;                    ///< 1 (grey), 2 (grey and alpha), 3 (RGB) or 4 (RGBA).
  int bits = 0;                        ///< 8 or 16
  std::vector<std::uint16_t> samples;  ///< [height][width][channels], values as stored, without gamma
                                       ///< correction.
};

/// Reads a PNG. Palettes and samples of fewer than 8 bits are expanded to 8 bits. Never throws. Errors:
/// file_not_found, invalid_file, out_of_memory.
Result<PngImage> load_png(const std::filesystem::path& path);

/// Writes values in C order as `.npy` version 1, type `<f4`. Error: invalid_argument where the product
/// of `shape` is not the number of values.
Status save_npy(const std::filesystem::path& path, std::span<const float> values,
                std::span<const std::size_t> shape);
/// Writes float64 values, type `<f8`. Errors: as above.
Status save_npy(const std::filesystem::path& path, std::span<const double> values,
                std::span<const std::size_t> shape);

/// An array that load_npy read.
struct NpyArray {
  std::vector<std::size_t> shape;  ///< Length of each axis.
  std::vector<double> values;  ///< In C order, whatever the order of the file. Other types than float64
                               ///< are widened exactly.
  bool is_double = false;      ///< Whether the file holds float64.
  std::string descr;           ///< NumPy's name of the file's type, such as "<f4".
};

/// Reads `.npy` versions 1 to 3: little-endian float16, float32 and float64, integers of 8 to 64 bits
/// and booleans, in C or Fortran order, of any rank. The file must have exactly the bytes that its shape
/// needs. Errors: file_not_found; invalid_file; unsupported (other types, or integers that a double
/// cannot hold exactly); out_of_memory.
Result<NpyArray> load_npy(const std::filesystem::path& path);

}  // namespace gsnav::io
