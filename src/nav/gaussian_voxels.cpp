// SPDX-License-Identifier: Apache-2.0
#include "gaussian_voxels.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <string>

#include "gsnav/kernels/packed_gaussians.hpp"

namespace gsnav::detail {
namespace {

/// One opaque Gaussian in the world.
struct Solid {
  Vec3d mean;
  Mat3d axes;  // columns: principal axes times standard deviations
  double opacity;
};

template <class F>
void for_each_opaque(std::span<const GaussianSet> sets, double min_opacity, std::size_t& faint, F&& f) {
  for (const GaussianSet& set : sets) {
    const GaussianView& g = set.gaussians;
    const Mat3d placed = rotation_matrix(set.world_from_asset.rotation) * set.world_from_asset.scale;
    for (std::size_t i = 0; i < g.size; ++i) {
      Solid s;
      s.opacity = static_cast<double>(opacity_of(g, i));
      const Vec3d o = g.origin_ids.empty() ? Vec3d{} : g.origins[g.origin_ids[i]];
      s.mean = set.world_from_asset * (o + vec_cast<double>(mean_of(g, i)));
      if (!(s.opacity >= min_opacity) || !is_finite(s.mean)) {
        ++faint;
        continue;
      }
      const Quatd q = quat_cast<double>(quat_of(g, i));
      const Vec3d scales = vec_cast<double>(scales_of(g, i));
      s.axes = placed * rotation_matrix(q);
      for (int k = 0; k < 3; ++k) {
        for (int r = 0; r < 3; ++r) s.axes(r, k) *= scales[k];
      }
      f(s);
    }
  }
}

/// Box of the densest connected part of the scene and of every part with a tenth of its mass: outliers
/// and a far shell of sky are parts of their own.
Aabb<double> scene_box(std::span<const GaussianSet> sets, const GaussianNavOptions& options) {
  constexpr double kCoarse = 1.0;   // metres
  constexpr double kSparse = 0.02;  // of what the middle Gaussian's coarse cell holds: not the scene
  constexpr double kFar = 1e7;
  using Cell = std::array<std::int64_t, 3>;
  std::map<Cell, double> mass;
  std::size_t faint = 0;
  for_each_opaque(sets, options.min_opacity, faint, [&](const Solid& s) {
    if (std::abs(s.mean.x) > kFar || std::abs(s.mean.y) > kFar || std::abs(s.mean.z) > kFar) return;
    Cell c;
    for (int k = 0; k < 3; ++k) {
      c[static_cast<std::size_t>(k)] = static_cast<std::int64_t>(std::floor(s.mean[k] / kCoarse));
    }
    mass[c] += s.opacity;
  });
  std::vector<double> filled;
  double total = 0;
  for (const auto& [cell, m] : mass) {
    filled.push_back(m);
    total += m;
  }
  std::sort(filled.begin(), filled.end());
  double least = 0, below = 0;
  for (std::size_t i = 0; i < filled.size() && below < 0.5 * total; ++i) {
    below += filled[i];
    least = kSparse * filled[i];
  }
  struct Part {
    double mass = 0;
    Aabb<double> box;
  };
  std::vector<Part> parts;
  std::map<Cell, bool> seen;
  for (const auto& [start, m] : mass) {
    if (m < least || seen[start]) continue;
    Part part;
    std::vector<Cell> stack{start};
    seen[start] = true;
    while (!stack.empty()) {
      const Cell c = stack.back();
      stack.pop_back();
      part.mass += mass.at(c);
      const Vec3d low{static_cast<double>(c[0]), static_cast<double>(c[1]), static_cast<double>(c[2])};
      part.box.add(low * kCoarse);
      part.box.add((low + Vec3d{1, 1, 1}) * kCoarse);
      for (std::int64_t i = 0; i < 27; ++i) {
        const Cell n{c[0] + i % 3 - 1, c[1] + i / 3 % 3 - 1, c[2] + i / 9 - 1};
        const auto it = mass.find(n);
        if (it == mass.end() || it->second < least || seen[n]) continue;
        seen[n] = true;
        stack.push_back(n);
      }
    }
    parts.push_back(part);
  }
  double most = 0;
  for (const Part& p : parts) most = max(most, p.mass);
  Aabb<double> box;
  for (const Part& p : parts) {
    if (p.mass >= 0.1 * most) box.add(p.box);
  }
  return box;
}

/// Adds -log(1 - alpha) of one Gaussian to the voxels that it reaches.
class Splatter {
 public:
  Splatter(VoxelGrid& grid, double sigmas) : grid_(grid), cut_(sigmas * sigmas), sigmas_(sigmas) {
    mass_.assign(grid.nx * grid.ny * grid.nz, 0.0f);
  }

  bool add(const Solid& s) {
    // Widened by the variance of a voxel, so that a disk thinner than a voxel still meets its centre.
    const double vc = grid_.cell * grid_.cell / 12.0, vl = grid_.level * grid_.level / 12.0;
    Mat3d cov = s.axes * transpose(s.axes);
    cov(0, 0) += vc;
    cov(1, 1) += vl;
    cov(2, 2) += vc;
    const double det = determinant(cov);
    if (!(det > 0) || !is_finite(det)) return false;
    const Mat3d inv = transpose(Mat3d{{cross(cov.row[1], cov.row[2]), cross(cov.row[2], cov.row[0]),
                                       cross(cov.row[0], cov.row[1])}}) * (1.0 / det);
    std::size_t first[3], last[3];
    const std::size_t n[3] = {grid_.nx, grid_.ny, grid_.nz};
    const double size[3] = {grid_.cell, grid_.level, grid_.cell};
    for (int k = 0; k < 3; ++k) {
      const double reach = sigmas_ * std::sqrt(cov(k, k)), c = s.mean[k] - grid_.low[k];
      const double a = std::ceil((c - reach) / size[k] - 0.5), b = std::floor((c + reach) / size[k] - 0.5);
      if (b < 0 || a > static_cast<double>(n[k] - 1) || a > b) return false;
      first[k] = static_cast<std::size_t>(max(a, 0.0));
      last[k] = static_cast<std::size_t>(min(b, static_cast<double>(n[k] - 1)));
    }
    for (std::size_t z = first[2]; z <= last[2]; ++z) {
      for (std::size_t x = first[0]; x <= last[0]; ++x) {
        const double dx = grid_.low.x + (static_cast<double>(x) + 0.5) * size[0] - s.mean.x;
        const double dz = grid_.low.z + (static_cast<double>(z) + 0.5) * size[2] - s.mean.z;
        float* column = mass_.data() + grid_.at(x, 0, z);
        for (std::size_t y = first[1]; y <= last[1]; ++y) {
          const double dy = grid_.low.y + (static_cast<double>(y) + 0.5) * size[1] - s.mean.y;
          const Vec3d d{dx, dy, dz};
          const double q = dot(d, inv * d);
          if (q > cut_) continue;
          const double alpha = min(s.opacity * std::exp(-0.5 * q), 0.99);
          column[y] -= static_cast<float>(std::log1p(-alpha));
        }
      }
    }
    return true;
  }

  void threshold(double alpha) {
    const float least = static_cast<float>(-std::log1p(-alpha));
    grid_.solid.resize(mass_.size());
    for (std::size_t i = 0; i < mass_.size(); ++i) grid_.solid[i] = mass_[i] >= least ? 1 : 0;
  }

 private:
  VoxelGrid& grid_;
  double cut_, sigmas_;
  std::vector<float> mass_;
};

/// Clears connected sets (26 neighbours) of fewer than `least` voxels. Returns how many were cleared.
std::size_t remove_floaters(VoxelGrid& g, std::size_t least) {
  std::size_t removed = 0;
  std::vector<std::size_t> part;
  for (std::size_t start = 0; start < g.solid.size(); ++start) {
    if (g.solid[start] != 1) continue;
    part.assign(1, start);
    g.solid[start] = 2;
    for (std::size_t k = 0; k < part.size(); ++k) {
      const std::size_t y = part[k] % g.ny, x = part[k] / g.ny % g.nx, z = part[k] / g.ny / g.nx;
      for (std::size_t zz = z - min<std::size_t>(z, 1); zz <= min(z + 1, g.nz - 1); ++zz) {
        for (std::size_t xx = x - min<std::size_t>(x, 1); xx <= min(x + 1, g.nx - 1); ++xx) {
          for (std::size_t yy = y - min<std::size_t>(y, 1); yy <= min(y + 1, g.ny - 1); ++yy) {
            std::uint8_t& v = g.solid[g.at(xx, yy, zz)];
            if (v != 1) continue;
            v = 2;
            part.push_back(g.at(xx, yy, zz));
          }
        }
      }
    }
    if (part.size() < least) {
      removed += part.size();
      for (const std::size_t i : part) g.solid[i] = 0;
    }
  }
  for (std::uint8_t& v : g.solid) v = v != 0 ? 1 : 0;
  return removed;
}

}  // namespace

Result<VoxelGrid> voxelise(const NavMeshSettings& settings, std::span<const GaussianSet> sets,
                           const GaussianNavOptions& options, GaussianNavReport& report) {
  Aabb<double> box = scene_box(sets, options);
  if (box.empty()) {
    return Status(Errc::nothing_navigable, "NavMesh from Gaussians: no part of the scene is opaque enough "
                                           "(min_opacity " + std::to_string(options.min_opacity) + ")");
  }
  VoxelGrid g;
  g.cell = settings.cell_size;
  g.level = settings.cell_height;
  // A column of air around, so that Recast's edge filters have something to look at.
  const Vec3d margin{2 * g.cell, 2 * g.level, 2 * g.cell};
  box = {box.low - margin, box.high + margin};
  g.low = box.low;
  report.bounds = box;
  const Vec3d size = box.high - box.low;
  const double nx = std::ceil(size.x / g.cell), ny = std::ceil(size.y / g.level), nz = std::ceil(size.z / g.cell);
  if (!(nx * ny * nz <= static_cast<double>(options.max_voxels))) {
    std::string message = "NavMesh from Gaussians: a grid of ";
    message += std::to_string(nx) + " x " + std::to_string(ny) + " x " + std::to_string(nz) +
               " voxels exceeds max_voxels = " + std::to_string(options.max_voxels) +
               "; raise cell_size or cell_height, or crop the scene";
    return Status(Errc::invalid_argument, message);
  }
  g.nx = static_cast<std::size_t>(nx);
  g.ny = static_cast<std::size_t>(ny);
  g.nz = static_cast<std::size_t>(nz);
  Splatter splatter(g, options.sigmas);
  for_each_opaque(sets, options.min_opacity, report.gaussians_faint, [&](const Solid& s) {
    (splatter.add(s) ? report.gaussians_used : report.gaussians_outside) += 1;
  });
  splatter.threshold(options.solid_alpha);
  report.columns = g.nx * g.nz;
  report.voxels = g.solid.size();
  report.floater_voxels = remove_floaters(g, options.min_support);
  report.solid_voxels = static_cast<std::size_t>(std::count(g.solid.begin(), g.solid.end(), std::uint8_t{1}));
  return g;
}

}  // namespace gsnav::detail
