// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "gsnav/core/backend.hpp"
#include "gsnav/core/view.hpp"
#include "gsnav/detail/eval/oracle_config.hpp"
#include "gsnav/detail/eval/oracle_gaussian.hpp"

// From sets of Gaussians to one sorted list of records. All kinds of reference use it.

namespace gsnav::eval::detail {

/// A Gaussian that is ready to be blended.
template <class Model>
struct OracleRecord {
  Model model;
  Double3 color;
  PixelRect box;       ///< Box within the crop. May be empty if boxes are not used.
  std::uint32_t id;    ///< Stable id.
  std::uint32_t rank;  ///< Position in the order that order_flip compares with.
};

/// Settings of blending, with limits as they are compared.
struct OracleRules {
  double log2_alpha_min, max_alpha, transmittance_min, first_hit_tau;
  bool normalize_closed;
  Double3 background;
};

/// Records of one camera and crop, in blending order (for OracleOrder::per_ray, in the order of float32
/// keys).
template <class Model>
struct OracleScene {
  std::vector<OracleRecord<Model>> records;
  OracleRules rules;
  PixelRect rect;
  double log2_least;  ///< Pairs with lower log2 alpha need not be evaluated.
  bool boxed, per_ray;
  const OracleMesh* mesh;
  std::size_t image_width;
  OracleCounts counts;

  /// Depth of the mesh at pixel (x, y) of the camera. Infinity if there is none.
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
  std::uint32_t id;   ///< Stable id. It decides between equal keys.
  std::uint32_t row;  ///< Index among the stored rows of all sets.
};

inline constexpr std::size_t kOracleChunk = 2048;

/// Returns the Gaussians of all sets that are drawn and, with boxes, reach the crop.
template <class Model, Backend B>
std::vector<OracleCandidate> oracle_candidates(B& backend, std::span<const OracleSet> sets, int key_bits,
                                               OracleScene<Model>& scene) {
  std::vector<OracleCandidate> all;
  for (const OracleSet& s : sets) {
    const std::size_t n = s.set.gaussians.size(), chunks = (n + kOracleChunk - 1) / kOracleChunk;
    std::vector<std::vector<OracleCandidate>> found(chunks);
    std::vector<std::uint64_t> reaching(chunks);
    backend.parallel_for(chunks, [&](std::size_t c) {
      for (std::size_t row = c * kOracleChunk; row < std::min(n, (c + 1) * kOracleChunk); ++row) {
        Model model;
        PixelRect box;
        if (!Model::make(s, row, scene.log2_least, model, box)) continue;
        const bool reaches = !box.intersection(scene.rect).empty();
        reaching[c] += reaches ? 1 : 0;
        if (scene.boxed && !reaches) continue;
        const Real key = s.key(row);
        const float near_plane = static_cast<float>(s.camera.near_plane);
        found[c].push_back({static_cast<double>(key),
                            sorted_code(static_cast<float>(key), key_bits, near_plane), s.id(row),
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

/// Projects, culls and sorts. Gaussians that are drawn are projected a second time when their records
/// are written, so that projections need not be kept.
template <class Model, Backend B>
OracleScene<Model> make_oracle_scene(B& backend, std::span<const GaussianSet> gaussian_sets,
                                     const Camera& camera, const OracleConfig& config) {
  const RenderConfig& c = config.rules;
  const bool truncated = config.kind != OracleKind::untruncated;
  const double infinity = std::numeric_limits<double>::infinity();
  OracleScene<Model> scene;
  const bool normalized = c.quality.normalize_closed && c.compat == Compat::none;
  double stop = truncated ? c.quality.transmittance_min : 0.0;
  if (normalized) stop = std::min({stop, 0.5, 1 - c.first_hit_tau});  // the pixel then has both depths
  scene.rules = {truncated ? std::log2(c.quality.alpha_min) : -infinity,
                 c.quality.max_alpha,
                 stop,
                 c.first_hit_tau,
                 normalized,
                 {c.background.x, c.background.y, c.background.z}};
  scene.rect = oracle_rect(config, camera);
  scene.boxed = config.boxed;
  scene.mesh = config.mesh;
  scene.image_width = static_cast<std::size_t>(camera.width);
  scene.per_ray = config.order == OracleOrder::per_ray ||
                  (config.order == OracleOrder::own && config.kind == OracleKind::ray);
  // Include Gaussians whose alpha is below alpha_min by less than the undecided margin.
  scene.log2_least = truncated      ? scene.rules.log2_alpha_min - 3 * kUndecidedRelative
                     : config.boxed ? kLog2NegligibleAlpha
                                    : -infinity;

  std::vector<OracleSet> sets;
  std::size_t total = 0;
  for (const GaussianSet& s : gaussian_sets) {
    sets.emplace_back(s, camera, c, total);
    total += s.gaussians.size();
  }
  std::vector<OracleCandidate> order =
      oracle_candidates<Model>(backend, sets, c.quality.key_bits, scene);
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
  // Ranks in the other order, for order_flip. With per_ray, the other order is that of the list.
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
    for (std::size_t i = chunk * kOracleChunk; i < std::min(order.size(), (chunk + 1) * kOracleChunk);
         ++i) {
      const auto after =
          std::upper_bound(sets.begin(), sets.end(), order[i].row,
                           [](std::uint32_t row, const OracleSet& s) { return row < s.first_row; });
      const OracleSet& s = *std::prev(after);
      const std::size_t row = order[i].row - s.first_row;
      OracleRecord<Model>& record = scene.records[i];
      Model::make(s, row, scene.log2_least, record.model, record.box);
      record.box = record.box.intersection(scene.rect);
      record.color =
          s.color(row, std::min(s.set.gaussians.color.degree, c.quality.max_sh_degree), c.blend_space);
      record.id = order[i].id;
      record.rank = rank[i];
    }
  });
  return scene;
}

}  // namespace gsnav::eval::detail
