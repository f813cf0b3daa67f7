// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/io/spz.hpp"

#include <cmath>
#include <span>
#include <utility>

#include "cloud_fill.hpp"
#include "described.hpp"
#include "file.hpp"
#include "quantised.hpp"
#include "spz_planes.hpp"

namespace gsnav::io {
namespace {

using detail::load_le;

class SpzDecoder {
 public:
  SpzDecoder(const detail::SpzHeader& header, bool turn) : header_(header), turn_(turn) {}

  void add(std::size_t i, detail::CloudSink& sink) const {
    const GaussianCloud& planes = sink.cloud();
    RawGaussian raw;
    for (std::size_t k = 0; k < 3; ++k) {
      const int axis = static_cast<int>(k);
      raw.mean[axis] = static_cast<double>(planes.means[k][i]);
      raw.sh0[k] = planes.sh0[3 * i + k];
      raw.log_scales[axis] = static_cast<double>(planes.scales[k][i]);
    }
    raw.opacity_logit = detail::opacity_logit(static_cast<unsigned>(planes.opacities[i]));
    raw.quat = quaternion(std::as_bytes(std::span(planes.quats[0])).data() + 4 * i);
    if (turn_) raw.quat = {raw.quat.w, raw.quat.x, -raw.quat.y, -raw.quat.z};
    raw.shN = sink.bands(i);
    sink.add(raw);
  }

 private:
  Quatd quaternion(const std::byte* p) const {
    double others[3];
    if (header_.version < 3) {  // x, y and z of a quaternion whose w is positive
      for (std::size_t k = 0; k < 3; ++k) others[k] = std::to_integer<int>(p[k]) / 127.5 - 1;
      return detail::quat_without(0, others);
    }
    // x, y, z, w without the largest, each as sign and magnitude, the last one in the lowest bits.
    const std::uint32_t packed = load_le<std::uint32_t>(p);
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t bits = packed >> (20 - 10 * k);
      const double magnitude = static_cast<double>(bits & 511) / 511 * std::sqrt(0.5);
      others[k] = (bits & 512) != 0 ? -magnitude : magnitude;
    }
    const Quatd xyzw = detail::quat_without(packed >> 30, others);
    return {xyzw.z, xyzw.w, xyzw.x, xyzw.y};
  }

  const detail::SpzHeader& header_;
  const bool turn_;
};

Result<LoadedCloud> load(const detail::ByteSource& bytes, const std::string& source,
                         const LoadSpzOptions& options) {
  auto planes = detail::read_spz_planes(bytes, source, !options.keep_axes);
  if (!planes) return planes.status();
  const detail::SpzHeader& header = planes->header;
  const SpzDecoder decoder(header, !options.keep_axes);
  const auto decode = [&](std::size_t first, std::size_t last, detail::CloudSink& sink) -> Status {
    for (std::size_t i = first; i < last; ++i) decoder.add(i, sink);
    return {};
  };
  const int degree = planes->cloud.sh_degree;
  auto out = detail::fill_cloud(header.count, degree, source, decode, true, std::move(planes->cloud));
  if (!out) return out;
  out->cloud.filter = (header.flags & detail::kSpzAntialiased) != 0 ? Filter::mip : Filter::classic;
  out->report.warnings = std::move(planes->warnings);
  if (header.degree > kMaxShDegree) {
    out->report.warnings.push_back("SH degree 4 in the file: bands up to degree 3 are read");
  }
  return detail::described(std::move(out), options.keep_axes ? Vec3d{0, 1, 0} : Vec3d{0, -1, 0});
}

}  // namespace

Result<LoadedCloud> parse_spz(std::span<const std::byte> bytes, std::string source,
                              const LoadSpzOptions& options) {
  return detail::guarded(source, [&] { return load(bytes, source, options); });
}

Result<LoadedCloud> load_spz(const std::filesystem::path& path, const LoadSpzOptions& options) {
  const std::string source = path.string();
  return detail::guarded(source, [&]() -> Result<LoadedCloud> {
    detail::RandomFile file;
    if (Status s = file.open(path); !s) return s;
    return load(file, source, options);
  });
}

}  // namespace gsnav::io
