// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cmath>

#include "avatar_npz.hpp"
#include "gsnav/avatar.hpp"
#include "gsnav/detail/demo/humanoid.hpp"
#include "gsnav/detail/io/avatar_file.hpp"
#include "support/files.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

struct AvatarFolder : TempFolder {
  AvatarFolder() : TempFolder("avatar") {}
  Result<io::LoadedAvatar> load(const TestArrays& arrays,
                                const io::LoadAvatarOptions& options = {}) const {
    write_npz(*this / "a.npz", arrays);
    return io::load_avatar(*this / "a.npz", options);
  }
};

/// Joint j's inverse bind is a translation by (x[j], 0, 0).
void translate_binds(TestArrays& arrays, const std::vector<double>& x) {
  for (std::size_t j = 0; j < x.size(); ++j) arrays["joints_inv_bind_matrix"].values[16 * j + 3] = x[j];
}

}  // namespace

TEST_CASE("avatar file: every degree, both floats, both bodies") {
  const AvatarFolder folder;
  for (const std::size_t joints : {24u, 55u}) {
    for (int degree = 0; degree <= 3; ++degree) {
      const auto k = static_cast<std::size_t>((degree + 1) * (degree + 1));
      TestArrays arrays = avatar_arrays(60, joints, k);
      for (auto& [name, a] : arrays) a.is_float = degree % 2 == 0;
      const auto loaded = folder.load(arrays);
      CAPTURE(loaded.status().message());
      REQUIRE(loaded.ok());
      const AvatarAsset& asset = loaded->asset;
      CHECK(asset.name == "a");
      REQUIRE(asset.size() == 60);
      CHECK(asset.skeleton.size() == joints);
      CHECK(asset.skeleton.names[4] == "left_knee");
      CHECK(asset.skeleton.parents[4] == 1);
      CHECK(asset.skeleton.names.back() == (joints == 24 ? "right_hand" : "right_thumb3"));
      CHECK(asset.cloud.sh_degree == degree);
      CHECK(asset.cloud.opacities[0] == 1.0f);
      CHECK(asset.cloud.opacities[7] == 0.5f);
      for (std::size_t i = 0; i < 60; i += 7) {
        const double x = static_cast<double>(i);
        CHECK(asset.cloud.mean(i) == Vec3d{0.125 * x, 1.0, -0.5 * x});
        CHECK(asset.cloud.scales[0][i] == doctest::Approx(0.01).epsilon(1e-7));
        CHECK(asset.cloud.scales[2][i] == 0.0f);
        CHECK(asset.cloud.quats[3][i] ==
              doctest::Approx(0.5 * x / std::hypot(2.0, 0.5 * x)).epsilon(1e-7));
        CHECK(asset.joint_indices[4 * i] == i % joints);
        CHECK(asset.skinning_weights[4 * i] == kWeightParts);
        if (i == 0) continue;
        CHECK(asset.cloud.sh0[3 * i + 1] == static_cast<float>(-0.25 + 0.0625 * x));
        for (std::size_t c = 3; c < 3 * k; ++c) {
          CHECK(asset.cloud.shN[i * (3 * k - 3) + c - 3] ==
                static_cast<float>(-0.25 * static_cast<double>(c) + 0.0625 * x));
        }
      }
      CHECK(loaded->report.read == 60);
      CHECK(loaded->report.warnings.empty());
      CHECK(loaded->weights.most_weights == 1);
      CHECK(loaded->weights.dropped_mass == 0.0);
    }
  }
}

TEST_CASE("avatar file: the shapes that exporters write") {
  const AvatarFolder folder;
  TestArrays arrays = avatar_arrays(5, 24);
  arrays["opacities"].shape = {5};
  arrays["shs"].shape = {5, 3};
  arrays["joints_inv_bind_matrix"].shape = {1, 24, 4, 4};
  CHECK(folder.load(arrays).ok());
  arrays["joints_inv_bind_matrix"].shape = {24, 16};
  CHECK(folder.load(arrays).ok());
  CHECK(folder.load(avatar_arrays(1, 24)).ok());
  // Gaussians that are never seen take their weights with them.
  arrays["opacities"].values[1] = 0.003;
  const auto loaded = folder.load(arrays).value();
  CHECK(loaded.report.dropped_transparent == 1);
  REQUIRE(loaded.asset.size() == 4);
  CHECK(loaded.asset.joint_indices[4] == 2);
}

TEST_CASE("avatar file: colours that may be RGB") {
  const AvatarFolder folder;
  TestArrays arrays = avatar_arrays(4, 24);
  for (double& v : arrays["shs"].values) v = 0.75;
  const double sh = 0.25 * std::sqrt(4 * 3.14159265358979323846);
  auto loaded = folder.load(arrays).value();
  CHECK(loaded.asset.cloud.sh0[5] == doctest::Approx(sh).epsilon(1e-7));
  CHECK(contains(loaded.report.warnings.at(0), "RGB"));
  io::LoadAvatarOptions options;
  options.colors = io::AvatarColors::coefficients;
  CHECK(folder.load(arrays, options).value().asset.cloud.sh0[5] == 0.75f);
  arrays["shs"].values[3] = 1.5;
  CHECK(folder.load(arrays).value().asset.cloud.sh0[5] == 0.75f);
  options.colors = io::AvatarColors::rgb;
  CHECK(folder.load(arrays, options).value().asset.cloud.sh0[5] == doctest::Approx(sh).epsilon(1e-7));
}

TEST_CASE("avatar file: what dropping weights costs, against sums by hand") {
  const AvatarFolder folder;
  TestArrays arrays = avatar_arrays(2, 24);
  std::vector<double>& w = arrays["lbs_weights"].values;
  const double row[10] = {0.30, 0.20, 0.15, 0.10, 0.08, 0.06, 0.04, 0.03, 0.02, 0.02};
  for (std::size_t j = 0; j < 10; ++j) w[j] = row[9 - j] * 3;  // any sum will do
  // Joint j goes j metres along y: Gaussians move by the mean of their joints' numbers.
  std::vector<Affine3<double>> pose(24);
  double all = 0, four = 0, eight = 0;
  for (std::size_t j = 0; j < 24; ++j) pose[j] = {Mat3d::identity(), {0, static_cast<double>(j), 0}};
  for (std::size_t j = 0; j < 10; ++j) {
    const double term = row[j] * static_cast<double>(9 - j);
    all += term;
    four += j < 4 ? term / 0.75 : 0;
    eight += j < 8 ? term / 0.96 : 0;
  }
  io::LoadAvatarOptions options;
  options.weights.influences = 4;
  options.weights.poses = {std::vector<Affine3<double>>(24, {Mat3d::identity(), {}}), pose};
  const auto loaded = folder.load(arrays, options).value();
  CHECK(loaded.weights.most_weights == 10);
  CHECK(loaded.weights.poses == 2);
  CHECK(loaded.weights.dropped_mass == doctest::Approx(0.25).epsilon(1e-6));
  // The four that are kept are up to 3 m apart; their weights are rounded.
  CHECK(std::abs(loaded.weights.position_error - std::abs(four - all)) < 3 * 4.0 / (4 * kWeightParts));
  CHECK(loaded.weights.position_error_8 ==
        doctest::Approx(std::abs(eight - all)).epsilon(1e-5));  // weights are float
  CHECK(loaded.weights.needs_more == 1);
  REQUIRE(loaded.report.warnings.size() == 2);
  CHECK(contains(loaded.report.warnings[0], "1 rows do not sum to 1"));
  CHECK(contains(loaded.report.warnings[1], "1 Gaussians are off by up to"));
  CHECK(weight_of_parts(loaded.asset.skinning_weights[0]) == doctest::Approx(0.30 / 0.75).epsilon(1e-4));
  CHECK(loaded.asset.joint_indices[0] == 9);
  options.weights.influences = 8;
  const auto loaded8 = folder.load(arrays, options).value();
  CHECK(loaded8.asset.influences == 8);
  CHECK(loaded8.asset.joint_indices[7] == 2);
  CHECK(loaded8.weights.dropped_mass == doctest::Approx(0.04).epsilon(1e-6));
  CHECK(std::abs(loaded8.weights.position_error - std::abs(eight - all)) < 7 * 8.0 / (4 * kWeightParts));
  options.weights.influences = 6;
  CHECK(folder.load(arrays, options).code() == Errc::invalid_argument);
  options.weights.influences = 4;
  options.weights.tolerance = 10;
  CHECK(folder.load(arrays, options).value().weights.needs_more == 0);
  // Left to choose, it keeps four where that is within the bound, and eight where it is not or nobody
  // knows.
  options.weights.influences = 0;
  CHECK(folder.load(arrays, options).value().weights.influences == 4);
  options.weights.tolerance = 0.5 * std::abs(four - all);
  CHECK(folder.load(arrays, options).value().asset.influences == 8);
  CHECK(folder.load(arrays).value().asset.influences == 8);
  options.weights.poses[1].pop_back();
  CHECK(folder.load(arrays, options).code() == Errc::invalid_argument);
}

TEST_CASE("avatar file: the canonical pose is where the joints are, whatever the inverse binds") {
  const AvatarFolder folder;
  TestArrays arrays = avatar_arrays(24, 24);
  std::vector<double> x(24);
  for (std::size_t j = 0; j < 24; ++j) x[j] = 0.1 * static_cast<double>(j);
  translate_binds(arrays, x);
  const AvatarAsset asset = folder.load(arrays).value().asset;
  const auto globals = asset.skeleton.rest_globals();
  const auto inverse = asset.skeleton.bind_inverses();
  for (std::size_t j = 0; j < 24; ++j) {
    CHECK(globals[j].translation.x == doctest::Approx(-x[j]).epsilon(1e-6));
    const Affine3<double> m = globals[j] * inverse[j];
    CHECK(norm(m.translation) < 1e-12);
  }
}

TEST_CASE("avatar file: what is written is read back") {
  const AvatarFolder folder;
  HumanoidOptions options;
  options.gaussians = 2000;
  for (const int degree : {0, 2}) {
    options.sh_degree = degree;
    AvatarAsset asset = make_humanoid(options);
    asset.cloud.sh0[4] = -0.3f;
    if (degree == 0) {
      // Habitat-GS would take these for RGB.
      for (float& v : asset.cloud.sh0) v = std::abs(v) < 1 ? std::abs(v) : 0.9f;
    }
    REQUIRE(io::save_avatar(folder / "b.npz", asset).ok());
    const auto loaded = io::load_avatar(folder / "b.npz");
    CAPTURE(loaded.status().message());
    REQUIRE(loaded.ok());
    const AvatarAsset& back = loaded->asset;
    CHECK(back.cloud.means == asset.cloud.means);
    CHECK(back.cloud.scales == asset.cloud.scales);
    CHECK(back.cloud.opacities == asset.cloud.opacities);
    CHECK(back.cloud.sh0 == asset.cloud.sh0);
    CHECK(back.cloud.shN == asset.cloud.shN);
    CHECK(back.skeleton.names == asset.skeleton.names);
    CHECK(back.skeleton.parents == asset.skeleton.parents);
    double worst_quat = 0, worst_rest = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      for (std::size_t i = 0; i < asset.size(); ++i) {
        worst_quat =
            max(worst_quat, static_cast<double>(abs(back.cloud.quats[k][i] - asset.cloud.quats[k][i])));
      }
    }
    for (std::size_t j = 0; j < 55; ++j) {
      worst_rest = max(worst_rest, norm(back.skeleton.rest_local[j].translation -
                                        asset.skeleton.rest_local[j].translation));
    }
    CHECK(worst_quat < 1e-7);
    CHECK(back.skinning_weights == asset.skinning_weights);
    CHECK(worst_rest < 1e-14);
    CHECK(loaded->weights.most_weights <= 4);
  }
}

TEST_CASE("avatar file: rigs with names of their own") {
  const AvatarFolder folder;
  TestArrays arrays = avatar_arrays(6, 3);
  CHECK(folder.load(arrays).code() == Errc::unsupported);
  io::LoadAvatarOptions options;
  options.joint_names = {"root", "mid", "tip"};
  options.joint_parents = {-1, 0, 1};
  AvatarAsset asset = folder.load(arrays, options).value().asset;
  REQUIRE(io::save_avatar(folder / "b.npz", asset).ok());
  const auto back = io::load_avatar(folder / "b.npz");
  CAPTURE(back.status().message());
  REQUIRE(back.ok());
  CHECK(back->asset.skeleton.names == options.joint_names);
  CHECK(back->asset.skeleton.parents == options.joint_parents);
  options.joint_parents = {-1, 2, 1};  // a cycle
  CHECK(contains(folder.load(arrays, options).status().message(), "is its own ancestor"));
  options.joint_parents.pop_back();
  CHECK(folder.load(arrays, options).code() == Errc::invalid_argument);
}

TEST_CASE("avatar file: GART's parameters become the same avatar as activated ones") {
  const AvatarFolder folder;
  TestArrays plain = avatar_arrays(30, 24, 4), gart;
  gart["joints_inv_bind_matrix"] = plain["joints_inv_bind_matrix"];
  gart["lbs_weights"] = plain["lbs_weights"];
  gart["lbs_weights"].values[5] = -1e-3;  // corrections may go below zero
  gart["_xyz"] = plain["means"];
  gart["_rotation"] = plain["quats"];
  const auto logit = [](double p) { return std::log(p / (1 - p)); };
  for (double& v : plain["scales"].values) v = 0.005 + 0.4 * v;
  gart["_scaling"] = plain["scales"];
  for (double& v : gart["_scaling"].values) v = logit(v / 0.1);
  for (double& v : plain["opacities"].values) v = 0.25 + 0.5 * v;
  gart["_opacity"] = plain["opacities"];
  for (double& v : gart["_opacity"].values) v = logit(v);
  TestArray dc{{30, 3}, {}}, rest{{30, 9}, {}};
  for (std::size_t i = 0; i < 30; ++i) {
    const auto row = plain["shs"].values.begin() + static_cast<std::ptrdiff_t>(12 * i);
    dc.values.insert(dc.values.end(), row, row + 3);
    rest.values.insert(rest.values.end(), row + 3, row + 12);
  }
  gart["_features_dc"] = dc;
  gart["_features_rest"] = rest;
  const auto a = folder.load(plain).value().asset, b = folder.load(gart).value().asset;
  REQUIRE(a.size() == b.size());
  CHECK(a.joint_indices == b.joint_indices);
  CHECK(a.cloud.sh_degree == 1);
  CHECK(a.cloud.sh0 == b.cloud.sh0);
  CHECK(a.cloud.shN == b.cloud.shN);
  for (std::size_t i = 0; i < a.size(); ++i) {
    CHECK(a.cloud.mean(i) == b.cloud.mean(i));
    CHECK(a.cloud.opacities[i] == doctest::Approx(b.cloud.opacities[i]).epsilon(1e-5));
    for (std::size_t k = 0; k < 3; ++k)
      CHECK(a.cloud.scales[k][i] == doctest::Approx(b.cloud.scales[k][i]).epsilon(1e-5));
  }
  gart["max_scale"] = {{1}, {0.2}};
  CHECK(folder.load(gart).value().asset.cloud.scales[0][3] ==
        doctest::Approx(2 * a.cloud.scales[0][3]).epsilon(1e-5));
  gart["_features_rest"] = {{30, 6}, std::vector<double>(180, 0.0)};
  CHECK(contains(folder.load(gart).status().message(),
                 "_features_dc and _features_rest together have 3 coefficients"));
  gart.erase("_opacity");
  CHECK(contains(folder.load(gart).status().message(), "_opacity"));
}
