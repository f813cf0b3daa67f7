// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>
#include <webp/encode.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "check_refused.hpp"
#include "gltf_builder.hpp"
#include "gsnav/detail/io/mesh_file.hpp"
#include "gsnav/io/image_file.hpp"
#include "support/data.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

/// Bytes as a buffer view of its own.
std::size_t add_view(TestGltf& g, const std::string& bytes) {
  g.doc["bufferViews"].push_back(
      {{"buffer", 0}, {"byteOffset", g.bytes.size()}, {"byteLength", bytes.size()}});
  g.bytes += bytes;
  g.bytes.resize((g.bytes.size() + 3) / 4 * 4);
  return g.doc["bufferViews"].size() - 1;
}

const std::vector<std::uint8_t> kPixels{10, 20, 30, 40,  50,  60,
                                        70, 80, 90, 100, 110, 120};  // 2 x 2, RGB

std::string png_of(const TempFolder& folder) {
  io::save_png_rgb8(folder / "p.png", kPixels, 2, 2).throw_if_error();
  return read_file(folder / "p.png");
}

std::string webp_of(bool lossless) {
  std::uint8_t* out = nullptr;
  const std::size_t size = lossless ? WebPEncodeLosslessRGB(kPixels.data(), 2, 2, 6, &out)
                                    : WebPEncodeRGB(kPixels.data(), 2, 2, 6, 90, &out);
  std::string text(reinterpret_cast<const char*>(out), size);
  WebPFree(out);
  return text;
}

/// A square in z = 0 of two triangles, with normals, coordinates and colours, and a bare triangle beside
/// it.
TestGltf square() {
  TestGltf g;
  const std::vector<float> corners{0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0};
  const std::vector<float> normals{0, 0, 2, 0, 0, 2, 0, 0, 2, 0, 0, 2}, uvs{0, 1, 1, 1, 1, 0, 0, 0};
  const std::vector<std::uint8_t> colors{255, 0, 51, 255, 0, 255, 0, 255, 0, 0, 255, 255, 102, 0, 0, 51};
  const json attributes = {{"POSITION", g.add(corners, "VEC3", 5126)},
                           {"NORMAL", g.add(normals, "VEC3", 5126)},
                           {"TEXCOORD_0", g.add(uvs, "VEC2", 5126)},
                           {"COLOR_0", g.add(colors, "VEC4", 5121, true)}};
  const std::size_t indices = g.add(std::vector<std::uint16_t>{0, 1, 2, 0, 2, 3}, "SCALAR", 5123);
  g.doc["meshes"].push_back(
      {{"primitives",
        json::array(
            {{{"attributes", attributes}, {"indices", indices}, {"material", 0}},
             {{"attributes", {{"POSITION", attributes["POSITION"]}}}, {"mode", 5}, {"indices", indices}},
             {{"attributes", {{"POSITION", attributes["POSITION"]}}}, {"mode", 1}}})}});
  g.doc["materials"] =
      json::array({{{"pbrMetallicRoughness", {{"baseColorFactor", {0.5, 0.25, 1.0, 0.5}}}}}});
  g.doc["nodes"] = json::array({{{"mesh", 0}}});
  g.doc["images"] = g.doc["textures"] = json::array();
  return g;
}

/// ... with a picture.
TestGltf textured(const std::string& picture) {
  TestGltf g = square();
  g.doc["images"].push_back({{"bufferView", add_view(g, picture)}});
  g.doc["textures"].push_back({{"source", 0}});
  g.doc["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = {{"index", 0}};
  return g;
}

Result<TexturedScene> load(const TestGltf& g) {
  TempFolder folder("gltf_scene");
  g.write(folder / "a.glb");
  return io::load_textured_scene(folder / "a.glb");
}

/// Corners of all triangles in the world, and of their normals where there are any.
void in_world(const TexturedScene& scene, std::vector<Vec3d>& corners, std::vector<Vec3d>& normals) {
  for (const auto& instance : scene.instances) {
    const TexturedPart& part = scene.parts[instance.part];
    for (const auto& t : part.geometry.triangles) {
      for (const std::uint32_t c : t) {
        corners.push_back(instance.world_from_part * vec_cast<double>(part.geometry.vertices[c]));
        if (!part.normals.empty()) {
          normals.push_back(
              rotate(instance.world_from_part.rotation, vec_cast<double>(part.normals[c])));
        }
      }
    }
  }
}

}  // namespace

TEST_CASE("gltf scene: every primitive with what the file says of its surface") {
  TempFolder folder("gltf_scene_png");
  TestGltf g = textured(png_of(folder));
  json& material = g.doc["materials"][0];
  material["doubleSided"] = true;
  material["alphaMode"] = "MASK";
  material["alphaCutoff"] = 0.25;
  material["extensions"] = {{"KHR_materials_unlit", json::object()}};
  g.doc["extensionsRequired"] = {"KHR_materials_unlit"};
  const TexturedScene scene = load(g).value();
  CHECK(scene.warnings.empty());
  REQUIRE(scene.parts.size() == 2);
  REQUIRE(scene.instances.size() == 2);
  const TexturedPart& part = scene.parts[0];
  CHECK(part.geometry.triangles.size() == 2);
  CHECK(part.normals == std::vector<Vec3f>(4, Vec3f{0, 0, 1}));
  CHECK(part.colors == std::vector<Vec3f>{{1, 0, 0.2f}, {0, 1, 0}, {0, 0, 1}, {0.4f, 0, 0}});
  CHECK(part.uvs[0].y == 1);
  CHECK(part.uvs[2].x == 1);
  CHECK(part.material.factor == Vec3d{0.5, 0.25, 1.0});
  CHECK(part.material.alpha_cutoff == 0.25);
  CHECK(part.material.double_sided);
  CHECK(part.material.unlit);
  REQUIRE(part.material.texture == 0);
  const TextureImage& picture = scene.textures.at(0);
  REQUIRE(picture.width == 2);
  for (std::size_t i = 0; i < 4; ++i) {
    for (std::size_t k = 0; k < 3; ++k) CHECK(picture.rgba[4 * i + k] == kPixels[3 * i + k]);
    CHECK(picture.rgba[4 * i + 3] == 255);
  }
  const TexturedPart& bare = scene.parts[1];
  CHECK(bare.geometry.triangles.size() == 4);  // a strip of six corners
  CHECK(bare.normals.empty());
  CHECK(bare.colors.empty());
  CHECK(bare.uvs.empty());
  CHECK(bare.material.texture == -1);
  CHECK_FALSE(bare.material.double_sided);
}

TEST_CASE("gltf scene: alpha modes, and the alphas that each reads") {
  TestGltf g = square();
  json& material = g.doc["materials"][0];  // its colour factor's alpha is 0.5
  const auto part_of = [&] { return load(g).value().parts.at(0); };
  CHECK_FALSE(part_of().material.blend);  // OPAQUE where nothing is said: alpha says nothing
  CHECK(part_of().material.alpha_cutoff == 0);
  CHECK(part_of().alphas.empty());
  material["alphaMode"] = "BLEND";
  const TexturedPart through = part_of();
  CHECK(through.material.blend);
  CHECK(through.material.alpha == 0.5);
  REQUIRE(through.alphas.size() == 4);
  for (std::size_t v = 0; v < 4; ++v) CHECK(through.alphas[v] == (v == 3 ? 0.2f : 1.0f));
  CHECK(load(g).value().warnings.empty());
  material["alphaMode"] = "MASK";
  CHECK_FALSE(part_of().material.blend);
  CHECK(part_of().material.alpha_cutoff == 0.5);
  CHECK(part_of().alphas.size() == 4);
}

TEST_CASE("gltf scene: pictures are PNG or WebP; what cannot be read leaves the colour and a warning") {
  const TexturedScene exact = load(textured(webp_of(true))).value();
  REQUIRE(exact.textures.size() == 1);
  for (std::size_t i = 0; i < 4; ++i) CHECK(exact.textures[0].rgba[4 * i + 1] == kPixels[3 * i + 1]);
  TestGltf g = textured(webp_of(false));
  g.doc["textures"][0] = {{"extensions", {{"EXT_texture_webp", {{"source", 0}}}}}};
  g.doc["extensionsRequired"] = {"EXT_texture_webp"};
  CHECK(load(g).value().textures.size() == 1);
  const TexturedScene none = load(textured("KTX 20 or what not")).value();
  CHECK(none.parts[0].material.texture == -1);
  REQUIRE(none.warnings.size() == 1);
  CHECK(contains(none.warnings[0], "images[0]: neither PNG, JPEG nor WebP"));
  g = textured(webp_of(true));
  g.doc["samplers"] = json::array({{{"wrapS", 33071}}});
  g.doc["textures"][0]["sampler"] = 0;
  CHECK(contains(load(g).value().warnings.at(0), "samplers[0]: 'wrapS' is '33071'"));
  g = textured(webp_of(true));
  g.doc["meshes"][0]["primitives"][0]["attributes"].erase("TEXCOORD_0");
  CHECK(contains(load(g).value().warnings.at(0), "has a texture and no coordinates"));
}

TEST_CASE(
    "gltf scene: coordinates are scaled, turned as one sees them and moved, as KHR_texture_transform "
    "says") {
  TestGltf g = textured(webp_of(true));
  const double angle = 0.4;
  g.doc["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["extensions"] = {
      {"KHR_texture_transform", {{"offset", {0.5, -0.25}}, {"rotation", angle}, {"scale", {2, 3}}}}};
  const auto uvs = load(g).value().parts[0].uvs;
  const double corners[4][2] = {{0, 1}, {1, 1}, {1, 0}, {0, 0}};
  for (std::size_t i = 0; i < 4; ++i) {
    // As seen, with v upwards, a turn by the angle counter-clockwise.
    const double x = 2 * corners[i][0], up = -3 * corners[i][1];
    const double turned_x = std::cos(angle) * x - std::sin(angle) * up;
    const double turned_up = std::sin(angle) * x + std::cos(angle) * up;
    CHECK(static_cast<double>(uvs[i].x) == doctest::Approx(turned_x + 0.5));
    CHECK(static_cast<double>(uvs[i].y) == doctest::Approx(-turned_up - 0.25));
  }
}

TEST_CASE("gltf scene: parts stand where nodes show them, outsides outside") {
  TestGltf g = square();
  g.doc["nodes"] =
      json::array({{{"children", {1, 2, 3}}, {"translation", {5, 6, 7}}, {"scale", {2, 2, 2}}},
                   {{"mesh", 0}, {"rotation", {0.5, 0.5, 0.5, 0.5}}},
                   {{"mesh", 0}, {"scale", {-1, 1, 1}}, {"rotation", {0, 0, 0.6, 0.8}}},
                   {{"mesh", 0}, {"scale", {1, 3, 0.5}}, {"rotation", {0.8, 0, 0, 0.6}}}});
  TempFolder folder("gltf_scene_nodes");
  g.write(folder / "a.glb");
  const TexturedScene scene = io::load_textured_scene(folder / "a.glb").value();
  CHECK(scene.instances.size() == 6);
  CHECK(scene.parts.size() == 6);  // two shared, two each for the mirrored and the uneven node
  const TriangleMesh flat = io::load_mesh(folder / "a.glb").value();
  std::vector<Vec3d> corners, normals;
  in_world(scene, corners, normals);
  REQUIRE(corners.size() == 3 * flat.triangles.size());
  for (std::size_t i = 0; i < corners.size(); ++i) {
    CHECK(norm(corners[i] - vec_cast<double>(flat.vertices[flat.triangles[i / 3][i % 3]])) < 1e-5);
  }
  for (const TexturedPart& part : scene.parts) {
    for (const auto& t : part.geometry.triangles) {
      const auto at = [&](std::size_t k) { return vec_cast<double>(part.geometry.vertices[t[k]]); };
      const Vec3d face = cross(at(1) - at(0), at(2) - at(0));
      // The strip's degenerate triangles have no face.
      if (part.normals.empty() || !(norm(face) > 0)) continue;
      CHECK(norm(face * (1 / norm(face)) - vec_cast<double>(part.normals[t[0]])) < 1e-6);
    }
  }
}

TEST_CASE("gltf scene: what makes no sense is named") {
  const auto fails = [](auto change, const std::string& part, Errc code = Errc::invalid_file) {
    TestGltf g = textured(webp_of(true));
    change(g.doc);
    check_refused(load(g), code, "a.glb", part);
  };
  fails([](json& d) { d["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["index"] = 3; },
        "'index' is '3'");
  fails([](json& d) { d["textures"][0]["source"] = 2; }, "textures[0]: 'source' is '2'");
  fails([](json& d) { d["images"][0]["bufferView"] = 77; }, "images[0]: 'bufferView' is '77'");
  fails([](json& d) { d["meshes"][0]["primitives"][0]["material"] = 1; }, "'material' is '1'");
  fails(
      [](json& d) {
        d["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"] = {1, 2};
      },
      "'baseColorFactor'");
  fails([](json& d) { d["accessors"][3]["count"] = 3; }, "COLOR_0 has 3 values for 4 vertices");
  fails([](json& d) { d["bufferViews"].back()["byteLength"] = 20; }, "images[0]");
  fails([](json& d) { d["extensionsRequired"] = {"KHR_draco_mesh_compression"}; },
        "KHR_draco_mesh_compression", Errc::unsupported);
  fails([](json& d) { d["nodes"][0]["scale"] = {1e300, 1, 1}; }, "not finite");
}

TEST_CASE("gltf scene: many nodes that scale one mesh unevenly are not trusted with memory") {
  TestGltf g;
  const std::size_t points = g.add(std::vector<float>(3 * 4000, 1.0f), "VEC3", 5126);
  g.doc["meshes"].push_back({{"primitives", json::array({{{"attributes", {{"POSITION", points}}}}})}});
  for (int k = 0; k < 3000; ++k) g.doc["nodes"].push_back({{"mesh", 0}, {"scale", {1, 2, 1}}});
  check_refused(load(g), Errc::invalid_file, "a.glb",
                "more vertices or triangles than the file has bytes");
}

TEST_CASE("gltf scene: real files hold the triangles that load_mesh finds") {
  for (const char* name : {"nav/habitat/simple_room.glb", "nav/glb/vr-gallery.glb", "nav/glb/house.glb",
                           "avatars/cesium_man.gltf", "avatars/lumberjack.glb"}) {
    const std::string path = data_file(name);
    if (path.empty()) continue;
    CAPTURE(path);
    const TexturedScene scene = io::load_textured_scene(path).value();
    const TriangleMesh flat = io::load_mesh(path).value();
    std::vector<Vec3d> corners, normals;
    in_world(scene, corners, normals);
    REQUIRE(corners.size() == 3 * flat.triangles.size());
    double worst = 0, size = 1;
    for (std::size_t i = 0; i < corners.size(); ++i) {
      const Vec3d want = vec_cast<double>(flat.vertices[flat.triangles[i / 3][i % 3]]);
      worst = std::max(worst, norm(corners[i] - want));
      size = std::max(size, norm(want));
    }
    CHECK(worst < 1e-6 * size);
    std::printf("%s: %zu parts, %zu instances, %zu textures, %zu warnings\n", name, scene.parts.size(),
                scene.instances.size(), scene.textures.size(), scene.warnings.size());
    for (const std::string& w : scene.warnings) std::printf("  %s\n", w.c_str());
  }
}
