// SPDX-License-Identifier: Apache-2.0
#include "cache.hpp"

#include <cstdio>
#include <fstream>
#include <system_error>
#include <utility>

#include "gsnav/core/replace_file.hpp"

namespace gsnav_report {

using namespace gsnav;

namespace {

constexpr char kMagic[8] = {'G', 'S', 'N', 'A', 'V', 'R', 'E', 'F'};
constexpr std::uint32_t kFormat = 1;

/// Header of an entry. The arrays follow in the order of their counts.
struct Header {
  char magic[8];
  std::uint32_t format, header_size;
  std::int32_t width, height;
  std::uint64_t counts[5];  // rgb, alpha, depth, undecided, undecided_depth
  std::uint64_t evaluations;
  std::uint64_t checksum;  // of all data that load() returns
};
static_assert(std::is_trivially_copyable_v<Header> && sizeof(Header) == 80);

template <class R, class F>
void each_array(R& r, const F& f) {
  f(r.rgb);
  f(r.alpha);
  f(r.depth);
  f(r.undecided);
  f(r.undecided_depth);
}

std::uint64_t checksum(const Reference& r) {
  Hasher h;
  h.value(r.width);
  h.value(r.height);
  h.value(r.evaluations);
  each_array(r, [&](const auto& v) { h.array(v); });
  return h.low();
}

}  // namespace

void hash_camera(Hasher& h, const Camera& c) {
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) h.value(c.viewmat.linear(i, j));
    h.value(c.viewmat.translation[i]);
  }
  for (const double v : {c.fx, c.fy, c.cx, c.cy, c.near_plane, c.near_sigma}) h.value(v);
  h.value(c.width);
  h.value(c.height);
}

std::optional<Reference> ReferenceCache::load(const std::string& hash, std::string& warning) const {
  warning.clear();
  const std::filesystem::path path = file(hash);
  std::error_code error;
  if (folder_.empty() || !std::filesystem::exists(path, error)) return std::nullopt;
  const auto damaged = [&](const char* what) {
    warning = path.string() + ": " + what + "; the reference is rendered again";
    return std::nullopt;
  };
  std::ifstream in(path, std::ios::binary);
  Header header{};
  in.read(reinterpret_cast<char*>(&header), sizeof header);
  if (!in || std::memcmp(header.magic, kMagic, sizeof kMagic) != 0) return damaged("no reference file");
  if (header.format != kFormat || header.header_size != sizeof(Header)) {
    return damaged("another version of the format");
  }
  // Sizes are compared with the size of the file before anything is allocated.
  constexpr std::int32_t kMaxSide = 1 << 16;
  if (header.width < 1 || header.height < 1 || header.width > kMaxSide || header.height > kMaxSide) {
    return damaged("an impossible image size");
  }
  const std::uint64_t pixels =
      static_cast<std::uint64_t>(header.width) * static_cast<std::uint64_t>(header.height);
  std::uint64_t bytes = sizeof(Header);
  for (std::size_t k = 0; k < 5; ++k) {
    const std::uint64_t full = k == 0 ? 3 * pixels : pixels;
    if (header.counts[k] != full && header.counts[k] != 0) {
      return damaged("array sizes that do not fit the image");
    }
    bytes += header.counts[k] * (k < 3 ? sizeof(float) : 1);
  }
  if (std::filesystem::file_size(path, error) != bytes || error)
    return damaged("another size than its header says");
  Reference r;
  r.width = header.width;
  r.height = header.height;
  r.evaluations = header.evaluations;
  std::size_t k = 0;
  each_array(r, [&](auto& v) {
    v.resize(header.counts[k++]);
    in.read(
        reinterpret_cast<char*>(v.data()),
        static_cast<std::streamsize>(v.size() * sizeof(typename std::decay_t<decltype(v)>::value_type)));
  });
  if (!in) return damaged("cannot be read");
  if (checksum(r) != header.checksum) return damaged("checksum does not agree");
  return r;
}

Status ReferenceCache::store(const std::string& hash, const Reference& r) const {
  if (folder_.empty()) return {};
  std::error_code error;
  std::filesystem::create_directories(folder_, error);
  Header header{};
  std::memcpy(header.magic, kMagic, sizeof kMagic);
  header.format = kFormat;
  header.header_size = sizeof(Header);
  header.width = r.width;
  header.height = r.height;
  std::size_t k = 0;
  each_array(r, [&](const auto& v) { header.counts[k++] = v.size(); });
  header.evaluations = r.evaluations;
  header.checksum = checksum(r);
  return replace_file(file(hash), [&](OutputFile& out) {
    out.write(&header, sizeof header);
    each_array(r, [&](const auto& v) {
      out.write(v.data(), v.size() * sizeof(typename std::decay_t<decltype(v)>::value_type));
    });
  });
}

}  // namespace gsnav_report
