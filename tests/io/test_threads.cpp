// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <string>
#include <vector>

#include "gsnav/core/rng.hpp"
#include "gsnav/io/scene_file.hpp"
#include "row_clouds.hpp"
#include "support/files.hpp"
#include "threads.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

/// What this thread's readers and writers do with so many threads.
template <class F>
auto with_threads(std::size_t threads, const F& f) {
  io::detail::wanted_threads = threads;
  auto out = f();
  io::detail::wanted_threads = 0;
  return out;
}

}  // namespace

TEST_CASE("any number of threads writes the same bytes, SOG among them") {
  TempFolder folder("threads");
  const GaussianCloud cloud = cloud_of(random_rows(5000, 45, 5), 45);
  for (const char* name : {"a.sog", "a.spz", "a.compressed.ply", "a.ply", "a.splat", "a.glb"}) {
    CAPTURE(name);
    const auto bytes = [&] {
      REQUIRE(io::save_scene(folder / name, cloud).ok());
      return read_file(folder / name);
    };
    const std::string one = with_threads(1, bytes);
    CHECK(one.size() > 5000);
    for (const std::size_t threads : {2u, 3u, 16u}) CHECK(with_threads(threads, bytes) == one);
  }
}

TEST_CASE("any number of threads reads the same cloud") {
  TempFolder folder("threads");
  // Enough for four pieces, with rows that are left out on the way.
  GaussianCloudBuilder builder(1);
  Rng rng(6);
  std::vector<float> bands(9);
  for (int n = 0; n < 140000; ++n) {
    RawGaussian g;
    g.mean = {rng.uniform(-300, 300), rng.uniform(-2, 2), rng.uniform(-300, 300)};
    g.quat = {rng.uniform(-1, 1), rng.uniform(-1, 1), rng.uniform(-1, 1), rng.uniform(0.1, 1)};
    g.log_scales = {rng.uniform(-6, 0), rng.uniform(-6, 0), rng.uniform(-6, 0)};
    g.opacity_logit = rng.uniform(-5.54, 9);
    for (float& b : bands) b = static_cast<float>(rng.uniform(-1, 1));
    g.shN = bands.data();
    builder.add(g);
  }
  for (const char* name : {"a.sog", "a.spz", "a.compressed.ply", "a.ply", "a.glb"}) {
    CAPTURE(name);
    REQUIRE(io::save_scene(folder / name, builder.cloud()).ok());
    const auto read = [&] { return io::load_scene((folder / name).string()).value().cloud; };
    const GaussianCloud one = with_threads(1, read);
    for (const std::size_t threads : {2u, 4u}) {
      const GaussianCloud many = with_threads(threads, read);
      CHECK(many.means == one.means);
      CHECK(many.quats == one.quats);
      CHECK(many.scales == one.scales);
      CHECK(many.opacities == one.opacities);
      CHECK(many.sh0 == one.sh0);
      CHECK(many.shN == one.shN);
      CHECK(many.origin_ids == one.origin_ids);
      CHECK(many.row_ids == one.row_ids);
    }
  }
}
