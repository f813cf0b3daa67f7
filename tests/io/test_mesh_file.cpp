// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "check_refused.hpp"
#include "gsnav/detail/io/mesh_file.hpp"
#include "support/data.hpp"
#include "support/files.hpp"

using namespace gsnav;
using namespace gsnav_test;
using Triangle = std::array<std::uint32_t, 3>;

namespace {

Result<TriangleMesh> parse(const std::string& text) {
  TempFolder folder("obj");
  write_file(folder / "a.obj", text);
  return io::load_obj(folder / "a.obj");
}

const std::string kFour = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

void check_fails(const std::string& text, const std::string& part) {
  check_refused(parse(text), Errc::invalid_file, "a.obj", "a.obj: " + part);
}

}  // namespace

TEST_CASE("obj: faces of every form") {
  const TriangleMesh m =
      parse("# comment\r\nmtllib a.mtl\no thing\n" + kFour +
            "vn 0 0 1\nvt 0 0\ns off\n\nf 1 2 3\nf 1/1 3/2/1 4//1\nf -4 -3 -1 # tail\n"
            "  f\t1 2 3 4  \r\nv +5e-1 -.25 1e2 0.1 0.2 0.3\nf 5 -1 1")
          .value();
  REQUIRE(m.vertices.size() == 5);
  CHECK(m.vertices[4].x == 0.5f);
  CHECK(m.vertices[4].y == -0.25f);
  CHECK(m.vertices[4].z == 100.0f);
  const std::vector<Triangle> expected = {{0, 1, 2}, {0, 2, 3}, {0, 1, 3},
                                          {0, 1, 2}, {0, 2, 3}, {4, 4, 0}};
  CHECK(m.triangles == expected);
  CHECK(parse("").value().vertices.empty());
}

TEST_CASE("obj: errors name line and word") {
  check_fails(kFour + "f 1 2\n", "line 5: a face of 2 corners");
  check_fails(kFour + "f\n", "line 5: a face of 0 corners");
  check_fails(kFour + "\nf 1 2 5\n", "line 6: face corner '5', must be 1 to 4");
  check_fails(kFour + "f 1 2 -5\n", "line 5: face corner '-5'");
  check_fails(kFour + "f 0 1 2\n", "line 5: face corner '0'");
  check_fails(kFour + "f 1 2 x\n", "line 5: face corner 'x'");
  check_fails(kFour + "f 1 2 3.5\n", "line 5: face corner '3.5'");
  check_fails(kFour + "f 1 2 /3\n", "line 5: face corner '/3'");
  check_fails(kFour + "f 1 2 99999999999999999999\n", "line 5: face corner '99999999999999999999'");
  check_fails("f 1 2 3\n" + kFour, "line 1: face corner '1'");
  check_fails("v 1 2\n", "line 1: coordinate z is ''");
  check_fails("v 1 nan 3\n", "line 1: coordinate y is 'nan'");
  check_fails("v 1 1e39 3\n", "line 1: coordinate y is '1e39'");
  check_fails("v 1 1e999 3\n", "line 1: coordinate y is '1e999'");
  check_fails("v 1,5 2 3\n", "line 1: coordinate x is '1,5'");
  CHECK(io::load_obj("/none/a.obj").code() == Errc::file_not_found);
}

TEST_CASE("obj: what is written comes back as the nearest float32") {
  const TempFolder folder("obj");
  const std::vector<Vec3d> vertices{{0.1, -2.5e-7, 1e20}, {1.0 / 3, 123456.789, -0.0}, {3, 4, 5}};
  const std::vector<std::array<std::uint32_t, 3>> triangles{{0, 1, 2}, {2, 1, 0}};
  REQUIRE(io::save_obj(folder / "a.obj", vertices, triangles).ok());
  const TriangleMesh read = io::load_obj(folder / "a.obj").value();
  REQUIRE(read.vertices.size() == 3);
  for (std::size_t i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) CHECK(read.vertices[i][k] == static_cast<float>(vertices[i][k]));
  }
  CHECK(read.triangles == triangles);
}

TEST_CASE("obj: what cannot be written is named and the file of before stays") {
  const TempFolder folder("obj");
  const std::vector<Vec3d> good{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, bad{{0, 0, 0}, {0, std::nan(""), 0}};
  const std::vector<std::array<std::uint32_t, 3>> one{{0, 1, 2}}, outside{{0, 1, 2}, {0, 1, 3}};
  REQUIRE(io::save_obj(folder / "a.obj", good, one).ok());
  const std::string before = read_file((folder / "a.obj").string());
  CHECK(io::save_obj(folder / "a.obj", bad, {}).message().find("vertex 1 is not finite") !=
        std::string::npos);
  CHECK(io::save_obj(folder / "a.obj", good, outside).message().find("triangle 1 names a vertex") !=
        std::string::npos);
  CHECK(read_file((folder / "a.obj").string()) == before);
  CHECK(io::save_obj(folder / "none" / "a.obj", good, one).code() == Errc::file_not_found);
}

TEST_CASE("obj: a real mesh") {
  const std::string path = data_file("nav/recast/nav_test.obj");
  if (path.empty()) return;
  const TriangleMesh m = io::load_obj(path).value();
  // Counted by line, and n - 2 triangles a face.
  std::size_t vertices = 0, triangles = 0;
  const std::string text = read_file(path);
  for (std::size_t at = 0; at < text.size(); at = text.find('\n', at) + 1) {
    const std::string line = text.substr(at, text.find_first_of("\r\n", at) - at);
    vertices += line.starts_with("v ") ? 1 : 0;
    if (!line.starts_with("f ")) continue;
    std::size_t corners = 0;
    for (std::size_t i = 1; i < line.size(); ++i)
      corners += line[i - 1] == ' ' && line[i] != ' ' ? 1 : 0;
    triangles += corners - 2;
  }
  CHECK(m.vertices.size() == vertices);
  CHECK(m.triangles.size() == triangles);
  CHECK(vertices == 884);
  CHECK(triangles > 1500);
}
