// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "flat_painter.hpp"
#include "gsnav/detail/math/curves.hpp"

// Measures and light of a painted surface, for Gaussians and meshes.

namespace gsnav::flat {

struct Tangents {
  Vec3d ds, dt, normal;
};

/// Derivatives by central differences, inside the patch. At a pole, where they vanish, that of a
/// neighbouring point is used.
inline Tangents tangents(const Field& position, double s, double t) {
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

inline double row_length(const Field& position, double t, bool flat) {
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

inline double column_length(const Field& position, double s, bool flat) {
  return row_length([&](double a, double) { return position(s, a); }, 0, flat);
}

/// Length of the longest of three rows.
inline double widest_row(const Field& position, bool flat) {
  return std::max({row_length(position, 0.5, flat), row_length(position, 0.02, flat),
                   row_length(position, 0.98, flat)});
}

inline int count_for(double length, double spacing) {
  return std::max(1, static_cast<int>(std::lround(length / spacing)));
}

/// Tone mapping with a filmic shoulder, then sRGB encoding.
inline double display(double x) noexcept { return srgb_from_linear(1.0 - std::exp(-x)); }

/// Light over a patch. It varies slowly, so it is computed on a coarse grid and interpolated.
class Painter::PatchLight {
 public:
  PatchLight(const Painter& painter, const Patch& patch, double length_s, double length_t) {
    const double cell = patch.flat && length_t * length_s > 3.0 ? 0.20 : 0.12;
    const auto cells = [cell](double length) { return length < 0.08 ? 0 : count_for(length, cell); };
    cells_s_ = cells(length_s);
    cells_t_ = cells(length_t);
    // Keep the grid a little inside, clear of things that touch the border of the patch.
    const auto grid = [](int i, int n) { return n == 0 ? 0.5 : 0.02 + 0.96 * i / n; };
    for (int j = 0; j <= cells_t_; ++j) {
      for (int i = 0; i <= cells_s_; ++i) {
        const double s = grid(i, cells_s_), t = grid(j, cells_t_);
        light_.push_back(painter.light_at(painter.rooms_[patch.room], patch.position(s, t),
                                          tangents(patch.position, s, t).normal));
      }
    }
  }

  Vec3d at(double s, double t) const {
    const double x = std::clamp((s - 0.02) / 0.96, 0.0, 1.0) * cells_s_;
    const double y = std::clamp((t - 0.02) / 0.96, 0.0, 1.0) * cells_t_;
    const int i = std::clamp(static_cast<int>(x), 0, std::max(cells_s_ - 1, 0));
    const int j = std::clamp(static_cast<int>(y), 0, std::max(cells_t_ - 1, 0));
    const Vec3d* row = light_.data() + j * (cells_s_ + 1) + i;
    const Vec3d* next = row + (cells_t_ > 0 ? cells_s_ + 1 : 0);
    const int right = cells_s_ > 0 ? 1 : 0;
    return lerp(lerp(row[0], row[right], x - i), lerp(next[0], next[right], x - i), y - j);
  }

 private:
  int cells_s_ = 0, cells_t_ = 0;
  std::vector<Vec3d> light_;
};

}  // namespace gsnav::flat
