// SPDX-License-Identifier: Apache-2.0
// Share of the Gaussians in view, and of their chunks, that contribute to an image, which is an upper
// bound on the work that visible sets can save. A Gaussian contributes if it takes part of some pixel's
// light (alpha times transmittance) in a 256x256 image. It also prints how much culling saves, as the
// number of rows that are read for each Gaussian that reaches a tile (count_culled).
//
//   GSNAV_BENCH_SCENE=scene.ply GSNAV_BENCH_CAMERAS=cameras.json bench_hidden [views]
//
// Without the variables, the scene is the embedded flat from its four viewpoints. The default is 16
// views.
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <span>
#include <string>
#include <vector>

#include "frame_stages.hpp"
#include "gsnav/backends/openmp.hpp"
#include "gsnav/detail/render/count_culled.hpp"
#include "workload.hpp"

using namespace gsnav;
using namespace gsnav_bench;

namespace {

constexpr int kSide = 256;
constexpr float kParts[] = {1e-4f, 1e-3f, 1.0f / 255};

/// Counts of one view, or sums over all views.
struct Shares {
  CullCounts culled;
  double visible = 0, chunks = 0;            ///< in view
  double seen[3] = {}, seen_chunks[3] = {};  ///< contribute more than kParts of a pixel's light

  void add(const Shares& other) {
    culled.rows += other.culled.rows;
    culled.touched += other.culled.touched;
    culled.emitting += other.culled.emitting;
    visible += other.visible;
    chunks += other.chunks;
    for (int k = 0; k < 3; ++k) {
      seen[k] += other.seen[k];
      seen_chunks[k] += other.seen_chunks[k];
    }
  }
};

Shares shares_of(OpenMPBackend& backend, const GaussianCloud& cloud, const Camera& camera) {
  RenderConfig config;
  config.tuning.tile_size = 16;
  config.outputs = kAlpha;
  const FrameStages<float, OpenMPBackend> stages(backend, cloud, camera, config);
  const BinArgs<float>& bins = stages.bins();
  const BlendRules<float> rules = blend_rules<float>(config);
  std::vector<BlendState<float, DepthMode::none>> pixels(std::size_t{kSide} * kSide);
  std::vector<float> most_of_chunk(cloud.chunk_bounds.size(), -1.0f);
  Shares out;
  const GaussianSet set = cloud.set();
  out.culled = count_culled(backend, std::span(&set, 1), camera, config);
  for (std::size_t i = 0; i < bins.order.size; ++i) {
    const std::uint32_t slot = bins.order[i];  // a chunk has one slot for each of its rows
    const SplatBounds& b = bins.bounds[slot];
    const SplatRecords<float> splat{&bins.geometry[slot], nullptr, nullptr, nullptr};
    float most = 0;
    for (int y = b.y0; y < b.y1; ++y) {
      for (int x = b.x0; x < b.x1; ++x) {
        BlendState<float, DepthMode::none>& pixel = pixels[static_cast<std::size_t>(y * kSide + x)];
        const float before = pixel.transmittance;
        blend_splat<false, DepthMode::none, Exp2::degree5, false>(
            pixel, rules, splat, static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f);
        most = std::max(most, before - pixel.transmittance);
      }
    }
    ++out.visible;
    for (int k = 0; k < 3; ++k) out.seen[k] += most > kParts[k] ? 1 : 0;
    float& of_chunk = most_of_chunk[slot / kProjectChunk];
    of_chunk = std::max(of_chunk, most);
  }
  for (const float most : most_of_chunk) {
    out.chunks += most >= 0 ? 1 : 0;
    for (int k = 0; k < 3; ++k) out.seen_chunks[k] += most > kParts[k] ? 1 : 0;
  }
  return out;
}

void print(const char* name, const Shares& s) {
  std::printf("%-5s %9.0f", name, s.visible);
  for (const double seen : s.seen) std::printf("  %6.1f", 100 * seen / std::max(s.visible, 1.0));
  std::printf(" %9.0f", s.chunks);
  for (const double seen : s.seen_chunks) std::printf("  %6.1f", 100 * seen / std::max(s.chunks, 1.0));
  std::printf("  %7.3f\n", s.culled.touched_per_emitting());
}

}  // namespace

int main(int argc, char** argv) {
  const GaussianCloud& cloud = workload().cloud;
  const std::vector<Camera> cameras = sized(kSide, kSide);
  const std::size_t views = static_cast<std::size_t>(std::max(argc > 1 ? std::atoi(argv[1]) : 16, 1));
  const std::size_t step = std::max<std::size_t>(cameras.size() / views, 1);
  std::printf("%zu Gaussians; %% with more than 1e-4, 1e-3, 1/255 of a pixel's light\n", cloud.size());
  std::printf("view    visible    1e-4    1e-3   1/255    chunks    1e-4    1e-3   1/255  touched\n");
  OpenMPBackend backend;
  Shares all;
  for (std::size_t c = 0; c < cameras.size(); c += step) {
    const Shares s = shares_of(backend, cloud, cameras[c]);
    print(std::to_string(c).c_str(), s);
    all.add(s);
  }
  print("all", all);
}
