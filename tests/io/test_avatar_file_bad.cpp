// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cmath>
#include <cstdio>
#include <random>

#include "allocations.hpp"
#include "avatar_npz.hpp"
#include "gsnav/detail/io/avatar_file.hpp"
#include "gsnav/io/image_file.hpp"
#include "zip_file.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

/// The error for `arrays` names the file and all `parts`.
void check_fails(const TestArrays& arrays, Errc code, const std::vector<std::string>& parts) {
  TempFolder folder("avatar_bad");
  write_npz(folder / "some.npz", arrays);
  const Status s = io::load_avatar(folder / "some.npz").status();
  CAPTURE(s.message());
  CHECK(s.code() == code);
  CHECK(contains(s.message(), "some.npz"));
  for (const std::string& part : parts) {
    CAPTURE(part);
    CHECK(contains(s.message(), part));
  }
}

template <class F>
TestArrays changed(F&& change) {
  TestArrays arrays = avatar_arrays(30, 24);
  change(arrays);
  return arrays;
}

}  // namespace

TEST_CASE("avatar file: each array must be there") {
  for (const auto& [name, array] : avatar_arrays(3, 24)) {
    check_fails(changed([&, key = name](TestArrays& a) { a.erase(key); }), Errc::invalid_file,
                {"there is no array '" + name + "'"});
  }
}

TEST_CASE("avatar file: numbers that are none") {
  for (const auto& [name, array] : avatar_arrays(3, 24)) {
    for (const double v : {static_cast<double>(NAN), HUGE_VAL, -HUGE_VAL}) {
      check_fails(changed([&, key = name](TestArrays& a) { a[key].values[17] = v; }), Errc::invalid_file,
                  {name, "row"});
    }
  }
}

TEST_CASE("avatar file: shapes that do not fit each other") {
  const auto rows = [](const char* name, std::size_t n, std::size_t row) {
    return changed([=](TestArrays& a) {
      a[name].values.resize(n * row, 0.25);
      a[name].shape = {n, row};
    });
  };
  check_fails(rows("means", 30, 4), Errc::invalid_file,
              {"means has the shape [30, 4], must be [any, 3]"});
  check_fails(rows("means", 0, 3), Errc::invalid_file, {"no Gaussians"});
  check_fails(rows("scales", 29, 3), Errc::invalid_file,
              {"scales has the shape [29, 3], must be [30, 3]"});
  check_fails(rows("quats", 30, 3), Errc::invalid_file, {"quats", "must be [30, 4]"});
  check_fails(rows("opacities", 31, 1), Errc::invalid_file, {"opacities", "must be [30, 1]"});
  check_fails(rows("lbs_weights", 30, 55), Errc::invalid_file, {"lbs_weights", "must be [30, 24]"});
  check_fails(rows("joints_inv_bind_matrix", 24, 15), Errc::invalid_file,
              {"joints_inv_bind_matrix", "[24, 15]"});
  check_fails(rows("shs", 30, 4), Errc::invalid_file, {"shs", "[30, 4]"});
  for (const std::size_t k : {2u, 25u}) {
    check_fails(changed([k](TestArrays& a) {
                  a["shs"].values.resize(90 * k, 0.5);
                  a["shs"].shape = {30, k, 3};
                }),
                Errc::unsupported, {"shs has " + std::to_string(k) + " coefficients"});
  }
  check_fails(changed([](TestArrays& a) {
                a["joints_inv_bind_matrix"] = identities(25);
                a["lbs_weights"].shape = {30, 25};
                a["lbs_weights"].values.resize(750, 0.25);
              }),
              Errc::unsupported, {"has 25 joints"});
  check_fails(changed([](TestArrays& a) { a["joints_inv_bind_matrix"] = identities(4097); }),
              Errc::unsupported, {"more than 4096"});
}

TEST_CASE("avatar file: values that cannot be") {
  check_fails(changed([](TestArrays& a) { a["scales"].values[10] = -0.5; }), Errc::invalid_file,
              {"scales: row 3 has -0.5"});
  check_fails(changed([](TestArrays& a) { a["opacities"].values[4] = 1.5; }), Errc::invalid_file,
              {"opacities: row 4 has 1.5"});
  check_fails(changed([](TestArrays& a) { a["opacities"].values[4] = -0.5; }), Errc::invalid_file,
              {"opacities: row 4"});
  check_fails(changed([](TestArrays& a) { a["lbs_weights"].values[50] = -0.5; }), Errc::invalid_file,
              {"lbs_weights: row 2 has -0.5"});
  check_fails(changed([](TestArrays& a) { a["lbs_weights"].values[24 * 5 + 5] = 0; }),
              Errc::invalid_file, {"lbs_weights: row 5 is all zero"});
  check_fails(changed([](TestArrays& a) {
                for (double& v : a["opacities"].values) v = 0;
              }),
              Errc::invalid_file, {"no Gaussian can be seen"});
  check_fails(changed([](TestArrays& a) { a["means"].values[3] = 1000; }), Errc::unsupported, {"32 m"});
  const std::vector<std::pair<std::size_t, double>> not_rigid{{0, 1.01}, {1, 0.1},  {5, -1.0},
                                                              {12, 0.5}, {15, 2.0}, {15, 0.0}};
  for (const auto& [at, value] : not_rigid) {
    check_fails(changed([p = at, v = value](TestArrays& a) {
                  a["joints_inv_bind_matrix"].values[16 * 7 + p] = v;
                }),
                Errc::invalid_file, {"joints_inv_bind_matrix: the matrix of joint 7 is not rigid"});
  }
}

TEST_CASE("avatar file: the kind of skinning comes back; one that there is none of is named") {
  TempFolder folder("avatar_skinning");
  for (const Skinning kind : {Skinning::linear, Skinning::linear_stretched, Skinning::dual_quaternion}) {
    write_npz(folder / "a.npz", changed([kind](TestArrays& a) {
                a["skinning"].values = {static_cast<double>(kind)};
                a["skinning"].shape = {1};
              }));
    const auto loaded = io::load_avatar(folder / "a.npz");
    CAPTURE(loaded.status().message());
    REQUIRE(loaded.ok());
    CHECK(loaded->asset.skinning == kind);
    REQUIRE(io::save_avatar(folder / "b.npz", loaded->asset).ok());
    const auto again = io::load_avatar(folder / "b.npz");
    REQUIRE(again.ok());
    CHECK(again->asset.skinning == kind);
    CHECK(again->asset.weight_gradients.size() == loaded->asset.weight_gradients.size());
  }
  check_fails(changed([](TestArrays& a) {
                a["skinning"].values = {3};
                a["skinning"].shape = {1};
              }),
              Errc::invalid_file, {"skinning is 3"});
}

TEST_CASE("avatar file: joints that are their own ancestors") {
  TempFolder folder("avatar_cycle");
  write_npz(folder / "a.npz", avatar_arrays(30, 24));
  io::LoadAvatarOptions options;
  for (int j = 0; j < 24; ++j) {
    options.joint_names.emplace_back("j").append(std::to_string(j));
    options.joint_parents.push_back(j - 1);
  }
  CHECK(io::load_avatar(folder / "a.npz", options).ok());
  options.joint_parents[3] = 5;
  const Status s = io::load_avatar(folder / "a.npz", options).status();
  CAPTURE(s.message());
  CHECK(s.code() == Errc::invalid_argument);
  CHECK(contains(s.message(), "a.npz"));
  CHECK(contains(s.message(), "joint 3 (\"j3\") is its own ancestor"));
}

TEST_CASE("avatar file: changed bytes of every array, in an archive whose checksums fit") {
  TempFolder folder("avatar_mutations");
  std::map<std::string, std::string> files;
  for (const auto& [name, array] : avatar_arrays(30, 24)) {
    const std::vector<float> values(array.values.begin(), array.values.end());
    REQUIRE(io::save_npy(folder / "x.npy", values, array.shape).ok());
    files[name + ".npy"] = read_file(folder / "x.npy");
  }
  std::mt19937 generator(11);
  int refused = 0;
  for (int i = 0; i < 1500; ++i) {
    std::vector<ZipFileEntry> entries;
    const std::size_t chosen = generator() % files.size();
    for (const auto& [name, content] : files) {
      entries.push_back({name, content, i % 2 == 0});
      if (entries.size() - 1 != chosen) continue;
      std::string& text = entries.back().content;
      const std::size_t at = i % 3 == 0 ? generator() % 128 : generator() % text.size();
      if (i % 7 == 0) {
        text.erase(at, 1 + generator() % 40);
      } else {
        text[at] = static_cast<char>(generator());
      }
    }
    write_file(folder / "some.npz", make_zip(entries));
    reset_largest_allocation();
    const auto loaded = io::load_avatar(folder / "some.npz");
    REQUIRE(largest_allocation() < 1000000);
    if (loaded.ok()) {
      REQUIRE(loaded->asset.validate().ok());
    } else {
      REQUIRE(contains(loaded.status().message(), "some.npz"));
      ++refused;
    }
  }
  std::printf("avatar: of 1500 mutations %d were refused\n", refused);
  CHECK(refused > 300);
  CHECK(io::load_avatar(folder / "none.npz").code() == Errc::file_not_found);
  CHECK(io::save_avatar(folder / "b.npz", {}).code() == Errc::invalid_argument);
}
