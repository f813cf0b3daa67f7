// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "gsnav/render/render.hpp"
#include "gsnav/scene/basic_renderer.hpp"

namespace gsnav_bench {

/// The stages of one camera's frame as separate calls, on any backend; `render_camera` runs them one
/// after the other. One cloud, one origin, Response::ewa. Every stage reads the results of the stage
/// before it and may run any number of times. The constructor runs all stages but the blending once.
template <class S, gsnav::Backend B>
class FrameStages {
 public:
  FrameStages(B& backend, const gsnav::GaussianCloud& cloud, const gsnav::Camera& camera,
              const gsnav::RenderConfig& config = {})
      : config_(config),
        backend_(&backend),
        arrays_(backend, cloud),
        offsets_(backend),
        geometry_(backend),
        colors_(backend),
        depths_(backend),
        bounds_(backend),
        chunk_keys_(backend),
        counts_(backend),
        order_(backend),
        cursors_(backend),
        tile_offsets_(backend),
        tile_splats_(backend),
        spans_(backend),
        words_(backend),
        images_(backend) {
    prepare_projection(camera);
    project();
    set_order();
    prepare_bins();
    bin();
  }

  void project() {
    gsnav::run(*backend_, gsnav::stage::Project{}, project_, projected_);
    sync();
  }

  /// Fills tile_offsets and tile_splats.
  void bin() {
    gsnav::run(*backend_, gsnav::stage::CountTiles{}, bin_, gsnav::NoCull{});
    tile_offsets_.download(&pairs_, 1, bin_.grid.count());
    sync();
    tile_splats_.resize_discard(pairs_);
    bin_.tile_splats = tile_splats_.view();
    gsnav::run(*backend_, gsnav::stage::ScatterTiles{}, bin_, gsnav::NoCull{});
    sync();
  }

  /// Blends the RGB of the bins.
  void blend() {
    gsnav::RasterArgs<S> raster;
    raster.grid = bin_.grid;
    raster.tile_offsets = tile_offsets_.view();
    raster.tile_splats = tile_splats_.view();
    raster.geometry = geometry_.view();
    raster.colors = colors_.view();
    raster.rules = gsnav::blend_rules<S>(config_);
    raster.exp2_method = gsnav::exp2_method(config_.quality);
    raster.images.rgb = images_.data();
    gsnav::run(*backend_, gsnav::stage::Blend{}, raster);
    sync();
  }

  std::size_t visible() const noexcept { return order_.size(); }
  std::size_t pairs() const noexcept { return static_cast<std::size_t>(pairs_); }
  std::size_t pixels() const noexcept { return images_.size() / 3; }
  const gsnav::BinArgs<S>& bins() const noexcept { return bin_; }

  /// Records of the Gaussians that survive culling, in the order of the chunks' slots.
  std::vector<gsnav::SplatGeometry<S>> survivors_geometry() const { return survivors(geometry_); }
  std::vector<gsnav::SplatColor<S>> survivors_colors() const { return survivors(colors_); }
  std::vector<std::uint64_t> tile_offsets() const { return all_of(tile_offsets_); }
  std::vector<S> image() const { return all_of(images_); }

 private:
  void sync() { backend_->synchronize().throw_if_error(); }

  template <class T>
  std::vector<T> all_of(const gsnav::Buffer<T, B>& buffer) const {
    std::vector<T> out(buffer.size());
    buffer.download(out.data(), out.size());
    backend_->synchronize().throw_if_error();
    return out;
  }

  template <class T>
  std::vector<T> survivors(const gsnav::Buffer<T, B>& buffer) const {
    const std::vector<T> slots = all_of(buffer);
    const std::vector<std::uint32_t> counts = all_of(counts_);
    std::vector<T> out;
    for (std::size_t c = 0; c < counts.size(); ++c) {
      const auto first = slots.begin() + static_cast<std::ptrdiff_t>(c * gsnav::kProjectChunk);
      out.insert(out.end(), first, first + counts[c]);
    }
    return out;
  }

  void prepare_projection(const gsnav::Camera& camera) {
    const gsnav::GaussianSet set = arrays_.set();
    const gsnav::ProjectionRules rules = gsnav::projection_rules(config_);
    project_ = gsnav::view_set<S>(camera, set, rules, config_.quality.max_sh_degree);
    std::vector<gsnav::Vec3d> offsets;
    for (std::size_t o = 0; o < gsnav::origin_count(set.gaussians); ++o) {
      offsets.push_back(gsnav::origin_offset(project_, o));
    }
    offsets_.upload(offsets.data(), offsets.size());
    const bool color = (config_.outputs & gsnav::kRgb) != 0,
               depth = (config_.outputs & gsnav::kAnyDepth) != 0;
    const std::size_t slots = project_.chunk_count() * gsnav::kProjectChunk;
    geometry_.resize_discard(slots);
    colors_.resize_discard(color ? slots : 0);
    depths_.resize_discard(depth ? slots : 0);
    bounds_.resize_discard(slots);
    chunk_keys_.resize_discard(slots);
    counts_.resize_discard(project_.chunk_count());
    projected_.geometry = geometry_.view();
    projected_.colors = colors_.view();
    projected_.depths = depths_.view();
    projected_.bounds = bounds_.view();
    projected_.keys = chunk_keys_.view();
    projected_.counts = counts_.view();
    projected_.grid = gsnav::TileGrid::of(camera.width, camera.height,
                                          gsnav::tile_size_of<B>(config_, camera.width, camera.height));
    spans_.resize_discard(gsnav::detail::bins_by_entries<S, B> ? slots : 0);
    words_.resize_discard(spans_.size());
    projected_.spans = spans_.view();
    projected_.words = words_.view();
    project_.offsets = offsets_.view();
    images_.resize_discard(static_cast<std::size_t>(3 * camera.width) *
                           static_cast<std::size_t>(camera.height));
  }

  /// Computes the depth order of the survivors on the host, because the sort has its own benchmark.
  void set_order() {
    const std::vector<std::uint32_t> keys = all_of(chunk_keys_), counts = all_of(counts_);
    std::vector<std::uint32_t> order;
    for (std::size_t c = 0; c < counts.size(); ++c) {
      for (std::size_t i = 0; i < counts[c]; ++i) {
        order.push_back(static_cast<std::uint32_t>(c * gsnav::kProjectChunk + i));
      }
    }
    std::stable_sort(order.begin(), order.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return keys[a] < keys[b]; });
    order_.upload(order.data(), order.size());
    if constexpr (gsnav::detail::bins_by_entries<S, B>) {
      bin_.entry = gsnav::SortEntry::of(keys.size(), projected_.grid.count());
      entries_.clear();
      for (const std::uint32_t slot : order)
        entries_.push_back(bin_.entry(0, words_.view()[slot], slot));
      bin_.entries = gsnav::view_of(std::as_const(entries_));
    }
  }

  void prepare_bins() {
    bin_.grid = projected_.grid;
    bin_.spans = spans_.view();
    bin_.order = order_.view();
    bin_.geometry = geometry_.view();
    bin_.bounds = bounds_.view();
    bin_.log2_alpha_min = static_cast<S>(log2_alpha_min(config_.quality));
    bin_.blocks = gsnav::concurrency_of(*backend_);
    cursors_.resize_discard(bin_.blocks * bin_.grid.count());
    tile_offsets_.resize_discard(bin_.grid.count() + 1);
    bin_.cursors = cursors_.view();
    bin_.tile_offsets = tile_offsets_.view();
  }

  gsnav::RenderConfig config_;
  B* backend_;
  gsnav::GaussianArrays<B> arrays_;
  gsnav::Buffer<gsnav::Vec3d, B> offsets_;
  gsnav::Buffer<gsnav::SplatGeometry<S>, B> geometry_;
  gsnav::Buffer<gsnav::SplatColor<S>, B> colors_;
  gsnav::Buffer<gsnav::SplatDepth<S>, B> depths_;
  gsnav::Buffer<gsnav::SplatBounds, B> bounds_;
  gsnav::Buffer<std::uint32_t, B> chunk_keys_, counts_, order_;
  gsnav::Buffer<std::uint64_t, B> cursors_, tile_offsets_;
  gsnav::Buffer<std::uint32_t, B> tile_splats_;
  gsnav::Buffer<gsnav::TileSpans, B> spans_;
  gsnav::Buffer<std::uint32_t, B> words_;
  std::vector<std::uint64_t> entries_;
  gsnav::Buffer<S, B> images_;
  gsnav::ViewedSet<S> project_;
  gsnav::ProjectOutputs<S> projected_;
  gsnav::BinArgs<S> bin_;
  std::uint64_t pairs_ = 0;
};

}  // namespace gsnav_bench
