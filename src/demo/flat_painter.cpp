// SPDX-License-Identifier: Apache-2.0
#include "flat_painter.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "gsnav/detail/scene/spatial_order.hpp"
#include "gsnav/frame/sh.hpp"

namespace gsnav::flat {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kSigmaPerSpacing = 0.70;  // neighbours overlap until about 1 % shines through
constexpr double kThickness = 0.0012;      // metres, one sigma
constexpr double kOpacityLogit = 6.0;

}  // namespace

Vec3d srgb(unsigned hex) noexcept {
  const auto channel = [hex](int shift) {
    const double c = static_cast<double>((hex >> shift) & 255u) / 255.0;
    return c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4);
  };
  return {channel(16), channel(8), channel(0)};
}

double hash01(int a, int b, int c) noexcept {
  std::uint32_t h = static_cast<std::uint32_t>(a) * 0x8da6b343u ^
                    static_cast<std::uint32_t>(b) * 0xd8163841u ^
                    static_cast<std::uint32_t>(c) * 0xcb1ab31fu;
  h = (h ^ (h >> 16)) * 0x7feb352du;
  h = (h ^ (h >> 15)) * 0x846ca68bu;
  return static_cast<double>((h ^ (h >> 16)) >> 8) * 0x1.0p-24;
}

double noise(double x, double y, int seed) noexcept {
  const double fx = std::floor(x), fy = std::floor(y);
  const int i = static_cast<int>(fx), j = static_cast<int>(fy);
  const auto smooth = [](double t) { return t * t * (3.0 - 2.0 * t); };
  const double u = smooth(x - fx), v = smooth(y - fy);
  const double low = hash01(i, j, seed) * (1 - u) + hash01(i + 1, j, seed) * u;
  const double high = hash01(i, j + 1, seed) * (1 - u) + hash01(i + 1, j + 1, seed) * u;
  return low * (1 - v) + high * v;
}

Painter::Painter(double density) : stretch_(1.07 / std::sqrt(density)) {
  // Cosine-weighted directions about +Z on a spiral: the same for every point, so that neighbours
  // differ by what they see and not by chance.
  constexpr int kRays = 56;
  for (int i = 0; i < kRays; ++i) {
    const double r2 = (i + 0.5) / kRays, r = std::sqrt(r2);
    const double a = i * kPi * (3.0 - std::sqrt(5.0));
    hemisphere_.push_back({r * std::cos(a), r * std::sin(a), std::sqrt(1.0 - r2)});
  }
}

Room& Painter::add_room(const Box& inside, const Vec3d& bounce) {
  Room r;
  r.inside = inside;
  r.bounce = bounce;
  rooms_.push_back(std::move(r));
  place();
  return rooms_.back();
}

void Painter::place(const Vec3d& origin, double yaw) {
  origin_ = origin;
  turn_ = axis_angle(Vec3d{0, 1, 0}, yaw);
}

void Painter::patch(Field position, Field color, Spacing spacing, int cells_s, int cells_t, bool glows) {
  const Vec3d o = origin_;
  const Mat3d turn = rotation_matrix(turn_);
  patches_.push_back({[o, turn, position = std::move(position)](double s, double t) {
                        return turn * position(s, t) + o;
                      },
                      std::move(color), spacing, cells_s, cells_t, glows, cells_s * cells_t == 1,
                      rooms_.size() - 1});
}

void Painter::rect(const Vec3d& o, const Vec3d& a, const Vec3d& b, Field color, Spacing spacing,
                   bool glows) {
  patch([=](double s, double t) { return o + a * s + b * t; }, std::move(color), spacing, 1, 1, glows);
}

Box Painter::world_box(const Vec3d& low, const Vec3d& high) const noexcept {
  Box b;
  for (int corner = 0; corner < 8; ++corner) {
    b.add(world({(corner & 1) != 0 ? high.x : low.x, (corner & 2) != 0 ? high.y : low.y,
                 (corner & 4) != 0 ? high.z : low.z}));
  }
  return b;
}

void Painter::blocker(const Vec3d& low, const Vec3d& high) {
  room().blockers.push_back(world_box(low, high));
}

void Painter::cover(const Vec3d& low, const Vec3d& high) {
  room().covered.push_back(world_box(low, high));
}

void Painter::box(const Vec3d& l, const Vec3d& h, const Field& color, Spacing spacing, unsigned faces,
                  bool blocks) {
  const Vec3d d = h - l;
  const Vec3d x{d.x, 0, 0}, y{0, d.y, 0}, z{0, 0, d.z};
  if ((faces & kXn) != 0) rect(l, z, y, color, spacing);
  if ((faces & kXp) != 0) rect({h.x, l.y, h.z}, -z, y, color, spacing);
  if ((faces & kYn) != 0) rect(l, x, z, color, spacing);
  if ((faces & kYp) != 0) rect({l.x, h.y, h.z}, x, -z, color, spacing);
  if ((faces & kZn) != 0) rect({h.x, l.y, l.z}, -x, y, color, spacing);
  if ((faces & kZp) != 0) rect({l.x, l.y, h.z}, x, y, color, spacing);
  if (blocks) blocker(l, h);
}

void Painter::rounded_box(const Vec3d& low, const Vec3d& high, double radius, const Field& color,
                          Spacing spacing, bool blocks) {
  const Vec3d center = (low + high) * 0.5, half = (high - low) * 0.5;
  const double r = std::min({radius, half.x, half.y, half.z});
  const Vec3d core = half - Vec3d{r, r, r};
  for (int axis = 0; axis < 3; ++axis) {
    for (const double sign : {-1.0, 1.0}) {
      if (axis == 1 && sign < 0) continue;  // nobody sees an underside
      const int i = (axis + 1) % 3, j = (axis + 2) % 3;
      const auto position = [=](double s, double t) {
        const double a = sign > 0 ? s : t, b = sign > 0 ? t : s;
        Vec3d q{};
        q[axis] = sign * half[axis];
        q[i] = half[i] * (2 * a - 1);
        q[j] = half[j] * (2 * b - 1);
        Vec3d c = q;
        for (int k = 0; k < 3; ++k) c[k] = std::clamp(q[k], -core[k], core[k]);
        return center + c + normalized(q - c) * r;
      };
      patch(position, color, spacing, 6, 6);
    }
  }
  if (blocks) {
    const double inset = 0.25 * r;
    blocker(low + Vec3d{inset, 0, inset}, high - Vec3d{inset, inset, inset});
  }
}

void Painter::cone(const Vec3d& base, double radius0, double radius1, double height, const Field& color,
                   Spacing spacing, bool cap, bool glows) {
  patch(
      [=](double s, double t) {
        const double a = -2 * kPi * s, r = radius0 + (radius1 - radius0) * t;
        return base + Vec3d{r * std::cos(a), height * t, r * std::sin(a)};
      },
      color, spacing, 12, 1 + (height > 0.5 ? 1 : 0), glows);
  if (cap) disc(base + Vec3d{0, height, 0}, radius1, color, spacing);
}

void Painter::disc(const Vec3d& center, double radius, const Field& color, Spacing spacing) {
  patch(
      [=](double s, double t) {
        const double a = -2 * kPi * s, r = radius * (1 - t);
        return center + Vec3d{r * std::cos(a), 0, r * std::sin(a)};
      },
      color, spacing, 16, 1);
}

void Painter::ellipsoid(const Vec3d& center, const Vec3d& radii, const Field& color, Spacing spacing,
                        bool glows) {
  patch(
      [=](double s, double t) {
        const double a = -2 * kPi * s, b = kPi * (t - 0.5);
        return center + Vec3d{radii.x * std::cos(b) * std::cos(a), radii.y * std::sin(b),
                              radii.z * std::cos(b) * std::sin(a)};
      },
      color, spacing, 12, 6, glows);
}

namespace {

struct Tangents {
  Vec3d ds, dt, normal;
};

/// Central differences, kept inside the patch; poles borrow the neighbouring direction.
Tangents tangents(const Field& position, double s, double t) {
  constexpr double h = 1e-3;
  const auto difference = [&](double s0, double t0, double s1, double t1) {
    return position(s1, t1) - position(s0, t0);
  };
  const double s0 = std::max(s - h, 0.0), s1 = std::min(s + h, 1.0);
  const double t0 = std::max(t - h, 0.0), t1 = std::min(t + h, 1.0);
  Tangents out{
      difference(s0, t, s1, t) * (1.0 / (s1 - s0)), difference(s, t0, s, t1) * (1.0 / (t1 - t0)), {}};
  out.normal = normalized(cross(out.ds, out.dt));
  return out;
}

double row_length(const Field& position, double t, bool flat) {
  const int pieces = flat ? 1 : 16;
  double sum = 0;
  Vec3d last = position(0, t);
  for (int i = 1; i <= pieces; ++i) {
    const Vec3d p = position(static_cast<double>(i) / pieces, t);
    sum += norm(p - last);
    last = p;
  }
  return sum;
}

double column_length(const Field& position, double s, bool flat) {
  return row_length([&](double a, double) { return position(s, a); }, 0, flat);
}

int count_for(double length, double spacing) {
  return std::max(1, static_cast<int>(std::lround(length / spacing)));
}

bool inside(const Box& b, const Vec3d& p) noexcept {
  return p.x >= b.low.x && p.x <= b.high.x && p.y >= b.low.y && p.y <= b.high.y && p.z >= b.low.z &&
         p.z <= b.high.z;
}

/// Filmic shoulder, then sRGB encoding.
double display(double x) noexcept {
  const double c = 1.0 - std::exp(-x);
  return c <= 0.0031308 ? 12.92 * c : 1.055 * std::pow(c, 1.0 / 2.4) - 0.055;
}

}  // namespace

void Painter::emit_gaussians(const Patch& patch, GaussianCloudBuilder& builder) const {
  const Room& where = rooms_[patch.room];
  const double length_t = column_length(patch.position, 0.5, patch.flat);
  const int rows = count_for(length_t, patch.spacing.v * stretch_);
  const double widest = std::max({row_length(patch.position, 0.5, patch.flat),
                                  row_length(patch.position, 0.02, patch.flat),
                                  row_length(patch.position, 0.98, patch.flat)});

  // Light varies slowly: it is computed on a coarse grid and interpolated.
  const double cell = patch.flat && length_t * widest > 3.0 ? 0.20 : 0.12;
  const auto light_cells = [cell](double length) { return length < 0.08 ? 0 : count_for(length, cell); };
  const int light_s = light_cells(widest), light_t = light_cells(length_t);
  // The grid stands a little inside, clear of what touches the patch's border.
  const auto grid = [](int i, int n) { return n == 0 ? 0.5 : 0.02 + 0.96 * i / n; };
  std::vector<Vec3d> light;
  if (!patch.glows) {
    for (int j = 0; j <= light_t; ++j) {
      for (int i = 0; i <= light_s; ++i) {
        const double s = grid(i, light_s), t = grid(j, light_t);
        light.push_back(light_at(where, patch.position(s, t), tangents(patch.position, s, t).normal));
      }
    }
  }
  const auto light_between = [&](double s, double t) {
    const double x = std::clamp((s - 0.02) / 0.96, 0.0, 1.0) * light_s;
    const double y = std::clamp((t - 0.02) / 0.96, 0.0, 1.0) * light_t;
    const int i = std::clamp(static_cast<int>(x), 0, std::max(light_s - 1, 0));
    const int j = std::clamp(static_cast<int>(y), 0, std::max(light_t - 1, 0));
    const Vec3d* row = light.data() + j * (light_s + 1) + i;
    const Vec3d* next = row + (light_t > 0 ? light_s + 1 : 0);
    const int right = light_s > 0 ? 1 : 0;
    return lerp(lerp(row[0], row[right], x - i), lerp(next[0], next[right], x - i), y - j);
  };

  Tangents f = tangents(patch.position, 0.5, 0.5);
  RawGaussian raw;
  raw.opacity_logit = kOpacityLogit;
  for (int j = 0; j < rows; ++j) {
    const double t = (j + 0.5) / rows;
    const double length_s = row_length(patch.position, t, patch.flat);
    const int columns = count_for(length_s, patch.spacing.u * stretch_);
    for (int i = 0; i < columns; ++i) {
      const double s = (i + 0.5) / columns;
      const Vec3d p = patch.position(s, t);
      if (std::any_of(where.covered.begin(), where.covered.end(),
                      [&](const Box& b) { return inside(b, p); })) {
        continue;
      }
      if (!patch.flat) f = tangents(patch.position, s, t);
      const Vec3d x = normalized(f.ds), y = cross(f.normal, x);
      Mat3d axes;
      for (int k = 0; k < 3; ++k) axes.row[k] = {x[k], y[k], f.normal[k]};
      raw.mean = p;
      raw.quat = quat_from_matrix(axes);
      raw.log_scales = {std::log(kSigmaPerSpacing * norm(f.ds) / columns),
                        std::log(kSigmaPerSpacing * norm(f.dt) / rows), std::log(kThickness)};
      Vec3d color = patch.color(s, t);
      if (!patch.glows) {
        Vec3d incoming = light_between(s, t);
        if (sun_at(where, p, f.normal)) incoming += Vec3d{2.3, 2.0, 1.5} * 0.8;
        color = {color.x * incoming.x, color.y * incoming.y, color.z * incoming.z};
      }
      for (int k = 0; k < 3; ++k) {
        raw.sh0[static_cast<std::size_t>(k)] = static_cast<float>((display(color[k]) - 0.5) / kSh0);
      }
      builder.add(raw);
    }
  }
}

void Painter::emit_triangles(const Patch& patch, DefaultScene& scene) {
  const auto first = static_cast<std::uint32_t>(scene.vertices.size());
  const int ns = patch.cells_s, nt = patch.cells_t;
  for (int j = 0; j <= nt; ++j) {
    for (int i = 0; i <= ns; ++i) {
      scene.vertices.push_back(patch.position(static_cast<double>(i) / ns, static_cast<double>(j) / nt));
    }
  }
  for (int j = 0; j < nt; ++j) {
    for (int i = 0; i < ns; ++i) {
      const std::uint32_t a = first + static_cast<std::uint32_t>(j * (ns + 1) + i);
      const std::uint32_t b = a + static_cast<std::uint32_t>(ns + 1);
      scene.triangles.push_back({a, a + 1, b + 1});
      scene.triangles.push_back({a, b + 1, b});
    }
  }
}

void Painter::finish(DefaultScene& scene) {
  GaussianCloudBuilder builder(0, "default scene");
  builder.reserve(static_cast<std::size_t>(400000 / (stretch_ * stretch_)));
  for (const Patch& p : patches_) {
    emit_gaussians(p, builder);
    emit_triangles(p, scene);
  }
  scene.bounds = builder.report().bounds;
  scene.cloud = std::move(builder.cloud());
  sort_spatially(scene.cloud);
}

}  // namespace gsnav::flat
