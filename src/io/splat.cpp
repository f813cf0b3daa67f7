// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/io/splat.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "cloud_fill.hpp"
#include "described.hpp"
#include "file.hpp"
#include "quantised.hpp"

namespace gsnav::io {
namespace {

constexpr std::size_t kRecord = 32, kScales = 12, kColour = 24, kQuat = 28;

RawGaussian gaussian(const std::byte* p) {
  const auto number = [p](std::size_t offset) {
    return static_cast<double>(detail::load_le<float>(p + offset));
  };
  RawGaussian raw;
  for (std::size_t k = 0; k < 3; ++k) {
    const int axis = static_cast<int>(k);
    raw.mean[axis] = number(4 * k);
    raw.log_scales[axis] = std::log(number(kScales + 4 * k));
    raw.sh0[k] = static_cast<float>(sh0_of_color(std::to_integer<unsigned>(p[kColour + k]) / 255.0));
  }
  raw.opacity_logit = detail::opacity_logit(std::to_integer<unsigned>(p[kColour + 3]));
  double q[4];
  for (std::size_t k = 0; k < 4; ++k) q[k] = std::to_integer<unsigned>(p[kQuat + k]) - 128.0;
  raw.quat = {q[0], q[1], q[2], q[3]};
  return raw;
}

Result<LoadedCloud> parse(const detail::ByteSource& bytes, const std::string& source) {
  if (bytes.size() == 0 || bytes.size() % kRecord != 0) {
    return {Errc::invalid_file, source + ": " + std::to_string(bytes.size()) +
                                    " bytes, must be records of 32 bytes, at least one"};
  }
  const auto decode = [&](std::size_t first, std::size_t last, detail::CloudSink& sink) -> Status {
    std::vector<std::byte> scratch;
    for (std::size_t row = first; row < last; row += detail::kRowsAtOnce) {
      const std::size_t n = std::min(detail::kRowsAtOnce, last - row);
      const std::byte* p = bytes.get(std::uint64_t{row} * kRecord, n * kRecord, scratch);
      if (p == nullptr) return detail::reading_failed(source);
      for (std::size_t i = 0; i < n; ++i) sink.add(gaussian(p + i * kRecord));
    }
    return {};
  };
  return detail::fill_cloud(static_cast<std::size_t>(bytes.size() / kRecord), 0, source, decode);
}

}  // namespace

Result<LoadedCloud> parse_splat(std::span<const std::byte> bytes, std::string source) {
  return detail::guarded(source, [&] { return detail::described(parse(bytes, source)); });
}

Result<LoadedCloud> load_splat(const std::filesystem::path& path) {
  return detail::guarded(path.string(), [&]() -> Result<LoadedCloud> {
    detail::RandomFile file;
    if (Status s = file.open(path); !s) return s;
    return detail::described(parse(file, path.string()));
  });
}

}  // namespace gsnav::io
