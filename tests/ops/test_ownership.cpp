// SPDX-License-Identifier: Apache-2.0
// docs/reference/ownership.md: what would view a temporary does not compile; types are deduced from the
// backend.
#include <doctest/doctest.h>

#include <concepts>
#include <type_traits>
#include <utility>

#include "gsnav/avatar/skinned_gaussians.hpp"
#include "gsnav/detail/avatar/skinned_crowd.hpp"
#include "gsnav/detail/scene/placed_meshes.hpp"
#include "gsnav/detail/scene/temporal_gaussians.hpp"
#include "gsnav/detail/sim/greedy_follower.hpp"
#include "gsnav/scene/lod_cut.hpp"
#include "ops/backends.hpp"
#include "support/scenes.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

template <class T>
concept HasSet = requires(T&& t) {
  std::forward<T>(t).set();
};
template <class T>
concept HasView = requires(T&& t) {
  std::forward<T>(t).view();
};
template <class T>
concept HasViewOf = requires(T&& t) {
  std::forward<T>(t).view(std::size_t{});
};
template <class T>
concept HasInstance = requires(T&& t) {
  std::forward<T>(t).instance();
};
template <class T>
concept HasInstanceOf = requires(T&& t) {
  std::forward<T>(t).instance(std::size_t{});
};
template <class T>
concept HasMeshOf = requires(T&& t) {
  std::forward<T>(t).mesh(std::size_t{});
};
template <class T>
concept IsInWorld = requires(T&& t) {
  std::forward<T>(t).in_world();
};
template <class T>
concept HasSetAt = requires(T&& t) {
  std::forward<T>(t).set(std::size_t{});
};
template <class T>
concept HasSkinning = requires(T&& t) {
  std::forward<T>(t).skinning();
};
template <class T>
concept AppliesBands = requires(T&& t) {
  std::forward<T>(t).applied_to(GaussianSet{});
};
template <class T>
concept IsPhotographed = requires(T&& t) {
  LodCut::photo_set(std::forward<T>(t), LodChoice{});
};
template <class T>
concept IsFollowedOn = requires(T&& t) {
  GreedyGeodesicFollower::make(std::forward<T>(t), Vec3d{});
};

/// Holds of an object that has a name, and of no temporary.
#define ONLY_NAMED(Concept, ...)                                                                 \
  static_assert(Concept<__VA_ARGS__&> && Concept<const __VA_ARGS__&> && !Concept<__VA_ARGS__> && \
                !Concept<const __VA_ARGS__>)

ONLY_NAMED(HasSet, GaussianCloud);
ONLY_NAMED(HasView, GaussianCloud);
ONLY_NAMED(HasSet, PackedCloud);
ONLY_NAMED(HasView, PackedCloud);
ONLY_NAMED(HasView, TemporalCloud);
ONLY_NAMED(AppliesBands, SceneBands);
ONLY_NAMED(IsPhotographed, GaussianCloud);
ONLY_NAMED(IsFollowedOn, NavMesh);
ONLY_NAMED(HasView, MeshTexture);
ONLY_NAMED(HasViewOf, MeshScene);
ONLY_NAMED(HasInstanceOf, MeshScene);
ONLY_NAMED(HasMeshOf, MeshScene);
ONLY_NAMED(IsInWorld, PlacedMeshes);

// On every backend alike, where arrays are copied too: who changes the backend must not be surprised.
template <class B>
consteval bool holds_on() {
  ONLY_NAMED(HasSet, GaussianArrays<B>);
  ONLY_NAMED(HasSet, TemporalGaussians<B>);
  ONLY_NAMED(HasInstance, MeshArrays<B>);
  ONLY_NAMED(HasSet, AvatarArrays<B>);
  ONLY_NAMED(HasSkinning, AvatarArrays<B>);
  ONLY_NAMED(HasSet, SkinnedGaussians<B>);
  ONLY_NAMED(HasSetAt, SkinnedCrowd<B>);
  using Cloud = GaussianCloud;
  using Bands = SceneBands;
  using Arrays = GaussianArrays<B>;
  static_assert(std::is_constructible_v<Arrays, B&, Cloud&>);
  static_assert(std::is_constructible_v<Arrays, B&, PackedCloud&, const Bands&>);
  static_assert(!std::is_constructible_v<Arrays, B&, Cloud>);
  static_assert(!std::is_constructible_v<Arrays, B&, const Cloud>);
  static_assert(!std::is_constructible_v<Arrays, B&, PackedCloud>);
  static_assert(!std::is_constructible_v<Arrays, B&, Cloud, Bands&>);
  static_assert(!std::is_constructible_v<Arrays, B&, Cloud&, Bands>);
  static_assert(!std::is_constructible_v<Arrays, B&, PackedCloud, Bands&>);
  static_assert(!std::is_constructible_v<Arrays, B&, PackedCloud&, Bands>);
  static_assert(!std::is_constructible_v<Arrays, B, Cloud&>);
  static_assert(std::is_constructible_v<TemporalGaussians<B>, B&, TemporalCloud&>);
  static_assert(!std::is_constructible_v<TemporalGaussians<B>, B&, TemporalCloud>);
  static_assert(!std::is_constructible_v<BasicRenderer<float, B>, B>);
  return true;
}
static_assert(holds_on<SerialBackend>() && holds_on<ToyBackend>());

static_assert(std::is_constructible_v<LodCut, LodTree&, const GaussianCloud&>);
static_assert(!std::is_constructible_v<LodCut, LodTree, GaussianCloud&>);
static_assert(!std::is_constructible_v<LodCut, LodTree&, GaussianCloud>);
static_assert(!std::is_constructible_v<LodCut, LodTree, GaussianCloud>);

}  // namespace

TEST_CASE("the backend's type is not named twice") {
  SerialBackend serial;
  ToyBackend toy;
  const GaussianCloud cloud = random_cloud(3, {.count = 100});
  const Camera camera = Camera::look_at({0, 0, 0}, {0, 0, 4}, {0, -1, 0}, 24, 16, 70);
  BasicRenderer renderer(serial);
  BasicRenderer there(toy, RenderConfig{});
  const GaussianArrays arrays(toy, cloud);
  static_assert(std::same_as<decltype(renderer), BasicRenderer<float, SerialBackend>>);
  static_assert(std::same_as<decltype(there), BasicRenderer<float, ToyBackend>>);
  static_assert(std::same_as<decltype(arrays), const GaussianArrays<ToyBackend>>);
  CHECK(there.render(arrays.set(), camera).value().rgb ==
        renderer.render(cloud.set(), camera).value().rgb);
}

TEST_CASE("arrays view a named cloud") {
  SerialBackend backend;
  const auto load_cloud = [] { return random_cloud(3, {.count = 100}); };
  static_assert(!std::is_constructible_v<GaussianArrays<SerialBackend>, SerialBackend&, GaussianCloud>);
  // [snippet: named_cloud]
  // GaussianArrays arrays(backend, load_cloud()) does not compile, because the cloud is a temporary.
  const gsnav::GaussianCloud cloud = load_cloud();
  const gsnav::GaussianArrays arrays(backend, cloud);  // right while cloud lives
  // [/snippet]
  CHECK(arrays.set().gaussians.size() == 100);
}
