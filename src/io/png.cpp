// SPDX-License-Identifier: Apache-2.0
#include <png.h>

#include <algorithm>
#include <csetjmp>

#include "file.hpp"
#include "gsnav/core/replace_file.hpp"
#include "gsnav/io/image_file.hpp"
#include "gsnav/math/functions.hpp"
#include "picture.hpp"

namespace gsnav::io {
namespace {

constexpr std::uint64_t kDeflateRatio = 1032;  // no deflate stream expands more than this

// libpng returns from errors by longjmp, so functions that it may leave hold no object with a
// destructor.
void on_error(png_structp png, png_const_charp) { png_longjmp(png, 1); }
void on_warning(png_structp, png_const_charp) {}

void write_bytes(png_structp png, png_bytep from, std::size_t n) {
  static_cast<OutputFile*>(png_get_io_ptr(png))->write(from, n);
}
void flush_nothing(png_structp) {}

bool encode(OutputFile& file, png_const_bytep pixels, int width, int height) {
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, on_error, on_warning);
  if (png == nullptr) return false;
  png_infop info = png_create_info_struct(png);
  if (info == nullptr || setjmp(png_jmpbuf(png)) != 0) {
    png_destroy_write_struct(&png, &info);
    return false;
  }
  png_set_write_fn(png, &file, write_bytes, flush_nothing);
  png_set_IHDR(png, info, static_cast<png_uint_32>(width), static_cast<png_uint_32>(height), 8,
               PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT,
               PNG_FILTER_TYPE_DEFAULT);
  png_write_info(png, info);
  const std::size_t stride = 3 * static_cast<std::size_t>(width);
  for (int row = 0; row < height; ++row)
    png_write_row(png, pixels + static_cast<std::size_t>(row) * stride);
  png_write_end(png, nullptr);
  png_destroy_write_struct(&png, &info);
  return true;
}

Status save(const std::filesystem::path& path, std::span<const std::uint8_t> rgb, int width,
            int height) {
  if (width <= 0 || height <= 0 || width > detail::kMostPngSide || height > detail::kMostPngSide ||
      rgb.size() != 3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height)) {
    return {Errc::invalid_argument, path.string() + ": " + std::to_string(rgb.size()) +
                                        " samples are no " + std::to_string(width) + " x " +
                                        std::to_string(height) + " image of 3 channels"};
  }
  return replace_file(path, [&](OutputFile& file) -> Status {
    if (encode(file, rgb.data(), width, height)) return {};
    return {Errc::out_of_memory, path.string() + ": the PNG could not be made: not enough memory"};
  });
}

struct Source {
  const std::byte* data;
  std::size_t left;
};

void read_bytes(png_structp png, png_bytep to, std::size_t n) {
  Source& source = *static_cast<Source*>(png_get_io_ptr(png));
  if (n > source.left) png_error(png, "truncated");
  std::memcpy(to, source.data, n);
  source.data += n;
  source.left -= n;
}

/// A decoder as an object, so that memory is allocated outside the reach of setjmp.
class Decoder {
 public:
  Decoder() = default;
  Decoder(const Decoder&) = delete;
  Decoder& operator=(const Decoder&) = delete;
  ~Decoder() { png_destroy_read_struct(&png_, &info_, nullptr); }

  bool read_header(std::span<const std::byte> bytes) {
    source_ = {bytes.data(), bytes.size()};
    png_ = png_create_read_struct(PNG_LIBPNG_VER_STRING, nullptr, on_error, on_warning);
    info_ = png_ != nullptr ? png_create_info_struct(png_) : nullptr;
    if (info_ == nullptr || setjmp(png_jmpbuf(png_)) != 0) return false;
    png_set_user_limits(png_, detail::kMostPngSide, detail::kMostPngSide);
    png_set_read_fn(png_, &source_, read_bytes);
    png_read_info(png_, info_);
    png_set_expand(png_);
    if (png_get_bit_depth(png_, info_) == 16) png_set_swap(png_);
    png_set_interlace_handling(png_);
    png_read_update_info(png_, info_);
    return true;
  }
  bool read_rows(png_bytepp rows) {
    if (setjmp(png_jmpbuf(png_)) != 0) return false;
    png_read_image(png_, rows);
    png_read_end(png_, nullptr);
    return true;
  }

  std::size_t width() const { return png_get_image_width(png_, info_); }
  std::size_t height() const { return png_get_image_height(png_, info_); }
  std::size_t stride() const { return png_get_rowbytes(png_, info_); }
  int channels() const { return png_get_channels(png_, info_); }
  int bits() const { return png_get_bit_depth(png_, info_); }

 private:
  png_structp png_ = nullptr;
  png_infop info_ = nullptr;
  Source source_{};
};

}  // namespace

Result<PngImage> detail::decode_png(std::span<const std::byte> bytes, const std::string& name,
                                    int most_side) {
  Decoder decoder;
  if (!decoder.read_header(bytes))
    return {Errc::invalid_file, name + ": not a PNG, or its header is damaged"};
  if (std::max(decoder.width(), decoder.height()) > static_cast<std::size_t>(most_side)) {
    return too_large(name, decoder.width(), decoder.height(), most_side);
  }
  const std::size_t size = decoder.stride() * decoder.height();
  // A 1-bit palette image expands to at most 32 times its bits.
  if (size / 32 > kDeflateRatio * bytes.size()) {
    return {Errc::invalid_file, name + ": " + std::to_string(decoder.width()) + " x " +
                                    std::to_string(decoder.height()) + " pixels cannot be in " +
                                    std::to_string(bytes.size()) + " bytes"};
  }
  std::vector<png_byte> pixels(size);
  std::vector<png_bytep> rows(decoder.height());
  for (std::size_t i = 0; i < rows.size(); ++i) rows[i] = pixels.data() + i * decoder.stride();
  if (!decoder.read_rows(rows.data()))
    return {Errc::invalid_file, name + ": damaged or truncated PNG data"};
  PngImage image;
  image.width = static_cast<int>(decoder.width());
  image.height = static_cast<int>(decoder.height());
  image.channels = decoder.channels();
  image.bits = decoder.bits();
  if (image.bits == 16) {
    image.samples.resize(pixels.size() / 2);
    std::memcpy(image.samples.data(), pixels.data(), pixels.size());
  } else {
    image.samples.assign(pixels.begin(), pixels.end());
  }
  return image;
}

Status save_png_rgb(const std::filesystem::path& path, std::span<const float> rgb, int width,
                    int height) {
  return detail::guarded(path.string(), [&]() -> Status {
    std::vector<std::uint8_t> bytes(rgb.size());
    std::transform(rgb.begin(), rgb.end(), bytes.begin(), [](float x) { return to_byte(x); });
    return save(path, bytes, width, height);
  });
}

Status save_png_rgb8(const std::filesystem::path& path, std::span<const std::uint8_t> rgb, int width,
                     int height) {
  return detail::guarded(path.string(), [&] { return save(path, rgb, width, height); });
}

Result<PngImage> load_png(const std::filesystem::path& path) {
  return detail::with_file(
      path, [&](const auto& file) { return detail::decode_png(file.span(), path.string()); });
}

}  // namespace gsnav::io
