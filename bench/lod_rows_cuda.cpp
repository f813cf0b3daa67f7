// SPDX-License-Identifier: Apache-2.0
// bench_lod on a GPU: one camera per call, then many in one call. Times are milliseconds per frame
// between events on the stream. They include the copy of the cut's chunks, but not the cut itself, which
// the host makes.
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <optional>
#include <span>
#include <vector>

#include "device_time.hpp"
#include "gsnav/backends/cuda/batch.hpp"
#include "gsnav/detail/sim/scene_levels.hpp"
#include "gsnav/scene/basic_renderer.hpp"
#include "lod_rows.hpp"

using namespace gsnav;

namespace gsnav_bench {

namespace {

class GpuRows {
 public:
  GpuRows(CudaBackend& cuda, LodViews& views, const GaussianCloud& cloud, const LodTree& tree,
          const VisibleSets& visible)
      : cuda_(cuda),
        views_(views),
        pixels_(views.pixels()),
        cloud_(cloud),
        arrays_(cuda, cloud),
        merged_(cuda, tree.merged),
        renderer_(cuda, fast()),
        chunks_(cuda),
        tree_(&tree),
        visible_(&visible),
        visible_there_(cuda),
        memory_(cuda),
        time_(cuda) {
    levels_.assets = {{&tree, &cloud, {}, arrays_.set().gaussians, merged_.set().gaussians}};
    memory_.resize_discard(4 * pixels_);
    visible_there_.upload(visible.bits.data(), visible.bits.size());
  }

  void row(const char* name, LodDraw draw, double pixels, bool seen = false) {
    LeveledScene::Asset& asset = levels_.assets[0];
    asset.tree = draw == LodDraw::lod ? tree_ : nullptr;
    asset.visible = seen ? visible_ : nullptr;
    asset.visible_there = seen ? visible_there_.data() : nullptr;
    LodRow out(views_, draw);
    levels_.choice.pixels = std::max(pixels, 1e-3);
    std::vector<float> rgb(3 * pixels_), depth(pixels_);
    for (const Camera& camera : views_.cameras) {
      BatchImages images;
      images.floats.rgb = memory_.data();
      double least = 1e9, pairs = 0;
      draw_once(draw, camera, images, pairs);  // may end early, to make its arrays larger
      for (int repeat = 0; repeat < 9; ++repeat)
        least = std::min(least, draw_once(draw, camera, images, pairs));
      cuda_.copy(rgb.data(), images.floats.rgb, rgb.size() * sizeof(float), CopyKind::device_to_host);
      BatchImages depths;
      depths.floats.median_depth = memory_.data() + 3 * pixels_;
      double ignored = 0;
      draw_once(draw, camera, depths, ignored);
      cuda_.copy(depth.data(), depths.floats.median_depth, depth.size() * sizeof(float),
                 CopyKind::device_to_host);
      cuda_.synchronize().throw_if_error();
      out.add(rgb, depth, least, static_cast<double>(drawn_), pairs);
    }
    out.print(name, pixels);
  }

  /// `n` cameras in one call, of which the first are the views.
  void batch_row(std::size_t n, const char* name, LodDraw draw, double pixels, bool seen = false) {
    LodRow out(views_, draw);
    levels_.choice.pixels = std::max(pixels, 1e-3);
    LeveledScene::Asset& asset = levels_.assets[0];
    asset.tree = tree_;
    asset.visible = seen ? visible_ : nullptr;
    asset.visible_there = seen ? visible_there_.data() : nullptr;
    const std::size_t views = views_.cameras.size();
    std::vector<CutSets> cuts(n);
    std::vector<GaussianSet> sets{arrays_.set()};
    std::vector<std::vector<std::uint32_t>> lists(n);
    std::vector<View<const std::uint32_t>> bits(n);
    std::vector<BatchCamera> batch;
    std::uint64_t drawn = 0;
    for (std::size_t c = 0; c < n; ++c) {
      batch.push_back({views_.cameras[c % views], {}, {}});
      Camera& camera = batch.back().camera;
      camera.viewmat.translation.x += 0.02 * static_cast<double>(c / views);
      if (draw == LodDraw::lod) {
        cuts[c].select(levels_, {}, camera);
        drawn += cuts[c].cut(0).stats().drawn;
      } else {
        drawn += cloud_.size();
        const auto cell = seen ? visible_->cell_of(camera) : std::nullopt;
        if (cell) bits[c] = visible_->seen_from(*cell, visible_there_.data());
        batch[c].seen = std::span(bits).subspan(c, 1);
      }
    }
    if (draw == LodDraw::lod) {
      sets.clear();
      chunks_.place(cuts);
      for (std::size_t c = 0; c < n; ++c) {
        for (const GaussianSet& set : cuts[c].sets()) {
          // Cameras in one cell share its cut, as in a batch of simulators.
          const auto same = std::ranges::find_if(sets, [&](const GaussianSet& other) {
            return other.gaussians.shape.means.data[0] == set.gaussians.shape.means.data[0] &&
                   other.selection.drawn_chunks.data == set.selection.drawn_chunks.data;
          });
          lists[c].push_back(static_cast<std::uint32_t>(same - sets.begin()));
          if (same == sets.end()) sets.push_back(set);
        }
        batch[c].sets = lists[c];
      }
    }
    CudaBatchRenderer& renderer = renderer_;
    memory_.resize_discard(5 * n * pixels_);
    BatchImages images, depths, both;
    images.floats.rgb = both.floats.rgb = memory_.data();
    depths.floats.median_depth = both.floats.median_depth = memory_.data() + 3 * n * pixels_;
    both.floats.alpha = memory_.data() + 4 * n * pixels_;
    // The least of nine calls, milliseconds per frame. The call before them may end early, to make its
    // arrays larger.
    const auto time = [&](const BatchImages& into) {
      double least = 1e9;
      for (int repeat = -1; repeat < 9; ++repeat) {
        const double us = time_.us([&] {
          if (draw == LodDraw::lod) chunks_.place(cuts);
          renderer.render(sets, batch, into).throw_if_error();
        });
        renderer.finish().throw_if_error();
        if (repeat >= 0) least = std::min(least, us);
      }
      return least * 1e-3 / static_cast<double>(n);
    };
    const double rgbd_ms = time(both), rgb_ms = time(images);
    const double pairs =
        static_cast<double>(renderer.stats().tile_intersections) / static_cast<double>(n);
    out.set_other_times(rgbd_ms, time(depths));
    std::vector<float> rgb(3 * pixels_), depth(pixels_);
    for (std::size_t c = 0; c < views; ++c) {
      cuda_.copy(rgb.data(), images.floats.rgb + 3 * c * pixels_, rgb.size() * sizeof(float),
                 CopyKind::device_to_host);
      cuda_.copy(depth.data(), depths.floats.median_depth + c * pixels_, depth.size() * sizeof(float),
                 CopyKind::device_to_host);
      cuda_.synchronize().throw_if_error();
      out.add(rgb, depth, rgb_ms, static_cast<double>(drawn) / static_cast<double>(n), pairs);
    }
    out.print(name, pixels);
  }

 private:
  static RenderConfig fast() {
    RenderConfig config;
    config.quality = Quality::fast();
    return config;
  }
  double draw_once(LodDraw draw, const Camera& camera, const BatchImages& images, double& pairs) {
    const BatchCamera view{camera, {}, {}};
    const GaussianSet own = arrays_.set();
    GaussianSet photo = LodCut::photo_set(cloud_, levels_.choice);
    photo.gaussians = own.gaussians;
    std::span<const GaussianSet> sets(draw == LodDraw::direct || draw == LodDraw::seen ? &own : &photo,
                                      1);
    CudaBatchRenderer* const renderer = &renderer_;
    drawn_ = cloud_.size();
    const bool chosen = draw == LodDraw::lod || levels_.assets[0].visible != nullptr;
    if (chosen) sets = cut_.select(levels_, sets, camera);
    if (draw == LodDraw::lod) {
      drawn_ = cut_.cut(0).stats().drawn;
    } else if (chosen) {
      drawn_ -= cut_.unseen();
    }
    const double us = time_.us([&] {
      if (chosen) chunks_.place(std::span(&cut_, 1));
      renderer->render(sets, std::span(&view, 1), images).throw_if_error();
    });
    renderer->finish().throw_if_error();
    pairs = static_cast<double>(renderer->stats().tile_intersections);
    return us * 1e-3;
  }

  CudaBackend& cuda_;
  LodViews& views_;
  std::size_t pixels_;  ///< number of pixels of a view
  const GaussianCloud& cloud_;
  GaussianArrays<CudaBackend> arrays_, merged_;
  CudaBatchRenderer renderer_;
  ChosenChunks<CudaBackend> chunks_;
  const LodTree* tree_;
  const VisibleSets* visible_;
  Buffer<std::uint32_t, CudaBackend> visible_there_;
  Buffer<float, CudaBackend> memory_;
  DeviceTime time_;
  LeveledScene levels_;
  CutSets cut_;
  std::uint64_t drawn_ = 0;
};

}  // namespace

void lod_rows_on_gpu(LodViews& views, std::size_t cameras, const GaussianCloud& cloud,
                     const LodTree& tree, const VisibleSets& visible,
                     const std::vector<double>& pixels) {
  if (CudaBackend::device_count() == 0) {
    std::printf("no GPU\n");
    return;
  }
  CudaBackend cuda;
  std::printf("\n%s; \"visible\" counts rows that are read, ms is device time\n",
              cuda.device_name().c_str());
  LodRow::print_head();
  GpuRows rows(cuda, views, cloud, tree, visible);
  views.direct.clear();
  rows.row("direct fast", LodDraw::direct, 0);
  rows.row("photo filter", LodDraw::photo, 0);
  for (const double p : pixels) rows.row("lod", LodDraw::lod, p);
  rows.row("fast, seen", LodDraw::seen, 0, true);
  for (const double p : pixels) rows.row("lod, seen", LodDraw::lod, p, true);
  cameras = std::max(cameras, views.cameras.size());
  std::printf("%zu cameras in one call\n", cameras);
  rows.batch_row(cameras, "direct fast", LodDraw::direct, 0);
  for (const double p : pixels) rows.batch_row(cameras, "lod", LodDraw::lod, p);
  rows.batch_row(cameras, "fast, seen", LodDraw::seen, 0, true);
  for (const double p : pixels) rows.batch_row(cameras, "lod, seen", LodDraw::lod, p, true);
}

}  // namespace gsnav_bench
