// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <vector>

#include "gsnav/core/backend.hpp"
#include "gsnav/core/view.hpp"
#include "gsnav/detail/eval/oracle_config.hpp"
#include "gsnav/detail/eval/oracle_project.hpp"

// Blending of sorted records into pixels. Every kind and order of reference blends with
// OraclePixel::blend.

namespace gsnav::eval::detail {

/// State of a pixel during blending from front to back.
struct OraclePixel {
  double transmittance = 1, weights = 0;
  Double3 color{};
  double median = 0, accumulated = 0, first_hit = 0;
  std::uint32_t blended = 0, last_rank = 0;
  bool closed = false, undecided = false, undecided_depth = false, order_flip = false;

  /// Blends one Gaussian.
  /// @param log2_alpha log2 of its alpha before the limit max_alpha.
  /// @param mesh Depth of the mesh at this pixel, infinity if there is none.
  /// @param depth Returns the depth of the Gaussian along the ray.
  template <class Depth>
  void blend(const OracleRules& rules, double log2_alpha, const Double3& c, std::uint32_t rank,
             double mesh, const Depth& depth) noexcept {
    const double excess = log2_alpha - rules.log2_alpha_min;
    if (std::isfinite(mesh)) {
      const double beyond = depth() - mesh;
      if (std::abs(beyond) < kUndecidedMesh && excess * std::numbers::ln2 > -kUndecidedRelative)
        undecided = true;
      if (beyond > 0) return;
    }
    if (std::abs(excess) * std::numbers::ln2 < kUndecidedRelative) undecided = true;
    if (!(excess >= 0)) return;
    const double alpha = std::min(rules.max_alpha, std::exp2(log2_alpha));
    if (!(alpha > 0)) return;
    if (blended++ > 0 && rank < last_rank) order_flip = true;
    last_rank = rank;
    take(rules, alpha, c, depth());
    settle(rules);
  }

  /// Blends a transparent fragment of a mesh.
  void pass(const OracleRules& rules, const OracleFragment& f) noexcept {
    take(rules, f.alpha, {f.rgb.x, f.rgb.y, f.rgb.z}, f.depth);
    settle(rules);
    last_rank = 0;  // Another list begins.
  }

  /// Takes a share of the light at depth z. An opaque mesh takes all of it.
  void take(const OracleRules& rules, double alpha, const Double3& c, double z) noexcept {
    const double before = transmittance, weight = alpha * before, open = 1 - rules.first_hit_tau;
    transmittance = before * (1 - alpha);
    color = color + weight * c;
    weights += weight;
    accumulated += weight * z;
    if (before > 0.5 && transmittance <= 0.5) median = z;
    if (before > open && transmittance <= open) first_hit = z;
  }

  /// Closes the pixel below the stop, and marks a transmittance that float32 may decide differently.
  void settle(const OracleRules& rules) noexcept {
    const double stop = rules.transmittance_min;
    for (const double at : {0.5, 1 - rules.first_hit_tau})
      undecided_depth = undecided_depth || std::abs(transmittance - at) < kUndecidedCrossing;
    undecided = undecided || std::abs(transmittance - stop) < kUndecidedRelative * stop;
    closed = closed || transmittance < stop;
  }

  void write(const OracleRules& rules, OracleFrames& out, std::size_t pixel) const noexcept {
    const bool opaque = closed && rules.normalize_closed && transmittance < 1;
    const double scale = opaque ? 1 / (1 - transmittance) : 1, through = opaque ? 0 : transmittance;
    const Double3 rgb = scale * color + through * rules.background;
    out.rgb[3 * pixel] = rgb.x;
    out.rgb[3 * pixel + 1] = rgb.y;
    out.rgb[3 * pixel + 2] = rgb.z;
    out.alpha[pixel] = 1 - through;
    out.median_depth[pixel] = median;
    out.expected_depth[pixel] = weights > 0 ? accumulated / weights : 0;
    out.accumulated_depth[pixel] = accumulated * scale;
    out.first_hit_depth[pixel] = first_hit;
    out.undecided[pixel] = undecided ? 1 : 0;
    out.undecided_depth[pixel] = undecided_depth ? 1 : 0;
    out.order_flip[pixel] = order_flip ? 1 : 0;
  }
};

/// Columns of a row at which a record is evaluated.
template <class Model>
struct OracleSpan {
  int x0, x1;
  OracleSpan(const OracleScene<Model>& s, const OracleRecord<Model>& r) noexcept
      : x0(s.boxed ? r.box.x0 : s.rect.x0), x1(s.boxed ? r.box.x1 : s.rect.x1) {}
};

/// Blends a pixel with transparent fragments. Each Gaussian is placed in front of, between or behind
/// them by its depth along the ray. Gaussians between the same two fragments keep the order of `list`.
template <class Model>
void blend_among(const OracleScene<Model>& scene, View<const std::uint32_t> list, int x, int y,
                 const std::vector<OracleFragment>& fragments, OraclePixel& pixel) {
  struct Met {
    std::size_t behind;  // Number of fragments in front of the Gaussian.
    const OracleRecord<Model>* record;
    double log2_alpha, depth;
  };
  std::vector<Met> met;
  const double px = x + 0.5, py = y + 0.5;
  for (std::size_t i = 0; i < list.size; ++i) {
    const OracleRecord<Model>& r = scene.records[list[i]];
    const OracleSpan<Model> span(scene, r);
    if (x < span.x0 || x >= span.x1) continue;
    Met m{0, &r, r.model.log2_alpha(px, py), 0};
    if (!(m.log2_alpha >= scene.log2_least)) continue;
    m.depth = r.model.depth(px, py);
    const bool drawn =
        (m.log2_alpha - scene.rules.log2_alpha_min) * std::numbers::ln2 > -kUndecidedRelative;
    for (const OracleFragment& f : fragments) {
      m.behind += f.depth < m.depth ? 1 : 0;
      if (drawn && std::abs(f.depth - m.depth) < kUndecidedMesh) pixel.undecided = true;
    }
    met.push_back(m);
  }
  std::stable_sort(met.begin(), met.end(),
                   [](const Met& a, const Met& b) { return a.behind < b.behind; });
  std::size_t next = 0;
  for (std::size_t k = 0; k <= fragments.size(); ++k) {
    for (; next < met.size() && met[next].behind == k; ++next) {
      if (pixel.closed) continue;
      const Met& m = met[next];
      pixel.blend(scene.rules, m.log2_alpha, m.record->color, m.record->rank, scene.mesh_depth(x, y),
                  [&m] { return m.depth; });
    }
    if (k < fragments.size()) pixel.pass(scene.rules, fragments[k]);
  }
}

/// Blends one row in the order of `list`, which holds indices of records that reach the row.
template <class Model>
void blend_in_order(const OracleScene<Model>& scene, View<const std::uint32_t> list, int y,
                    std::vector<OraclePixel>& pixels) {
  std::size_t open = pixels.size();
  std::vector<std::uint8_t> apart(pixels.size());  // 1 for pixels that blend_among handles.
  if (scene.mesh != nullptr && !scene.mesh->fragments.empty()) {
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      const int x = scene.rect.x0 + static_cast<int>(i);
      const auto& fragments = scene.mesh->fragments[scene.pixel(x, y)];
      if (fragments.empty()) continue;
      apart[i] = 1;
      --open;
      blend_among(scene, list, x, y, fragments, pixels[i]);
    }
  }
  for (std::size_t i = 0; i < list.size && open > 0; ++i) {
    const OracleRecord<Model>& r = scene.records[list[i]];
    const OracleSpan<Model> span(scene, r);
    for (int x = span.x0; x < span.x1; ++x) {
      const std::size_t column = static_cast<std::size_t>(x - scene.rect.x0);
      OraclePixel& pixel = pixels[column];
      if (pixel.closed || apart[column] != 0) continue;
      const double px = x + 0.5, py = y + 0.5, log2_alpha = r.model.log2_alpha(px, py);
      if (!(log2_alpha >= scene.log2_least)) continue;
      pixel.blend(scene.rules, log2_alpha, r.color, r.rank, scene.mesh_depth(x, y),
                  [&] { return r.model.depth(px, py); });
      open -= pixel.closed ? 1 : 0;
    }
  }
}

/// Blends one row, each pixel in its own order of depth. Columns are processed in strips of at most
/// kOracleFragments pairs (or one column), so that memory does not grow with the image.
template <class Model>
void blend_per_ray(const OracleScene<Model>& scene, View<const std::uint32_t> list, int y,
                   std::vector<OraclePixel>& pixels) {
  struct Fragment {
    double depth, log2_alpha;
    std::uint32_t record, id;
  };
  constexpr std::size_t kOracleFragments = std::size_t{1} << 20;
  std::vector<std::int64_t> change(pixels.size() + 1);
  for (std::size_t i = 0; i < list.size; ++i) {
    const OracleSpan<Model> span(scene, scene.records[list[i]]);
    ++change[static_cast<std::size_t>(span.x0 - scene.rect.x0)];
    --change[static_cast<std::size_t>(span.x1 - scene.rect.x0)];
  }
  std::vector<std::size_t> begin(pixels.size() + 1), end(pixels.size());
  std::vector<Fragment> fragments;
  std::int64_t covering = 0;
  for (std::size_t first = 0, last = 0; first < pixels.size(); first = last) {
    begin[first] = 0;
    while (last < pixels.size()) {
      const std::size_t pairs = static_cast<std::size_t>(covering + change[last]);
      if (last > first && begin[last] + pairs > kOracleFragments) break;
      covering += change[last];
      end[last] = begin[last];
      begin[last + 1] = begin[last] + pairs;
      ++last;
    }
    fragments.resize(begin[last]);
    const int strip0 = scene.rect.x0 + static_cast<int>(first),
              strip1 = scene.rect.x0 + static_cast<int>(last);
    const double py = y + 0.5;
    for (std::size_t i = 0; i < list.size; ++i) {
      const OracleRecord<Model>& r = scene.records[list[i]];
      const OracleSpan<Model> span(scene, r);
      for (int x = std::max(span.x0, strip0); x < std::min(span.x1, strip1); ++x) {
        const double px = x + 0.5, log2_alpha = r.model.log2_alpha(px, py);
        if (!(log2_alpha >= scene.log2_least)) continue;
        fragments[end[static_cast<std::size_t>(x - scene.rect.x0)]++] = {r.model.depth(px, py),
                                                                         log2_alpha, list[i], r.id};
      }
    }
    for (std::size_t p = first; p < last; ++p) {
      const auto from = fragments.begin() + static_cast<std::ptrdiff_t>(begin[p]);
      const auto to = fragments.begin() + static_cast<std::ptrdiff_t>(end[p]);
      std::sort(from, to, [](const Fragment& a, const Fragment& b) {
        return a.depth != b.depth ? a.depth < b.depth : a.id < b.id;
      });
      for (auto f = from; f != to && !pixels[p].closed; ++f) {
        const OracleRecord<Model>& r = scene.records[f->record];
        pixels[p].blend(scene.rules, f->log2_alpha, r.color, r.rank,
                        scene.mesh_depth(scene.rect.x0 + static_cast<int>(p), y),
                        [&] { return f->depth; });
      }
    }
  }
}

/// Renders row y of the scene into row `to` of `out`. Returns the work that it took.
template <class Model>
OracleCounts blend_row(const OracleScene<Model>& scene, View<const std::uint32_t> list, int y,
                       OracleFrames& out, std::size_t to) {
  std::vector<OraclePixel> pixels(scene.rect.width());
  if (scene.per_ray) {
    blend_per_ray(scene, list, y, pixels);
  } else {
    blend_in_order(scene, list, y, pixels);
  }
  OracleCounts counts;
  for (std::size_t i = 0; i < list.size; ++i) {
    const OracleSpan<Model> span(scene, scene.records[list[i]]);
    counts.listed += static_cast<std::uint64_t>(span.x1 - span.x0);
  }
  for (std::size_t x = 0; x < pixels.size(); ++x) {
    const int column = scene.rect.x0 + static_cast<int>(x);
    if (const double z = scene.mesh_depth(column, y); std::isfinite(z)) {
      const double* const c = scene.mesh->rgb.data() + 3 * scene.pixel(column, y);
      pixels[x].take(scene.rules, 1, {c[0], c[1], c[2]}, z);
    }
    pixels[x].write(scene.rules, out, to * out.width + x);
    counts.evaluations += pixels[x].blended;
    counts.order_flips += pixels[x].order_flip ? 1 : 0;
  }
  return counts;
}

/// Lists of records per row, for rows from y0 until 2^24 pairs (64 MiB) or at least one row. Built by a
/// counting sort that keeps the order of the records.
template <class Model>
class RowLists {
 public:
  RowLists(const OracleScene<Model>& scene, int y0, int y_limit) : y0_(y0), offsets_(1, 0) {
    constexpr std::size_t kPairs = std::size_t{1} << 24;
    const std::size_t rows = static_cast<std::size_t>(y_limit - y0);
    std::vector<std::int64_t> change(rows + 1);
    for (const OracleRecord<Model>& r : scene.records) {
      const auto [from, to] = rows_of(scene, r, y_limit);
      if (from >= to) continue;
      ++change[static_cast<std::size_t>(from - y0)];
      --change[static_cast<std::size_t>(to - y0)];
    }
    std::int64_t covering = 0;
    for (std::size_t row = 0; row < rows; ++row) {
      covering += change[row];
      const std::size_t end = offsets_.back() + static_cast<std::size_t>(covering);
      if (row > 0 && end > kPairs) break;
      offsets_.push_back(end);
    }
    records_.resize(offsets_.back());
    std::vector<std::size_t> cursors(offsets_.begin(), offsets_.end() - 1);
    for (std::size_t i = 0; i < scene.records.size(); ++i) {
      const auto [from, to] = rows_of(scene, scene.records[i], y0 + static_cast<int>(row_count()));
      for (int y = from; y < to; ++y) {
        records_[cursors[static_cast<std::size_t>(y - y0)]++] = static_cast<std::uint32_t>(i);
      }
    }
  }
  std::size_t row_count() const noexcept { return offsets_.size() - 1; }
  View<const std::uint32_t> row(std::size_t i) const noexcept {
    return {records_.data() + offsets_[i], offsets_[i + 1] - offsets_[i]};
  }

 private:
  struct PixelRows {
    int from, to;
  };
  PixelRows rows_of(const OracleScene<Model>& scene, const OracleRecord<Model>& r,
                    int y_limit) const noexcept {
    return {std::max(scene.boxed ? r.box.y0 : scene.rect.y0, y0_),
            std::min(scene.boxed ? r.box.y1 : scene.rect.y1, y_limit)};
  }
  int y0_;
  std::vector<std::size_t> offsets_;
  std::vector<std::uint32_t> records_;
};

/// Renders rows [y0, y1) of the scene into `out`, which is resized to them.
template <class Model, Backend B>
void render_rows(B& backend, const OracleScene<Model>& scene, int y0, int y1, OracleFrames& out) {
  out.resize(scene.rect.width(), static_cast<std::size_t>(y1 - y0));
  out.counts = scene.counts;
  std::vector<OracleCounts> counts(out.height);
  for (int y = y0; y < y1;) {
    const RowLists<Model> lists(scene, y, y1);
    const std::size_t to = static_cast<std::size_t>(y - y0);
    backend.parallel_for(lists.row_count(), [&](std::size_t i) {
      counts[to + i] = blend_row(scene, lists.row(i), y + static_cast<int>(i), out, to + i);
    });
    y += static_cast<int>(lists.row_count());
  }
  for (const OracleCounts& c : counts) out.counts += c;
}

}  // namespace gsnav::eval::detail
