// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <functional>

#include "check_refused.hpp"
#include "glb_file.hpp"
#include "gsnav/detail/io/mesh_file.hpp"
#include "support/data.hpp"

using namespace gsnav;
using namespace gsnav_test;
using Triangle = std::array<std::uint32_t, 3>;

namespace {

Result<TriangleMesh> parse_mesh(const std::string& name, const std::string& text) {
  TempFolder folder("mesh_formats");
  write_file(folder / name, text);
  return io::load_mesh(folder / name);
}

void check_mesh_fails(const std::string& name, const std::string& text, const std::string& part,
                      Errc code = Errc::invalid_file) {
  check_refused(parse_mesh(name, text), code, name, part);
}

const std::string kPlyHead =
    "element vertex 4\nproperty float x\nproperty uchar red\nproperty double y\nproperty float z\n"
    "element face 2\nproperty uchar flags\nproperty list uchar int vertex_indices\nend_header\n";

/// Two faces of a unit square, as text or as bytes of either order.
std::string square_ply(const std::string& format) {
  std::string out = "ply\nformat " + format + " 1.0\n" + kPlyHead;
  const double points[4][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0.5}};
  if (format == "ascii") {
    for (const auto& p : points) {
      out += std::to_string(p[0]) + " 200 " + std::to_string(p[1]) + " " + std::to_string(p[2]) + "\n";
    }
    return out + "7 4 0 1 2 3\n7 3 2 1 0\n";
  }
  const auto add = [&](auto value) {
    std::string raw;
    put(raw, value);
    if (format == "binary_big_endian") std::reverse(raw.begin(), raw.end());
    out += raw;
  };
  for (const auto& p : points) {
    add(static_cast<float>(p[0]));
    add(std::uint8_t{200});
    add(p[1]);
    add(static_cast<float>(p[2]));
  }
  for (const std::vector<int>& face : {std::vector<int>{0, 1, 2, 3}, std::vector<int>{2, 1, 0}}) {
    add(std::uint8_t{7});
    add(static_cast<std::uint8_t>(face.size()));
    for (const int corner : face) add(corner);
  }
  return out;
}

/// A square of two triangles, its corners as bytes of a GLB.
std::string square_glb(const std::string& nodes = R"([{"mesh":0}])", const std::string& mode = "4",
                       const std::vector<std::uint16_t>& corners = {0, 1, 2, 0, 2, 3},
                       const std::string& count = "") {
  std::string binary;
  for (const float v : {0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 1.f, 1.f, 0.f, 0.f, 1.f, 0.f}) put(binary, v);
  for (const std::uint16_t c : corners) put(binary, c);
  const std::string n = std::to_string(corners.size());
  while (binary.size() % 4 != 0) binary += '\0';
  return GlbFile::glb(
      R"({"asset":{"version":"2.0"},"nodes":)" + nodes + R"(,"meshes":[{"primitives":[{"mode":)" + mode +
          R"(,"attributes":{"POSITION":0},"indices":1}]}],)" +
          R"("accessors":[{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"},)" +
          R"({"bufferView":1,"componentType":5123,"count":)" + (count.empty() ? n : count) +
          R"(,"type":"SCALAR"}],"bufferViews":[{"buffer":0,"byteLength":48},{"buffer":0,"byteOffset":48,)" +
          R"("byteLength":)" + std::to_string(2 * corners.size()) + R"(}],"buffers":[{"byteLength":)" +
          std::to_string(binary.size()) + "}]}",
      binary);
}

/// Twice the area vector, summed over the triangles: for a square in z = 0 it points along z.
Vec3d area(const TriangleMesh& m) {
  Vec3d sum{};
  for (const Triangle& t : m.triangles) {
    const auto at = [&](std::size_t k) { return vec_cast<double>(m.vertices[t[k]]); };
    sum = sum + cross(at(1) - at(0), at(2) - at(0));
  }
  return sum;
}

}  // namespace

TEST_CASE("ply mesh: text and both byte orders, other properties between") {
  for (const char* format : {"ascii", "binary_little_endian", "binary_big_endian"}) {
    CAPTURE(format);
    const TriangleMesh m = parse_mesh("a.ply", square_ply(format)).value();
    REQUIRE(m.vertices.size() == 4);
    CHECK(m.vertices[3] == Vec3f{0, 1, 0.5f});
    REQUIRE(m.triangles.size() == 3);
    CHECK(m.triangles[0] == Triangle{0, 1, 2});
    CHECK(m.triangles[1] == Triangle{0, 2, 3});
    CHECK(m.triangles[2] == Triangle{2, 1, 0});
  }
}

TEST_CASE("ply mesh: what makes no sense") {
  const std::string good = square_ply("ascii"), binary = square_ply("binary_little_endian");
  const std::size_t rows = good.find("end_header\n") + 11;
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string out = good;
    return out.replace(out.find(from, rows), from.size(), to);
  };
  check_mesh_fails("a.ply", with("4 0 1 2 3", "4 0 1 2 4"), "face 0: a corner outside of the 4");
  check_mesh_fails("a.ply", with("4 0 1 2 3", "4 0 1 2 -1"), "face 0: a corner outside");
  check_mesh_fails("a.ply", with("4 0 1 2 3", "4 0 1 2 0.5"), "face 0: a corner outside");
  check_mesh_fails("a.ply", with("3 2 1 0", "2 2 1"), "face 1 has 2 corners");
  check_mesh_fails("a.ply", with("3 2 1 0", "-3 2 1 0"), "'face' promises 2 rows, 1 are there");
  check_mesh_fails("a.ply", with("3 2 1 0", "1e300 2 1 0"), "'face' promises 2 rows, 1 are there");
  check_mesh_fails("a.ply", with("1.000000", "nan"), "is no finite number");
  check_mesh_fails("a.ply", "ply\nformat ascii 1.0\nelement face 0\nend_header\n",
                   "'face' comes before");
  check_mesh_fails("a.ply", "ply\nformat ascii 1.0\nelement vertex 0\nend_header\n", "property 'x'");
  std::string large = binary;
  large.replace(large.find("face 2"), 6, "face 999999999999");
  check_mesh_fails("a.ply", large, "'face' promises 999999999999 rows, 2 are there");
  large = binary;
  large.replace(large.find("vertex 4"), 8, "vertex 999999999999");
  check_mesh_fails("a.ply", large, "'vertex' promises 999999999999 rows");
  const std::size_t start = binary.find("end_header\n") + 11;
  for (std::size_t n = start; n < binary.size(); ++n) {
    REQUIRE(parse_mesh("a.ply", binary.substr(0, n)).code() == Errc::invalid_file);
  }
}

TEST_CASE("gltf mesh: triangles, strips and fans cover the same square") {
  for (const std::string& text : {square_glb(), square_glb(R"([{"mesh":0}])", "5", {0, 1, 3, 2}),
                                  square_glb(R"([{"mesh":0}])", "6", {0, 1, 2, 3})}) {
    const TriangleMesh m = parse_mesh("a.glb", text).value();
    CHECK(m.vertices.size() == 4);
    CHECK(m.triangles.size() == 2);
    CHECK(area(m) == Vec3d{0, 0, 2});
  }
}

TEST_CASE("gltf mesh: nodes place it; a mirrored one keeps its outside") {
  const TriangleMesh m =
      parse_mesh(
          "a.glb",
          square_glb(
              R"([{"children":[1],"translation":[0,0,5],"scale":[2,2,2]},{"mesh":0,"translation":[1,0,0]}])"))
          .value();
  CHECK(m.vertices[2] == Vec3f{4, 2, 5});
  CHECK(area(m) == Vec3d{0, 0, 8});
  // Mirrored at x = 0 and at z = 0: outsides turn with the second only.
  CHECK(area(parse_mesh("a.glb", square_glb(R"([{"mesh":0,"scale":[-1,1,1]}])")).value()) ==
        Vec3d{0, 0, 2});
  CHECK(area(parse_mesh("a.glb", square_glb(R"([{"mesh":0,"scale":[1,1,-1]}])")).value()) ==
        Vec3d{0, 0, -2});
}

TEST_CASE("gltf mesh: what makes no sense") {
  check_mesh_fails("a.glb", square_glb(R"([{"mesh":0}])", "4", {0, 1, 4}), "corner 4 of 4 vertices");
  check_mesh_fails("a.glb", square_glb(R"([{"mesh":0}])", "4", {0, 1, 2}, "4"),
                   "accessors[1]: 4 elements");
  check_mesh_fails("a.glb", square_glb(R"([{"mesh":0}])", "4", {0, 1, 2}, "4294967295"),
                   "accessors[1]: 4294967295 elements");
  check_mesh_fails("a.glb", square_glb(R"([{"mesh":0}])", "0"), "no triangles");
  check_mesh_fails("a.glb", square_glb(R"([{"mesh":0,"scale":[1e300,1,1]}])"), "is not finite");
  check_mesh_fails("a.glb", square_glb("[]"), "no triangles");
  check_mesh_fails("a.stl", "solid", "not a mesh that is read here", Errc::unsupported);
  CHECK(io::load_mesh("none.glb").code() == Errc::file_not_found);
}

TEST_CASE("gltf mesh: real files") {
  struct Expected {
    const char* path;
    std::size_t triangles;
    double size[3];  ///< of the bounding box, file's units; 0: not known
  };
  const Expected all[] = {{"nav/habitat/simple_room.glb", 84, {0, 0, 0}},
                          {"nav/glb/vr-gallery.glb", 0, {10, 5, 10}},
                          {"avatars/cesium_man.gltf", 0, {0, 0, 0}}};
  for (const Expected& e : all) {
    const std::string path = data_file(e.path);
    if (path.empty()) continue;
    CAPTURE(path);
    const TriangleMesh m = io::load_mesh(path).value();
    CHECK(m.triangles.size() > 0);
    if (e.triangles != 0) CHECK(m.triangles.size() == e.triangles);
    Vec3f low = m.vertices[0], high = low;
    for (const Vec3f& v : m.vertices) {
      for (int k = 0; k < 3; ++k) {
        low[k] = std::min(low[k], v[k]);
        high[k] = std::max(high[k], v[k]);
      }
    }
    for (int k = 0; k < 3; ++k) {
      if (e.size[k] != 0)
        CHECK(static_cast<double>(high[k] - low[k]) == doctest::Approx(e.size[k]).epsilon(0.2));
    }
  }
}
