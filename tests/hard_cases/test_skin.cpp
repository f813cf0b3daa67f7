// SPDX-License-Identifier: Apache-2.0
// N54 to N58: linear blend skinning.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <memory>

#include "gsnav/detail/avatar/skinned_crowd.hpp"
#include "hard_cases/skin_case.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

Real determinant3(const Real m[3][3]) {
  return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) -
         m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
         m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
}

/// U V^T of the singular value decomposition by one-sided Jacobi rotations, long double.
void svd_rotation(const Real m[3][3], Real out[3][3]) {
  Real u[3][3], v[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) u[i][k] = m[i][k];
  }
  for (int sweep = 0; sweep < 30; ++sweep) {
    Real off = 0;
    for (int p = 0; p < 3; ++p) {
      for (int q = p + 1; q < 3; ++q) {
        Real a = 0, b = 0, c = 0;
        for (int i = 0; i < 3; ++i) {
          a += u[i][p] * u[i][p];
          b += u[i][q] * u[i][q];
          c += u[i][p] * u[i][q];
        }
        off = std::max(off, std::abs(c) / std::sqrt(a * b));
        if (c == 0) continue;
        const Real angle = 0.5L * std::atan2(2 * c, a - b), cs = std::cos(angle), sn = std::sin(angle);
        for (int i = 0; i < 3; ++i) {
          const Real up = u[i][p], uq = u[i][q], vp = v[i][p], vq = v[i][q];
          u[i][p] = cs * up + sn * uq;
          u[i][q] = cs * uq - sn * up;
          v[i][p] = cs * vp + sn * vq;
          v[i][q] = cs * vq - sn * vp;
        }
      }
    }
    if (off < 1e-18L) break;
  }
  for (int k = 0; k < 3; ++k) {
    const Real s = std::sqrt(u[0][k] * u[0][k] + u[1][k] * u[1][k] + u[2][k] * u[2][k]);
    for (int i = 0; i < 3; ++i) u[i][k] /= s;
  }
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) out[i][k] = u[i][0] * v[k][0] + u[i][1] * v[k][1] + u[i][2] * v[k][2];
  }
}

/// Angle from a rotation matrix to a quaternion, degrees: by the distance of the matrices.
double angle_to(const Real want[3][3], const Quatd& q) {
  const Mat3d r = rotation_matrix(q);
  Real d2 = 0;
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k)
      d2 += (want[i][k] - static_cast<Real>(r(i, k))) * (want[i][k] - static_cast<Real>(r(i, k)));
  }
  return static_cast<double>(2 * std::asin(std::min<Real>(1, std::sqrt(d2 / 8)))) * 57.29577951308232;
}

/// R diag(s^2) R^T.
Mat3d covariance(const Quatd& q, const Vec3d& s) {
  const Mat3d r = rotation_matrix(q);
  Mat3d m = r;
  for (int i = 0; i < 3; ++i) m.row[i] = {r(i, 0) * s.x, r(i, 1) * s.y, r(i, 2) * s.z};
  return m * transpose(m);
}

/// Means of an actor's Gaussians at time 0, as a backend skins them, and where they stand.
struct SkinnedMeans {
  std::vector<Vec3d> means;
  Similarity world_from_asset;
};
template <class B>
SkinnedMeans skinned_means(B& backend, const AvatarActor& actor) {
  Arrays<B> arrays(backend);
  SkinnedGaussians<B> skinned(backend, actor.asset());
  skinned.pose(actor, 0).throw_if_error();
  const GaussianSet set = skinned.set();
  SkinnedMeans out{std::vector<Vec3d>(actor.asset()->size()), set.world_from_asset};
  for (int k = 0; k < 3; ++k) {
    const View<const float> v = set.gaussians.shape.means[static_cast<std::size_t>(k)];
    const std::vector<float> plane = arrays.fetch(View<float>{const_cast<float*>(v.data), v.size});
    for (std::size_t i = 0; i < plane.size(); ++i) out.means[i][k] = plane[i];
  }
  return out;
}

/// An avatar with three joints in a chain, without Gaussians.
AvatarAsset chain_of_three() {
  AvatarAsset asset;
  asset.skeleton.names = {"a", "b", "c"};
  asset.skeleton.parents = {-1, 0, 1};
  asset.skeleton.rest_local.resize(3);
  return asset;
}

}  // namespace

TEST_CASE("N54_lbs_identity") {
  double worst = 0, worst_angle = 0;
  for (const int influences : {4, 8}) {
    SkinCase c = random_case(54, 3000, 90, influences);
    for (auto& m : c.matrices) m = {};
    skin_everywhere(c, [&](const SkinResult& s, const auto& renderer) {
      double distance = 0, angle = 0, turn = 0;
      for (std::size_t i = 0; i < c.size(); ++i) {
        distance = std::max(distance, norm(s.means[i] - c.mean(i)));
        angle = std::max(angle, angle_between(s.quats[i], c.quat(i)));
        turn = std::max(turn, angle_between(s.rotations[i], {}));
      }
      CHECK(distance <=
            renderer.bound(1e-6, 1e-6));  // the weights in float32 sum to 1 within a few roundings
      CHECK(angle <= 1e-4);
      CHECK(turn <= 1e-4);
      worst = std::max(worst, distance);
      worst_angle = std::max({worst_angle, angle, turn});
    });
  }
  MESSAGE("off by " << worst << " m and " << worst_angle << " degrees");
}

TEST_CASE("N55_lbs_rigid_far") {
  // Weights off by 1e-3 in their sum, a root 1000 m away: renormalised at load, skinned relative to the
  // root.
  AvatarAsset asset = chain_of_three();
  Rng rng(55);
  GaussianCloudBuilder builder(0);
  std::vector<std::uint16_t> indices;
  std::vector<float> weights;
  for (int i = 0; i < 500; ++i) {
    RawGaussian g =
        gaussian({rng.uniform(-1, 1), rng.uniform(0, 2), rng.uniform(-1, 1)}, {0.1, 0.1, 0.1}, 0.9);
    g.quat = random_rotation(rng);
    builder.add(g);
    double w[3] = {rng.uniform(), rng.uniform(), rng.uniform()};
    const double sum = (w[0] + w[1] + w[2]) / (1 + (i % 2 == 0 ? 1e-3 : -1e-3));
    for (std::uint16_t k = 0; k < 3; ++k) {
      indices.push_back(k);
      weights.push_back(static_cast<float>(w[k] / sum));
    }
  }
  asset.cloud = builder.cloud();
  CHECK(asset.set_weights(3, indices, weights).value() < 1e-9);
  CHECK(asset.validate().ok());
  for (std::size_t i = 0; i < asset.size(); ++i) {
    int sum = 0;
    for (std::size_t k = 0; k < 4; ++k) sum += asset.skinning_weights[4 * i + k];
    REQUIRE(sum == kWeightParts);
  }
  // Far by the motion's root path, and by where the actor stands.
  double largest = 0;
  for (const bool by_root : {true, false}) {
    MotionClip clip;
    clip.joints = 3;
    clip.rotations.assign(3, Quatd{});
    clip.translations.assign(3, Vec3d{});
    if (by_root) clip.root_translation = {{0, 0, -1000}};
    const Vec3d place = by_root ? Vec3d{3, 0, 0} : Vec3d{1000, 0, -600};
    const auto shared = std::make_shared<const AvatarAsset>(asset);
    const AvatarActor actor = AvatarActor::create(shared, std::make_shared<const MotionClip>(clip),
                                                  std::make_shared<const StandingTrajectory>(place, 0.7))
                                  .value();
    const Similarity all = Similarity{axis_angle(Vec3d{0, 1, 0}, 0.7), place, 1} *
                           Similarity{{}, {0, 0, by_root ? -1000.0 : 0.0}, 1};
    for_each_backend([&](auto& renderer) {
      const auto [means, world_from_asset] = skinned_means(renderer.backend(), actor);
      double worst = 0;
      for (std::size_t i = 0; i < shared->size(); ++i) {
        worst = std::max(worst, norm(world_from_asset * means[i] - all * shared->cloud.mean(i)));
      }
      CHECK(worst <= 1e-5);
      largest = std::max(largest, worst);
    });
  }
  MESSAGE("1000 m from zero: off by " << largest << " m");
}

TEST_CASE("joints that turn carry what hangs on them, from the last to the first") {
  AvatarAsset asset = chain_of_three();
  Rng rng(59);
  const auto point = [&] { return Vec3d{rng.uniform(-1, 1), rng.uniform(0, 2), rng.uniform(-1, 1)}; };
  GaussianCloudBuilder builder(0);
  std::vector<std::uint16_t> indices;
  std::vector<float> weights;
  constexpr std::size_t kCount = 300;
  for (std::size_t i = 0; i < kCount; ++i) {
    builder.add(gaussian(point(), {0.1, 0.1, 0.1}, 0.9));
    for (std::uint16_t k = 0; k < 3; ++k) {
      indices.push_back(k);
      weights.push_back(k == i % 3 ? 1.0f : 0.0f);
    }
  }
  asset.cloud = builder.cloud();
  CHECK(asset.set_weights(3, indices, weights).ok());
  LocalPose pose;
  for (int j = 0; j < 3; ++j) {
    pose.rotations.push_back(random_rotation(rng));
    pose.translations.push_back(point());
  }
  const auto shared = std::make_shared<const AvatarAsset>(asset);
  const AvatarActor actor = AvatarActor::create(shared, std::make_shared<const FixedPose>(pose)).value();
  for_each_backend([&](auto& renderer) {
    const auto means = skinned_means(renderer.backend(), actor).means;
    double worst = 0;
    for (std::size_t i = 0; i < kCount; ++i) {
      Vec3d want = shared->cloud.mean(i);
      for (std::size_t j = i % 3 + 1; j-- > 0;)
        want = rotate(pose.rotations[j], want) + pose.translations[j];
      worst = std::max(worst, norm(means[i] - want));
    }
    CHECK(worst < 2e-6);
  });
}

TEST_CASE("a crowd is skinned as each of its actors alone, bit for bit") {
  // Of 1100 joints the matrices do not fit where a GPU likes to keep them.
  const auto body = [](std::size_t joints, int count, std::uint64_t seed) {
    AvatarAsset asset;
    for (std::size_t j = 0; j < joints; ++j) {
      asset.skeleton.names.push_back("j" + std::to_string(j));
      asset.skeleton.parents.push_back(j == 0 ? -1 : static_cast<int>((j - 1) / 2));
    }
    asset.skeleton.rest_local.resize(joints);
    Rng rng(seed);
    GaussianCloudBuilder builder(1);
    std::vector<std::uint16_t> indices;
    std::vector<float> weights;
    const float first_band[9] = {};
    for (int i = 0; i < count; ++i) {
      RawGaussian g =
          gaussian({rng.uniform(-1, 1), rng.uniform(0, 2), rng.uniform(-1, 1)}, {0.1, 0.05, 0.1}, 0.9);
      g.quat = random_rotation(rng);
      g.shN = first_band;
      builder.add(g);
      for (int k = 0; k < 3; ++k) {
        indices.push_back(static_cast<std::uint16_t>(rng.uniform() * static_cast<double>(joints)));
        weights.push_back(static_cast<float>(0.1 + rng.uniform()));
      }
    }
    asset.cloud = builder.cloud();
    asset.set_weights(3, indices, weights).value();
    REQUIRE(asset.validate().ok());
    return std::make_shared<const AvatarAsset>(std::move(asset));
  };
  const auto few = body(3, 2500, 1), many = body(1100, 300, 2);
  std::vector<AvatarActor> people;
  Rng rng(3);
  for (int i = 0; i < 5; ++i) {
    const auto& asset = i % 2 == 0 ? few : many;
    LocalPose pose = asset->skeleton.rest_pose();
    for (auto& r : pose.rotations) r = random_rotation(rng);
    ActorOptions options;
    if (i == 2) options.time_begin = 10;  // not there yet
    people.push_back(
        AvatarActor::create(asset, std::make_shared<const FixedPose>(pose),
                            std::make_shared<const StandingTrajectory>(Vec3d{1.0 * i, 0, 2}), options)
            .value());
  }
  for_each_backend([&](auto& renderer) {
    using B = std::remove_cvref_t<decltype(renderer.backend())>;
    Arrays<B> arrays(renderer.backend());
    const auto fetch = [&](const View<const float>& v) {
      return arrays.fetch(View<float>{const_cast<float*>(v.data), v.size});
    };
    SkinnedCrowd<B> crowd(renderer.backend());
    for (const AvatarActor& a : people) crowd.add(a.asset());
    REQUIRE(crowd.pose(people, 0.5).ok());
    for (std::size_t i = 0; i < people.size(); ++i) {
      SkinnedGaussians<B> alone(renderer.backend(), people[i].asset());
      REQUIRE(alone.pose(people[i], 0.5).ok());
      const GaussianRows a = crowd.set(i).gaussians, b = alone.set().gaussians;
      REQUIRE(a.size() == (i == 2 ? 0 : people[i].asset()->size()));
      REQUIRE(a.size() == b.size());
      if (i == 2) continue;
      CHECK(crowd.set(i).world_from_asset.translation.x == 1.0 * static_cast<double>(i));
      for (std::size_t k = 0; k < 3; ++k) CHECK(fetch(a.shape.means[k]) == fetch(b.shape.means[k]));
      for (std::size_t k = 0; k < 4; ++k) CHECK(fetch(a.shape.quats[k]) == fetch(b.shape.quats[k]));
      for (std::size_t k = 0; k < 4; ++k)
        CHECK(fetch(a.color.rotations[k]) == fetch(b.color.rotations[k]));
    }
    const std::vector<AvatarActor> swapped{people[1], people[0], people[2], people[3], people[4]};
    CHECK(crowd.pose(swapped, 0.5).message().find("place 0") != std::string::npos);
    CHECK(crowd.pose(std::span(people).first(2), 0.5).message().find("2 actors for 5") !=
          std::string::npos);
  });
}

TEST_CASE("N56_lbs_candy_180") {
  SkinCase c;
  Rng rng(56);
  const double pi = 3.14159265358979323846;
  std::vector<Quatd> greatest;
  double worst_angle = 0, worst_place = 0;
  for (std::uint16_t i = 0; i < 300; ++i) {
    // Half and half, det(B) = 0; and unequal, down to where the blend has an orientation again.
    const double second = std::array<double, 3>{0.5, 0.499, 0.4}[i % 3];
    const Quatd first = random_rotation(rng);
    const Vec3d axis = normalized(Vec3d{rng.normal(), rng.normal(), rng.normal()});
    const Quatd turned = first * axis_angle(axis, pi);
    c.matrices.push_back({rotation_matrix(first), {0.1, 0.2, 0.3}});
    c.matrices.push_back({rotation_matrix(turned), {0.1, 0.2, 0.3}});
    const std::uint16_t at = static_cast<std::uint16_t>(2 * i);
    c.add({rng.uniform(-1, 1), rng.uniform(-1, 1), rng.uniform(-1, 1)}, random_rotation(rng),
          {1 - second, second, 0, 0}, {at, static_cast<std::uint16_t>(at + 1), at, at});
    greatest.push_back(first);
  }
  skin_everywhere(c, [&](const SkinResult& s, const auto& renderer) {
    double angle = 0, place = 0;
    for (std::size_t i = 0; i < c.size(); ++i) {
      REQUIRE(is_finite(s.means[i]));
      REQUIRE(is_finite(Vec3d{s.quats[i].x, s.quats[i].y, s.quats[i].z}));
      angle = std::max(angle, angle_between(s.rotations[i], greatest[i]));
      Real b[3][3], t[3];
      c.blend<typename std::remove_cvref_t<decltype(renderer)>::scalar>(i, b, t);
      const Vec3d m = c.mean(i);
      for (int k = 0; k < 3; ++k) {
        const Real want = b[k][0] * static_cast<Real>(m.x) + b[k][1] * static_cast<Real>(m.y) +
                          b[k][2] * static_cast<Real>(m.z) + t[k];
        place = std::max(place, static_cast<double>(std::abs(want - static_cast<Real>(s.means[i][k]))));
      }
    }
    worst_angle = std::max(worst_angle, angle);
    worst_place = std::max(worst_place, place);
    CHECK(angle < renderer.bound(3e-5, 1e-6));  // the joint's own matrix, as the scalar holds it
    CHECK(place < 1e-6);                        // positions stay linear: LBS is the asset's contract
  });
  MESSAGE("the greatest joint's rotation to " << worst_angle << " degrees, positions to " << worst_place
                                              << " m");
}

TEST_CASE("N57_polar_equivariance") {
  // Turned by 90 degrees about one axis, the scales of the other two change places: the same ellipsoid.
  const double r = std::sqrt(0.5);
  const Quatd turns[3] = {{r, r, 0, 0}, {r, 0, r, 0}, {r, 0, 0, r}};
  const SkinCase base = random_case(57, 3000, 120);
  Rng rng(570);
  std::vector<Vec3d> scales;
  for (std::size_t i = 0; i < base.size(); ++i) {
    scales.push_back({rng.uniform(0.01, 0.1), rng.uniform(0.01, 0.1), rng.uniform(0.001, 0.1)});
  }
  SkinCase turned[3];
  for (int k = 0; k < 3; ++k) {
    turned[k] = base;
    for (std::size_t i = 0; i < base.size(); ++i) {
      const Quatd q = base.quat(i) * turns[k];
      const double w[4] = {q.w, q.x, q.y, q.z};
      for (int n = 0; n < 4; ++n) turned[k].quats[n][i] = static_cast<float>(w[n]);
    }
  }
  double largest = 0;
  for_each_backend([&](auto& renderer) {
    const SkinResult a = skin_on(renderer, base);
    double worst = 0;
    for (int k = 0; k < 3; ++k) {
      const SkinResult b = skin_on(renderer, turned[k]);
      for (std::size_t i = 0; i < base.size(); ++i) {
        const Vec3d& s = scales[i];
        const Vec3d permuted[3] = {{s.x, s.z, s.y}, {s.z, s.y, s.x}, {s.y, s.x, s.z}};
        const Mat3d p = covariance(a.quats[i], s), q = covariance(b.quats[i], permuted[k]);
        for (int n = 0; n < 3; ++n) worst = std::max(worst, norm(p.row[n] - q.row[n]) / 0.01);
      }
    }
    CHECK(worst <= 1e-5);  // of the largest variance
    largest = std::max(largest, worst);
  });
  MESSAGE("covariances differ by " << largest << " of the largest variance");
}

TEST_CASE("N58_polar_vs_svd") {
  // Few joints turned far, and many turned less: with eight at 120 degrees most blends have no
  // orientation.
  for (const int influences : {4, 8}) {
    const SkinCase c = random_case(58, sample_count(30000), influences == 4 ? 120 : 60, influences);
    skin_everywhere(c, [&](const SkinResult& s, const auto& renderer) {
      using S = typename std::remove_cvref_t<decltype(renderer)>::scalar;
      if (renderer.name() != "serial float" && renderer.name() != "serial double")
        return;  // the same bits
      double worst = 0, worst_mean = 0, worst_fallback = 0;
      std::size_t tested = 0, fallback = 0;
      for (std::size_t i = 0; i < c.size(); ++i) {
        Real b[3][3], t[3], want[3][3];
        c.blend<S>(i, b, t);
        const Vec3d m = c.mean(i);
        for (int k = 0; k < 3; ++k) {
          const Real at = b[k][0] * static_cast<Real>(m.x) + b[k][1] * static_cast<Real>(m.y) +
                          b[k][2] * static_cast<Real>(m.z) + t[k];
          worst_mean =
              std::max(worst_mean, static_cast<double>(std::abs(at - static_cast<Real>(s.means[i][k]))));
        }
        const Real det = determinant3(b);
        if (std::abs(det - 0.1L) < 1e-5L) continue;  // which branch is a matter of rounding
        if (det > 0.1L) {
          ++tested;
          svd_rotation(b, want);
          worst = std::max(worst, angle_to(want, s.rotations[i]));
        } else {
          ++fallback;
          const Mat3d& first = c.matrices[c.joints[c.row() * i]].linear;
          for (int r = 0; r < 3; ++r) {
            for (int k = 0; k < 3; ++k) want[r][k] = first(r, k);
          }
          worst_fallback = std::max(worst_fallback, angle_to(want, s.rotations[i]));
        }
      }
      MESSAGE(renderer.name() << ", K = " << influences << ": " << tested << " blends " << worst
                              << " degrees, " << fallback << " without orientation " << worst_fallback
                              << " degrees, mean " << 1e3 * worst_mean << " mm");
      CHECK(tested > c.size() * 8 / 10);
      CHECK(worst <= renderer.bound(1e-3, 1e-6));  // the budget is 0.01
      CHECK(worst_fallback <= renderer.bound(1e-4, 1e-6));
      CHECK(worst_mean <= renderer.bound(1e-6, 1e-14));
    });
  }
}
