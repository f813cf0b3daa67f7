// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <vector>

#include "gsnav/detail/core/host_threads.hpp"
#include "gsnav/detail/sim/scene_levels.hpp"
#include "gsnav/scene/basic_renderer.hpp"
#include "gsnav/sim/config.hpp"

namespace gsnav {

/// One image to render: camera, sets, meshes, rules and output.
struct ImageRequest : FrameJob<float> {
  const LeveledScene* levels = nullptr;  ///< Levels of detail and visible sets of the assets, which are
                                         ///< the first of `sets`. Null: draw everything.
  std::span<const BodyLevels> bodies{};  ///< Levels of detail of the avatars, which are the last of
                                         ///< `sets`.
};

/// Renders independent images by BasicRenderer. It selects the visible part of the assets for each.
template <Backend B>
class ImageRenderer {
 public:
  explicit ImageRenderer(B& backend) : backend_(&backend), renderer_(backend), chosen_(backend) {}

  /// Renders all requests into images in `memory`. Replaces the sets and rules in the requests by those
  /// that were drawn; they are valid until the next call. Throws gsnav::Error (out_of_memory).
  /// @param idle Called before each wait for a batch (BasicRenderer::render).
  /// @return an error of rendering.
  Status render(std::span<ImageRequest> requests, ImageMemory memory,
                const std::function<void()>& idle = {}) {
    choose_levels(requests);
    jobs_.assign(requests.begin(), requests.end());
    stats_.assign(jobs_.size(), {});
    return memory == ImageMemory::backend ? renderer_.render_on_backend(jobs_, stats_, idle)
                                          : renderer_.render(jobs_, stats_, idle);
  }

  /// Renders one request into `out`, which is resized. `request.config->outputs` selects the images;
  /// `request.images` is ignored.
  Status render(ImageRequest request, Frames<float>& out) {
    choose_levels(std::span(&request, 1));
    renderer_.set_config(*request.config);
    renderer_.set_meshes(request.meshes.instances, request.meshes.light);
    return renderer_.render(request.sets, std::span(request.camera, 1), out);
  }

  /// Statistics of each request of the last call. FrameBatch says what is counted in batches.
  std::span<const RenderStats> stats() const noexcept { return stats_; }

 private:
  void choose_levels(std::span<ImageRequest> requests) {
    leveled_.clear();
    for (ImageRequest& r : requests) {
      if (r.levels != nullptr) leveled_.push_back(&r);
    }
    while (cuts_.size() < leveled_.size()) cuts_.emplace_back();
    for_each_on_host(*backend_, leveled_.size(), [this](std::size_t i) {
      ImageRequest& r = *leveled_[i];
      r.sets = cuts_[i].select(*r.levels, r.sets, *r.camera, r.bodies);
      r.config = &cuts_[i].rules(*r.config);
    });
    chosen_.place(std::span(cuts_).first(leveled_.size()));
  }
  B* backend_;
  BasicRenderer<float, B> renderer_;
  ChosenChunks<B> chosen_;
  std::vector<CutSets> cuts_;  // One per element of leveled_.
  std::vector<ImageRequest*> leveled_;
  std::vector<FrameJob<float>> jobs_;
  std::vector<RenderStats> stats_;
};

}  // namespace gsnav
