// SPDX-License-Identifier: Apache-2.0
// Properties that an image of Gaussians has whatever is in it: random scenes with needles, several
// seeds.
#include <doctest/doctest.h>

#include <algorithm>

#include "hard_cases/arrays.hpp"
#include "hard_cases/cases.hpp"
#include "support/scenes.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

constexpr int kWidth = 64, kHeight = 64;
constexpr std::uint64_t kSeeds[] = {1, 2, 3};

Camera square_camera() {
  Camera c;
  c.set_hfov(kWidth, kHeight, 75);
  c.viewmat.translation = {0.125, -0.25, 0.5};
  return c;
}

/// Half of it needles of 1000 : 1, SH of degree 3.
GaussianCloud scene(std::uint64_t seed) { return random_cloud(seed, {.count = 500, .needle = 0.5}); }

template <class A, class B>
double difference(const std::vector<A>& a, std::size_t i, const std::vector<B>& b, std::size_t k,
                  std::size_t channels) {
  double worst = 0;
  for (std::size_t c = 0; c < channels; ++c) {
    const double d = static_cast<double>(a[channels * i + c]) - static_cast<double>(b[channels * k + c]);
    worst = std::max(worst, std::abs(d));
  }
  return worst;
}

/// Largest difference of colour and alpha where pixel p of a is pixel `other(p)` of b, but for undecided
/// ones.
template <class S, class F>
double largest_difference(const Frames<S>& a, const Frames<S>& b, const std::vector<bool>& undecided,
                          const F& other) {
  double worst = 0;
  for (std::size_t p = 0; p < a.alpha.size(); ++p) {
    if (undecided[p]) continue;
    const std::size_t q = other(p);
    worst = std::max({worst, difference(a.rgb, p, b.rgb, q, 3), difference(a.alpha, p, b.alpha, q, 1)});
  }
  return worst;
}

/// The largest difference of all backends of a precision, and what is allowed.
struct Worst {
  double in_float = 0, in_double = 0;
  template <class R>
  void add(const R&, double d) {
    double& w = R::is_float ? in_float : in_double;
    w = std::max(w, d);
  }
  void check(const std::string& what, double float_bound) const {
    MESSAGE(what << ": float " << in_float << ", double " << in_double);
    CHECK(in_float <= float_bound);
    CHECK(in_double <= 1e-10);
  }
};

}  // namespace

TEST_CASE("property_scale_by_power_of_two") {
  for (const std::uint64_t seed : {1u, 2u}) {
    const GaussianCloud cloud = scene(seed);
    const Camera camera = square_camera();
    for (const double factor : {0x1p-7, 4.0, 0x1p10}) {
      GaussianCloud scaled = cloud;
      for (auto& plane : scaled.means) {
        for (float& v : plane) v *= static_cast<float>(factor);
      }
      for (auto& plane : scaled.scales) {
        for (float& v : plane) v *= static_cast<float>(factor);
      }
      Camera far = camera;
      far.viewmat.translation = camera.viewmat.translation * factor;
      far.near_plane = factor * static_cast<double>(static_cast<float>(camera.near_plane));
      for (const Response response : {Response::ewa, Response::tangent_plane, Response::ray}) {
        RenderConfig config = all_outputs();
        config.response = response;
        for_each_renderer([&](auto& renderer) {
          const auto a = renderer.render({&cloud}, camera, config);
          auto b = renderer.render({&scaled}, far, config);
          for (auto* image :
               {&b.median_depth, &b.expected_depth, &b.accumulated_depth, &b.first_hit_depth}) {
            for (auto& z : *image)
              z /= static_cast<typename std::remove_reference_t<decltype(renderer)>::scalar>(factor);
          }
          CHECK(same_images(a, b));
        });
      }
    }
  }
}

TEST_CASE("property_roll_by_90_degrees") {
  Worst worst;
  for (const std::uint64_t seed : kSeeds) {
    const GaussianCloud cloud = scene(seed);
    const Camera camera = square_camera();
    Camera rolled = camera;  // right becomes down, down becomes left
    rolled.viewmat.linear.row[0] = -camera.viewmat.linear.row[1];
    rolled.viewmat.linear.row[1] = camera.viewmat.linear.row[0];
    rolled.viewmat.translation = {-camera.viewmat.translation.y, camera.viewmat.translation.x,
                                  camera.viewmat.translation.z};
    const auto undecided = undecided_pixels({&cloud}, camera, all_outputs(), 1e-4);
    for_each_renderer([&](auto& renderer) {
      const auto a = renderer.render({&cloud}, camera, all_outputs());
      const auto b = renderer.render({&cloud}, rolled, all_outputs());
      worst.add(renderer, largest_difference(a, b, undecided, [](std::size_t p) {
                  const std::size_t x = p % kWidth, y = p / kWidth;
                  return x * kWidth + (kWidth - 1 - y);
                }));
    });
  }
  worst.check("roll", 2e-6);
}

TEST_CASE("property_horizontal_mirror") {
  // Basis functions odd in x, of bands 1 to 3, change their sign.
  constexpr int kOdd[] = {3, 4, 7, 10, 13, 15};
  Worst worst;
  for (const std::uint64_t seed : kSeeds) {
    const GaussianCloud cloud = scene(seed);
    GaussianCloud mirrored = cloud;
    for (float& x : mirrored.means[0]) x = -x;
    for (const std::size_t k : {2u, 3u}) {
      for (float& v : mirrored.quats[k]) v = -v;
    }
    for (std::size_t i = 0; i < cloud.size(); ++i) {
      for (const int k : kOdd) {
        for (std::size_t c = 0; c < 3; ++c) {
          float& v = mirrored.shN[(15 * i + static_cast<std::size_t>(k - 1)) * 3 + c];
          v = -v;
        }
      }
    }
    const Camera camera = square_camera();
    Camera other = camera;
    other.viewmat.translation.x = -camera.viewmat.translation.x;
    const auto undecided = undecided_pixels({&cloud}, camera, all_outputs(), 1e-4);
    for_each_renderer([&](auto& renderer) {
      const auto a = renderer.render({&cloud}, camera, all_outputs());
      const auto b = renderer.render({&mirrored}, other, all_outputs());
      worst.add(renderer, largest_difference(a, b, undecided, [](std::size_t p) {
                  return p / kWidth * kWidth + (kWidth - 1 - p % kWidth);
                }));
    });
  }
  worst.check("mirror", 2e-6);
}

TEST_CASE("property_split_screen") {
  // A part of the image is the image of a camera whose principal point is shifted. The contract's limits
  // on x/z and y/z in the Jacobian (Response::ewa) are taken from the image's own borders, so that for
  // it this holds only where no limit is met: means that every part has within its limits.
  struct Part {
    int x, y, w, h;
  };
  const Part parts[] = {
      {0, 0, 32, 64}, {32, 0, 32, 64}, {0, 0, 64, 32}, {0, 32, 64, 32}, {16, 8, 25, 31}};
  Worst worst;
  std::size_t same = 0, all = 0;
  for (const std::uint64_t seed : kSeeds) {
    const GaussianCloud wide = scene(seed);
    // Seen within 4 px of the middle, which is 0.15 of half of the narrowest part.
    const GaussianCloud narrow =
        random_cloud(seed, {.count = 300, .needle = 0.5, .center = {-0.125, 0.25, 6}, .extent = 0.35});
    for (const Response response : {Response::ewa, Response::tangent_plane, Response::ray}) {
      const GaussianCloud& cloud = response == Response::ewa ? narrow : wide;
      RenderConfig config = all_outputs();
      config.response = response;
      const Camera camera = square_camera();
      const auto undecided = undecided_pixels({&cloud}, camera, config, 1e-4);
      for_each_renderer([&](auto& renderer) {
        const auto whole = renderer.render({&cloud}, camera, config);
        for (const Part& part : parts) {
          // The last part is for the responses without limits.
          if (response == Response::ewa && part.w == 25) continue;
          Camera c = camera;
          c.width = part.w;
          c.height = part.h;
          c.cx -= part.x;
          c.cy -= part.y;
          const auto f = renderer.render({&cloud}, c, config);
          for (std::size_t p = 0; p < f.alpha.size(); ++p) {
            const std::size_t x =
                p % static_cast<std::size_t>(part.w) + static_cast<std::size_t>(part.x);
            const std::size_t y =
                p / static_cast<std::size_t>(part.w) + static_cast<std::size_t>(part.y);
            const std::size_t q = y * kWidth + x;
            if (undecided[q]) continue;
            const double d = std::max(difference(f.rgb, p, whole.rgb, q, 3),
                                      difference(f.alpha, p, whole.alpha, q, 1));
            worst.add(renderer, d);
            same += d == 0 ? 1 : 0;
            ++all;
          }
        }
      });
    }
  }
  MESSAGE("the same bits in " << 100.0 * static_cast<double>(same) / static_cast<double>(all)
                              << " % of the pixels");
  worst.check("split screen", 2e-6);
}

TEST_CASE("property_opacity_monotonicity") {
  // More opacity of any one Gaussian never makes a pixel clearer. With the stop at T < 1e-4 a pixel that
  // closes one layer earlier may keep up to 1e-4 more of T; without it, not a bit.
  for (const std::uint64_t seed : kSeeds) {
    GaussianCloud cloud = random_cloud(seed, {.count = 150, .needle = 0.3, .scale = 0.2});
    Rng rng(seed);
    for (int round = 0; round < 6; ++round) {
      GaussianCloud more = cloud;
      const std::size_t i = rng.below(cloud.size());
      more.opacities[i] = std::min(1.0f, more.opacities[i] * static_cast<float>(rng.uniform(1.01, 3)));
      for (const double stop : {0.0, 1e-4}) {
        RenderConfig config;
        config.outputs = kAlpha;
        config.quality.transmittance_min = stop;
        for_each_renderer([&](auto& renderer) {
          const auto a = renderer.render({&cloud}, square_camera(), config);
          const auto b = renderer.render({&more}, square_camera(), config);
          double lost = 0;
          for (std::size_t p = 0; p < a.alpha.size(); ++p) {
            lost = std::max(lost, static_cast<double>(a.alpha[p]) - static_cast<double>(b.alpha[p]));
          }
          CHECK(lost <= stop);
        });
      }
    }
  }
}

TEST_CASE("property_occluded_changes_nothing") {
  // Walls that close every pixel, and anything behind them, before or after them in the file.
  std::vector<RawGaussian> walls;
  for (int i = 0; i < 9; ++i) {
    walls.push_back(gaussian({0, 0, 1 + 0.1 * i}, {3, 3, 1e-9}, 0.9999, {static_cast<float>(i), 1, 0}));
  }
  const GaussianCloud front = cloud_of(walls);
  for (const std::uint64_t seed : kSeeds) {
    const GaussianCloud behind = random_cloud(seed, {.count = 400, .needle = 0.5, .center = {0, 0, 6}});
    for_each_renderer([&](auto& renderer) {
      const auto alone = renderer.render({&front}, square_camera(), all_outputs());
      for (const auto a : alone.alpha) REQUIRE(static_cast<double>(a) > 1 - 1.01e-4);
      CHECK(same_images(alone, renderer.render({&front, &behind}, square_camera(), all_outputs())));
      CHECK(same_images(alone, renderer.render({&behind, &front}, square_camera(), all_outputs())));
    });
  }
}

TEST_CASE("property_union_is_the_merged_list") {
  for (const std::uint64_t seed : kSeeds) {
    const GaussianCloud a = scene(seed),
                        b = random_cloud(seed + 50,
                                         {.count = 700, .needle = 0.2, .center = {0.5, 0, 5}});
    GaussianCloud merged = a;
    REQUIRE(append(merged, b).ok());
    for (const Response response : {Response::ewa, Response::ray}) {
      RenderConfig config = all_outputs();
      config.response = response;
      for_each_renderer([&](auto& renderer) {
        const auto f = renderer.render({&merged}, square_camera(), config);
        CHECK(same_images(f, renderer.render({&a, &b}, square_camera(), config)));
        // Without ties the order of the sets does not matter either.
        CHECK(same_images(f, renderer.render({&b, &a}, square_camera(), config)));
      });
    }
  }
}

TEST_CASE("property_placement") {
  // Asset and camera moved together, SH directions included: the image stays, depths are scaled.
  Similarity place;
  place.rotation = axis_angle(normalized(Vec3d{1, 2, 3}), 1.1);
  place.translation = {100, -20, 7};
  place.scale = 2.5;
  Worst worst;
  double depth = 0, depth_in_float = 0;
  for (const std::uint64_t seed : kSeeds) {
    const GaussianCloud cloud = scene(seed);
    const Camera camera = square_camera();
    const Affine3<double> world_from_camera = rigid_inverse(camera.viewmat);
    Camera moved = camera;
    moved.viewmat =
        rigid_inverse(Affine3<double>{rotation_matrix(place.rotation) * world_from_camera.linear,
                                      place * world_from_camera.translation});
    moved.near_plane = camera.near_plane * place.scale;
    const auto undecided = undecided_pixels({&cloud}, camera, all_outputs(), 1e-4);
    for_each_renderer([&](auto& renderer) {
      using R = std::remove_reference_t<decltype(renderer)>;
      const auto a = renderer.render({&cloud}, camera, all_outputs());
      const auto b = renderer.render({Placed(&cloud, place)}, moved, all_outputs());
      worst.add(renderer, largest_difference(a, b, undecided, [](std::size_t p) { return p; }));
      for (std::size_t p = 0; p < a.alpha.size(); ++p) {
        if (undecided[p]) continue;
        const double d = static_cast<double>(a.expected_depth[p]) * place.scale -
                         static_cast<double>(b.expected_depth[p]);
        double& most = R::is_float ? depth_in_float : depth;
        most = std::max(most, std::abs(d));
      }
    });
  }
  MESSAGE("depth is off by " << depth << " m, in float by " << depth_in_float);
  CHECK(depth < 1e-6);
  CHECK(depth_in_float < 1e-3);
  worst.check("placement", 1e-6);
}
