// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "gsnav/core/stages.hpp"
#include "gsnav/detail/scene/spatial_order.hpp"
#include "ops/backends.hpp"
#include "ops/mesh_images.hpp"
#include "support/scenes.hpp"

// Backends that have a form of their own of one stage and nothing else. Each form is the generic one on
// the host, so that every image must have the serial backend's bits: what may go wrong is how stages of
// two origins fit together.

namespace {

using namespace gsnav;
using namespace gsnav_test;

/// Its generic forms are those of SerialBackend, which are compiled once for all tests.
struct HostLoop : SerialBackend {
  int calls = 0;
};

/// Has the stage Own for whatever arguments its generic form takes.
template <class Own>
struct WithStage : HostLoop {
  template <class... Args>
  void run(Own, const Args&... args) requires requires(SerialBackend& serial) {
    Own::generic(serial, args...);
  }
  {
    SerialBackend serial;
    ++calls;
    Own::generic(serial, args...);
  }
};

/// Has both forms of stage::Project.
struct WithChunks : HostLoop {
  void run(stage::Project, const ViewedSet<float>& args, const ProjectOutputs<float>& out) {
    ++calls;
    for (std::size_t c = 0; c < args.chunk_count(); ++c) ProjectChunk<float>{args, out}(c);
  }
  void run(stage::Project, const ViewedSet<float>& args, const ProjectOutputs<float>& out,
           View<const std::uint32_t> chunks) {
    ++calls;
    for (std::size_t i = 0; i < chunks.size; ++i) ProjectChunk<float>{args, out}(chunks[i]);
  }
};
static_assert(ProjectsChunks<WithChunks, float> && !SlicingBackend<WithChunks, float>);

constexpr int kWidth = 61, kHeight = 45;

/// Every image of a frame, one behind the other.
template <class B>
std::vector<float> images_of(B& backend, const GaussianSet& set, const MeshFrame& meshes, int slices) {
  const std::size_t pixels = kWidth * kHeight;
  std::vector<float> values(8 * pixels);
  FrameImages<float> images{values.data(),
                            values.data() + 3 * pixels,
                            values.data() + 4 * pixels,
                            values.data() + 5 * pixels,
                            values.data() + 6 * pixels,
                            values.data() + 7 * pixels};
  RenderConfig config;
  config.tuning.depth_slices = slices;
  RenderWorkspace<float, B> ws(backend);
  const Camera camera = mesh_lens(kWidth, kHeight, 50);
  const Status drawn =
      draw_frame<float>(backend, ws, std::span(&set, 1), meshes, camera, config, images);
  REQUIRE_MESSAGE(drawn.ok(), drawn.message());
  return values;
}

template <class B>
void check_backend(bool used_without_mesh, bool used_with_mesh) {
  // In chunks at different depths, and dense: a backend that draws in slices leaves cells closed.
  GaussianCloud cloud = random_cloud(31, {.count = 6000, .scale = 0.15, .extent = 2.5});
  sort_spatially(cloud);
  const GaussianSet set = cloud.set();
  const OneMesh mesh(random_triangles(5, 40));
  SerialBackend serial;
  for (const bool with_mesh : {false, true}) {
    CAPTURE(with_mesh);
    const MeshFrame meshes{with_mesh ? std::span<const MeshInstance>(mesh.instances)
                                     : std::span<const MeshInstance>()};
    const std::vector<float> reference = images_of(serial, set, meshes, 1);
    for (const int slices : {1, 4}) {
      CAPTURE(slices);
      B backend;
      CHECK(images_of(backend, set, meshes, slices) == reference);
      CHECK((backend.calls > 0) == (with_mesh ? used_with_mesh : used_without_mesh));
    }
  }
}

TEST_CASE("a backend with one stage of its own draws the serial backend's bits, in slices or not") {
  SUBCASE("Project") { check_backend<WithStage<stage::Project>>(true, true); }
  SUBCASE("Project, with the form for some chunks") { check_backend<WithChunks>(true, true); }
  SUBCASE("CountTiles") { check_backend<WithStage<stage::CountTiles>>(true, true); }
  SUBCASE("ScatterTiles") { check_backend<WithStage<stage::ScatterTiles>>(true, true); }
  SUBCASE("Blend") { check_backend<WithStage<stage::Blend>>(true, false); }
  SUBCASE("BlendWithMeshes") { check_backend<WithStage<stage::BlendWithMeshes>>(false, true); }
}

}  // namespace
