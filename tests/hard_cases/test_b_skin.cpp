// SPDX-License-Identifier: Apache-2.0
// N54 to N58, N60: linear blend skinning and forward kinematics.
#include <doctest/doctest.h>

#include "avatar/support.hpp"
#include "gsnav/ops/skin.hpp"
#include "hard_cases/arrays.hpp"
#include "hard_cases/cases.hpp"
#include "hard_cases/truth.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

/// Gaussians with four joints each, as skinning is given them.
struct SkinCase {
  std::vector<float> means[3], quats[4], weights;
  std::vector<std::uint16_t> joints;          // [N][4]
  std::vector<Affine3<double>> matrices;

  std::size_t size() const { return means[0].size(); }
  void add(const Vec3d& mean, const Quatd& quat, const std::array<double, 4>& w,
           const std::array<std::uint16_t, 4>& j) {
    for (int k = 0; k < 3; ++k) means[k].push_back(static_cast<float>(mean[k]));
    const double q[4] = {quat.w, quat.x, quat.y, quat.z};
    for (int k = 0; k < 4; ++k) quats[k].push_back(static_cast<float>(q[k]));
    for (const double v : w) weights.push_back(static_cast<float>(v));
    joints.insert(joints.end(), j.begin(), j.end());
  }
  Vec3d mean(std::size_t i) const { return {means[0][i], means[1][i], means[2][i]}; }
  Quatd quat(std::size_t i) const { return {quats[0][i], quats[1][i], quats[2][i], quats[3][i]}; }
  /// Blended matrix in long double from the stored weights and the matrices as the kernel has them.
  template <class S>
  void blend(std::size_t i, Real linear[3][3], Real shift[3]) const {
    for (int r = 0; r < 3; ++r) {
      shift[r] = 0;
      for (int c = 0; c < 3; ++c) linear[r][c] = 0;
    }
    for (std::size_t k = 0; k < 4; ++k) {
      const Real w = weights[4 * i + k];
      const Affine3<double>& m = matrices[joints[4 * i + k]];
      for (int r = 0; r < 3; ++r) {
        shift[r] += w * static_cast<Real>(static_cast<S>(m.translation[r]));
        for (int c = 0; c < 3; ++c) linear[r][c] += w * static_cast<Real>(static_cast<S>(m.linear(r, c)));
      }
    }
  }
};

struct SkinResult {
  std::vector<Vec3d> means;
  std::vector<Quatd> quats, rotations;
};

/// Skins on a backend in its scalar.
template <class R>
SkinResult skin_on(R& renderer, const SkinCase& c) {
  using S = typename R::scalar;
  using B = std::remove_cvref_t<decltype(renderer.backend())>;
  Arrays<B> arrays(renderer.backend());
  std::vector<Affine3<S>> matrices;
  for (const auto& m : c.matrices) matrices.push_back(affine_cast<S>(m));
  SkinningArgs<S, S> args;
  for (int k = 0; k < 3; ++k) {
    args.means[k] = arrays.in(c.means[k]);
    args.means_out[k] = arrays.template out<S>(c.size());
  }
  for (int k = 0; k < 4; ++k) {
    args.quats[k] = arrays.in(c.quats[k]);
    args.quats_out[k] = arrays.template out<S>(c.size());
    args.rotations_out[k] = arrays.template out<S>(c.size());
  }
  args.joint_indices = arrays.in(c.joints);
  args.weights = arrays.in(c.weights);
  args.joints = arrays.in(matrices);
  skin_gaussians(renderer.backend(), args).throw_if_error();
  std::vector<S> m[3], q[4], r[4];
  for (int k = 0; k < 3; ++k) m[k] = arrays.fetch(args.means_out[k]);
  for (int k = 0; k < 4; ++k) {
    q[k] = arrays.fetch(args.quats_out[k]);
    r[k] = arrays.fetch(args.rotations_out[k]);
  }
  SkinResult out;
  for (std::size_t i = 0; i < c.size(); ++i) {
    out.means.push_back(vec_cast<double>(Vec3<S>{m[0][i], m[1][i], m[2][i]}));
    out.quats.push_back(quat_cast<double>(Quat<S>{q[0][i], q[1][i], q[2][i], q[3][i]}));
    out.rotations.push_back(quat_cast<double>(Quat<S>{r[0][i], r[1][i], r[2][i], r[3][i]}));
  }
  return out;
}

/// Skins everywhere; float results must have the serial backend's bits.
template <class F>
void skin_everywhere(const SkinCase& c, const F& check) {
  SkinResult reference;
  const auto bits = [](const std::vector<Quatd>& a, const std::vector<Quatd>& b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const Quatd& p, const Quatd& q) {
      return p.w == q.w && p.x == q.x && p.y == q.y && p.z == q.z;
    });
  };
  for_each_renderer([&](auto& renderer) {
    const SkinResult result = skin_on(renderer, c);
    if (std::remove_reference_t<decltype(renderer)>::is_float) {
      if (reference.means.empty()) reference = result;
      CHECK(result.means == reference.means);
      CHECK(bits(result.quats, reference.quats));
      CHECK(bits(result.rotations, reference.rotations));
    }
    check(result, renderer);
  });
}

/// 2 to 4 joints at most `degrees` from the first, weights sorted and summing to 1; each row its own joints.
SkinCase random_case(std::uint64_t seed, std::size_t count, double degrees) {
  Rng rng(seed);
  SkinCase c;
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t n = 2 + rng.below(3);
    std::array<double, 4> w{};
    double sum = 0;
    for (std::size_t k = 0; k < n; ++k) sum += w[k] = rng.uniform(0.02, 1.0);
    std::sort(w.begin(), w.end(), std::greater<>());
    for (double& v : w) v /= sum;
    const Quatd base = random_rotation(rng);
    // Joint indices have 16 bits: matrices are used again by rows far apart.
    const std::uint16_t first = static_cast<std::uint16_t>(4 * (i % 16000));
    for (std::size_t k = 0; k < 4; ++k) {
      if (i >= 16000) continue;
      const Quatd q = k == 0 ? base : rotation_within(rng, degrees) * base;
      c.matrices.push_back({rotation_matrix(q), {rng.uniform(-1, 1), rng.uniform(-1, 1), rng.uniform(-1, 1)}});
    }
    c.add({rng.uniform(-1, 1), rng.uniform(0, 2), rng.uniform(-1, 1)}, random_rotation(rng), w,
          {first, static_cast<std::uint16_t>(first + 1), static_cast<std::uint16_t>(first + 2),
           static_cast<std::uint16_t>(first + 3)});
  }
  return c;
}

Real determinant3(const Real m[3][3]) {
  return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
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
    for (int k = 0; k < 3; ++k) d2 += (want[i][k] - static_cast<Real>(r(i, k))) * (want[i][k] - static_cast<Real>(r(i, k)));
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

}  // namespace

TEST_CASE("N54_lbs_identity") {
  SkinCase c = random_case(54, 3000, 90);
  for (auto& m : c.matrices) m = {};
  skin_everywhere(c, [&](const SkinResult& s, const auto& renderer) {
    double distance = 0, angle = 0, turn = 0;
    for (std::size_t i = 0; i < c.size(); ++i) {
      distance = std::max(distance, norm(s.means[i] - c.mean(i)));
      angle = std::max(angle, angle_between(s.quats[i], c.quat(i)));
      turn = std::max(turn, angle_between(s.rotations[i], {}));
    }
    CHECK(distance <= renderer.bound(1e-6, 1e-6));  // weights are float32 and sum to 1 within 1.2e-7
    CHECK(angle <= 1e-4);
    CHECK(turn <= 1e-4);
  });
}

TEST_CASE("N55_lbs_rigid_far") {
  // Weights off by 1e-3 in their sum, a root 1000 m away: renormalised at load, skinned relative to the root.
  AvatarAsset asset;
  asset.skeleton.names = {"a", "b", "c"};
  asset.skeleton.parents = {-1, 0, 1};
  asset.skeleton.rest_local.resize(3);
  Rng rng(55);
  GaussianCloudBuilder builder(0);
  std::vector<std::uint16_t> indices;
  std::vector<float> weights;
  for (int i = 0; i < 500; ++i) {
    RawGaussian g = gaussian({rng.uniform(-1, 1), rng.uniform(0, 2), rng.uniform(-1, 1)}, {0.1, 0.1, 0.1}, 0.9);
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
  double sum_error = 0;
  for (std::size_t i = 0; i < asset.size(); ++i) {
    double sum = 0;
    for (std::size_t k = 0; k < 4; ++k) sum += static_cast<double>(asset.skinning_weights[4 * i + k]);
    sum_error = std::max(sum_error, std::abs(sum - 1));
  }
  CHECK(sum_error < 1.2e-7);
  // Far by the motion's root path, and by where the actor stands.
  for (const bool by_root : {true, false}) {
    MotionClip clip;
    clip.joints = 3;
    clip.rotations.assign(3, Quatd{});
    clip.translations.assign(3, Vec3d{});
    if (by_root) clip.root_translation = {{0, 0, -1000}};
    const Vec3d place = by_root ? Vec3d{3, 0, 0} : Vec3d{1000, 0, -600};
    const auto shared = std::make_shared<const AvatarAsset>(asset);
    const AvatarActor actor =
        AvatarActor::create(shared, std::make_shared<const MotionClip>(clip),
                            std::make_shared<const StandingTrajectory>(place, 0.7)).value();
    const Similarity all =
        Similarity{axis_angle(Vec3d{0, 1, 0}, 0.7), place, 1} * Similarity{{}, {0, 0, by_root ? -1000.0 : 0.0}, 1};
    for_each_renderer([&](auto& renderer) {
      using B = std::remove_cvref_t<decltype(renderer.backend())>;
      Arrays<B> arrays(renderer.backend());
      SkinnedGaussians<B> skinned(renderer.backend(), shared);
      skinned.pose(actor, 0).throw_if_error();
      const GaussianSet set = skinned.set();
      std::vector<float> mean[3];
      for (int k = 0; k < 3; ++k) {
        const View<const float>& v = set.gaussians.means[k];
        mean[k] = arrays.fetch(View<float>{const_cast<float*>(v.data), v.size});
      }
      double worst = 0;
      for (std::size_t i = 0; i < shared->size(); ++i) {
        const Vec3d p{mean[0][i], mean[1][i], mean[2][i]};
        worst = std::max(worst, norm(set.world_from_asset * p - all * shared->cloud.mean(i)));
      }
      CHECK(worst <= 1e-5);
    });
  }
}

TEST_CASE("N56_lbs_candy_180") {
  SkinCase c;
  Rng rng(56);
  const double pi = 3.14159265358979323846;
  std::vector<Quatd> greatest;
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
    CHECK(angle < renderer.bound(3e-5, 1e-6));  // the joint's own matrix, as the scalar holds it
    CHECK(place < 1e-6);                        // positions stay linear: LBS is the asset's contract
  });
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
  for_each_renderer([&](auto& renderer) {
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
  });
}

TEST_CASE("N58_polar_vs_svd") {
  const SkinCase c = random_case(58, sample_count(30000), 120);
  skin_everywhere(c, [&](const SkinResult& s, const auto& renderer) {
    using S = typename std::remove_cvref_t<decltype(renderer)>::scalar;
    if (renderer.name() != "serial float" && renderer.name() != "serial double") return;  // the same bits
    double worst = 0, worst_mean = 0, worst_fallback = 0;
    std::size_t tested = 0, fallback = 0;
    for (std::size_t i = 0; i < c.size(); ++i) {
      Real b[3][3], t[3], want[3][3];
      c.blend<S>(i, b, t);
      const Vec3d m = c.mean(i);
      for (int k = 0; k < 3; ++k) {
        const Real at = b[k][0] * static_cast<Real>(m.x) + b[k][1] * static_cast<Real>(m.y) +
                        b[k][2] * static_cast<Real>(m.z) + t[k];
        worst_mean = std::max(worst_mean, static_cast<double>(std::abs(at - static_cast<Real>(s.means[i][k]))));
      }
      const Real det = determinant3(b);
      if (std::abs(det - 0.1L) < 1e-5L) continue;  // which branch is a matter of rounding
      if (det > 0.1L) {
        ++tested;
        svd_rotation(b, want);
        worst = std::max(worst, angle_to(want, s.rotations[i]));
      } else {
        ++fallback;
        const Mat3d& first = c.matrices[c.joints[4 * i]].linear;
        for (int r = 0; r < 3; ++r) {
          for (int k = 0; k < 3; ++k) want[r][k] = first(r, k);
        }
        worst_fallback = std::max(worst_fallback, angle_to(want, s.rotations[i]));
      }
    }
    MESSAGE(renderer.name() << ": " << tested << " blends " << worst << " degrees, " << fallback
                            << " without orientation " << worst_fallback << " degrees, mean " << 1e3 * worst_mean << " mm");
    CHECK(tested > c.size() * 8 / 10);
    CHECK(worst <= renderer.bound(1e-3, 1e-6));  // the budget is 0.01
    CHECK(worst_fallback <= renderer.bound(1e-4, 1e-6));
    CHECK(worst_mean <= renderer.bound(1e-6, 1e-14));
  });
}

TEST_CASE("N60_slerp_vs_lerp") {
  // Two keys of a chain of four joints of 0.25 m; poses between them by slerp of local rotations.
  Rng rng(60);
  const std::size_t joints = 4;
  for (const double degrees : {10.0, 30.0, 60.0}) {
    CAPTURE(degrees);
    double worst_float = 0, worst_double = 0, matrix_lerp = 0;
    for (int round = 0; round < 200; ++round) {
      Skeleton skeleton;
      MotionClip clip;
      clip.frame_rate = 1;
      clip.joints = joints;
      clip.end = ClipEnd::hold;
      std::vector<Quatd> keys[2];
      std::vector<Vec3d> axes;
      for (std::size_t j = 0; j < joints; ++j) {
        skeleton.names.push_back("joint" + std::to_string(j));
        skeleton.parents.push_back(static_cast<std::int32_t>(j) - 1);
        skeleton.rest_local.emplace_back();
        skeleton.rest_local.back().translation = {0, j == 0 ? 1.0 : 0.25, 0};
        axes.push_back(normalized(Vec3d{rng.normal(), rng.normal(), rng.normal()}));
        keys[0].push_back(random_rotation(rng));
        // Either sign stands for the same rotation: the short way must be taken.
        const Quatd next = keys[0][j] * axis_angle(axes[j], degrees * 0.017453292519943295);
        keys[1].push_back(rng.below(2) == 0 ? next : -next);
      }
      for (const auto& key : keys) clip.rotations.insert(clip.rotations.end(), key.begin(), key.end());
      clip.translations = skeleton.rest_pose().translations;
      REQUIRE(clip.validate().ok());
      for (const double u : {0.25, 0.5, 0.75}) {
        // Truth: each joint has turned by u of its angle about its axis, by Rodrigues' formula.
        Real global[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, at[3] = {0, 0, 0};
        for (std::size_t j = 0; j < joints; ++j) {
          const Vec3d& offset = skeleton.rest_local[j].translation;
          for (int r = 0; r < 3; ++r) at[r] += global[r][1] * static_cast<Real>(offset.y);
          const Mat3d first = rotation_matrix(keys[0][j]);
          const Real angle = static_cast<Real>(u * degrees) * 0.017453292519943295769L;
          const Real s = std::sin(angle), c = std::cos(angle), n[3] = {axes[j].x, axes[j].y, axes[j].z};
          const Real cross_axis[3][3] = {{0, -n[2], n[1]}, {n[2], 0, -n[0]}, {-n[1], n[0], 0}};
          Real turn[3][3], local[3][3], next[3][3];
          for (int r = 0; r < 3; ++r) {
            for (int k = 0; k < 3; ++k) turn[r][k] = (r == k ? c : 0) + s * cross_axis[r][k] + (1 - c) * n[r] * n[k];
          }
          for (int r = 0; r < 3; ++r) {
            for (int k = 0; k < 3; ++k) {
              local[r][k] = 0;
              for (int i = 0; i < 3; ++i) local[r][k] += static_cast<Real>(first(r, i)) * turn[i][k];
            }
          }
          for (int r = 0; r < 3; ++r) {
            for (int k = 0; k < 3; ++k) {
              next[r][k] = 0;
              for (int i = 0; i < 3; ++i) next[r][k] += global[r][i] * local[i][k];
            }
          }
          std::copy(&next[0][0], &next[0][0] + 9, &global[0][0]);
        }
        for (int r = 0; r < 3; ++r) at[r] += global[r][1] * 0.5L;  // half a metre along the last joint

        MotionInput input;
        input.time = u;
        LocalPose pose;
        clip.pose(input, pose);
        std::vector<Affine3<double>> globals;
        forward_kinematics(skeleton, pose, globals);
        const Vec3d seen = globals.back() * Vec3d{0, 0.5, 0};
        // The kernel in float, as a device would run it.
        std::vector<Quatf> rotations;
        std::vector<Vec3f> translations;
        for (std::size_t j = 0; j < joints; ++j) {
          rotations.push_back(quat_cast<float>(pose.rotations[j]));
          translations.push_back(vec_cast<float>(pose.translations[j]));
        }
        std::vector<Affine3<float>> globals_f(joints);
        ForwardKinematicsArgs<float> args;
        args.parents = view_of(std::as_const(skeleton.parents));
        args.rotations = view_of(std::as_const(rotations));
        args.translations = view_of(std::as_const(translations));
        args.globals = view_of(globals_f);
        ForwardKinematics<float>{args}(0);
        const Vec3d seen_f = vec_cast<double>(globals_f.back() * Vec3f{0, 0.5f, 0});
        // What mixing the keys' matrices would give, for one joint half a metre long.
        const Mat3d a = rotation_matrix(keys[0][0]), b = rotation_matrix(keys[1][0]);
        const Mat3d mixed = a * (1 - u) + b * u, right = rotation_matrix(pose.rotations[0]);
        const Vec3d arm = normalized(cross(axes[0], Vec3d{0.3, 0.5, 0.8})) * 0.5;
        matrix_lerp = std::max(matrix_lerp, norm(mixed * arm - right * arm));
        for (int r = 0; r < 3; ++r) {
          worst_double = std::max(worst_double, static_cast<double>(std::abs(at[r] - static_cast<Real>(seen[r]))));
          worst_float = std::max(worst_float, static_cast<double>(std::abs(at[r] - static_cast<Real>(seen_f[r]))));
        }
      }
    }
    MESSAGE(degrees << " degrees a key: slerp and forward kinematics " << 1e3 * worst_float << " mm in float, "
                    << 1e3 * worst_double << " in double; matrices mixed " << 1e3 * matrix_lerp << " mm");
    CHECK(worst_double < 1e-12);
    CHECK(worst_float < 5e-6);  // the budget is 0.05 mm
    CHECK(matrix_lerp > 1e-3);
  }
}
