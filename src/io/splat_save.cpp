// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "cloud_check.hpp"
#include "file.hpp"
#include "gsnav/core/replace_file.hpp"
#include "gsnav/detail/io/splat.hpp"
#include "gsnav/detail/scene/spatial_order.hpp"
#include "quantised.hpp"

namespace gsnav::io {

Status save_splat(const std::filesystem::path& path, const GaussianCloud& cloud) {
  return detail::guarded(path.string(), [&]() -> Status {
    if (Status s = detail::check_arrays(path, cloud); !s) return s;
    if (cloud.size() == 0) {
      return {Errc::invalid_argument, path.string() + ": a .splat needs a Gaussian, the cloud has none"};
    }
    OutputFile out;
    if (Status s = out.open(path); !s) return s;
    for (const std::size_t i : rows_as_read(cloud)) {
      const Vec3d mean = cloud.mean(i);
      float numbers[6];
      std::uint8_t bytes[8];
      for (std::size_t k = 0; k < 3; ++k) {
        numbers[k] = static_cast<float>(mean[static_cast<int>(k)]);
        numbers[3 + k] = cloud.scales[k][i];
        const double colour = color_of_sh0(static_cast<double>(cloud.sh0[3 * i + k]));
        bytes[k] = static_cast<std::uint8_t>(detail::nearest_step(colour, 8));
      }
      bytes[3] =
          static_cast<std::uint8_t>(detail::nearest_step(static_cast<double>(cloud.opacities[i]), 8));
      for (std::size_t k = 0; k < 4; ++k) {
        const double step = std::nearbyint(128 * static_cast<double>(cloud.quats[k][i])) + 128;
        bytes[4 + k] = static_cast<std::uint8_t>(std::clamp(step, 0.0, 255.0));
      }
      out.write(numbers, sizeof numbers);
      out.write(bytes, sizeof bytes);
    }
    return out.commit();
  });
}

}  // namespace gsnav::io
