// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cmath>
#include <vector>

#include "cloud_check.hpp"
#include "file.hpp"
#include "gsnav/core/replace_file.hpp"
#include "gsnav/detail/io/ply.hpp"
#include "gsnav/detail/math/curves.hpp"
#include "gsnav/detail/scene/spatial_order.hpp"
#include "gsnav/frame/rules.hpp"

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

/// The logit that is read back as this opacity, or as the nearest opacity that a float32 logit has. It
/// is always finite, because trainers differentiate what they read.
float logit_of(float opacity) {
  // 1 + exp(-18) rounds to 1 in float32, and exp(110) is beyond float32.
  constexpr float kOpaque = 18, kClear = -110;
  if (opacity >= 1) return kOpaque;
  if (!(opacity > 0)) return kClear;
  float stored = static_cast<float>(logit(static_cast<double>(opacity)));
  // Rounding must not move a Gaussian below the threshold at which loaders drop it.
  constexpr float kVisible = static_cast<float>(kAlphaMin);
  const auto back = [&stored] { return static_cast<float>(sigmoid(stored)); };
  while (opacity >= kVisible && back() < kVisible) stored = std::nextafter(stored, 0.0f);
  return stored;
}

using Quad = std::array<float, 4>;

/// What load_ply reads from four stored components.
Quad normalised(const Quad& stored) {
  Quatd q{double{stored[0]}, double{stored[1]}, double{stored[2]}, double{stored[3]}};
  if (!normalize(q)) return stored;
  return {static_cast<float>(q.w), static_cast<float>(q.x), static_cast<float>(q.y),
          static_cast<float>(q.z)};
}

/// Components that load_ply normalises exactly to `unit`. Storing a rounded unit quaternion itself works
/// in only 99 of 100 cases.
Quad stored_quat(const Quad& unit) {
  if (normalised(unit) == unit) return unit;
  // Find the quaternion of unit length within the rounding of `unit`: move all components by the same
  // share of half their last place.
  Quad half;
  double square = 0, room = 0;
  for (std::size_t k = 0; k < 4; ++k) {
    const float v = std::fabs(unit[k]);
    half[k] = 0.5f * (std::nextafter(v, 2.0f) - v);
    square += double{v} * double{v};
    room += double{v} * double{half[k]};
  }
  const double share = 0.5 * (square - 1) / room;
  // Its components are no floats. Try multiples of it until the rounded one is normalised to `unit`.
  // Among a million random quaternions, the worst takes 11,780 tries.
  constexpr int kMostTries = 100000;
  constexpr double kGolden = 0.61803398874989485;  // visits [1, 2) evenly
  for (int t = 1; t <= kMostTries; ++t) {
    const double length = 1 + t * kGolden - std::floor(t * kGolden);
    Quad stored;
    for (std::size_t k = 0; k < 4; ++k) {
      const double inside = double{unit[k]} - std::copysign(share * double{half[k]}, double{unit[k]});
      stored[k] = static_cast<float>(length * inside);
    }
    if (normalised(stored) == unit) return stored;
  }
  return unit;
}

}  // namespace

Status save_ply(const std::filesystem::path& path, const GaussianCloud& cloud,
                const SavePlyOptions& options) {
  return detail::guarded(path.string(), [&]() -> Status {
    if (Status s = detail::check_arrays(path, cloud); !s) return s;
    const std::size_t rest = detail::rest_width(cloud);
    OutputFile out;
    if (Status s = out.open(path); !s) return s;
    const std::string header = header_of(cloud, rest, options);
    out.write(header.data(), header.size());
    std::vector<std::byte> rows;
    const std::vector<std::uint32_t> order = rows_as_read(cloud);
    for (std::size_t row = 0; row < order.size(); ++row) {
      const std::size_t i = order[row];
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
      for (const float part :
           stored_quat({cloud.quats[0][i], cloud.quats[1][i], cloud.quats[2][i], cloud.quats[3][i]})) {
        put<float>(rows, double{part});
      }
      if ((row + 1) % kRowsAtATime == 0 || row + 1 == order.size()) {
        out.write(rows.data(), rows.size());
        rows.clear();
      }
    }
    return out.commit();
  });
}

}  // namespace gsnav::io
