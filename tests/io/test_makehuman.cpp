// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

#include "gsnav/detail/io/skinned_mesh_file.hpp"
#include "support/data.hpp"
#include "support/files.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

struct Files {
  std::string obj =
      "# body\nv 0 0 0\nv 1 0 0\nv 1 2 0\nv 0 2 0\nv 0 2 1\nv 5 -9 5\nvt 0 0\n"
      "g helper\nf 1 2 6\ng body\nf 1/1 2/1 3/1 4/1\nf 4 3 5\n";
  std::string skeleton =
      R"({"bones": {"arm": {"head": "a", "tail": "b", "parent": "base"},
"base": {"head": "b", "tail": "a", "parent": null}},
          "joints": {"a": [2, 3], "b": [5, 0]}, "weights_file": "folder/w.mhw"})";
  std::string weights =
      R"({"weights": {"base": [[0, 1], [1, 0.5], [2, 0.25]], "arm": [[2, 0.5], [3, 0.3], [5, 9]]}})";
  std::string target = "# target\n2 .5 0 -1e-1\n5 0 0 2\n";
};

Result<io::LoadedSkinnedMesh> load(const Files& files, double amount = 0) {
  TempFolder folder("makehuman");
  write_file(folder / "some.obj", files.obj);
  write_file(folder / "some.mhskel", files.skeleton);
  write_file(folder / "w.mhw", files.weights);
  write_file(folder / "some.target", files.target);
  io::MakeHumanOptions options;
  options.skeleton = folder / "some.mhskel";
  if (amount != 0) options.targets = {{folder / "some.target", amount}};
  return io::load_makehuman(folder / "some.obj", options);
}

}  // namespace

TEST_CASE("makehuman: a body by hand") {
  const auto m = load({}, 2.0);
  CAPTURE(m.status().message());
  REQUIRE(m.ok());
  // Vertices 0 to 4 are the surface; it faces -Z in metres and stands on the floor.
  REQUIRE(m->mesh.positions.size() == 5);
  REQUIRE(m->mesh.triangles.size() == 3);
  CHECK(norm(m->mesh.positions[2] - Vec3d{-0.2, 0.2, 0.02}) <
        1e-12);  // 1 + 2 * 0.5, 2, -0.2, turned, times 0.1
  CHECK(m->mesh.skeleton.names == std::vector<std::string>{"base", "arm"});
  const auto rest = m->mesh.skeleton.rest_globals();
  CHECK(norm(rest[0].translation - Vec3d{-0.25, -0.45, -0.45}) < 1e-12);  // (5, -9, 5 + 4) and (0, 0, 0)
  CHECK(norm(rest[1].translation - Vec3d{-0.1, 0.2, 0.01}) < 1e-12);
  CHECK(m->report.unequal_weights == 3);
  CHECK(m->report.without_weights == 1);
  CHECK(m->report.least_weight_sum == doctest::Approx(0.3));
  const auto weight = [&](std::size_t v, std::uint16_t joint) {
    double sum = 0;
    for (std::size_t k = v * m->mesh.influences; k < (v + 1) * m->mesh.influences; ++k) {
      sum += m->mesh.joint_indices[k] == joint ? static_cast<double>(m->mesh.weights[k]) : 0.0;
    }
    return sum;
  };
  CHECK(weight(1, 0) == doctest::Approx(1.0));
  CHECK(weight(2, 1) == doctest::Approx(2.0 / 3));
  CHECK(weight(2, 0) == doctest::Approx(1.0 / 3));
  CHECK(weight(3, 1) == doctest::Approx(1.0));
  CHECK(weight(4, 1) == doctest::Approx(1.0));  // as its nearest neighbour, vertex 3
}

TEST_CASE("makehuman: what is wrong is named") {
  const auto fails = [](std::string Files::*which, const std::string& from, const std::string& to,
                        const std::string& part) {
    Files files;
    std::string& text = files.*which;
    text.replace(text.find(from), from.size(), to);
    const Status s = load(files, 1.0).status();
    CAPTURE(s.message());
    CHECK(s.code() == Errc::invalid_file);
    CHECK(contains(s.message(), part));
  };
  fails(&Files::obj, "v 1 2 0", "v 1 two 0", "line 4: 'two' is not a number");
  fails(&Files::obj, "f 4 3 5", "f 4 3 7", "'7', must be 1 to 6");
  fails(&Files::obj, "f 4 3 5", "f 4 3", "a face of 2 corners");
  fails(&Files::obj, "g body", "g head", "no faces in the group 'body'");
  fails(&Files::skeleton, "\"base\"}", "\"chest\"}", "has the parent 'chest'");
  fails(&Files::skeleton, "\"parent\": null", "\"parent\": \"arm\"", "its own ancestor");
  fails(&Files::skeleton, "\"arm\"", "\"\"",
        "a bone has no name");  // once its own child for ever, found by fuzzing
  fails(&Files::skeleton, "[5, 0]", "[6, 0]", "names vertex '6' of 6");
  fails(&Files::skeleton, "\"head\": \"a\"", "\"head\": \"q\"", "there is no joint");
  fails(&Files::skeleton, "{\"bones\"", "{\"bonez\"", "no 'bones'");
  fails(&Files::weights, "\"arm\"", "\"leg\"", "'leg' is not in the skeleton");
  fails(&Files::weights, "[2, 0.5]", "[2, -0.5]", "is no vertex with a weight");
  fails(&Files::weights, "[2, 0.5]", "[2]", "is no vertex with a weight");
  fails(&Files::target, "2 .5", "8 .5", "vertex '8' of 6");
  fails(&Files::target, "-1e-1", "x", "'x' is not a number");
  CHECK(io::load_makehuman("/none/a.obj", {}).code() == Errc::file_not_found);
  io::MakeHumanOptions options;
  options.scale = -1;
  CHECK(io::load_makehuman("/none/a.obj", options).code() == Errc::invalid_argument);
}

TEST_CASE("makehuman: the real body") {
  const std::string path = data_file("avatars/makehuman_cc0/base.obj");
  if (path.empty()) return;
  const std::filesystem::path folder = std::filesystem::path(path).parent_path();
  io::MakeHumanOptions options;
  options.skeleton = folder / "default.mhskel";
  options.targets = {{folder / "caucasian-male-young.target", 1.0},
                     {folder / "universal-male-young-averagemuscle-averageweight.target", 1.0}};
  const auto m = io::load_makehuman(path, options);
  CAPTURE(m.status().message());
  REQUIRE(m.ok());
  double high = 0;
  for (const Vec3d& p : m->mesh.positions) high = std::max(high, p.y);
  std::printf(
      "makehuman: %zu vertices, %.2f m, %zu joints, weights sum to %.2f to %.2f, %zu unequal, %zu "
      "without\n",
      m->mesh.positions.size(), high, m->mesh.skeleton.size(), m->report.least_weight_sum,
      m->report.greatest_weight_sum, m->report.unequal_weights, m->report.without_weights);
  CHECK(m->mesh.positions.size() == 13380);
  CHECK(m->mesh.skeleton.size() == 163);
  CHECK(high > 1.6);
  CHECK(high < 2.0);
  CHECK(m->report.unequal_weights > 0);
  // Feet point to -Z.
  const auto rest = m->mesh.skeleton.rest_globals();
  const auto at = [&](const char* n) {
    return rest[static_cast<std::size_t>(m->mesh.skeleton.find(n))].translation;
  };
  CHECK(at("toe2-1.L").z < at("foot.L").z - 0.05);
  CHECK(at("foot.L").x < 0);  // its left is on -X
  CHECK(at("head").y > at("neck01").y);
}
