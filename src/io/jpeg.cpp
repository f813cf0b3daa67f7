// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdlib>
#include <vector>

#include "picture.hpp"

#if defined(GSNAV_HAS_JPEG)

#include <csetjmp>
#include <cstdio>
#include <cstring>

// After <cstdio>, which jpeglib.h needs and does not include.
#include <jpeglib.h>

namespace gsnav::io::detail {
namespace {

constexpr unsigned kLargestSide = static_cast<unsigned>(kMostJpegSide);
// Each scan of a progressive image visits all of its blocks. Encoders write about ten.
constexpr int kMostScans = 100;

[[noreturn]] void on_error(j_common_ptr info);
void on_message(j_common_ptr, int) {}
void print_message(j_common_ptr) {}

/// An error handler that jumps to the last setjmp and drops messages.
struct ErrorHandler {
  jpeg_error_mgr base{};
  std::jmp_buf jump{};

  jpeg_error_mgr* set_up() {
    jpeg_error_mgr* const standard = jpeg_std_error(&base);
    base.error_exit = on_error;
    base.emit_message = on_message;
    base.output_message = print_message;
    return standard;
  }
};

void on_error(j_common_ptr info) { std::longjmp(reinterpret_cast<ErrorHandler*>(info->err)->jump, 1); }

void on_progress(j_common_ptr info) {
  if (reinterpret_cast<j_decompress_ptr>(info)->input_scan_number > kMostScans) on_error(info);
}

/// A decoder as an object, so that memory is allocated outside the reach of setjmp.
class JpegDecoder {
 public:
  JpegDecoder() { info_.err = error_.set_up(); }
  JpegDecoder(const JpegDecoder&) = delete;
  JpegDecoder& operator=(const JpegDecoder&) = delete;
  ~JpegDecoder() { jpeg_destroy_decompress(&info_); }

  /// Reads the header. Nothing of the image's size is allocated yet.
  bool read_header(std::span<const std::byte> bytes) {
    if (setjmp(error_.jump) != 0) return false;
    jpeg_create_decompress(&info_);
    progress_.progress_monitor = on_progress;
    info_.progress = &progress_;
    jpeg_mem_src(&info_, reinterpret_cast<const unsigned char*>(bytes.data()),
                 static_cast<unsigned long>(bytes.size()));
    if (jpeg_read_header(&info_, TRUE) != JPEG_HEADER_OK) return false;
    if (info_.image_width > kLargestSide || info_.image_height > kLargestSide) return false;
    info_.out_color_space = JCS_RGB;
    return true;
  }
  bool start() {
    if (setjmp(error_.jump) != 0) return false;
    return jpeg_start_decompress(&info_) != 0 && info_.output_components == 3;
  }
  bool read_rows(unsigned char* to) {
    if (setjmp(error_.jump) != 0) return false;
    while (info_.output_scanline < info_.output_height) {
      JSAMPROW row = to + std::size_t{3} * info_.output_width * info_.output_scanline;
      if (jpeg_read_scanlines(&info_, &row, 1) != 1) return false;
    }
    return true;
  }
  std::size_t width() const { return info_.image_width; }
  std::size_t height() const { return info_.image_height; }

 private:
  jpeg_decompress_struct info_{};
  jpeg_progress_mgr progress_{};
  ErrorHandler error_;
};

/// An encoder as an object, like the decoder. Its output is in memory that libjpeg allocates.
class JpegEncoder {
 public:
  JpegEncoder() { info_.err = error_.set_up(); }
  JpegEncoder(const JpegEncoder&) = delete;
  JpegEncoder& operator=(const JpegEncoder&) = delete;
  ~JpegEncoder() {
    jpeg_destroy_compress(&info_);
    std::free(bytes_);
  }

  bool write(const std::uint8_t* rgb, int width, int height, int quality) {
    if (setjmp(error_.jump) != 0) return false;
    jpeg_create_compress(&info_);
    jpeg_mem_dest(&info_, &bytes_, &size_);
    info_.image_width = static_cast<JDIMENSION>(width);
    info_.image_height = static_cast<JDIMENSION>(height);
    info_.input_components = 3;
    info_.in_color_space = JCS_RGB;
    jpeg_set_defaults(&info_);
    jpeg_set_quality(&info_, quality, TRUE);
    jpeg_start_compress(&info_, TRUE);
    while (info_.next_scanline < info_.image_height) {
      // libjpeg does not write to the rows that it compresses, so the cast is safe.
      JSAMPROW row =
          const_cast<JSAMPROW>(rgb) + std::size_t{3} * info_.image_width * info_.next_scanline;
      if (jpeg_write_scanlines(&info_, &row, 1) != 1) return false;
    }
    jpeg_finish_compress(&info_);
    return true;
  }
  std::span<const std::byte> bytes() const {
    return {reinterpret_cast<const std::byte*>(bytes_), static_cast<std::size_t>(size_)};
  }

 private:
  jpeg_compress_struct info_{};
  ErrorHandler error_;
  unsigned char* bytes_ = nullptr;
  unsigned long size_ = 0;
};

Result<std::vector<std::byte>> compress_jpeg(std::span<const std::uint8_t> rgb, int width, int height,
                                             int quality) {
  if (width > static_cast<int>(kLargestSide) || height > static_cast<int>(kLargestSide)) {
    return {Errc::invalid_argument,
            "encode_jpeg: a side is longer than " + std::to_string(kLargestSide) + " pixels"};
  }
  JpegEncoder encoder;
  if (!encoder.write(rgb.data(), width, height, quality))
    return {Errc::out_of_memory, "encode_jpeg: libjpeg failed"};
  const std::span<const std::byte> bytes = encoder.bytes();
  return std::vector<std::byte>(bytes.begin(), bytes.end());
}

}  // namespace

Result<PngImage> decode_jpeg(std::span<const std::byte> bytes, const std::string& name, int most_side) {
  JpegDecoder decoder;
  if (!decoder.read_header(bytes))
    return {Errc::invalid_file, name + ": not a JPEG, or its header is damaged"};
  if (std::max(decoder.width(), decoder.height()) > static_cast<std::size_t>(most_side)) {
    return too_large(name, decoder.width(), decoder.height(), most_side);
  }
  // An 8 x 8 block of three planes takes at least one bit of the file.
  if (decoder.width() * decoder.height() / 512 > bytes.size()) {
    return {Errc::invalid_file, name + ": " + std::to_string(decoder.width()) + " x " +
                                    std::to_string(decoder.height()) + " pixels cannot be in " +
                                    std::to_string(bytes.size()) + " bytes"};
  }
  if (!decoder.start()) {
    return {Errc::invalid_file, name + ": not of three colours, of more than " +
                                    std::to_string(kMostScans) + " scans, or damaged JPEG data"};
  }
  std::vector<unsigned char> pixels(3 * decoder.width() * decoder.height());
  if (!decoder.read_rows(pixels.data()))
    return {Errc::invalid_file, name + ": damaged or truncated JPEG data"};
  PngImage out;
  out.width = static_cast<int>(decoder.width());
  out.height = static_cast<int>(decoder.height());
  out.channels = 3;
  out.bits = 8;
  out.samples.assign(pixels.begin(), pixels.end());
  return out;
}

}  // namespace gsnav::io::detail

#else

namespace gsnav::io::detail {
namespace {

Result<std::vector<std::byte>> compress_jpeg(std::span<const std::uint8_t>, int, int, int) {
  return {Errc::unsupported, "encode_jpeg: this build writes no JPEG (libjpeg was not found)"};
}

}  // namespace

Result<PngImage> decode_jpeg(std::span<const std::byte>, const std::string& name, int) {
  return {Errc::unsupported, name + ": this build reads no JPEG (libjpeg was not found)"};
}

}  // namespace gsnav::io::detail

#endif

namespace gsnav::io {

Result<std::vector<std::byte>> encode_jpeg(std::span<const std::uint8_t> rgb, int width, int height,
                                           int quality) {
  if (width < 1 || height < 1 ||
      rgb.size() !=
          std::size_t{3} * static_cast<std::size_t>(width) * static_cast<std::size_t>(height)) {
    return {Errc::invalid_argument, "encode_jpeg: " + std::to_string(rgb.size()) + " bytes for " +
                                        std::to_string(width) + " x " + std::to_string(height) +
                                        " pixels of three"};
  }
  if (quality < 1 || quality > 100) {
    return {Errc::invalid_argument,
            "encode_jpeg: quality = " + std::to_string(quality) + ": must be in [1, 100]"};
  }
  return detail::compress_jpeg(rgb, width, height, quality);
}

}  // namespace gsnav::io
