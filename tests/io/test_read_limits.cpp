// SPDX-License-Identifier: Apache-2.0
// What small files may ask for: nested JSON, text in gzip, textures.
#include <doctest/doctest.h>
#include <webp/encode.h>
#include <zlib.h>

#include <chrono>
#include <cstdio>
#include <cstring>
#include <string>
#include <vector>

#include "allocations.hpp"
#include "check_refused.hpp"
#include "gltf_builder.hpp"
#include "gsnav/detail/io/avatar_scene_file.hpp"
#include "gsnav/detail/io/cameras_file.hpp"
#include "gsnav/detail/io/episode_file.hpp"
#include "gsnav/detail/io/habitat_dataset.hpp"
#include "gsnav/detail/io/lod_set.hpp"
#include "gsnav/detail/io/mesh_file.hpp"
#include "gsnav/detail/io/navmesh_settings_file.hpp"
#include "gsnav/detail/io/skinned_mesh_file.hpp"
#include "gsnav/io/image_file.hpp"
#include "gsnav/io/scene_file.hpp"
#include "gzip.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

/// `depth` arrays inside each other.
std::string arrays(std::size_t depth) { return std::string(depth, '[') + std::string(depth, ']'); }

/// No episodes, and a member nested `depth` deep in all. The brackets of its text do not count.
std::string episodes_nested(std::size_t depth) {
  return R"({"episodes":[],"note":"[[[\"[{\\","deep":)" + arrays(depth - 1) + "}";
}

double seconds_of(const std::chrono::steady_clock::time_point& begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

std::string compressed(const std::string& text) {
  const auto bytes = io::detail::gzip(std::as_bytes(std::span(text)));
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// A triangle with a texture.
TestGltf textured_triangle(const std::string& picture) {
  TestGltf g;
  const std::size_t corners = g.add(std::vector<float>{0, 0, 0, 1, 0, 0, 0, 1, 0}, "VEC3", 5126),
                    uvs = g.add(std::vector<float>{0, 0, 1, 0, 0, 1}, "VEC2", 5126),
                    pixels = g.add(std::vector<char>(picture.begin(), picture.end()), "SCALAR", 5121);
  g.doc["images"] = json::array({{{"bufferView", g.doc["accessors"][pixels]["bufferView"]}}});
  g.doc["textures"] = json::array({{{"source", 0}}});
  g.doc["materials"] = json::array({{{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}}});
  g.doc["meshes"].push_back(
      {{"primitives", json::array({{{"attributes", {{"POSITION", corners}, {"TEXCOORD_0", uvs}}},
                                    {"material", 0}}})}});
  g.doc["nodes"] = json::array({{{"mesh", 0}}});
  g.doc.erase("scenes");
  return g;
}

/// RGB of 8 bits a sample; the data begin as a PNG's do and are `bytes` long.
std::string png_claiming(std::uint32_t width, std::uint32_t height, std::size_t bytes) {
  const auto big_endian = [](std::size_t v) {
    std::string out;
    for (int shift = 24; shift >= 0; shift -= 8) out += static_cast<char>(v >> shift & 255);
    return out;
  };
  const auto chunk = [&](const std::string& body) {  // name and data
    const uLong sum =
        crc32(0, reinterpret_cast<const Bytef*>(body.data()), static_cast<uInt>(body.size()));
    return big_endian(body.size() - 4) + body + big_endian(sum);
  };
  return "\x89PNG\r\n\x1a\n" +
         chunk("IHDR" + big_endian(width) + big_endian(height) + std::string("\x08\x02\0\0\0", 5)) +
         chunk("IDAT\x78\x01" + std::string(bytes, '\0')) + chunk("IEND");
}

}  // namespace

TEST_CASE("read limits: JSON of depth 100000 is refused by every reader, at once") {
  const TempFolder folder("deep");
  const std::string deep = arrays(100000);
  const auto refused = [&](const char* name, auto&& load) {
    CAPTURE(name);
    write_file(folder / name, deep);
    reset_largest_allocation();
    const auto begin = std::chrono::steady_clock::now();
    check_refused(load(folder / name), Errc::unsupported, name,
                  "JSON nested more than 64 deep at byte 64");
    CHECK(seconds_of(begin) < 0.5);
    CHECK(largest_allocation() < 400000);
  };
  refused("a.json", [](const auto& p) { return io::load_episodes(p); });
  refused("a.gltf", [](const auto& p) { return io::load_gltf_mesh(p); });
  refused("b.gltf", [](const auto& p) { return io::load_textured_scene(p); });
  refused("c.gltf", [](const auto& p) { return io::load_gltf_skin(p); });
  refused("d.gltf", [](const auto& p) { return io::load_scene(p); });
  refused("lod-meta.json", [](const auto& p) { return io::load_scene(p); });
  refused("meta.json", [](const auto& p) { return io::load_scene(p); });
  refused("cameras.json", [](const auto& p) { return io::load_cameras(p); });
  refused("a.scene_dataset_config.json", [](const auto& p) { return io::load_habitat_dataset(p); });
  refused("navmesh.json", [](const auto& p) { return io::load_navmesh_settings(p); });
  refused("avatars.json", [](const auto& p) { return io::load_avatar_scene(p); });
}

TEST_CASE("read limits: the depth is the caller's") {
  const TempFolder folder("depth");
  const auto path = folder / "a.json";
  write_file(path, episodes_nested(64));
  CHECK(io::load_episodes(path).ok());
  write_file(path, episodes_nested(65));
  check_refused(io::load_episodes(path), Errc::unsupported, "a.json", "raise ReadLimits::json_depth");
  CHECK(io::load_episodes(path, {.json_depth = 65}).ok());
  // A tree of nodes needs two levels of JSON each.
  for (const int bad : {0, -1, 10001}) {
    check_refused(io::load_episodes(path, {.json_depth = bad}), Errc::invalid_argument, "a.json",
                  "ReadLimits::json_depth = " + std::to_string(bad) + ": must be in [1, 10000]");
  }
  write_file(folder / "lod-meta.json", arrays(70));
  io::LoadSceneOptions options;
  options.limits.json_depth = 70;
  CHECK(io::load_scene(folder / "lod-meta.json").code() == Errc::unsupported);
  CHECK(io::load_scene(folder / "lod-meta.json", options).code() == Errc::invalid_file);
}

TEST_CASE("read limits: 200 KB of gzip are refused early, in little memory") {
  const TempFolder folder("gzip");
  const auto path = folder / "bomb.json.gz";
  {
    std::string text = R"({"episodes":[)";
    while (text.size() < 200000000)
      text += "[],[],[],[],[],[],[],[],[],[],[],[],[],[],[],[],[],[],[],[],[],[],[],[],";
    write_file(path, compressed(text + "[]]}"));
  }
  const std::size_t size = std::filesystem::file_size(path);
  REQUIRE(size > 190000);
  REQUIRE(size < 500000);
  reset_largest_allocation();
  const auto begin = std::chrono::steady_clock::now();
  check_refused(io::load_episodes(path), Errc::unsupported, "bomb.json.gz",
                "bytes of gzip grow more than 200 times; raise ReadLimits::inflation");
  const double took = seconds_of(begin);
  std::printf("gzip of %zu bytes refused in %.3f s, largest allocation %zu\n", size, took,
              largest_allocation());
  CHECK(took < 1.0);
  CHECK(largest_allocation() <= 200 * size + 1);
}

TEST_CASE("read limits: text in gzip that grows less is read, and more where the caller says so") {
  const TempFolder folder("growth");
  const auto path = folder / "a.json.gz";
  const auto spaced = [&](std::size_t spaces) {
    const std::string gzip = compressed(R"({"episodes":[]})" + std::string(spaces, ' '));
    write_file(path, gzip);
    return (15 + spaces) / gzip.size();
  };
  // 64 KiB are read whatever they came from; the next byte is not.
  REQUIRE(spaced(65536 - 15) > 500);
  CHECK(io::load_episodes(path).ok());
  REQUIRE(spaced(65536 - 14) > 500);
  CHECK(io::load_episodes(path).code() == Errc::unsupported);
  REQUIRE(spaced(3000000) > 900);
  CHECK(io::load_episodes(path).code() == Errc::unsupported);
  CHECK(io::load_episodes(path, {.inflation = 1032}).ok());
  for (const int bad : {0, 1033})
    CHECK(io::load_episodes(path, {.inflation = bad}).code() == Errc::invalid_argument);
  // Episodes as generators write them shrink to a tenth or so: far from the limit.
  std::string text = R"({"episodes":[)";
  for (int k = 0; k < 3000; ++k) {
    text += (k == 0 ? "" : ",");
    text += R"({"episode_id":")" + std::to_string(k) +
            R"(","scene_id":"a.glb","start_position":[1,2.5,)" + std::to_string(k % 7) +
            R"(],"start_rotation":[0,0,0,1],"goals":[{"position":[4,2.5,-1]}]})";
  }
  const std::string gzip = compressed(text + "]}");
  write_file(path, gzip);
  const auto read = io::load_episodes(path);
  REQUIRE(read.ok());
  CHECK(read->episodes.size() == 3000);
  CHECK(read->episodes[2999].start_position.z == 2999 % 7);
}

TEST_CASE("read limits: a PNG of 20000 x 20000 in 1 MB is left out before it is decoded") {
  const TempFolder folder("png");
  textured_triangle(png_claiming(20000, 20000, 1200000)).write(folder / "a.glb");
  reset_largest_allocation();
  const auto begin = std::chrono::steady_clock::now();
  const auto scene = io::load_gltf_scene(folder / "a.glb");
  REQUIRE(scene.ok());
  CHECK(seconds_of(begin) < 0.5);
  CHECK(largest_allocation() < 4000000);
  CHECK(scene->textures.empty());
  REQUIRE(scene->warnings.size() == 1);
  CHECK(contains(scene->warnings[0], "images[0]: 20000 x 20000 pixels, a side of at most 8192 is read"));
}

TEST_CASE("read limits: the side of textures, of every kind of picture, is the caller's") {
  const TempFolder folder("side");
  const std::vector<std::uint8_t> pixels(3 * 20 * 12, 90);
  REQUIRE(io::save_png_rgb8(folder / "p.png", pixels, 20, 12).ok());
  std::vector<std::string> pictures{read_file(folder / "p.png")};
  std::uint8_t* webp = nullptr;
  const std::size_t size = WebPEncodeLosslessRGB(pixels.data(), 20, 12, 60, &webp);
  pictures.emplace_back(reinterpret_cast<const char*>(webp), size);
  WebPFree(webp);
  if (const auto jpeg = io::encode_jpeg(pixels, 20, 12)) {
    pictures.emplace_back(reinterpret_cast<const char*>(jpeg->data()), jpeg->size());
  }
  for (const std::string& picture : pictures) {
    textured_triangle(picture).write(folder / "a.glb");
    const auto whole = io::load_gltf_scene(folder / "a.glb", {.texture_side = 20});
    REQUIRE(whole.ok());
    REQUIRE(whole->textures.size() == 1);
    CHECK(whole->warnings.empty());
    const auto none = io::load_textured_scene(folder / "a.glb", {.texture_side = 19});
    REQUIRE(none.ok());
    CHECK(none->textures.empty());
    REQUIRE(none->warnings.size() == 1);
    CHECK(contains(none->warnings[0], "20 x 12 pixels, a side of at most 19 is read"));
    CHECK(contains(none->warnings[0], "raise ReadLimits::texture_side"));
    CHECK(io::load_gltf_scene(folder / "a.glb", {.texture_side = 65536}).code() ==
          Errc::invalid_argument);
  }
}

TEST_CASE("read limits: one small picture that a file shows many times is read a few times only") {
  const TempFolder folder("many");
  constexpr std::size_t kImages = 30;
  REQUIRE(io::save_png_rgb8(folder / "p.png", std::vector<std::uint8_t>(3 * 20 * 20, 90), 20, 20).ok());
  TestGltf g = textured_triangle(read_file(folder / "p.png"));
  auto& primitives = g.doc["meshes"][0]["primitives"];
  for (std::size_t i = 1; i < kImages; ++i) {
    g.doc["images"].push_back(g.doc["images"][0]);  // the same bytes
    g.doc["textures"].push_back({{"source", i}});
    g.doc["materials"].push_back({{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", i}}}}}});
    primitives.push_back(primitives[0]);
    primitives.back()["material"] = i;
  }
  g.write(folder / "a.glb");
  const auto few = io::load_gltf_scene(folder / "a.glb", {.texture_side = 20});
  REQUIRE(few.ok());
  CHECK(few->textures.size() == 8);
  REQUIRE(few->warnings.size() == kImages - 8);
  CHECK(contains(few->warnings[0], "images[8]: the pictures before it have 3200 pixels"));
  const auto all = io::load_gltf_scene(folder / "a.glb");
  REQUIRE(all.ok());
  CHECK(all->textures.size() == kImages);
  CHECK(all->warnings.empty());
}
