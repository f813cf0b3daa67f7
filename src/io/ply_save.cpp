// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <vector>

#include "cloud_check.hpp"
#include "file.hpp"
#include "gsnav/io/ply.hpp"

namespace gsnav::io {
namespace {

constexpr std::size_t kRowsAtATime = 4096;

std::string header_of(const GaussianCloud& cloud, std::size_t rest, const SavePlyOptions& options) {
  std::string h = "ply\nformat binary_little_endian 1.0\n";
  if (cloud.filter == Filter::mip) h += "comment SplatRenderMode: mip\n";
  h += "element vertex " + std::to_string(cloud.size()) + "\n";
  const auto add = [&h](const std::string& name, const char* type = "float") {
    h += std::string("property ") + type + " " + name + "\n";
  };
  for (const char* name : {"x", "y", "z"}) add(name, options.double_positions ? "double" : "float");
  for (const char* name : {"nx", "ny", "nz", "f_dc_0", "f_dc_1", "f_dc_2"}) add(name);
  for (std::size_t k = 0; k < rest; ++k) add("f_rest_" + std::to_string(k));
  for (const char* name : {"opacity", "scale_0", "scale_1", "scale_2"}) add(name);
  for (int k = 0; k < 4; ++k) add("rot_" + std::to_string(k));
  return h + "end_header\n";
}

template <class T>
void put(std::vector<std::byte>& to, double value) {
  const T v = static_cast<T>(value);
  const std::size_t at = to.size();
  to.resize(at + sizeof v);
  std::memcpy(to.data() + at, &v, sizeof v);
}

/// The logit that reads back as this opacity.
float logit_of(float opacity) {
  const double p = opacity;
  float logit = static_cast<float>(std::log(p / (1.0 - p)));
  // Rounding must not take a Gaussian below the threshold at which loaders drop it.
  constexpr float kVisible = 1.0f / 255.0f;
  const auto back = [&logit] { return static_cast<float>(1.0 / (1.0 + std::exp(-double{logit}))); };
  while (opacity >= kVisible && back() < kVisible) logit = std::nextafter(logit, 0.0f);
  return logit;
}

}  // namespace

Status save_ply(const std::filesystem::path& path, const GaussianCloud& cloud,
                const SavePlyOptions& options) {
  return detail::guarded(path.string(), [&]() -> Status {
    if (Status s = detail::check_arrays(path, cloud); !s) return s;
    const std::size_t rest = detail::rest_width(cloud);
    detail::OutFile out;
    if (Status s = out.open(path); !s) return s;
    const std::string header = header_of(cloud, rest, options);
    out.write(header.data(), header.size());
    std::vector<std::byte> rows;
    for (std::size_t i = 0; i < cloud.size(); ++i) {
      const Vec3d mean = cloud.mean(i);
      for (int k = 0; k < 3; ++k) {
        if (options.double_positions) {
          put<double>(rows, mean[k]);
        } else {
          put<float>(rows, mean[k]);
        }
      }
      for (int k = 0; k < 3; ++k) put<float>(rows, 0);
      for (std::size_t k = 0; k < 3; ++k) put<float>(rows, cloud.sh0[3 * i + k]);
      for (std::size_t channel = 0; channel < 3; ++channel) {
        for (std::size_t k = channel; k < rest; k += 3) put<float>(rows, cloud.shN[i * rest + k]);
      }
      put<float>(rows, logit_of(cloud.opacities[i]));
      for (const auto& axis : cloud.scales) put<float>(rows, std::log(static_cast<double>(axis[i])));
      for (const auto& part : cloud.quats) put<float>(rows, part[i]);
      if ((i + 1) % kRowsAtATime == 0 || i + 1 == cloud.size()) {
        out.write(rows.data(), rows.size());
        rows.clear();
      }
    }
    return out.close();
  });
}

}  // namespace gsnav::io
