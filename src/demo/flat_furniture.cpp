// SPDX-License-Identifier: Apache-2.0
// Sitting, sleeping and eating: the larger furniture of the default scene.
#include <algorithm>
#include <cmath>

#include "flat_parts.hpp"

namespace gsnav::flat {
namespace {

const Vec3d kOak = srgb(0xb98a5a), kWalnut = srgb(0x6b4a33), kWhite = srgb(0xf1eee8);

Field wood(const Vec3d& c, double length, int seed, bool along_t = false) {
  return [=](double s, double t) {
    const double a = along_t ? t : s, b = along_t ? s : t;
    return c * (0.84 + 0.32 * noise(3 * length * a + seed, 14 * b, seed));
  };
}

Field woven(const Vec3d& c, int seed) {
  return [=](double s, double t) { return c * (0.90 + 0.20 * noise(26 * s, 26 * t, seed)); };
}

void legs(Painter& p, double width, double depth, double z0, double height, double thick,
          const Vec3d& color) {
  for (const double x : {-width / 2, width / 2 - thick}) {
    for (const double z : {z0, z0 + depth - thick}) {
      p.box({x, 0, z}, {x + thick, height, z + thick}, plain(color), {thick / 2, 0.04},
            Painter::kXn | Painter::kXp | Painter::kZn | Painter::kZp);
    }
  }
}

}  // namespace

void sofa(Painter& p, double width, const Vec3d& fabric, const Vec3d& cushion_a,
          const Vec3d& cushion_b) {
  const double depth = 0.92, arm = 0.17, w = width / 2;
  const Field cloth = woven(fabric, 21);
  p.rounded_box({-w, 0.10, 0.02}, {w, 0.30, depth}, 0.04, cloth, 0.030);
  p.rounded_box({-w + arm, 0.28, 0.0}, {w - arm, 0.86, 0.24}, 0.09, cloth, 0.026);
  p.rounded_box({-w, 0.10, 0.0}, {-w + arm, 0.62, depth}, 0.07, cloth, 0.026);
  p.rounded_box({w - arm, 0.10, 0.0}, {w, 0.62, depth}, 0.07, cloth, 0.026);
  const double inner = width - 2 * arm;
  const int seats = std::max(1, static_cast<int>(std::lround(inner / 0.72)));
  for (int i = 0; i < seats; ++i) {
    const double a = -inner / 2 + inner * i / seats, b = a + inner / seats;
    p.rounded_box({a + 0.006, 0.27, 0.20}, {b - 0.006, 0.46, depth + 0.02}, 0.06,
                  woven(fabric * 1.12, 22 + i), 0.024);
    p.rounded_box({a + 0.012, 0.44, 0.17}, {b - 0.012, 0.82, 0.36}, 0.09, woven(fabric * 1.06, 32 + i),
                  0.024);
  }
  p.rounded_box({-inner / 2 + 0.03, 0.46, 0.32}, {-inner / 2 + 0.45, 0.84, 0.50}, 0.09,
                woven(cushion_a, 41), 0.021);
  if (seats > 1) {
    p.rounded_box({inner / 2 - 0.45, 0.46, 0.32}, {inner / 2 - 0.04, 0.82, 0.50}, 0.09,
                  woven(cushion_b, 42), 0.021);
  }
  legs(p, width - 0.1, depth - 0.1, 0.05, 0.10, 0.05, kWalnut);
}

void coffee_table(Painter& p) {
  const double w = 1.1,
               d = 0.58;  // high enough not to be a step of a staircase to a NavMesh in 0.2 m voxels
  p.box({-w / 2, 0.40, -d / 2}, {w / 2, 0.44, d / 2}, wood(kWalnut * 1.3, w, 51), 0.022, Painter::kAll);
  p.box({-w / 2 + 0.08, 0.12, -d / 2 + 0.06}, {w / 2 - 0.08, 0.14, d / 2 - 0.06}, wood(kWalnut, w, 52),
        0.035);
  legs(p, w, d, -d / 2, 0.40, 0.045, kWalnut);
  // Two books and a bowl.
  p.box({-0.36, 0.44, -0.13}, {-0.08, 0.47, 0.09}, plain(srgb(0xc8553d)), 0.018, Painter::kAll, false);
  p.box({-0.33, 0.47, -0.10}, {-0.10, 0.495, 0.07}, plain(srgb(0xe8e0cf)), 0.018, Painter::kAll, false);
  p.cone({0.24, 0.44, 0.02}, 0.06, 0.13, 0.07, plain(srgb(0x3f6f78)), 0.016, false);
  for (int i = 0; i < 5; ++i) {
    const double a = 1.2566 * i;
    p.ellipsoid({0.24 + 0.06 * std::cos(a), 0.505, 0.02 + 0.06 * std::sin(a)}, {0.04, 0.04, 0.04},
                plain(srgb(i % 2 == 0 ? 0xe2a13b : 0xd0652f)), 0.013);
  }
}

void table(Painter& p, double width, double depth, double height, const Vec3d& tone) {
  p.box({-width / 2, height - 0.04, -depth / 2}, {width / 2, height, depth / 2}, wood(tone, width, 61),
        0.024, Painter::kAll);
  legs(p, width - 0.1, depth - 0.1, -depth / 2 + 0.05, height - 0.04, 0.06, tone * 0.8);
}

void chair(Painter& p, const Vec3d& seat) {
  p.rounded_box({-0.21, 0.42, -0.20}, {0.21, 0.47, 0.21}, 0.022, woven(seat, 71), 0.022);
  p.rounded_box({-0.20, 0.60, -0.215}, {0.20, 0.88, -0.175}, 0.018, woven(seat, 72), 0.022);
  for (const double x : {-0.20, 0.17}) {
    p.box({x, 0.40, -0.215}, {x + 0.03, 0.86, -0.185}, plain(kOak * 0.8), 0.024);
  }
  legs(p, 0.40, 0.40, -0.20, 0.42, 0.032, kOak * 0.8);
}

void bed(Painter& p, const Vec3d& cover) {
  const double w = 1.62, l = 2.05;
  p.box({-w / 2 - 0.04, 0.0, 0.0}, {w / 2 + 0.04, 1.02, 0.07}, wood(kOak, w, 81), 0.03);
  p.box({-w / 2, 0.06, 0.07}, {w / 2, 0.26, l}, wood(kOak * 0.9, w, 82), 0.034);
  p.rounded_box({-w / 2 + 0.01, 0.25, 0.07}, {w / 2 - 0.01, 0.50, l - 0.01}, 0.06, plain(kWhite), 0.034);
  // The cover hangs over three sides and is turned down towards the pillows.
  p.rounded_box(
      {-w / 2 - 0.03, 0.16, 0.72}, {w / 2 + 0.03, 0.54, l + 0.03}, 0.07,
      [=](double s, double t) {
        const double quilt = 0.5 + 0.5 * std::sin(38 * s) * std::sin(38 * t);
        return cover * (0.88 + 0.16 * quilt);
      },
      0.026);
  p.rounded_box({-w / 2 - 0.035, 0.20, 0.66}, {w / 2 + 0.035, 0.555, 0.98}, 0.06, plain(kWhite * 0.95),
                0.028);
  p.rounded_box({-w / 2 - 0.045, 0.22, 1.52}, {w / 2 + 0.045, 0.565, 1.90}, 0.05,
                woven(srgb(0xb0784c), 84), 0.024);
  for (const double x : {-0.40, 0.40}) {
    p.rounded_box({x - 0.33, 0.49, 0.12}, {x + 0.33, 0.66, 0.52}, 0.085, plain(kWhite * 1.02), 0.026);
  }
  p.rounded_box({-0.22, 0.55, 0.40}, {0.22, 0.76, 0.56}, 0.07, woven(srgb(0x3d5a73), 85), 0.021);
}

void bedside(Painter& p, bool lamp) {
  p.box({-0.22, 0.10, 0.0}, {0.22, 0.48, 0.38}, wood(kOak, 0.4, 91), 0.03);
  p.box({-0.20, 0.14, 0.38}, {0.20, 0.45, 0.392}, wood(kOak * 1.08, 0.4, 92), 0.03, Painter::kAll,
        false);
  p.ellipsoid({0, 0.30, 0.40}, {0.015, 0.015, 0.012}, plain(srgb(0x2b2b2b)), 0.01);
  if (!lamp) {
    p.box({-0.12, 0.48, 0.08}, {0.08, 0.52, 0.24}, plain(srgb(0x7a9e9f)), 0.02, Painter::kAll, false);
    return;
  }
  p.cone({0, 0.48, 0.18}, 0.06, 0.03, 0.20, plain(srgb(0x86a397)), 0.018, false);
  p.cone(
      {0, 0.66, 0.18}, 0.13, 0.09, 0.19,
      [](double, double t) { return lerp(srgb(0xffd9a0), srgb(0xfff0d4), t) * 1.9; }, 0.02, false, true);
  p.room().lamps.push_back({p.world({0, 0.78, 0.20}), 0.45});
}

void wardrobe(Painter& p, double width) {
  const double h = 2.12, d = 0.58;
  p.box({-width / 2, 0.06, 0}, {width / 2, h, d}, wood(srgb(0xe4ddd0), h, 101, true), 0.04);
  p.box({-width / 2 + 0.02, 0, 0.02}, {width / 2 - 0.02, 0.06, d - 0.03}, plain(kWalnut * 0.5), 0.04,
        Painter::kZp | Painter::kXn | Painter::kXp, false);
  const int doors = std::max(2, static_cast<int>(std::lround(width / 0.55)));
  for (int i = 0; i < doors; ++i) {
    const double a = -width / 2 + width * i / doors + 0.008,
                 b = -width / 2 + width * (i + 1) / doors - 0.008;
    p.box({a, 0.08, d}, {b, h - 0.02, d + 0.02}, wood(srgb(0xe9e2d6), h, 102 + i, true), 0.034,
          Painter::kAll, false);
    p.box({a + 0.07, 0.20, d + 0.02}, {b - 0.07, h - 0.14, d + 0.026},
          wood(srgb(0xddd4c4), h, 112 + i, true), 0.034, Painter::kAll, false);
    const double x = i % 2 == 0 ? b - 0.035 : a + 0.035;
    p.box({x - 0.008, 0.98, d + 0.02}, {x + 0.008, 1.16, d + 0.05}, plain(srgb(0x6b5a3e)), 0.014,
          Painter::kAll, false);
  }
}

void sideboard(Painter& p, double width) {
  const double h = 0.72, d = 0.40;
  p.box({-width / 2, 0.14, 0}, {width / 2, h, d}, wood(kWalnut * 1.35, width, 121), 0.028);
  const int doors = 3;
  for (int i = 0; i < doors; ++i) {
    const double a = -width / 2 + width * i / doors + 0.01,
                 b = -width / 2 + width * (i + 1) / doors - 0.01;
    p.box({a, 0.17, d}, {b, h - 0.05, d + 0.014}, wood(kWalnut * 1.5, 0.6, 122 + i), 0.026,
          Painter::kAll, false);
    p.ellipsoid({b - 0.04, 0.48, d + 0.02}, {0.012, 0.012, 0.012}, plain(srgb(0xc9a24b)), 0.009);
  }
  legs(p, width - 0.06, d - 0.06, 0.03, 0.14, 0.035, kWalnut);
  vase(p, {-width / 4, h, 0.20});
}

void desk(Painter& p) {
  const double w = 1.5, d = 0.66, h = 0.74;
  p.box({-w / 2, h - 0.03, 0}, {w / 2, h, d}, wood(kOak * 1.05, w, 131), 0.026, Painter::kAll);
  legs(p, w - 0.06, d - 0.06, 0.03, h - 0.03, 0.04, srgb(0x2f3234));
  p.box({w / 2 - 0.44, 0.12, 0.04}, {w / 2 - 0.04, h - 0.04, d - 0.06}, plain(srgb(0xdad7d0)), 0.035);
  // Monitor, keyboard, mug, papers.
  const Field dark = plain(srgb(0x26282b));
  p.box({-0.31, h + 0.11, 0.14}, {0.31, h + 0.48, 0.165}, dark, 0.03, Painter::kAll);
  p.rect(
      {-0.295, h + 0.125, 0.168}, {0.59, 0, 0}, {0, 0.34, 0},
      [](double s, double t) {
        const bool bar = t > 0.93 || (s < 0.22 && std::fmod(t * 17, 1.0) > 0.35);
        return bar ? srgb(0x5d8fa8) : lerp(srgb(0x1d3a4c), srgb(0x3b7d8c), s * t);
      },
      0.02, true);
  p.box({-0.04, h, 0.12}, {0.04, h + 0.13, 0.15}, dark, 0.02, Painter::kAll, false);
  p.box({-0.13, h, 0.06}, {0.13, h + 0.012, 0.24}, dark, 0.02, Painter::kAll, false);
  p.box({-0.22, h, 0.36}, {0.22, h + 0.018, 0.50}, plain(srgb(0xd7d9da)), 0.018, Painter::kAll, false);
  p.cone({0.48, h, 0.34}, 0.038, 0.04, 0.095, plain(srgb(0xc8553d)), 0.014, false);
  p.box({-0.66, h, 0.20}, {-0.40, h + 0.014, 0.52}, plain(kWhite), 0.022, Painter::kAll, false);
}

}  // namespace gsnav::flat
