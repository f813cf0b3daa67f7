// SPDX-License-Identifier: Apache-2.0
#include "gzip.hpp"

#include <algorithm>
#include <cstdint>
#include <new>

namespace gsnav::io::detail {
namespace {
constexpr std::size_t kMostAtOnce = std::size_t{1} << 30;  // zlib's counters are 32-bit
constexpr std::size_t kReadAtOnce = std::size_t{1} << 18;
}  // namespace

GzipReader::GzipReader(const ByteSource& packed) : left_(packed) {
  constexpr int kGzipOnly = 16;
  code_ = inflateInit2(&stream_, MAX_WBITS + kGzipOnly);
  if (code_ == Z_MEM_ERROR) throw std::bad_alloc();
  open_ = code_ == Z_OK;
}

GzipReader::~GzipReader() {
  if (open_) inflateEnd(&stream_);
}

std::size_t GzipReader::read(std::span<std::byte> out) {
  std::size_t done = 0;
  while (done < out.size() && code_ == Z_OK) {
    if (stream_.avail_in == 0) {
      const auto n = static_cast<std::size_t>(std::min<std::uint64_t>(left_.size(), kReadAtOnce));
      const std::byte* const piece = left_.get(0, n, room_);
      if (piece == nullptr) {
        code_ = Z_DATA_ERROR;
        break;
      }
      stream_.next_in = reinterpret_cast<Bytef*>(const_cast<std::byte*>(piece));
      stream_.avail_in = static_cast<uInt>(n);
      left_ = left_.part(n, left_.size() - n);
    }
    const std::size_t room = std::min(out.size() - done, kMostAtOnce);
    stream_.next_out = reinterpret_cast<Bytef*>(out.data() + done);
    stream_.avail_out = static_cast<uInt>(room);
    code_ = inflate(&stream_, Z_NO_FLUSH);  // Z_BUF_ERROR (no progress) if the stream is truncated
    done += room - stream_.avail_out;
  }
  return done;
}

std::vector<std::byte> gzip(std::span<const std::byte> bytes) {
  z_stream stream{};
  constexpr int kGzipOnly = 16, kMemory = 8;
  if (deflateInit2(&stream, Z_DEFAULT_COMPRESSION, Z_DEFLATED, MAX_WBITS + kGzipOnly, kMemory,
                   Z_DEFAULT_STRATEGY) != Z_OK) {
    throw std::bad_alloc();
  }
  std::vector<std::byte> out;
  try {
    out.resize(deflateBound(&stream, static_cast<uLong>(bytes.size())));
  } catch (...) {
    deflateEnd(&stream);
    throw;
  }
  std::size_t done = 0;
  int code = Z_OK;
  while (code == Z_OK) {
    const std::size_t n = std::min(bytes.size(), kMostAtOnce),
                      room = std::min(out.size() - done, kMostAtOnce);
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<std::byte*>(bytes.data()));
    stream.avail_in = static_cast<uInt>(n);
    stream.next_out = reinterpret_cast<Bytef*>(out.data() + done);
    stream.avail_out = static_cast<uInt>(room);
    code = deflate(&stream, n == bytes.size() ? Z_FINISH : Z_NO_FLUSH);
    bytes = bytes.subspan(n - stream.avail_in);
    done += room - stream.avail_out;
  }
  deflateEnd(&stream);
  out.resize(done);
  return out;
}

}  // namespace gsnav::io::detail
