// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <limits>
#include <string>
#include <vector>

#include "batch_state.cuh"

// Limits of a batch: supported frames, and cameras per call.

namespace gsnav {

namespace {

constexpr std::uint64_t kMostPlaces = std::numeric_limits<std::uint32_t>::max();

Status supports_set(const RenderConfig& config, const GaussianSet& set) {
  if (set.color_space == config.blend_space) return {};
  return {Errc::unsupported, "color_space is not RenderConfig.blend_space"};
}

Status supports_meshes(const RenderConfig& config, const MeshFrame& meshes) {
  const auto refused = [](const char* why) {
    return Status(Errc::unsupported, std::string("meshes: ") + why);
  };
  if (meshes.instances.empty()) return {};
  if (config.response != Response::ewa) return refused("RenderConfig.response must be Response::ewa");
  if (config.compat != Compat::none) return refused("RenderConfig.compat must be Compat::none");
  if (any_seen_through(meshes.instances))
    return refused("some are seen through (MeshAlpha::blend): draw them one camera at a time");
  return {};
}

/// Checks the sets that a camera lists and its visibility bits for them. The sets are already validated.
Status check_lists(std::span<const GaussianSet> sets, const BatchCamera& camera) {
  for (const std::uint32_t s : camera.sets) {
    if (s < sets.size()) continue;
    return {Errc::invalid_argument, "sets has " + std::to_string(s) + ", but there are " +
                                        std::to_string(sets.size()) + " sets"};
  }
  const std::size_t listed = camera.sets.empty() ? sets.size() : camera.sets.size();
  if (!camera.seen.empty() && camera.seen.size() != listed) {
    return {Errc::invalid_argument, "seen has " + std::to_string(camera.seen.size()) + " entries for " +
                                        std::to_string(listed) + " sets"};
  }
  std::uint64_t gaussians = 0;
  for (std::size_t i = 0; i < listed; ++i) {
    const GaussianRows& g = sets[camera.sets.empty() ? i : camera.sets[i]].gaussians;
    gaussians += g.size();
    const std::size_t words = camera.seen.empty() ? 0 : camera.seen[i].size;
    if (words == 0 || seen_may_have(words, g.chunk_count())) continue;
    return {Errc::invalid_argument, "seen[" + std::to_string(i) + "] has " + std::to_string(words) +
                                        " words for " + std::to_string(g.chunk_count()) + " chunks"};
  }
  if (gaussians > kMostPlaces) return {Errc::unsupported, "it sees more than 2^32 Gaussians"};
  return {};
}

}  // namespace

namespace cuda {

Status check_batch(std::span<const GaussianSet> sets, std::span<const BatchCamera> cameras,
                   const RenderConfig& config) {
  if (cameras.empty()) return {Errc::invalid_argument, "CudaBatchRenderer: no camera to render from"};
  if (cameras.size() > kMostCameras) {
    return {Errc::unsupported,
            "CudaBatchRenderer: " + std::to_string(cameras.size()) + " cameras: at most 65535 per call"};
  }
  const auto in = [](const char* list, std::size_t i, const Status& s) {
    return s ? s
             : Status(s.code(), std::string("CudaBatchRenderer: ") + list + "[" + std::to_string(i) +
                                    "]: " + s.message());
  };
  for (std::size_t i = 0; i < sets.size(); ++i) {
    if (Status s = in("sets", i, validate(sets[i])); !s) return s;
    if (Status s = in("sets", i, supports_set(config, sets[i])); !s) return s;
  }
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    const Camera& camera = cameras[c].camera;
    if (Status s = in("cameras", c, validate(camera)); !s) return s;
    if (config.composite == Composite::hard_depth &&
        cameras[c].meshes.instances.empty() != cameras[0].meshes.instances.empty()) {
      return in("cameras", c,
                {Errc::unsupported, "with Composite::hard_depth, all cameras have meshes or none has"});
    }
    if (camera.width != cameras[0].camera.width || camera.height != cameras[0].camera.height) {
      return in("cameras", c,
                {Errc::invalid_argument, "its size is not that of cameras[0]; a batch has one size"});
    }
    if (Status s = in("cameras", c, supports_meshes(config, cameras[c].meshes)); !s) return s;
    if (Status s = in("cameras", c, check_lists(sets, cameras[c])); !s) return s;
  }
  return {};
}

}  // namespace cuda

Status CudaBatchRenderer::supports(const RenderConfig& config, std::span<const GaussianSet> sets,
                                   const MeshFrame& meshes) {
  std::uint64_t gaussians = 0;
  for (const GaussianSet& set : sets) {
    if (Status s = supports_set(config, set); !s) return s;
    gaussians += set.gaussians.size();
  }
  if (gaussians > kMostPlaces) return {Errc::unsupported, "more than 2^32 Gaussians"};
  return supports_meshes(config, meshes);
}

std::size_t CudaBatchRenderer::State::measured_capacity(std::size_t cameras) const {
  if (taken.cameras == 0) return cameras;
  const auto of_each = [this](std::uint64_t n) {  // grown as capacities are
    return (n + n / cuda::policy::Capacity::kGrowth) / taken.cameras + 1;
  };
  std::uint64_t most = kMostPlaces / of_each(std::max(taken.slots, taken.pairs));
  constexpr std::uint64_t kSlotBytes = sizeof(cuda::SplatRecord) + sizeof(cuda::SplatEntry) +
                                       sizeof(SplatDepth<float>) + sizeof(std::uint32_t);
  constexpr std::uint64_t kPairBytes =
      3 * sizeof(cuda::Pair);  // Space for twice the mean, and once more.
  const std::uint64_t bytes = of_each(taken.slots * kSlotBytes + taken.pairs * kPairBytes);
  if (bytes * cameras > stats.scratch_bytes) {
    std::size_t free = 0, all = 0;
    cuda::need(cudaMemGetInfo(&free, &all), "cudaMemGetInfo");
    most = std::min<std::uint64_t>(most, (free + stats.scratch_bytes) / bytes);
  }
  return static_cast<std::size_t>(most);
}

std::size_t CudaBatchRenderer::capacity(std::span<const GaussianSet> sets,
                                        std::span<const BatchCamera> cameras) const {
  if (cameras.empty()) return 0;
  const Camera& camera = cameras[0].camera;
  const std::size_t tiles =
      TileGrid::of(camera.width, camera.height, cuda::policy::Batch::kTile).count();
  const std::size_t most = std::min({cameras.size(), cuda::kMostCameras, cuda::kMostTiles / tiles,
                                     state_->measured_capacity(cameras.size())});
  std::vector<std::uint32_t> instances(sets.size());
  std::uint64_t items = 0;
  std::size_t count = 0;
  for (; count < most && items <= cuda::kMostItems; ++count) {
    cuda::for_each_set(cameras[count], sets.size(), [&](std::uint32_t s) {
      if (s < sets.size() && instances[s]++ % 32 == 0)
        items += std::uint64_t{sets[s].drawn_chunk_count()} * kPartsPerChunk;
    });
  }
  return std::max<std::size_t>(1, items <= cuda::kMostItems ? count : count - 1);
}

}  // namespace gsnav
