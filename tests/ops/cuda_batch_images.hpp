// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <vector>

#include "gsnav/backends/cuda/batch.hpp"
#include "ops/backends.hpp"
#include "ops/no_gpu.hpp"
#include "ops/stage_frames.hpp"
#include "support/frame_images.hpp"
#include "support/scenes.hpp"

// Batches of the GPU and the same cameras one at a time.

namespace gsnav_test {

using namespace gsnav;

using Lists = std::vector<std::vector<std::uint32_t>>;

/// More than sixteen a multiprocessor, and than that would be few: of any GPU, or of the emulated one.
inline int many_tiles() { return is_emulated() ? 9 * 16 : 9 * 384; }

/// Images of a batch, fetched. `lists`: the sets of each camera; empty: all. `meshes`: likewise; empty:
/// none. `seen`: of each camera, BatchCamera::seen.
struct Batch {
  Frames<float> frames;
  std::vector<std::uint8_t> rgb8;
  BatchStats stats;
};

inline Batch draw_batch(CudaBackend& cuda, CudaBatchRenderer& renderer,
                        const std::vector<GaussianSet>& sets, const std::vector<Camera>& cameras,
                        const Lists& lists, unsigned outputs, bool bytes = true,
                        const std::vector<MeshFrame>& meshes = {},
                        const std::vector<std::vector<View<const std::uint32_t>>>& seen = {}) {
  Batch out;
  const std::size_t pixels = static_cast<std::size_t>(cameras[0].width) *
                             static_cast<std::size_t>(cameras[0].height) * cameras.size();
  Buffer<float, CudaBackend> images(cuda);
  Buffer<std::uint8_t, CudaBackend> rgb8(cuda);
  images.resize_discard(8 * pixels);
  rgb8.resize_discard(3 * pixels);
  cuda.fill(images.data(), 0xa5, 8 * pixels * sizeof(float));  // what is not written is seen
  cuda.fill(rgb8.data(), 0xa5, 3 * pixels);
  BatchImages to;
  const auto at = [&](unsigned output, std::size_t first) {
    return (outputs & output) != 0 ? images.data() + first * pixels : nullptr;
  };
  to.floats = {at(kRgb, 0),
               at(kAlpha, 3),
               at(kMedianDepth, 4),
               at(kExpectedDepth, 5),
               at(kAccumulatedDepth, 6),
               at(kFirstHitDepth, 7)};
  to.rgb8 = bytes ? rgb8.data() : nullptr;
  std::vector<BatchCamera> batch;
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    batch.push_back({cameras[c], lists.empty() ? std::span<const std::uint32_t>() : std::span(lists[c]),
                     meshes.empty() ? MeshFrame{} : meshes[c],
                     seen.empty() ? std::span<const View<const std::uint32_t>>() : std::span(seen[c])});
  }
  renderer.render(sets, batch, to).throw_if_error();
  renderer.finish().throw_if_error();
  out.stats = renderer.stats();
  const auto fetch = [&](std::vector<float>& image, const float* from, std::size_t channels) {
    if (from == nullptr) return;
    image.resize(channels * pixels);
    cuda.copy(image.data(), from, image.size() * sizeof(float), CopyKind::device_to_host);
  };
  fetch(out.frames.rgb, to.floats.rgb, 3);
  fetch(out.frames.alpha, to.floats.alpha, 1);
  fetch(out.frames.median_depth, to.floats.median_depth, 1);
  fetch(out.frames.expected_depth, to.floats.expected_depth, 1);
  fetch(out.frames.accumulated_depth, to.floats.accumulated_depth, 1);
  fetch(out.frames.first_hit_depth, to.floats.first_hit_depth, 1);
  if (bytes) {
    out.rgb8.resize(3 * pixels);
    rgb8.download(out.rgb8.data(), out.rgb8.size());
  }
  REQUIRE(cuda.synchronize().ok());
  return out;
}

/// Images of the cameras, each drawn alone by the stages of draw_frame.
inline Frames<float> singly(CudaBackend& cuda, const std::vector<GaussianSet>& sets,
                            const std::vector<Camera>& cameras, const Lists& lists, RenderConfig config,
                            unsigned outputs, const std::vector<MeshFrame>& meshes = {}) {
  config.outputs = outputs;
  Frames<float> all;
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    std::vector<GaussianSet> seen;
    if (lists.empty() || lists[c].empty()) seen = sets;
    if (!lists.empty()) {
      for (const std::uint32_t s : lists[c]) seen.push_back(sets[s]);
    }
    const Frames<float> f = draw_by_stages<float>(cuda, seen, std::span(&cameras[c], 1), config,
                                                  meshes.empty() ? MeshFrame{} : meshes[c]);
    for_each_image(all, f, [](std::vector<float>& to, const std::vector<float>& from) {
      to.insert(to.end(), from.begin(), from.end());
    });
  }
  return all;
}

inline std::size_t differing(const std::vector<float>& a, const std::vector<float>& b) {
  if (a.size() != b.size()) return a.size() + b.size() + 1;
  std::size_t n = 0;
  for (std::size_t i = 0; i < a.size(); ++i) n += a[i] == b[i] ? 0u : 1u;
  return n;
}

inline void check_same(const Frames<float>& a, const Frames<float>& b) {
  for_each_image(a, b, [](const auto& x, const auto& y) { CHECK(differing(x, y) == 0); });
}

/// Cameras around the origin that look at the box of `random_cloud`, none like another.
inline std::vector<Camera> ring(int count, int width, int height) {
  std::vector<Camera> cameras;
  Rng rng(99);
  for (int c = 0; c < count; ++c) {
    const Vec3d eye{rng.uniform(-1, 1), rng.uniform(-1, 1), rng.uniform(-0.5, 2.5)};
    Camera camera = Camera::look_at(eye, {0.3 * rng.uniform(-1, 1), 0.1, 4}, {0, -1, 0.1}, width, height,
                                    rng.uniform(60, 110));
    camera.cx += rng.uniform(-9, 9);
    camera.near_sigma = c % 3 == 0 ? 1 : 0;
    cameras.push_back(camera);
  }
  return cameras;
}

/// Gaussians of random colours, so faint that pixels stay open. place(i, rng) is the mean of Gaussian i,
/// and size(z) the standard deviation of those at depth z.
template <class Size, class Place>
GaussianCloud faint_cloud(int count, const Size& size, const Place& place) {
  GaussianCloudBuilder builder(0);
  Rng rng(5);
  for (int i = 0; i < count; ++i) {
    RawGaussian g;
    g.mean = place(i, rng);
    g.quat = {1, 0, 0, 0};
    for (int k = 0; k < 3; ++k) g.log_scales[k] = std::log(size(g.mean.z));
    g.opacity_logit = -4;
    for (auto& c : g.sh0) c = static_cast<float>(rng.normal());
    builder.add(g);
  }
  return builder.cloud();
}

/// Cameras whose images have more than sixteen tiles a multiprocessor.
inline int many_cameras() { return is_emulated() ? 8 : 60; }

/// Cameras of `count` in a ring, whose images have tiles cut by the edge.
inline std::vector<Camera> ring_of(int count) {
  return is_emulated() ? ring(count, 53, 37) : ring(count, 149, 101);
}

inline constexpr unsigned kMedianOnly = kRgb | kAlpha | kMedianDepth, kAll = kRgb | kAlpha | kAnyDepth;

}  // namespace gsnav_test
