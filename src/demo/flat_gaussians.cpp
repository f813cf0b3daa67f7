// SPDX-License-Identifier: Apache-2.0 Turns painted surfaces into Gaussians and triangles.
#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include "flat_patch.hpp"
#include "gsnav/detail/core/run_guarded.hpp"
#include "gsnav/detail/scene/spatial_order.hpp"
#include "gsnav/frame/sh.hpp"

namespace gsnav::flat {
namespace {

constexpr double kSigmaPerSpacing = 0.70;  // neighbours overlap until only about 1 % shines through
constexpr double kThickness = 0.0012;      // metres, one sigma
constexpr double kOpacityLogit = 6.0;

bool hidden(const std::vector<Box>& covers, const Vec3d& p) noexcept {
  return std::any_of(covers.begin(), covers.end(), [&](const Box& b) {
    return p.x >= b.low.x && p.x <= b.high.x && p.y >= b.low.y && p.y <= b.high.y && p.z >= b.low.z &&
           p.z <= b.high.z;
  });
}

}  // namespace

/// Boxes of the room that may cover points of the patch.
std::vector<Box> Painter::covers_of(const Patch& patch) const {
  std::vector<Box> covers = rooms_[patch.room].covered;
  if (!patch.flat) return covers;
  Box all;
  for (int corner = 0; corner < 4; ++corner) all.add(patch.position(corner & 1, corner >> 1));
  std::erase_if(covers, [&](const Box& b) {
    bool apart = false;
    for (int k = 0; k < 3; ++k) {
      apart = apart || all.high[k] + 1e-6 < b.low[k] || b.high[k] + 1e-6 < all.low[k];
    }
    return apart;
  });
  return covers;
}

void Painter::emit_gaussians(const Patch& patch, const PatchSplit& cut, std::size_t first_row,
                             int sh_degree, Made& out) const {
  const std::vector<Box> covers = covers_of(patch);
  const double length_t = column_length(patch.position, 0.5, patch.flat);
  const int rows = count_for(length_t, patch.spacing.v * cut.stretch);
  const double widest = widest_row(patch.position, patch.flat);
  std::optional<PatchLight> light;
  if (!patch.glows) light.emplace(*this, patch, widest, length_t);

  Tangents f = tangents(patch.position, 0.5, 0.5);
  const std::size_t bands = 3 * static_cast<std::size_t>(sh_coefficient_count(sh_degree) - 1);
  RawGaussian raw;
  raw.opacity_logit = kOpacityLogit;
  for (int j = 0; j < rows; ++j) {
    const double t = (j + 0.5) / rows;
    const double length_s = row_length(patch.position, t, patch.flat);
    const int columns = count_for(length_s, patch.spacing.u * cut.stretch) +
                        (covers.empty() ? cut.extra(first_row + static_cast<std::size_t>(j)) : 0);
    for (int i = 0; i < columns; ++i) {
      const double s = (i + 0.5) / columns;
      const Vec3d p = patch.position(s, t);
      if (hidden(covers, p)) continue;
      if (!patch.flat) f = tangents(patch.position, s, t);
      const Vec3d x = normalized(f.ds), y = cross(f.normal, x);
      Mat3d axes;
      for (int k = 0; k < 3; ++k) axes.row[k] = {x[k], y[k], f.normal[k]};
      raw.mean = p;
      raw.quat = quat_from_matrix(axes);
      raw.log_scales = {std::log(kSigmaPerSpacing * norm(f.ds) / columns),
                        std::log(kSigmaPerSpacing * norm(f.dt) / rows), std::log(kThickness)};
      const Vec3d color = shown(patch, light ? &*light : nullptr, s, t, f.normal);
      for (int k = 0; k < 3; ++k) {
        raw.sh0[static_cast<std::size_t>(k)] = static_cast<float>(sh0_of_color(color[k]));
      }
      out.rows.push_back(raw);
      if (bands == 0) continue;
      out.shN.resize(out.shN.size() + bands);
      if (!patch.glows) {
        write_sheen(rooms_[patch.room], p, f.normal, sh_degree, out.shN.data() + out.shN.size() - bands);
      }
    }
  }
}

/// The numbers that emit_gaussians makes of the patch without extra Gaussians.
Painter::Counted Painter::count(const Patch& patch, double stretch) const {
  const std::vector<Box> covers = covers_of(patch);
  const int rows = count_for(column_length(patch.position, 0.5, patch.flat), patch.spacing.v * stretch);
  Counted out{0, covers.empty() ? static_cast<std::size_t>(rows) : 0};
  for (int j = 0; j < rows; ++j) {
    const double t = (j + 0.5) / rows;
    const int columns = count_for(row_length(patch.position, t, patch.flat), patch.spacing.u * stretch);
    out.gaussians += static_cast<std::size_t>(columns);
    for (int i = 0; !covers.empty() && i < columns; ++i) {
      if (hidden(covers, patch.position((i + 0.5) / columns, t))) --out.gaussians;
    }
  }
  return out;
}

Result<Painter::PatchSplit> Painter::cut_at(double stretch, ThreadPool& pool) const {
  PatchSplit cut;
  cut.stretch = stretch;
  cut.patches.resize(patches_.size());
  const Status s = detail::run_guarded(pool, static_cast<std::uint32_t>(patches_.size()),
                                       [&](std::uint32_t p) -> Status {
                                         cut.patches[p] = count(patches_[p], stretch);
                                         return {};
                                       });
  if (!s) return s;
  for (const Counted& c : cut.patches) {
    cut.gaussians += c.gaussians;
    cut.rows += c.open_rows;
  }
  return cut;
}

Result<Painter::PatchSplit> Painter::cut_into(std::size_t gaussians, ThreadPool& pool) const {
  // The number falls with the square of `stretch`, in steps. Search a stretch that gives slightly too
  // few; rows then get the missing Gaussians, most of them one at most.
  const double goal = static_cast<double>(gaussians);
  std::optional<PatchSplit> best;
  double few = 0, many = 0;  // largest and smallest stretches known to give at most `gaussians`, and
                             // more; 0: none yet
  double stretch = 1.07 * std::sqrt(400000 / goal);
  constexpr int kTries = 16;
  for (int i = 0; i < kTries; ++i) {
    Result<PatchSplit> cut = cut_at(stretch, pool);
    if (!cut) return cut;
    const double made = static_cast<double>(cut->gaussians), rows = static_cast<double>(cut->rows);
    if (cut->gaussians <= gaussians) {
      few = few > 0 ? std::min(few, stretch) : stretch;
      const bool close = gaussians - cut->gaussians <= cut->rows;
      if (!best || best->gaussians < cut->gaussians) best = std::move(*cut);
      if (close) break;
    } else {
      many = std::max(many, stretch);
    }
    stretch *= std::sqrt(made / std::max(goal - 0.5 * rows, 0.5 * goal));
    if (few > 0 && many > 0 && !(stretch > many && stretch < few)) stretch = std::sqrt(few * many);
  }
  if (!best) {
    constexpr double kOneEach = 1e6;
    Result<PatchSplit> least = cut_at(kOneEach, pool);
    if (!least) return least;
    if (least->gaussians > gaussians) {
      return Status{Errc::invalid_argument,
                    "gaussians = " + std::to_string(gaussians) + ": this flat needs at least " +
                        std::to_string(least->gaussians) + ", one for each surface"};
    }
    best = std::move(*least);
  }
  best->missing = gaussians - best->gaussians;
  best->gaussians = gaussians;
  return std::move(*best);
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

Status Painter::emit(const PatchSplit& cut, const SceneSampling& sampling, ThreadPool& pool,
                     GaussianCloudBuilder& builder) const {
  constexpr std::size_t kBatch = 1 << 20;  // number of Gaussians that are made before they are written
                                           // in order
  std::size_t first_row = 0, done = 0;
  std::vector<std::size_t> first_rows;
  std::vector<Made> made;
  const int degree = sampling.sh_degree;
  const std::size_t bands = 3 * static_cast<std::size_t>(sh_coefficient_count(degree) - 1);
  for (std::size_t begin = 0; begin < patches_.size();) {
    std::size_t end = begin;
    first_rows.clear();
    for (std::size_t n = 0; end < patches_.size() && n < kBatch; ++end) {
      n += cut.patches[end].gaussians;
      first_rows.push_back(first_row);
      first_row += cut.patches[end].open_rows;
    }
    made.assign(end - begin, {});
    const Status s = detail::run_guarded(
        pool, static_cast<std::uint32_t>(end - begin), [&](std::uint32_t p) -> Status {
          made[p].rows.reserve(cut.patches[begin + p].gaussians);
          made[p].shN.reserve(bands * cut.patches[begin + p].gaussians);
          emit_gaussians(patches_[begin + p], cut, first_rows[p], degree, made[p]);
          return {};
        });
    if (!s) return s;
    for (Made& patch : made) {
      for (std::size_t i = 0; i < patch.rows.size(); ++i) {
        if (bands > 0) patch.rows[i].shN = patch.shN.data() + bands * i;
        builder.add(patch.rows[i]);
      }
      done += patch.rows.size();
    }
    begin = end;
    if (sampling.progress)
      sampling.progress(static_cast<double>(done) / static_cast<double>(cut.gaussians));
  }
  return {};
}

Result<DefaultScene> Painter::finish(const SceneSampling& sampling) const {
  if (Status s = validate(sampling); !s) return s;
  const int cores = static_cast<int>(std::clamp(std::thread::hardware_concurrency(), 1u, 16u));
  ThreadPool pool(sampling.threads > 0 ? sampling.threads : cores);
  DefaultScene scene;
  const Status s = detail::guarded([&]() -> Status {
    const Result<PatchSplit> cut = sampling.gaussians > 0
                                       ? cut_into(sampling.gaussians, pool)
                                       : cut_at(1.07 / std::sqrt(sampling.density), pool);
    if (!cut) return cut.status();
    for (const Patch& p : patches_) emit_triangles(p, scene);
    if (sampling.kind == SurfaceKind::mesh) return emit_painted(*cut, sampling, pool, scene);
    GaussianCloudBuilder builder(sampling.sh_degree, "default scene");
    builder.reserve(cut->gaussians);
    if (Status made = emit(*cut, sampling, pool, builder); !made) return made;
    scene.bounds = builder.report().bounds;
    scene.cloud = std::move(builder.cloud());
    sort_spatially(scene.cloud);
    return {};
  });
  if (!s) return s;
  return scene;
}

}  // namespace gsnav::flat
