// SPDX-License-Identifier: Apache-2.0
// Shares of light and visible sets on a GPU: those of a processor, to the bit.
#include <doctest/doctest.h>

#if defined(GSNAV_HAS_CUDA)
#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "gsnav/backends/cuda/batch.hpp"
#include "gsnav/backends/openmp.hpp"
#include "gsnav/detail/render/row_weights.hpp"
#include "gsnav/scene/visible_sets.hpp"
#include "lod/two_rooms.hpp"
#include "ops/cuda_batch_images.hpp"
#include "ops/no_gpu.hpp"
#include "support/files.hpp"
#include "support/scenes.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

/// Two rooms in which every 50th row stands in the place of the row before, so that depths are equal.
GaussianCloud rooms_with_equal_depths(int per_side) {
  GaussianCloud cloud = two_rooms(2, per_side);
  for (std::size_t i = 50; i < cloud.size(); i += 50) {
    for (auto& mean : cloud.means) mean[i] = mean[i - 1];
  }
  bound_chunks(cloud);
  return cloud;
}

std::vector<BatchCamera> batch_of(std::span<const Camera> cameras) {
  std::vector<BatchCamera> out;
  for (const Camera& c : cameras) out.push_back({c, {}});
  return out;
}

/// Shares on the GPU, [groups][rows].
std::vector<float> weighed(CudaBackend& cuda, CudaBatchRenderer& renderer, const GaussianSet& set,
                           std::span<const Camera> cameras, std::size_t of_group) {
  const std::vector<float> before(cameras.size() / of_group * set.gaussians.size(), 9.0f);
  Buffer<float, CudaBackend> most(cuda);
  most.upload(before.data(), before.size());
  REQUIRE(renderer.weigh(set, batch_of(cameras), of_group, most.data()).ok());
  REQUIRE(renderer.finish().ok());
  std::vector<float> out(before.size());
  most.download(out.data(), out.size());
  REQUIRE(cuda.synchronize().ok());
  return out;
}

std::vector<float> weighed_on_cpu(const GaussianSet& set, std::span<const Camera> cameras,
                                  std::size_t of_group) {
  OpenMPBackend openmp(2);
  RowWeightsWorkspace<OpenMPBackend> workspace(openmp);
  const std::size_t rows = set.gaussians.size();
  std::vector<float> out(cameras.size() / of_group * rows);
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    const auto to = std::span(out).subspan(c / of_group * rows, rows);
    REQUIRE(add_row_weights(openmp, workspace, set, cameras[c], to).ok());
  }
  return out;
}

}  // namespace

TEST_CASE("cuda weigh: shares of light have the bits of a processor, and those of no earlier call") {
  if (no_gpu("cuda weigh")) return;
  CudaBackend cuda;
  CudaBatchRenderer renderer(cuda, weighing_config());
  const std::vector<Vec3d> eyes = places_in_rooms();
  int reruns = 0;
  const int many = is_emulated() ? 1000 : 4000;
  for (const int per_side : {60, many}) {  // the second call needs more memory than the first
    const GaussianCloud cloud = rooms_with_equal_depths(per_side);
    const GaussianArrays<CudaBackend> arrays(cuda, cloud);
    for (const int face : {22, 70}) {
      std::vector<Camera> cameras;
      for (const std::size_t v : {std::size_t{1}, std::size_t{3}}) {
        for (const Camera& c : detail::cube_cameras(eyes[v], v, face, 0.2, 0)) cameras.push_back(c);
      }
      const auto want = weighed_on_cpu(cloud.set(), cameras, 6);
      const auto got = weighed(cuda, renderer, arrays.set(), cameras, 6);
      reruns += renderer.stats().reruns;
      CHECK(got == want);
      CHECK(std::count_if(want.begin(), want.end(), [](float w) { return w > 1e-3f; }) > 100);
      const auto one = std::span(cameras).subspan(2, 1);
      CHECK(weighed(cuda, renderer, arrays.set(), one, 1) == weighed_on_cpu(cloud.set(), one, 1));
    }
  }
  CHECK(reruns > 0);
}

TEST_CASE("cuda weigh: a renderer draws the same images before and after") {
  if (no_gpu("cuda weigh")) return;
  CudaBackend cuda;
  CudaBatchRenderer renderer(cuda, weighing_config());
  const GaussianCloud cloud = two_rooms(1);
  const GaussianArrays<CudaBackend> arrays(cuda, cloud);
  const std::vector<Vec3d> eyes = places_in_rooms();
  const auto cameras = detail::cube_cameras(eyes[0], 0, 40, 0.2, 0);
  const std::vector<Camera> views(cameras.begin(), cameras.end());
  const auto drawn = [&] {
    return draw_batch(cuda, renderer, {arrays.set()}, views, {}, kRgb, false).frames.rgb;
  };
  const auto before = drawn();
  weighed(cuda, renderer, arrays.set(), cameras, 6);
  CHECK(drawn() == before);
  CHECK(*std::max_element(before.begin(), before.end()) > 0.1f);
}

TEST_CASE("cuda weigh: bad arguments are named") {
  if (no_gpu("cuda weigh")) return;
  CudaBackend cuda;
  const GaussianCloud cloud = two_rooms(1, 20);
  const GaussianArrays<CudaBackend> arrays(cuda, cloud);
  const auto cameras = batch_of(detail::cube_cameras({1, 1, 0}, 0, 16, 0.2, 0));
  Buffer<float, CudaBackend> most(cuda);
  most.resize_discard(6 * cloud.size());
  const auto says = [&](const RenderConfig& config, std::size_t of_group, float* to, const char* text) {
    CudaBatchRenderer renderer(cuda, config);
    const Status s = renderer.weigh(arrays.set(), cameras, of_group, to);
    CHECK(s.code() == Errc::invalid_argument);
    CHECK_MESSAGE(contains(s.message(), text), s.message());
  };
  says(weighing_config(), 4, most.data(), "groups of 4");
  says(weighing_config(), 0, most.data(), "groups of 0");
  says(weighing_config(), 6, nullptr, "most");
  RenderConfig other = weighing_config();
  other.response = Response::ray;
  says(other, 6, most.data(), "response");
}

TEST_CASE("visible sets: found on a GPU, they have the bits of those found on a processor") {
  if (no_gpu("cuda weigh")) return;
  CudaBackend cuda;
  OpenMPBackend openmp(2);
  const GaussianCloud cloud = rooms_with_equal_depths(400);
  const std::vector<Vec3d> eyes = places_in_rooms();
  VisibleSettings settings;
  settings.face = 32;
  const auto same = [&](const Similarity& placed, std::span<const Vec3d> viewpoints) {
    const auto want = build_visible_sets(openmp, cloud, viewpoints, settings, placed).value();
    double last = 0;
    VisibleSettings reported = settings;
    reported.progress = [&last](double share) {
      CHECK(share > last);
      last = share;
    };
    const auto got = build_visible_sets(cuda, cloud, viewpoints, reported, placed).value();
    CHECK(got.keys == want.keys);
    CHECK(got.ends == want.ends);
    CHECK(got.bits == want.bits);
    CHECK(got.refused_share == want.refused_share);
    if (want.refused_share == 0) {
      CHECK(last == 1);
      CHECK(want.mean_row_share(cloud.size()) < 0.9);
    }
    return want.refused_share;
  };
  for (const int rows : {0, 1, 8, 32}) {
    settings.rows = rows;
    CHECK(same({}, std::span(eyes).first(rows == 8 ? 20 : 3)) == 0);  // 20: more than fit into a call
  }
  // A placed asset: twice as large, turned and moved.
  const Similarity placed{Quatd{std::sqrt(0.5), 0, std::sqrt(0.5), 0}, {3, 0.5, -2}, 2};
  std::vector<Vec3d> there;
  for (const Vec3d& eye : eyes) there.push_back(placed * eye);
  same(placed, std::span(there).first(3));
  VisibleSettings stopped = settings;
  stopped.progress = [](double) { throw 5; };
  CHECK_THROWS_AS((void)build_visible_sets(cuda, cloud, eyes, stopped), int);
  const GaussianCloud nothing;
  CHECK(build_visible_sets(cuda, nothing, eyes, settings).value().bits ==
        build_visible_sets(openmp, nothing, eyes, settings).value().bits);
  settings.most_share = 0.2;
  settings.cell = 0.05;  // 64 cells or more
  settings.margin = 0.05;
  CHECK(same({}, std::span(eyes).first(24)) > 0.2);
}
#endif
