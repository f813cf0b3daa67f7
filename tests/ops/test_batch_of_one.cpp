// SPDX-License-Identifier: Apache-2.0
// BasicRenderer on a backend with a renderer of batches: which frames go to it, in how many calls, and
// the serial backend's bits for all.
#include <doctest/doctest.h>

#include <limits>
#include <string>
#include <vector>

#include "ops/batch_of_toys.hpp"
#include "ops/mesh_images.hpp"
#include "support/frame_images.hpp"
#include "support/scenes.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

using Batching = BasicRenderer<float, BatchingBackend>;

void check_equal(const Frames<float>& a, const Frames<float>& b) {
  for_each_image(a, b, [](const auto& x, const auto& y) { CHECK(x == y); });
}

/// A cloud and a wall, here and in the memory of a backend.
struct Scene {
  GaussianCloud cloud = random_cloud(3, {.count = 700, .scale = 0.1});
  OneMesh wall{random_triangles(5, 40)};
  BatchingBackend backend;
  GaussianArrays<BatchingBackend> arrays{backend, cloud};
  MeshArrays<BatchingBackend> mesh{backend, wall.instances[0].mesh};
  std::vector<MeshInstance> there{mesh.instance({}, 0)};
  std::vector<Camera> cameras;

  explicit Scene(int count) {
    for (int c = 0; c < count; ++c) {
      cameras.push_back(mesh_lens(41, 29, 30));
      cameras.back().viewmat.translation.x = 0.05 * c;
    }
    batch_calls = 0;
    most_drawn = 0;
  }
  Frames<float> serial(const std::vector<GaussianSet>& sets, bool with_mesh = false) const {
    SerialBackend on;
    BasicRenderer<float, SerialBackend> renderer(on);
    if (with_mesh) renderer.set_meshes(wall.instances);
    return renderer.render(sets, cameras).value();
  }
};

}  // namespace

TEST_CASE("one camera is a batch of one; what no batch supports is drawn by the stages") {
  Scene s(1);
  Batching renderer(s.backend);
  const std::vector<GaussianSet> sets{s.arrays.set()};
  const Frames<float> plain = renderer.render(sets, s.cameras).value();
  check_equal(plain, s.serial({s.cloud.set()}));
  CHECK(batch_calls == 1);
  CHECK(plain.stats[0].gaussians == s.cloud.size());
  CHECK(plain.stats[0].visible == 0);

  renderer.set_meshes(s.there);
  const Frames<float> among = renderer.render(sets, s.cameras).value();
  check_equal(among, s.serial({s.cloud.set()}, true));
  CHECK(batch_calls == 1);
  CHECK(among.stats[0].visible > 0);
  CHECK(among.stats[0].meshes.drawn > 0);

  Batching moved = std::move(renderer);
  renderer.set_meshes({});
  check_equal(renderer.render(sets, s.cameras).value(), plain);
  check_equal(moved.render(sets, s.cameras).value(), among);
  CHECK(batch_calls == 2);
}

TEST_CASE("a set that a frame has twice is drawn twice in a batch") {
  Scene s(3);
  Batching renderer(s.backend);
  const GaussianSet set = s.arrays.set(), here = s.cloud.set();
  const Frames<float> twice = renderer.render(std::vector{set, set}, s.cameras).value();
  check_equal(twice, s.serial({here, here}));
  CHECK(twice.alpha != renderer.render(std::vector{set}, s.cameras).value().alpha);
  CHECK(most_sets >= 2);
}

TEST_CASE("frames of both kinds in one call, with images on either side") {
  Scene s(3);
  const std::vector<GaussianSet> sets{s.arrays.set()};
  const Frames<float> plain = s.serial({s.cloud.set()}), among = s.serial({s.cloud.set()}, true);
  const std::size_t pixels = plain.width * plain.height;
  const RenderConfig config;
  for (const bool there : {false, true}) {
    batch_calls = 0;
    Batching renderer(s.backend);
    Frames<float> frames;
    Batching::size_frames(s.cameras, config.outputs, frames).throw_if_error();
    Buffer<float, BatchingBackend> memory(s.backend);
    memory.resize_discard(5 * pixels * 3);
    std::vector<FrameJob<float>> jobs;
    for (std::size_t c = 0; c < 3; ++c) {
      FrameImages<float> to = Batching::images_of(frames, c);
      if (there) to = images_in(memory.data() + 5 * pixels * c, to, pixels);
      jobs.push_back({sets, &s.cameras[c], &config, to, {}});
    }
    jobs[1].meshes.instances = s.there;
    std::vector<RenderStats> stats(3);
    int waits = 0;
    const auto idle = [&] { ++waits; };
    const Status drawn =
        there ? renderer.render_on_backend(jobs, stats, idle) : renderer.render(jobs, stats, idle);
    REQUIRE_MESSAGE(drawn.ok(), drawn.message());
    CHECK(batch_calls == 1);
    CHECK(most_drawn == 2);
    CHECK(waits == 1);
    for (std::size_t c = 0; c < 3; ++c) {
      const Frames<float>& want = c == 1 ? among : plain;
      CHECK(std::equal(jobs[c].images.rgb, jobs[c].images.rgb + 3 * pixels,
                       want.rgb.data() + 3 * pixels * c));
      CHECK(std::equal(jobs[c].images.alpha, jobs[c].images.alpha + pixels,
                       want.alpha.data() + pixels * c));
      CHECK((stats[c].visible > 0) == (c == 1));
    }
  }
}

TEST_CASE("a call whose cameras memory does not suffice for is drawn in parts") {
  Scene s(7);
  const std::vector<GaussianSet> sets{s.arrays.set()};
  const Frames<float> want = s.serial({s.cloud.set()});
  for (const std::size_t room : {std::size_t{7}, std::size_t{4}, std::size_t{1}}) {
    memory_for = room;
    most_drawn = 0;
    Batching renderer(s.backend);
    check_equal(renderer.render(sets, s.cameras).value(), want);
    CHECK(batch_renderers == 1);
  }
  memory_for = 0;
  {
    Batching renderer(s.backend);
    const Status refused = renderer.render(sets, s.cameras).status();
    CHECK(refused.code() == Errc::out_of_memory);
    CHECK(refused.message().find("7 frames of 41 x 29 with " + std::to_string(s.cloud.size())) !=
          std::string::npos);
    memory_for = ~std::size_t{0};
    check_equal(renderer.render(sets, s.cameras).value(), want);
  }
  CHECK(batch_renderers == 0);
}

TEST_CASE("the memory of kinds of frames that are no longer drawn is freed") {
  Scene s(1);
  const std::vector<GaussianSet> sets{s.arrays.set()};
  Batching renderer(s.backend);
  for (int i = 0; i < 100; ++i) {
    RenderConfig config;
    config.background.x = 0.01 * i;
    renderer.set_config(config);
    CHECK(renderer.render(sets, s.cameras).ok());
    CHECK(batch_renderers <= 16);
  }
  for (int i = 0; i < 16; ++i) CHECK(renderer.render(sets, s.cameras).ok());
  CHECK(batch_renderers == 1);
}

TEST_CASE("bad frames get the errors of the stages, and no batch") {
  Scene s(1);
  SerialBackend serial;
  BasicRenderer<float, SerialBackend> here(serial);
  Batching there(s.backend);
  GaussianSet bad = s.arrays.set(), bad_here = s.cloud.set();
  bad.gaussians.shape.opacities.size -= 1;
  bad_here.gaussians.shape.opacities.size -= 1;
  const Status expected = here.render(bad_here, s.cameras[0]).status();
  CHECK(expected.code() == Errc::invalid_argument);
  CHECK(there.render(bad, s.cameras[0]).status().message() == expected.message());

  RenderConfig config;
  config.background.y = std::numeric_limits<double>::quiet_NaN();
  here.set_config(config);
  there.set_config(config);
  const Status of_config = here.render(s.cloud.set(), s.cameras[0]).status();
  CHECK(of_config.code() == Errc::invalid_argument);
  CHECK(there.render(s.arrays.set(), s.cameras[0]).status().message() == of_config.message());
  CHECK(batch_calls == 0);
}
