// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "gsnav/core/backend.hpp"
#include "gsnav/core/parallel.hpp"
#include "gsnav/eval/oracle_config.hpp"
#include "gsnav/kernels/color_space.hpp"
#include "gsnav/kernels/depth.hpp"
#include "gsnav/kernels/packed_gaussians.hpp"
#include "gsnav/kernels/project_chunk.hpp"
#include "gsnav/kernels/projection.hpp"

// From sets of Gaussians to one sorted list of records: what oracles of every kind share, and the
// contract's own model of a Gaussian.

namespace gsnav::eval::detail {

/// One set as a camera sees it.
struct OracleSet {
  GaussianSet set;
  ProjectionCamera<double> camera;
  std::vector<Vec3d> offsets;            ///< origin - camera, asset frame
  std::array<std::array<long double, 4>, 3> camera_from_asset{};
  std::size_t first_row = 0;             ///< among the rows of all sets

  OracleSet(const GaussianSet& s, const Camera& c, const RenderConfig& rules, std::size_t first)
      : set(s), camera(make_projection_camera<double>(c, s, projection_rules(rules))), first_row(first) {
    const Similarity& a = s.world_from_asset;
    const Vec3d eye = inverse(a) * c.position();
    const long double w = a.rotation.w, x = a.rotation.x, y = a.rotation.y, z = a.rotation.z;
    const long double turn[3][3] = {{1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)},
                                    {2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)},
                                    {2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)}};
    for (int r = 0; r < 3; ++r) {
      std::array<long double, 4>& out = camera_from_asset[static_cast<std::size_t>(r)];
      out = {0, 0, 0, c.viewmat.translation[r]};
      for (int i = 0; i < 3; ++i) {
        const long double view = c.viewmat.linear(r, i);
        for (std::size_t k = 0; k < 3; ++k) out[k] += view * turn[i][k] * static_cast<long double>(a.scale);
        out[3] += view * static_cast<long double>(a.translation[i]);
      }
    }
    const View<const Vec3d> table = s.gaussians.origins;
    for (std::size_t o = 0; o < (table.empty() ? 1 : table.size); ++o) {
      offsets.push_back((table.empty() ? Vec3d{} : table[o]) - eye);
    }
  }
  /// Stable id: sets one after the other, each in the order it was read in, however its rows lie in memory.
  std::uint32_t id(std::size_t row) const noexcept {
    const View<const std::uint32_t> rows = set.gaussians.row_ids;
    return static_cast<std::uint32_t>(first_row + (rows.empty() ? row : rows[row]));
  }
  std::size_t origin(std::size_t row) const noexcept {
    return set.gaussians.origin_ids.empty() ? 0 : set.gaussians.origin_ids[row];
  }
  Vec3<float> mean(std::size_t row) const noexcept {
    return mean_of(set.gaussians, row);
  }
  /// mean - camera position, asset frame.
  Vec3d delta(std::size_t row) const noexcept {
    return vec_cast<double>(mean(row)) + offsets[origin(row)];
  }
  /// The centre in camera axes, metres: from its place in the asset, in long double, as no kernel computes it.
  std::array<long double, 3> center(std::size_t row) const noexcept {
    const View<const Vec3d> table = set.gaussians.origins;
    const Vec3d from = table.empty() ? Vec3d{} : table[origin(row)];
    const Vec3<float> offset = mean(row);
    std::array<long double, 3> out;
    for (std::size_t r = 0; r < 3; ++r) {
      out[r] = camera_from_asset[r][3];
      for (int k = 0; k < 3; ++k) {
        const long double place = static_cast<long double>(from[k]) + static_cast<long double>(offset[k]);
        out[r] += camera_from_asset[r][static_cast<std::size_t>(k)] * place;
      }
    }
    return out;
  }
  /// Depth of the centre along the view axis, rounded to float32 once: what the contract culls by.
  float z_key(std::size_t row) const noexcept { return static_cast<float>(center(row)[2]); }
  /// The contract's near rules.
  bool in_front(std::size_t row, const SplatAxes<double>& axes) const noexcept {
    return z_key(row) > camera.near_plane &&
           (!(camera.near_sigma > 0) || axes.position.z > camera.near_sigma * norm(axes.factor.row[2]));
  }
};

/// Pixels whose centre lies within the half sizes of the centre, in the image.
inline PixelRect pixels_within(const ProjectionCamera<double>& camera, double center_x, double half_x,
                               double center_y, double half_y) noexcept {
  double x0, x1, y0, y1;
  gsnav::detail::pixel_range(center_x, half_x, camera.width, x0, x1);
  gsnav::detail::pixel_range(center_y, half_y, camera.height, y0, y1);
  PixelRect r;
  r.x0 = static_cast<std::int32_t>(x0);
  r.x1 = static_cast<std::int32_t>(x1);
  r.y0 = static_cast<std::int32_t>(y0);
  r.y1 = static_cast<std::int32_t>(y1);
  return r;
}

/// A Gaussian by the contract: the shared kernels in double.
struct EwaModel {
  double mean_x, mean_y, a, k, b, log2_opacity;
  SplatDepth<double> ray;

  /// False: not drawn. `box` holds every pixel with alpha >= 2^log2_cut.
  static bool make(const OracleSet& s, std::size_t row, double log2_cut, EwaModel& out,
                   PixelRect& box) noexcept {
    const SplatAxes<double> axes =
        gsnav::detail::load_axes(s.set.gaussians, s.camera, s.delta(row), row);
    if (!s.in_front(row, axes)) return false;
    const float opacity = opacity_of(s.set.gaussians, row);
    Projected<double> p = project<double, float>(s.camera, axes, s.z_key(row),
                                                 static_cast<double>(opacity));
    // What overflows float32 is not drawn, by any backend.
    constexpr double huge = 3e38;
    const double determinant = std::pow(kWhitenScale, 4) / (p.a * p.a * p.b * p.b);
    if (!(p.log2_opacity >= log2_cut && opacity > 0 && determinant <= huge && p.variance_x <= huge &&
          p.variance_y <= huge && abs(p.mean_x) <= huge && abs(p.mean_y) <= huge)) {
      return false;
    }
    p.s_max = max(p.s_max, 0.0);  // fainter than alpha_min throughout: depth of the centre
    out = {p.mean_x, p.mean_y, p.a, p.k, p.b, p.log2_opacity, make_splat_depth(s.camera, axes, p)};
    // q = k^2 touches x = mean +- k sqrt(A); the pad is a hundred times its rounding.
    const double k = sqrt(2 * kLn2 * (p.log2_opacity - log2_cut)) * (1 + 1e-9);
    box = pixels_within(s.camera, p.mean_x, k * sqrt(p.variance_x) + 1e-12 * abs(p.mean_x), p.mean_y,
                        k * sqrt(p.variance_y) + 1e-12 * abs(p.mean_y));
    return true;
  }
  /// log2 of alpha before max_alpha.
  double log2_alpha(double px, double py) const noexcept {
    const double dx = px - mean_x, dy = py - mean_y;
    const double w1 = a * dx, w2 = k * dx + b * dy;
    return log2_opacity - (w1 * w1 + w2 * w2);
  }
  double depth(double px, double py) const noexcept { return ray_depth(ray, px, py); }
};

/// A Gaussian ready to be blended.
template <class Model>
struct OracleRecord {
  Model model;
  Vec3d color;
  PixelRect box;            ///< within the crop; may be empty where boxes are not used
  std::uint32_t id;         ///< stable
  std::uint32_t rank;       ///< place in the order that order_flip compares with
};

/// The rules of blending, limits in the form they are compared in.
struct OracleRules {
  double log2_alpha_min, max_alpha, transmittance_min, first_hit_tau;
  Vec3d background;
};

/// Records in the order of the image (of float32 keys for OracleOrder::per_ray), for one camera and crop.
template <class Model>
struct OracleScene {
  std::vector<OracleRecord<Model>> records;
  OracleRules rules;
  PixelRect rect;
  double log2_cut;  ///< fainter pairs need not be asked
  bool boxed, per_ray;
  const OracleMesh* mesh;
  std::size_t image_width;
  OracleCounts counts;

  /// Of the camera's pixel (x, y): the mesh's depth, infinity where there is none.
  double mesh_depth(int x, int y) const noexcept {
    return mesh == nullptr ? std::numeric_limits<double>::infinity() : mesh->depth[pixel(x, y)];
  }
  std::size_t pixel(int x, int y) const noexcept {
    return static_cast<std::size_t>(y) * image_width + static_cast<std::size_t>(x);
  }
};

struct OracleCandidate {
  double key64;
  std::uint32_t code;
  std::uint32_t id;   ///< stable: what decides ties
  std::uint32_t row;  ///< among the rows of all sets as they lie in memory
};

inline constexpr std::size_t kOracleChunk = 2048;

/// Candidates of all sets: what is drawn and, where boxes are used, reaches the crop.
template <class Model, Backend B>
std::vector<OracleCandidate> oracle_candidates(B& backend, std::span<const OracleSet> sets,
                                               OracleScene<Model>& scene) {
  std::vector<OracleCandidate> all;
  for (const OracleSet& s : sets) {
    const std::size_t n = s.set.gaussians.size, chunks = (n + kOracleChunk - 1) / kOracleChunk;
    std::vector<std::vector<OracleCandidate>> found(chunks);
    std::vector<std::uint64_t> reaching(chunks);
    backend.parallel_for(chunks, [&](std::size_t c) {
      for (std::size_t row = c * kOracleChunk; row < std::min(n, (c + 1) * kOracleChunk); ++row) {
        Model model;
        PixelRect box;
        if (!Model::make(s, row, scene.log2_cut, model, box)) continue;
        const bool reaches = !box.intersection(scene.rect).empty();
        reaching[c] += reaches ? 1 : 0;
        if (scene.boxed && !reaches) continue;
        const bool by_z = s.camera.sort_order == SortOrder::z_depth;
        const std::array<long double, 3> at = s.center(row);
        const long double key = by_z ? at[2] : std::sqrt(at[0] * at[0] + at[1] * at[1] + at[2] * at[2]);
        found[c].push_back({static_cast<double>(key), s.camera.key_code(static_cast<float>(key)), s.id(row),
                            static_cast<std::uint32_t>(s.first_row + row)});
      }
    });
    for (std::size_t c = 0; c < chunks; ++c) {
      all.insert(all.end(), found[c].begin(), found[c].end());
      scene.counts.visible += reaching[c];
    }
    scene.counts.gaussians += n;
  }
  return all;
}

/// Projects, culls and sorts; what is drawn is projected again to be recorded in its place, so that nothing
/// is held twice.
template <class Model, Backend B>
OracleScene<Model> make_oracle_scene(B& backend, std::span<const GaussianSet> gaussian_sets,
                                     const Camera& camera, const OracleConfig& config) {
  const RenderConfig& c = config.rules;
  const bool truncated = config.kind != OracleKind::untruncated;
  const double infinity = std::numeric_limits<double>::infinity();
  OracleScene<Model> scene;
  scene.rules = {truncated ? std::log2(c.alpha_min) : -infinity, c.max_alpha,
                 truncated ? c.transmittance_min : 0.0, c.first_hit_tau, c.background};
  scene.rect = oracle_rect(config, camera);
  scene.boxed = config.boxed;
  scene.mesh = config.mesh;
  scene.image_width = static_cast<std::size_t>(camera.width);
  scene.per_ray = config.order == OracleOrder::per_ray ||
                  (config.order == OracleOrder::own && config.kind == OracleKind::ray);
  // What falls short of alpha_min by less than the undecided margin has to be seen too.
  scene.log2_cut = truncated      ? scene.rules.log2_alpha_min - 3 * kUndecidedRelative
                   : config.boxed ? kLog2NegligibleAlpha
                                  : -infinity;

  std::vector<OracleSet> sets;
  std::size_t total = 0;
  for (const GaussianSet& s : gaussian_sets) {
    sets.emplace_back(s, camera, c, total);
    total += s.gaussians.size;
  }
  std::vector<OracleCandidate> order = oracle_candidates<Model>(backend, sets, scene);
  const auto by_code = [](const OracleCandidate& a, const OracleCandidate& b) {
    return a.code != b.code ? a.code < b.code : a.id < b.id;
  };
  const auto by_key64 = [](const OracleCandidate& a, const OracleCandidate& b) {
    return a.key64 != b.key64 ? a.key64 < b.key64 : a.id < b.id;
  };
  const bool in_float64 = config.order == OracleOrder::float64;
  if (in_float64) {
    std::sort(order.begin(), order.end(), by_key64);
  } else {
    std::sort(order.begin(), order.end(), by_code);
  }
  // Places in the other order, for order_flip; by pixel, the order of the list is the other one.
  std::vector<std::uint32_t> place(order.size()), rank(order.size());
  for (std::size_t i = 0; i < order.size(); ++i) place[i] = static_cast<std::uint32_t>(i);
  if (!scene.per_ray) {
    std::sort(place.begin(), place.end(), [&](std::uint32_t i, std::uint32_t j) {
      return in_float64 ? by_code(order[i], order[j]) : by_key64(order[i], order[j]);
    });
  }
  for (std::size_t i = 0; i < order.size(); ++i) rank[place[i]] = static_cast<std::uint32_t>(i);

  scene.records.resize(order.size());
  backend.parallel_for((order.size() + kOracleChunk - 1) / kOracleChunk, [&](std::size_t chunk) {
    for (std::size_t i = chunk * kOracleChunk; i < std::min(order.size(), (chunk + 1) * kOracleChunk); ++i) {
      const auto after = std::upper_bound(sets.begin(), sets.end(), order[i].row,
                                          [](std::uint32_t row, const OracleSet& s) { return row < s.first_row; });
      const OracleSet& s = *std::prev(after);
      const std::size_t row = order[i].row - s.first_row;
      OracleRecord<Model>& record = scene.records[i];
      Model::make(s, row, scene.log2_cut, record.model, record.box);
      record.box = record.box.intersection(scene.rect);
      const SplatColor<double> color = gaussian_color<double>(
          s.set.gaussians, min(s.set.gaussians.sh_degree, c.max_sh_degree), row, s.delta(row));
      const auto blended = [&](double v) { return converted(v, s.set.color_space, c.blend_space); };
      record.color = {blended(color.r), blended(color.g), blended(color.b)};
      record.id = order[i].id;
      record.rank = rank[i];
    }
  });
  return scene;
}

}  // namespace gsnav::eval::detail
