// SPDX-License-Identifier: Apache-2.0
// Shelves, kitchen, plants, lamps, pictures and rugs of the default scene.
#include <algorithm>
#include <cmath>

#include "flat_parts.hpp"
#include "gsnav/detail/math/angles.hpp"

namespace gsnav::flat {
namespace {

const unsigned kBookColors[] = {0x8c2f39, 0x2f4858, 0xd9b26f, 0x3f6f5f, 0xe8e0cf, 0x6b4a33, 0xc8553d,
                                0x40627c, 0x9aa67a, 0x54364f, 0xd07a45, 0x23395b, 0xb7a99a, 0x7b8f3c};

Vec3d book_color(double h) {
  return srgb(kBookColors[static_cast<std::size_t>(h * std::size(kBookColors))]);
}

void books(Painter& p, double x0, double x1, double y, double z0, double z1, double space, int seed) {
  double x = x0;
  for (int i = 0; x < x1 - 0.02; ++i) {
    const double thick = std::min(0.018 + 0.030 * hash01(i, seed, 1), x1 - x);
    const double tall = space * (0.66 + 0.26 * hash01(i, seed, 2)),
                 front = z1 - 0.05 * hash01(i, seed, 3);
    const Vec3d c = book_color(hash01(i, seed, 4));
    const Field spine = [=](double, double t) {
      const bool label = t > 0.70 && t < 0.84;
      return label ? lerp(c, srgb(0xe9dfc4), 0.6) : c;
    };
    p.rect({x, y, front}, {thick, 0, 0}, {0, tall, 0}, spine, {0.014, 0.018});
    p.rect({x, y + tall, front}, {thick, 0, 0}, {0, 0, z0 - front}, plain(srgb(0xe6ddc8)),
           {0.016, 0.05});
    p.rect({x, y, z0}, {0, 0, front - z0}, {0, tall, 0}, plain(c), {0.05, 0.045});
    p.rect({x + thick, y, front}, {0, 0, z0 - front}, {0, tall, 0}, plain(c), {0.05, 0.045});
    x += thick + 0.002;
    if (hash01(i, seed, 5) > 0.93) x += 0.10;
  }
}

}  // namespace

void bookshelf(Painter& p, double width, double height, int seed) {
  const double d = 0.30, board = 0.024;
  const Vec3d wood = srgb(0xa87b4f);
  const Field oak = [wood](double s, double t) {
    return wood * (0.86 + 0.28 * noise(6 * s, 18 * t, 5));
  };
  const int shelves = static_cast<int>(std::lround(height / 0.37));
  p.rect({-width / 2, 0, 0.012}, {width, 0, 0}, {0, height, 0}, plain(wood * 0.75), 0.045);
  for (const double x : {-width / 2, width / 2 - board}) {
    p.box({x, 0, 0}, {x + board, height, d}, oak, {0.03, 0.04});
  }
  for (int i = 0; i <= shelves; ++i) {
    const double y = (height - board) * i / shelves;
    p.box({-width / 2 + board, y, 0}, {width / 2 - board, y + board, d}, oak, {0.035, 0.024},
          Painter::kYp | Painter::kYn | Painter::kZp);
    if (i == shelves) break;
    const double space = (height - board) / shelves - board;
    const double split = width * (0.45 + 0.4 * hash01(i, seed, 8));
    books(p, -width / 2 + board + 0.01, -width / 2 + split, y + board, 0.06, d - 0.02, space,
          seed * 31 + i);
    const double left = -width / 2 + split + 0.10, right = width / 2 - board;
    if (right - left < 0.15) continue;
    const double x = (left + right) / 2;
    switch (i % 3) {
      case 0:
        vase(p, {x, y + board, 0.16});
        break;
      case 1:
        p.ellipsoid({x, y + board + 0.07, 0.16}, {0.07, 0.07, 0.07}, plain(srgb(0xd9b26f)), 0.016);
        break;
      default:
        p.box({x - 0.09, y + board, 0.06}, {x + 0.09, y + board + 0.13, 0.24}, plain(srgb(0xd8cbb3)),
              0.024, Painter::kAll, false);
    }
  }
}

void kitchen(Painter& p, double length) {
  const double d = 0.62, h = 0.90, w = length / 2;
  const Vec3d front = srgb(0x56706c);
  p.box({-w, 0.10, 0}, {w, h - 0.035, d - 0.02}, plain(front * 0.8), 0.045,
        Painter::kXn | Painter::kXp | Painter::kZp);
  p.box({-w, 0, 0.05}, {w, 0.10, d - 0.07}, plain(srgb(0x2b2b2b)), 0.045,
        Painter::kXn | Painter::kXp | Painter::kZp);
  p.box(
      {-w, h - 0.035, 0}, {w, h, d + 0.01},
      [](double s, double t) { return srgb(0xe6e1d8) * (0.90 + 0.2 * noise(60 * s, 14 * t, 15)); },
      0.026);
  const int units = static_cast<int>(std::lround(length / 0.6));
  const auto handle = [&](double x0, double x1, double y, double z) {
    p.box({x0, y, z}, {x1, y + 0.014, z + 0.03}, plain(srgb(0xc9a24b)), {0.02, 0.012}, Painter::kAll,
          false);
  };
  for (int i = 0; i < units; ++i) {
    const double a = -w + length * i / units + 0.006, b = -w + length * (i + 1) / units - 0.006;
    if (i == units / 2) {  // oven
      p.box({a, 0.12, d - 0.02}, {b, 0.84, d}, plain(srgb(0x2a2d30)), 0.028, Painter::kAll, false);
      p.box({a + 0.06, 0.22, d}, {b - 0.06, 0.62, d + 0.004}, plain(srgb(0x111315)), 0.028,
            Painter::kAll, false);
      handle(a + 0.06, b - 0.06, 0.70, d);
    } else {
      p.box({a, 0.12, d - 0.02}, {b, 0.64, d}, plain(front), 0.03, Painter::kAll, false);
      p.box({a, 0.655, d - 0.02}, {b, 0.84, d}, plain(front * 1.05), 0.03, Painter::kAll, false);
      handle(a + 0.2, b - 0.2, 0.58, d);
      handle(a + 0.2, b - 0.2, 0.78, d);
    }
  }
  const double oven = -w + length * (units / 2 + 0.5) / units;  // hob above it
  p.box({oven - 0.28, h, 0.08}, {oven + 0.28, h + 0.006, 0.54}, plain(srgb(0x17191b)), 0.028,
        Painter::kAll, false);
  for (int i = 0; i < 4; ++i) {
    p.disc({oven + (i % 2 == 0 ? -0.13 : 0.13), h + 0.010, i < 2 ? 0.20 : 0.42}, 0.085,
           plain(srgb(0x3a3d40)), 0.018);
  }
  p.cone({oven - 0.13, h + 0.012, 0.20}, 0.09, 0.09, 0.12, plain(srgb(0xb9bdc0)), 0.02);
  const double sink = w - 0.62;
  p.box({sink - 0.25, h, 0.12}, {sink + 0.25, h + 0.004, 0.52}, plain(srgb(0x9fa4a6)), 0.026,
        Painter::kAll, false);
  p.box({sink - 0.21, h + 0.004, 0.16}, {sink + 0.21, h + 0.007, 0.48}, plain(srgb(0x55595b)), 0.026,
        Painter::kAll, false);
  p.cone({sink, h, 0.07}, 0.014, 0.014, 0.26, plain(srgb(0xc9cccd)), 0.012);
  p.box({sink - 0.012, h + 0.25, 0.06}, {sink + 0.012, h + 0.27, 0.24}, plain(srgb(0xc9cccd)), 0.014,
        Painter::kAll, false);
  // Splashback of small tiles, wall cabinets, things on the worktop.
  const double tw = 0.15, th = 0.075;
  int row = 0;
  for (double y = h; y < h + 0.56; y += th, ++row) {
    int k = 0;
    for (double x = -w - (row % 2) * tw / 2; x < w; x += tw, ++k) {
      const double a = std::max(x + 0.004, -w), b = std::min(x + tw - 0.004, w);
      if (b - a < 0.01) continue;
      const Vec3d c = srgb(0xe9ece6) * (0.86 + 0.2 * hash01(row, k, 17));
      p.rect({a, y + 0.003, 0.006}, {b - a, 0, 0}, {0, th - 0.006, 0}, plain(c), {0.036, 0.034});
    }
    p.rect({-w, y - 0.003, 0.006}, {length, 0, 0}, {0, 0.006, 0}, plain(srgb(0x9aa39c)), {0.05, 0.007});
  }
  for (int i = 0; i < units; ++i) {
    const double a = -w + length * i / units, b = -w + length * (i + 1) / units;
    p.box({a, 1.46, 0}, {b, 2.16, 0.34}, plain(srgb(0xe7e2d8)), 0.036, Painter::kAll);
    p.box({a + 0.008, 1.47, 0.34}, {b - 0.008, 2.15, 0.358}, plain(srgb(0xefebe2)), 0.034, Painter::kAll,
          false);
    handle(a + 0.22, b - 0.22, 1.50, 0.358);
  }
  p.cone({-w + 0.30, h, 0.22}, 0.07, 0.06, 0.20, plain(srgb(0xc8553d)), 0.018);
  p.cone({-w + 0.50, h, 0.20}, 0.05, 0.05, 0.15, plain(srgb(0xe2d3b0)), 0.018);
  p.ellipsoid({-w + 0.42, h + 0.05, 0.42}, {0.05, 0.05, 0.05}, plain(srgb(0x9fb543)), 0.014);
  p.ellipsoid({-w + 0.53, h + 0.05, 0.45}, {0.05, 0.05, 0.05}, plain(srgb(0xcf4b32)), 0.014);
}

void fridge(Painter& p) {
  const Field steel = [](double s, double t) {
    return srgb(0xc5c9cb) * (0.92 + 0.12 * noise(30 * s, 2 * t, 18));
  };
  p.box({-0.33, 0.03, 0}, {0.33, 1.86, 0.62}, steel, 0.04);
  p.box({-0.325, 0.05, 0.62}, {0.325, 0.70, 0.65}, steel, 0.034, Painter::kAll, false);
  p.box({-0.325, 0.72, 0.62}, {0.325, 1.85, 0.65}, steel, 0.034, Painter::kAll, false);
  for (const double y : {0.42, 0.86}) {
    p.box({0.25, y, 0.65}, {0.27, y + 0.26, 0.69}, plain(srgb(0x55595b)), 0.016, Painter::kAll, false);
  }
}

void vase(Painter& p, const Vec3d& base) {
  p.patch(
      [=](double s, double t) {
        const double a = -kTwoPi * s, r = 0.03 + 0.038 * std::sin(0.4 + 2.7 * t);
        return base + Vec3d{r * std::cos(a), 0.22 * t, r * std::sin(a)};
      },
      [](double, double t) { return lerp(srgb(0x2f5d62), srgb(0x8fb9aa), t); }, 0.015, 10, 4);
}

void plant(Painter& p, double size, int seed) {
  p.cone({0, 0, 0}, 0.13 * size, 0.17 * size, 0.30 * size, plain(srgb(0xc07a52)), 0.024, false);
  p.disc({0, 0.27 * size, 0}, 0.155 * size, plain(srgb(0x3d2c20)), 0.03);
  p.blocker({-0.15 * size, 0, -0.15 * size}, {0.15 * size, 0.28 * size, 0.15 * size});
  const int leaves = 30;
  for (int i = 0; i < leaves; ++i) {
    const double around = 2.39996 * i, rise = 0.30 + 0.55 * hash01(i, seed, 1);
    const double reach = size * (0.24 + 0.22 * hash01(i, seed, 2)),
                 lift = size * (rise + 0.45 * (1.0 - double(i) / leaves));
    const double wide = size * (0.060 + 0.030 * hash01(i, seed, 3));
    const Vec3d out{std::cos(around), 0, std::sin(around)}, side{-std::sin(around), 0, std::cos(around)};
    // A blade that rises from the pot, then bends outwards.
    const auto spine = [=](double t) {
      return out * (0.03 * size + reach * t * t) +
             Vec3d{0, 0.26 * size + lift * (1.3 * t - 0.55 * t * t * t), 0};
    };
    const Vec3d tint = lerp(srgb(0x2f5a34), srgb(0x76a152), hash01(i, seed, 4));
    p.patch(
        [=](double s, double t) {
          const double w =
              wide * std::sin(3.0 * std::min(1.0, 0.08 + t * 0.97)) * (t < 0.35 ? 0.25 + 2.1 * t : 1.0);
          return spine(t) + side * (w * (1 - 2 * s)) + Vec3d{0, -0.3 * w * abs(2 * s - 1), 0};
        },
        [=](double s, double t) {
          return tint * (0.75 + 0.35 * t) * (abs(2 * s - 1) < 0.16 ? 1.3 : 1.0);
        },
        {0.020, 0.030}, 2, 6);
  }
}

void floor_lamp(Painter& p) {
  const Field metal = plain(srgb(0x3a342d));
  p.cone({0, 0, 0}, 0.15, 0.14, 0.02, metal, 0.024);
  p.cone({0, 0.02, 0}, 0.012, 0.012, 1.35, metal, {0.014, 0.04}, false);
  const Field shade = [](double, double t) {
    return lerp(srgb(0xffcf8a), srgb(0xfff0d0), 0.3 + 0.7 * abs(2 * t - 1)) * 1.9;
  };
  p.cone({0, 1.32, 0}, 0.21, 0.15, 0.30, shade, 0.026, false, true);
  p.disc({0, 1.60, 0}, 0.15, plain(srgb(0xfff0d0)), 0.03);
  p.room().lamps.push_back({p.world({0, 1.45, 0}), 1.0});
}

void pendant(Painter& p, double drop, double power) {
  const double y = kCeiling - drop;
  p.cone({0, y + 0.16, 0}, 0.006, 0.006, drop - 0.16, plain(srgb(0x2b2b2b)), {0.01, 0.05}, false);
  p.ellipsoid(
      {0, y, 0}, {0.21, 0.17, 0.21},
      [](double, double t) { return lerp(srgb(0xffe3b0), srgb(0xfff4dd), t) * 1.8; }, 0.026, true);
  p.room().lamps.push_back({p.world({0, y - 0.18, 0}), power});
}

void picture(Painter& p, double x, double y, double w, double h, int seed) {
  const unsigned frame = seed % 2 == 0 ? 0x2e2a26 : 0xb98d5a;
  p.box({x - w / 2 - 0.03, y - h / 2 - 0.03, 0}, {x + w / 2 + 0.03, y + h / 2 + 0.03, 0.022 * p.relief},
        plain(srgb(frame)), 0.016, Painter::kAll & ~unsigned{Painter::kZn}, false);
  p.cover({x - w / 2 - 0.03, y - h / 2 - 0.03, -0.002}, {x + w / 2 + 0.03, y + h / 2 + 0.03, 0.002});
  p.cover({x - w / 2 + 0.01, y - h / 2 + 0.01, 0.002},
          {x + w / 2 - 0.01, y + h / 2 - 0.01, 0.024 * p.relief});
  p.rect(
      {x - w / 2, y - h / 2, 0.028 * p.relief}, {w, 0, 0}, {0, h, 0},
      [=](double s, double t) {
        const double mat = 0.09;
        if (std::min({s * w, (1 - s) * w, t * h, (1 - t) * h}) < mat * std::min(w, h))
          return srgb(0xf2ede2);
        if (seed % 3 == 0) {  // hills under a sun
          const double d = std::hypot((s - 0.66) * w, (t - 0.70) * h);
          if (d < 0.11 * h) return srgb(0xe5723f);
          for (int k = 0; k < 4; ++k) {
            const double ridge = 0.62 - 0.13 * k + 0.08 * std::sin(5 * s + 1.9 * k + seed) +
                                 0.05 * std::sin(11 * s + 4 * k);
            const unsigned tones[] = {0x9fb8b0, 0x6f9490, 0x47706f, 0x2b4c50};
            if (t < ridge && (k == 3 || t > ridge - 0.13)) return srgb(tones[k]);
          }
          return lerp(srgb(0xf3d7a6), srgb(0xe9efe6), t);
        }
        if (seed % 3 == 1) {  // blocks of colour
          const double stripe = std::floor(5 * t + 1.2 * noise(3 * s, 2 * t, seed));
          return book_color(hash01(static_cast<int>(stripe), seed, 19)) * 1.1;
        }
        // overlapping rings
        const double a = std::hypot((s - 0.40) * w, (t - 0.55) * h) / h,
                     b = std::hypot((s - 0.60) * w, (t - 0.42) * h) / h;
        if (a < 0.22) return b < 0.25 ? srgb(0x7d3c3c) : srgb(0xd0763f);
        return b < 0.25 ? srgb(0x34566b) : srgb(0xe9e0cf);
      },
      0.0125);
}

void rug(Painter& p, double w, double d, int style) {
  const Field wool = [=](double s, double t) {
    const double x = s * w, y = t * d, edge = std::min({x, y, w - x, d - y});
    const double fluff = 0.92 + 0.16 * noise(70 * x, 70 * y, 23);
    if (style == 0) {
      if (edge < 0.05) return srgb(0xe7dcc6) * fluff;
      if (edge < 0.10) return srgb(0x8c3b34) * fluff;
      if (edge < 0.16) return srgb(0x2c4152) * fluff;
      const double a = std::fmod(x / 0.30 + 100, 1.0) - 0.5, b = std::fmod(y / 0.30 + 100, 1.0) - 0.5;
      const double diamond = abs(a) + abs(b);
      if (diamond < 0.14) return srgb(0xc98d48) * fluff;
      if (diamond < 0.30) return srgb(0x8c3b34) * fluff;
      return (diamond < 0.40 ? srgb(0xe0d2b6) : srgb(0xcdbb9b)) * fluff;
    }
    const double band = std::fmod(y / 0.22 + 100, 1.0);
    return (edge < 0.04 ? srgb(0xf0ebe0) : (band < 0.5 ? srgb(0xd9d2c4) : srgb(0x94a3ab))) * fluff;
  };
  p.cover({-w / 2, -0.002, -d / 2}, {w / 2, 0.002, d / 2});
  p.rect({-w / 2, 0.012, d / 2}, {w, 0, 0}, {0, 0, -d}, wool, 0.0195);
}

void round_rug(Painter& p, double radius) {
  for (int i = -4; i < 4; ++i) {  // strips that fit the circle
    const double z0 = radius * i / 4, z1 = radius * (i + 1) / 4, z = std::max(abs(z0), abs(z1));
    const double x = std::sqrt(std::max(0.0, radius * radius - z * z));
    p.cover({-x, -0.002, z0}, {x, 0.002, z1});
  }
  p.patch(
      [=](double s, double t) {
        const double a = -kTwoPi * s, r = radius * (1 - t);
        return Vec3d{r * std::cos(a), 0.012, r * std::sin(a)};
      },
      [=](double s, double t) {
        const int ring = static_cast<int>((1 - t) * radius / 0.12);
        const unsigned tones[] = {0xc9b38c, 0xa8583f, 0xe4d9c2, 0x5f7a70};
        return srgb(tones[ring % 4]) * (0.92 + 0.16 * noise(90 * s, 40 * t, 29));
      },
      0.024, 24, 1);
}

}  // namespace gsnav::flat
