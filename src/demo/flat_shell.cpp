// SPDX-License-Identifier: Apache-2.0
// Walls with windows and doorways, floors and ceilings of the default scene.
#include <algorithm>
#include <cmath>

#include "flat_parts.hpp"
#include "gsnav/detail/math/angles.hpp"

namespace gsnav::flat {
namespace {

const Vec3d kTrim = srgb(0xf4f1ea);

/// The view outside: sky, a line of trees, a meadow.
Vec3d outside(double x, double y) {
  const double hill = 0.30 + 0.05 * std::sin(5 * x) + 0.10 * noise(9 * x, 0.5, 3);
  if (y > hill) {
    const double k = std::clamp((y - hill) / (1 - hill), 0.0, 1.0);
    return lerp(srgb(0xeef4f8), srgb(0xa9cbe8), k) * 2.2;
  }
  const double leaf = noise(30 * x, 30 * y, 5);
  return lerp(srgb(0x6f9a5b), srgb(0xb9cf94), leaf) * (1.15 + 0.5 * y);
}

void window(Painter& p, double x0, double x1, double y0, double y1) {
  const double w = x1 - x0, h = y1 - y0, deep = 0.14;
  const Field trim = plain(kTrim * 1.15);
  p.rect(
      {x0, y0, -deep}, {w, 0, 0}, {0, h, 0}, [](double s, double t) { return outside(s, t); }, 0.035,
      true);
  p.room().windows.push_back({p.world({x0, y0, -deep}),
                              p.world({x1, y0, -deep}) - p.world({x0, y0, -deep}),
                              p.world({x0, y1, -deep}) - p.world({x0, y0, -deep})});
  p.rect({x0, y0, 0}, {0, 0, -deep}, {0, h, 0}, trim, 0.035);
  p.rect({x1, y0, -deep}, {0, 0, deep}, {0, h, 0}, trim, 0.035);
  p.rect({x0, y1, -deep}, {w, 0, 0}, {0, 0, deep}, trim, 0.035);
  p.box({x0 - 0.06, y0 - 0.04, -deep}, {x1 + 0.06, y0, 0.07}, trim, 0.03, Painter::kAll, false);
  const double z0 = -deep + 0.005, z1 = -deep + 0.05, bar = 0.05;
  const auto frame = [&](double a, double b, double c, double d) {
    p.box({a, b, z0}, {c, d, z1}, trim, {0.025, 0.025}, Painter::kAll & ~unsigned{Painter::kZn}, false);
  };
  frame(x0, y0, x0 + bar, y1);
  frame(x1 - bar, y0, x1, y1);
  frame(x0, y0, x1, y0 + bar);
  frame(x0, y1 - bar, x1, y1);
  frame((x0 + x1 - bar) / 2, y0, (x0 + x1 + bar) / 2, y1);
  frame(x0, y0 + 0.62 * h - 0.02, x1, y0 + 0.62 * h + 0.02);
  const double c = 0.07, thick = 0.018 * p.relief;
  for (const double x : {x0 - c, x1}) {
    p.box({x, y0 - 0.04, 0}, {x + c, y1 + c, thick}, trim, {0.03, 0.035}, Painter::kAll, false);
  }
  p.box({x0, y1, 0}, {x1, y1 + c, thick}, trim, {0.035, 0.03}, Painter::kAll, false);
}

void casing(Painter& p, double x0, double x1, double top) {
  const double c = 0.08, thick = 0.02 * p.relief;
  const Field trim = plain(kTrim);
  p.box({x0 - c, 0, 0}, {x0, top + c, thick}, trim, {0.03, 0.04}, Painter::kAll, false);
  p.box({x1, 0, 0}, {x1 + c, top + c, thick}, trim, {0.03, 0.04}, Painter::kAll, false);
  p.box({x0, top, 0}, {x1, top + c, thick}, trim, {0.04, 0.03}, Painter::kAll, false);
}

void jambs(Painter& p, double x0, double x1, double top) {
  const double d = kWallThickness, w = x1 - x0;
  const Field trim = plain(kTrim);
  p.rect({x0, 0, 0}, {0, 0, -d}, {0, top, 0}, trim, 0.035);
  p.rect({x1, 0, -d}, {0, 0, d}, {0, top, 0}, trim, 0.035);
  p.rect({x0, top, -d}, {w, 0, 0}, {0, 0, d}, trim, 0.035);
  p.rect({x0, 0, 0}, {w, 0, 0}, {0, 0, -d}, plain(srgb(0x8b6a48)), 0.03);
}

}  // namespace

void wall(Painter& p, Side side, const Vec3d& paint, std::span<const Opening> openings) {
  const Box& in = p.room().inside;
  constexpr double kHalfPi = 1.5707963267948966;
  // Local x runs along the wall, y up, z into the room.
  double length = 0;
  bool forward = true;
  double origin = 0;
  switch (side) {
    case Side::z_low:
      p.place(in.low, 0);
      break;
    case Side::z_high:
      p.place({in.high.x, 0, in.high.z}, 2 * kHalfPi);
      break;
    case Side::x_low:
      p.place({in.low.x, 0, in.high.z}, kHalfPi);
      break;
    case Side::x_high:
      p.place({in.high.x, 0, in.low.z}, -kHalfPi);
      break;
  }
  const bool along_x = side == Side::z_low || side == Side::z_high;
  length = along_x ? in.high.x - in.low.x : in.high.z - in.low.z;
  forward = side == Side::z_low || side == Side::x_high;
  origin = forward ? (along_x ? in.low.x : in.low.z) : (along_x ? in.high.x : in.high.z);

  struct Hole {
    double x0, x1;
    const Opening* opening;
  };
  std::vector<Hole> holes;
  for (const Opening& o : openings) {
    holes.push_back(forward ? Hole{o.from - origin, o.to - origin, &o}
                            : Hole{origin - o.to, origin - o.from, &o});
  }
  std::sort(holes.begin(), holes.end(), [](const Hole& a, const Hole& b) { return a.x0 < b.x0; });

  const auto painted = [&](double x0, double x1, double y0, double y1) {
    if (x1 - x0 < 1e-6 || y1 - y0 < 1e-6) return;
    const double w = x1 - x0, h = y1 - y0;
    p.rect(
        {x0, y0, 0}, {w, 0, 0}, {0, h, 0},
        [=](double s, double t) {
          return paint * (0.975 + 0.05 * noise(2.5 * (x0 + s * w), 2.5 * (y0 + t * h), 11));
        },
        0.058);
  };
  const auto skirting = [&](double x0, double x1) {
    if (x1 - x0 < 0.02) return;
    p.box({x0, 0, 0}, {x1, 0.09, 0.014}, plain(kTrim), {0.05, 0.024},
          Painter::kZp | Painter::kYp | Painter::kXn | Painter::kXp, false);
  };
  double at = 0, skirt = 0;
  for (const Hole& h : holes) {
    const Opening& o = *h.opening;
    painted(at, h.x0, 0, kCeiling);
    painted(h.x0, h.x1, 0, o.bottom);
    painted(h.x0, h.x1, o.top, kCeiling);
    at = h.x1;
    if (o.kind == Opening::window) {
      window(p, h.x0, h.x1, o.bottom, o.top);
    } else {
      casing(p, h.x0, h.x1, o.top);
      if (o.kind == Opening::door) jambs(p, h.x0, h.x1, o.top);
      skirting(skirt, h.x0 - 0.08);
      skirt = h.x1 + 0.08;
    }
  }
  painted(at, length, 0, kCeiling);
  skirting(skirt, length);
  p.place();
}

void ceiling(Painter& p) {
  p.place();
  const Box& in = p.room().inside;
  p.rect({in.low.x, kCeiling, in.low.z}, {in.high.x - in.low.x, 0, 0}, {0, 0, in.high.z - in.low.z},
         plain(srgb(0xf6f4ef)), 0.075);
}

void wood_floor(Painter& p, const Vec3d& tone) {
  p.place();
  const Box& in = p.room().inside;
  const double wide = 0.142, seam = 0.007, plank = 1.25;
  int row = 0;
  for (double z = in.low.z; z < in.high.z - 1e-6; z += wide, ++row) {
    const double z1 = std::min(z + wide, in.high.z);
    double x = in.low.x - plank * hash01(row, 1);
    for (int k = 0; x < in.high.x - 1e-6; ++k, x += plank) {
      const double x0 = std::max(x, in.low.x), x1 = std::min(x + plank, in.high.x);
      if (x1 - x0 < 1e-3) continue;
      const double shade = 0.80 + 0.36 * hash01(row, k, 2), warm = 0.94 + 0.12 * hash01(row, k, 3);
      const Vec3d base{tone.x * shade * warm, tone.y * shade, tone.z * shade / warm};
      const double w = x1 - x0, h = z1 - z, offset = 17.0 * hash01(row, k, 4);
      const auto grain = [=](double s, double t) {
        const double g = noise(offset + 2.2 * (x0 + s * w), offset + 38 * t * h, 7);
        const double end = std::min(s, 1 - s) * w < 0.012 ? 0.78 : 1.0;
        return base * ((0.86 + 0.28 * g) * end);
      };
      p.rect({x0, 0, z1}, {w, 0, 0}, {0, 0, seam - h}, grain, {0.07, 0.044});
      p.rect({x0, 0, z + seam}, {w, 0, 0}, {0, 0, -seam}, plain(base * 0.45), {0.07, seam});
    }
  }
}

void tile_floor(Painter& p) {
  p.place();
  const Box& in = p.room().inside;
  const double side = 0.42, grout = 0.008;
  int i = 0;
  for (double x = in.low.x; x < in.high.x - 1e-6; x += side, ++i) {
    int j = 0;
    for (double z = in.low.z; z < in.high.z - 1e-6; z += side, ++j) {
      const double w = std::min(side, in.high.x - x), h = std::min(side, in.high.z - z);
      if (w < 0.02 || h < 0.02) continue;
      const Vec3d c = srgb((i + j) % 2 == 0 ? 0xdcd6ca : 0xb9b4aa) * (0.95 + 0.1 * hash01(i, j, 9));
      const double ox = x, oz = z;
      p.rect(
          {x + grout, 0, z + h}, {w - grout, 0, 0}, {0, 0, grout - h},
          [=](double s, double t) {
            return c * (0.92 + 0.16 * noise(6 * (ox + s * w), 6 * (oz - t * h), 13));
          },
          0.046);
      p.rect({x, 0, z + h}, {grout, 0, 0}, {0, 0, -h}, plain(srgb(0x8f8a80)), {grout, 0.05});
      p.rect({x + grout, 0, z + grout}, {w - grout, 0, 0}, {0, 0, -grout}, plain(srgb(0x8f8a80)),
             {0.05, grout});
    }
  }
}

void curtain(Painter& p, double x0, double x1, const Vec3d& cloth) {
  const double w = x1 - x0;
  p.patch(
      [=](double s, double t) {
        return Vec3d{x0 + w * s, 0.03 + 2.42 * t, 0.085 + 0.028 * std::sin(kTwoPi * w * 9 * s)};
      },
      [=](double s, double) { return cloth * (0.86 + 0.14 * std::sin(kTwoPi * w * 9 * s)); },
      {0.024, 0.08}, 24, 1);
}

}  // namespace gsnav::flat
