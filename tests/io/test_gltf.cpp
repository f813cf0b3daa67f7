// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>

#include "allocations.hpp"
#include "check_cloud.hpp"
#include "check_refused.hpp"
#include "check_turned.hpp"
#include "glb_file.hpp"
#include "gsnav/detail/io/gltf.hpp"
#include "gsnav/detail/io/ply.hpp"
#include "gsnav/io/scene_file.hpp"
#include "row_clouds.hpp"
#include "spz_file.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

constexpr int kRest[] = {0, 9, 24, 45};

GlbFile small_file(int degree = 1, std::size_t n = 5) {
  GlbFile file;
  file.degree = degree;
  file.rows = random_rows(n, kRest[degree], 71);
  return file;
}

LoadedCloud parse(const GlbFile& file, const io::LoadGltfOptions& options = {}) {
  const std::string text = file.text();
  return io::parse_gltf(bytes_of(text), "some.glb", options).value();
}

void check_fails(const std::string& text, Errc code, const std::string& part) {
  check_refused(io::parse_gltf(bytes_of(text), "some.glb"), code, "some.glb", part);
}

const Quatd kHalfTurn{0, 0, 0, 1};

}  // namespace

TEST_CASE("gltf: the Gaussians of a PLY, in its axes") {
  for (int degree = 0; degree <= 3; ++degree) {
    CAPTURE(degree);
    const GlbFile file = small_file(degree, 60);
    const LoadedCloud loaded = parse(file);
    check_consistent(loaded);
    CHECK(loaded.cloud.sort_order == SortOrder::camera_distance);
    CHECK(loaded.report.warnings.empty());
    CHECK(loaded.report.sh_degree == degree);
    const GaussianCloud want = cloud_of(file.rows, kRest[degree]);
    REQUIRE(loaded.cloud.size() == 60);
    for (std::size_t i = 0; i < 60; ++i) {
      CHECK(near(loaded.cloud.opacities[i], want.opacities[i]));
    }
    GaussianCloud copy = loaded.cloud;
    copy.opacities = want.opacities;
    check_turned(want, copy, {});
    // As stored: glTF's own axes.
    GaussianCloud kept = parse(file, {.keep_axes = true}).cloud;
    kept.opacities = want.opacities;
    check_turned(want, kept, {kHalfTurn, {}, 1});
  }
}

TEST_CASE("gltf: nodes move, turn and scale what they hold; a mesh may stand twice") {
  GlbFile file = small_file(3, 20);
  file.nodes =
      R"([{"children":[2,1],"rotation":[0.5,0.5,-0.5,0.5],"scale":[2,2,2]},{"mesh":0,"translation":[1,2,3]},)"
      R"({"mesh":0,"matrix":[0,1.5,0,0,-1.5,0,0,0,0,0,1.5,0,-4,0,100000,1]}])";
  const LoadedCloud loaded = parse(file, {.keep_axes = true});
  check_consistent(loaded);
  REQUIRE(loaded.cloud.size() == 40);
  GlbFile plain = file;
  plain.nodes = R"([{"mesh":0}])";
  const GaussianCloud base = parse(plain, {.keep_axes = true}).cloud;
  const Similarity parent{{0.5, 0.5, 0.5, -0.5}, {}, 2};
  const double half = std::sqrt(0.5);
  const Similarity children[] = {{{half, 0, 0, half}, {-4, 0, 100000}, 1.5}, {{}, {1, 2, 3}, 1}};
  GaussianCloud want = base;
  REQUIRE(append(want, base).ok());
  for (std::size_t child = 0; child < 2; ++child) {
    const Similarity world = parent * children[child];
    for (std::size_t i = 0; i < 20; ++i) {
      const Vec3d mean = world * base.mean(i), got = loaded.cloud.mean(20 * child + i);
      CHECK(norm(got - mean) <= 2e-6 * (1 + 64));
      CHECK(loaded.cloud.scales[0][20 * child + i] ==
            doctest::Approx(static_cast<double>(base.scales[0][i]) * world.scale).epsilon(1e-6));
      const Vec3d d{0.6, -0.48, 0.64};
      CHECK(norm(colour_of(loaded.cloud, 20 * child + i, rotate(world.rotation, d)) -
                 colour_of(base, i, d)) < 1e-5);
    }
  }
  CHECK(norm(loaded.report.bounds.high - loaded.report.bounds.low) > 190000);
}

TEST_CASE("gltf: bytes, strides, JSON with its buffer beside or inside") {
  TempFolder folder("gltf");
  GlbFile file = small_file(1);
  const GaussianCloud want = parse(file).cloud;
  file.bytes = true;
  const GaussianCloud packed = parse(file).cloud;
  CHECK(packed.scales == want.scales);
  CHECK(packed.means == want.means);
  for (std::size_t i = 0; i < 5; ++i)
    CHECK(std::fabs(packed.opacities[i] - want.opacities[i]) < 0.51 / 255);
  file.bytes = false;
  write_file(folder / "a.glb", file.text());
  write_file(folder / "b.bin", file.binary());
  file.uri = "b.bin";
  write_file(folder / "b.gltf", file.json());
  file.uri = "data:application/octet-stream;base64," + GlbFile::base64(file.binary());
  write_file(folder / "c.gltf", file.json());
  for (const char* name : {"a.glb", "b.gltf", "c.gltf"}) {
    const GaussianCloud c = io::load_gltf(folder / name).value().cloud;
    CHECK(c.means == want.means);
    CHECK(c.shN == want.shN);
    CHECK(io::load_scene((folder / name).string()).value().cloud.size() == 5);
  }
  file.uri = "gone.bin";
  write_file(folder / "d.gltf", file.json());
  CHECK(io::load_gltf(folder / "d.gltf").code() == Errc::file_not_found);
  for (const char* uri :
       {"../b.bin", "/etc/passwd", "http://a/b.bin", "data:x;base64,@@@", "data:x,abc"}) {
    file.uri = uri;
    write_file(folder / "e.gltf", file.json());
    const auto bad = io::load_gltf(folder / "e.gltf");
    CHECK(bad.code() == Errc::invalid_file);
    CHECK(contains(bad.message(), "buffers[0]"));
  }
}

TEST_CASE("save_glb: nothing is lost but the filter and float64") {
  TempFolder folder("save_glb");
  for (int degree = 0; degree <= 3; ++degree) {
    std::vector<PlyRow> rows = random_rows(50, kRest[degree], 72);
    rows[3]["scale_1"] = -INFINITY;
    rows[4]["opacity"] = INFINITY;
    const GaussianCloud cloud = cloud_of(rows, kRest[degree]);
    for (const bool keep : {false, true}) {
      REQUIRE(io::save_glb(folder / "a.glb", cloud, {.keep_axes = keep}).ok());
      const LoadedCloud loaded = io::load_gltf(folder / "a.glb", {.keep_axes = keep}).value();
      check_consistent(loaded);
      CHECK(loaded.report.warnings.empty());
      CHECK(loaded.cloud.means == cloud.means);
      CHECK(loaded.cloud.opacities == cloud.opacities);
      check_turned(cloud, loaded.cloud, {}, 2e-7);
    }
    REQUIRE(io::save_glb(folder / "a.glb", cloud).ok());
    check_turned(cloud, io::load_gltf(folder / "a.glb", {.keep_axes = true}).value().cloud,
                 {kHalfTurn, {}, 1}, 2e-7);
  }
  // Far from zero the node carries what float32 cannot.
  std::vector<PlyRow> rows = random_rows(5, 0, 73);
  for (PlyRow& row : rows) row["x"] += 1e6;
  const GaussianCloud far = cloud_of(rows, 0);
  REQUIRE(io::save_glb(folder / "far.glb", far).ok());
  const GaussianCloud got = io::load_gltf(folder / "far.glb").value().cloud;
  for (std::size_t i = 0; i < 5; ++i) CHECK(norm(got.mean(i) - far.mean(i)) < 1e-5);
  CHECK(io::save_glb(folder / "none/a.glb", far).code() == Errc::file_not_found);
  CHECK(io::save_glb(folder / "a.glb", GaussianCloud{}).code() == Errc::invalid_argument);
  GaussianCloud broken = far;
  broken.sh_degree = 1;
  CHECK(io::save_glb(folder / "a.glb", broken).code() == Errc::invalid_argument);
}

TEST_CASE("gltf: what the extension may say") {
  GlbFile file = small_file();
  file.splats =
      R"({"kernel":"ellipse","colorSpace":"lin_rec709_display","sortingMethod":"cameraDistance"})";
  REQUIRE(parse(file).report.warnings.size() == 1);
  CHECK(contains(parse(file).report.warnings[0], "lin_rec709_display"));
  CHECK(parse(file).cloud.color_space == ColorSpace::linear);
  CHECK(parse(small_file()).cloud.color_space == ColorSpace::display);
  {
    const TempFolder kept("gltf_space");
    for (const ColorSpace space : {ColorSpace::display, ColorSpace::linear}) {
      GaussianCloud cloud = parse(small_file()).cloud;
      cloud.color_space = space;
      io::save_glb(kept / "a.glb", cloud).throw_if_error();
      CHECK(io::load_gltf(kept / "a.glb").value().cloud.color_space == space);
    }
  }
  file.splats = R"({"kernel":"ellipse","colorSpace":"custom"})";
  CHECK(contains(parse(file).report.warnings[0], "as if they were srgb_rec709_display"));
  file.splats = R"({"kernel":"box","colorSpace":"srgb_rec709_display"})";
  check_fails(file.text(), Errc::unsupported, "node 0: kernel '\"box\"'");
  file.splats = R"({"kernel":"ellipse","colorSpace":"srgb_rec709_display","sortingMethod":"z"})";
  check_fails(file.text(), Errc::unsupported, "its sorting");
  file.splats = R"({"kernel":"ellipse"})";
  check_fails(file.text(), Errc::invalid_file, "colorSpace");
  file.splats = R"({"kernel":"ellipse","colorSpace":"srgb_rec709_display","extensions":)"
                R"({"KHR_gaussian_splatting_compression_spz_2":{"bufferView":0}}})";
  check_fails(file.text(), Errc::unsupported, "a draft");
  // With an SPZ in its buffer; the axes are the file's.
  SpzFile spz;
  spz.rows = random_rows(4, 0, 74);
  const std::string bytes = spz.text();
  const std::string json =
      R"({"asset":{"version":"2.0"},"nodes":[{"mesh":0}],"meshes":[{"primitives":[{"mode":0,"attributes":{},)"
      R"("extensions":{"KHR_gaussian_splatting":)" +
      file.splats + R"(}}]}],"bufferViews":[{"buffer":0,"byteLength":)" + std::to_string(bytes.size()) +
      R"(}],"buffers":[{"byteLength":)" + std::to_string(bytes.size()) + "}]}";
  const std::string text = GlbFile::glb(json, bytes);
  const LoadedCloud loaded =
      io::parse_gltf(bytes_of(text), "a.glb", {.keep_axes = true, .spz_compression = true}).value();
  REQUIRE(loaded.cloud.size() == 4);
  // The builder turned the PLY's y and z for SPZ.
  CHECK(loaded.cloud.mean(1).y == doctest::Approx(-spz.rows[1]["y"]).epsilon(1e-3));
}

TEST_CASE("gltf: files that make no sense") {
  const GlbFile file = small_file();
  const std::string text = file.text(), json = file.json(), binary = file.binary();
  check_fails("", Errc::invalid_file, "JSON");
  check_fails("no glTF", Errc::invalid_file, "JSON");
  check_fails("{}", Errc::invalid_file, "asset.version");
  check_fails(R"({"asset":{"version":"1.0"}})", Errc::unsupported, "version");
  check_fails(R"({"asset":{"version":"2.0"}})", Errc::invalid_file, "no primitive with");
  for (const char* name :
       {"POSITION", "ROTATION", "SCALE", "OPACITY", "SH_DEGREE_0_COEF_0", "SH_DEGREE_1_COEF_2"}) {
    GlbFile broken = file;
    broken.skip = name;
    check_fails(broken.text(), Errc::invalid_file, name);
  }
  const auto with = [&](const std::string& from, const std::string& to) {
    return GlbFile::glb(replaced(json, from, to), binary);
  };
  check_fails(with("\"count\":5", "\"count\":6"), Errc::invalid_file, "accessors[0]: 6 elements");
  check_fails(with("\"count\":5", "\"count\":4"), Errc::invalid_file, "has 5 elements, POSITION has 4");
  check_fails(with("\"count\":5", "\"count\":4294967295"), Errc::invalid_file,
              "accessors[0]: 4294967295 elements");
  check_fails(with("\"count\":5", "\"count\":-1"), Errc::invalid_file, "count");
  check_fails(with("\"count\":5", "\"count\":1e300"), Errc::invalid_file, "count");
  check_fails(with("\"componentType\":5126", "\"componentType\":5130"), Errc::invalid_file, "5130");
  check_fails(with("VEC3", "MAT3"), Errc::invalid_file, "MAT3");
  check_fails(with("VEC3", "VEC4"), Errc::invalid_file, "");
  check_fails(with("\"byteOffset\":0", "\"byteOffset\":4294967295"), Errc::invalid_file,
              "bufferViews[0]");
  check_fails(with("\"buffer\":0", "\"buffer\":1"), Errc::invalid_file, "bufferViews[0]");
  check_fails(with("\"bufferView\":0,", ""), Errc::unsupported, "without a buffer view");
  check_fails(with("\"bufferView\":0,", "\"bufferView\":99,"), Errc::invalid_file,
              "'bufferView' is '99'");
  check_fails(with("\"mesh\":0", "\"mesh\":7"), Errc::invalid_file, "'mesh' is '7'");
  check_fails(with("\"POSITION\":0", "\"POSITION\":77"), Errc::invalid_file,
              "'accessors' has no object 77");
  check_fails(GlbFile::glb(json, binary.substr(4)), Errc::invalid_file, "byteLength");
  GlbFile ring = file;
  for (const char* nodes :
       {R"([{"mesh":0,"children":[0]}])", R"([{"children":[1]},{"children":[0]}])"}) {
    ring.nodes = nodes;
    check_fails(ring.text(), Errc::invalid_file, "its own ancestor");
  }
  ring.nodes = R"([{"children":[1,1]},{}])";
  check_fails(ring.text(), Errc::invalid_file, "nodes[1] hangs on two nodes");
  ring.nodes = R"([{"mesh":0}])";
  ring.scene = R"(,"scenes":[{"nodes":[0,0]}])";
  check_fails(ring.text(), Errc::invalid_file, "nodes[0] comes twice");
  GlbFile uneven = file;
  uneven.nodes = R"([{"mesh":0,"name":"flat","scale":[1,0,1]}])";
  check_fails(uneven.text(), Errc::unsupported, "node 0 '\"flat\"': its transform");
  uneven.nodes = R"([{"mesh":0,"rotation":[0,0,0,0]}])";
  check_fails(uneven.text(), Errc::invalid_file, "rotation");
  uneven.nodes = R"([{"mesh":0,"matrix":[1,2]}])";
  check_fails(uneven.text(), Errc::invalid_file, "matrix");
  for (std::size_t n = 0; n < text.size(); ++n) {
    REQUIRE(io::parse_gltf(bytes_of(text.substr(0, n)), "some.glb").code() == Errc::invalid_file);
  }
}

TEST_CASE("gltf: many nodes of one mesh are not trusted with memory") {
  GlbFile file = small_file(0, 400);
  std::string nodes = "[", roots;
  for (int k = 0; k < 3000; ++k) {
    nodes += k == 0 ? R"({"mesh":0})" : R"(,{"mesh":0})";
    if (k != 0) roots += ',';
    roots += std::to_string(k);
  }
  file.nodes = nodes + "]";
  file.scene = R"(,"scenes":[{"nodes":[)" + roots + "]}]";
  const std::string text = file.text();
  reset_largest_allocation();
  check_fails(text, Errc::invalid_file, "more Gaussians than the file has bytes");
  CHECK(largest_allocation() < 20 * text.size());
}

TEST_CASE("gltf: what is no drawable Gaussian is counted") {
  GlbFile file = small_file(0, 4);
  std::string binary = file.binary();
  const float nan = NAN, two = 2, zero = 0;
  const auto put_float = [&binary](std::size_t at, float v) { std::memcpy(binary.data() + at, &v, 4); };
  put_float(0, nan);             // a position
  put_float(48 + 16 * 1, zero);  // a quaternion, below
  for (std::size_t k = 1; k < 4; ++k) put_float(48 + 16 + 4 * k, zero);
  put_float(48 + 64 + 12 * 2, nan);      // a scale
  put_float(48 + 64 + 48 + 4 * 3, two);  // an opacity
  const std::string text = GlbFile::glb(file.json(), binary);
  const LoadedCloud loaded = io::parse_gltf(bytes_of(text), "a.glb").value();
  check_consistent(loaded);
  CHECK(loaded.report.dropped_non_finite == 3);
  CHECK(loaded.report.dropped_zero_quat == 1);
}

TEST_CASE("gltf: the sign of a SCALE means nothing, and is told") {
  GlbFile file = small_file(1, 4);
  const LoadedCloud plain = parse(file);
  std::string binary = file.binary();
  for (const std::size_t k :
       {std::size_t{0}, std::size_t{4}, std::size_t{5}}) {  // one of row 0, two of row 1
    float v = 0;
    std::memcpy(&v, binary.data() + 48 + 64 + 4 * k, 4);
    v = -v;
    std::memcpy(binary.data() + 48 + 64 + 4 * k, &v, 4);
  }
  const std::string text = GlbFile::glb(file.json(), binary);
  const LoadedCloud loaded = io::parse_gltf(bytes_of(text), "a.glb").value();
  CHECK(loaded.report.dropped_non_finite == 0);
  CHECK(loaded.cloud.scales == plain.cloud.scales);
  REQUIRE(loaded.report.warnings.size() == 1);
  CHECK(contains(loaded.report.warnings[0], "a.glb: node 0: SCALE of 2 Gaussians is negative"));
}

TEST_CASE("gltf: nodes that scale unevenly, shear or mirror, bands included") {
  struct Case {
    const char* nodes;
    Mat3d m;  // by hand, from the node
    Vec3d t;
    Mat3d q;  // the orthogonal factor of m, by hand
  };
  // One scaled along its own axes; the same under a turn by 90 degrees about z; a mirror; both at once.
  const Mat3d one{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}, turn{{{0, -1, 0}, {1, 0, 0}, {0, 0, 1}}},
      mirror{{{-1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  const auto diagonal = [](double x, double y, double z) {
    return Mat3d{{{x, 0, 0}, {0, y, 0}, {0, 0, z}}};
  };
  const std::string h = "0.7071067811865476";
  const std::string turned = R"([{"mesh":0,"translation":[1,2,3],"rotation":[0,0,)" + h + "," + h +
                             R"(],"scale":[3,0.5,1]}])",
                    both = R"([{"children":[1],"scale":[-1,1,1]},{"mesh":0,"rotation":[0,0,)" + h + "," +
                           h + R"(],"scale":[0.001,2,4]}])";
  const Case cases[] = {
      {R"([{"mesh":0,"scale":[1,2,0.25]}])", diagonal(1, 2, 0.25), {}, one},
      {turned.c_str(), turn * diagonal(3, 0.5, 1), {1, 2, 3}, turn},
      {R"([{"mesh":0,"scale":[-1,1,1]}])", mirror, {}, mirror},
      {R"([{"mesh":0,"scale":[-2,-2,-2]}])", diagonal(-2, -2, -2), {}, diagonal(-1, -1, -1)},
      {both.c_str(), mirror * turn * diagonal(0.001, 2, 4), {}, mirror * turn},
      // A shear: x += 0.75 y. Its factor is the turn by -atan(0.375) about z.
      {R"([{"mesh":0,"matrix":[1,0,0,0,0.75,1,0,0,0,0,1,0,0,0,0,1]}])",
       Mat3d{{{1, 0.75, 0}, {0, 1, 0}, {0, 0, 1}}},
       {},
       Mat3d{{{std::cos(std::atan(0.375)), std::sin(std::atan(0.375)), 0},
              {-std::sin(std::atan(0.375)), std::cos(std::atan(0.375)), 0},
              {0, 0, 1}}}}};
  for (int degree = 0; degree <= 3; ++degree) {
    GlbFile file = small_file(degree, 40);
    const GaussianCloud base = parse(file, {.keep_axes = true}).cloud;
    for (const Case& c : cases) {
      CAPTURE(c.nodes);
      file.nodes = c.nodes;
      const LoadedCloud loaded = parse(file, {.keep_axes = true});
      check_consistent(loaded);
      CHECK(loaded.report.warnings.empty());
      const GaussianCloud& got = loaded.cloud;
      REQUIRE(got.size() == base.size());
      for (std::size_t i = 0; i < got.size(); ++i) {
        const Vec3d mean = c.m * base.mean(i) + c.t;
        CHECK(norm(got.mean(i) - mean) <= 2e-6 * (1 + norm(mean)));
        const Mat3d want = c.m * covariance_of(base, i) * transpose(c.m), have = covariance_of(got, i);
        double largest = 0, error = 0;
        for (int a = 0; a < 3; ++a) {
          for (int b = 0; b < 3; ++b) {
            largest = std::max(largest, std::fabs(want(a, b)));
            error = std::max(error, std::fabs(want(a, b) - have(a, b)));
          }
        }
        CHECK(error <= 2e-6 * largest);
        // The volume says that the least scale is right too.
        double volume = std::fabs(determinant(c.m)), made = 1;
        for (std::size_t k = 0; k < 3; ++k) {
          volume *= static_cast<double>(base.scales[k][i]),
              made *= static_cast<double>(got.scales[k][i]);
        }
        CHECK(made == doctest::Approx(volume).epsilon(1e-5));
        for (const Vec3d& d : {Vec3d{0.6, -0.48, 0.64}, Vec3d{-0.36, 0.48, 0.8}, Vec3d{0, 0, 1}}) {
          CHECK(norm(colour_of(got, i, c.q * d) - colour_of(base, i, d)) < 1e-5);
        }
      }
    }
  }
}
