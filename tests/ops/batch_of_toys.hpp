// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

#include "gsnav/detail/render/frame_batch.hpp"
#include "ops/backends.hpp"

// A backend with a memory of its own and a renderer of batches, as a GPU has, on the host.

namespace gsnav_test {

using namespace gsnav;

inline int batch_calls = 0;
inline std::size_t most_sets = 0, most_drawn = 0;   // sets and cameras of a call
inline std::size_t most_cameras = ~std::size_t{0};  // that one accepts
inline std::size_t memory_for = ~std::size_t{0};    // cameras that scratch of a call suffices for
inline int batch_renderers = 0;                     // that exist

/// One camera after the other, as CudaBatchRenderer is asked for batches of them.
class BatchOfToys {
 public:
  struct camera_type {
    Camera camera;
    std::span<const std::uint32_t> sets;
    MeshFrame meshes;
    std::span<const View<const std::uint32_t>> seen{};
  };
  struct images_type {
    FrameImages<float> floats;
  };
  static Status supports(const RenderConfig&, std::span<const GaussianSet>, const MeshFrame& meshes) {
    if (most_cameras == 0) return {Errc::unsupported, "nothing"};
    return meshes.instances.empty() ? Status() : Status(Errc::unsupported, "no meshes");
  }
  std::size_t capacity(std::span<const GaussianSet>, std::span<const camera_type> cameras) const {
    return std::min(most_cameras, cameras.size());
  }
  explicit BatchOfToys(ToyBackend& backend, const RenderConfig& config)
      : backend_(&backend), workspace_(backend), config_(config) {
    ++batch_renderers;
  }
  ~BatchOfToys() { --batch_renderers; }
  BatchOfToys(const BatchOfToys&) = delete;
  BatchOfToys& operator=(const BatchOfToys&) = delete;
  Status render(std::span<const GaussianSet> sets, std::span<const camera_type> cameras,
                const images_type& images) {
    ++batch_calls;
    most_sets = std::max(most_sets, sets.size());
    most_drawn = std::max(most_drawn, cameras.size());
    if (cameras.size() > most_cameras) return {Errc::unsupported, "draw fewer cameras a call"};
    if (cameras.size() > memory_for) gsnav::detail::fail(Errc::out_of_memory, "no room for cameras");
    for (const camera_type& c : cameras) {
      if (!c.meshes.instances.empty()) return {Errc::unsupported, "no meshes"};
    }
    for (std::size_t c = 0; c < cameras.size(); ++c) {
      const Camera& camera = cameras[c].camera;
      std::vector<GaussianSet> seen;
      for (const std::uint32_t s : cameras[c].sets) seen.push_back(sets[s]);
      for (std::size_t s = 0; s < cameras[c].seen.size(); ++s)
        seen[s].selection.seen = cameras[c].seen[s];
      const std::size_t pixels =
          static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
      FrameImages<float> to = images.floats;
      if (to.rgb != nullptr) to.rgb += 3 * c * pixels;
      if (to.alpha != nullptr) to.alpha += c * pixels;
      if (to.median_depth != nullptr) to.median_depth += c * pixels;
      if (Status s = render_camera<float>(*backend_, workspace_, seen, camera, config_, to); !s)
        return s;
    }
    return {};
  }
  Status finish() { return {}; }

 private:
  ToyBackend* backend_;
  RenderWorkspace<float, ToyBackend> workspace_;
  RenderConfig config_;
};

class BatchingBackend : public ToyBackend {
 public:
  using batch_renderer = BatchOfToys;
};
static_assert(BatchBackend<BatchingBackend>);

}  // namespace gsnav_test
