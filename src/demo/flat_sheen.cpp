// SPDX-License-Identifier: Apache-2.0
// What of the flat's colours depends on where they are seen from.
#include <array>
#include <cmath>
#include <numbers>

#include "flat_painter.hpp"
#include "gsnav/frame/sh.hpp"

namespace gsnav::flat {
namespace {

constexpr double kSheen = 0.12;  // display value that is added where the mirror image of the light is
const Vec3d kTint{1.0, 0.97, 0.90};
/// Shares of the added value in bands 1, 2 and 3. They add up to 1.
constexpr double kBandShare[] = {0.5, 0.3, 0.2};

/// All 16 basis functions at a direction.
std::array<double, 18> basis_at(const Vec3d& d) noexcept {
  std::array<double, 18> out{};
  for (int first = 0; first < 16; first += 3) {
    const Vec3d three = evaluate_sh(3, d, [first](int k) {
      return Vec3d{k == first ? 1.0 : 0.0, k == first + 1 ? 1.0 : 0.0, k == first + 2 ? 1.0 : 0.0};
    });
    for (int k = 0; k < 3; ++k) out[static_cast<std::size_t>(first + k)] = three[k];
  }
  return out;
}

/// Where most of a room's light comes from, as seen from a point; nothing is in the way.
Vec3d toward_light(const Room& room, const Vec3d& p, const Vec3d& normal) noexcept {
  Vec3d sum{};
  const auto add = [&](const Vec3d& to, double power) {
    const double r2 = dot(to, to);
    sum += to * (power / (std::sqrt(r2 + 1e-12) * (r2 + 0.25)));
  };
  for (const Window& w : room.windows)
    add(w.corner + (w.u + w.v) * 0.5 - p, 1.6 * norm(cross(w.u, w.v)));
  for (const Lamp& l : room.lamps) add(l.position - p, 0.3 * l.power);
  const double length = norm(sum);
  return length > 1e-9 ? sum * (1 / length) : normal;
}

}  // namespace

void Painter::write_sheen(const Room& room, const Vec3d& p, const Vec3d& normal, int sh_degree,
                          float* shN) const noexcept {
  const Vec3d light = toward_light(room, p, normal);
  // Light from behind has come back from the room's other side.
  const Vec3d mirrored = normal * (2 * abs(dot(normal, light))) - light;
  // A lobe about the direction in which a camera looks that sees the mirror image. Bands of degree l
  // add P_l of the angle's cosine, and nothing on average over all directions.
  const auto basis = basis_at(-normalized(mirrored));
  for (int l = 1; l <= sh_degree; ++l) {
    const double share = kSheen * kBandShare[l - 1] * 4 * std::numbers::pi / (2 * l + 1);
    for (int k = l * l; k < (l + 1) * (l + 1); ++k) {
      for (int c = 0; c < 3; ++c)
        shN[3 * (k - 1) + c] = static_cast<float>(share * kTint[c] * basis[static_cast<std::size_t>(k)]);
    }
  }
}

}  // namespace gsnav::flat
