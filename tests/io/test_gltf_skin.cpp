// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>

#include "allocations.hpp"
#include "gltf_builder.hpp"
#include "gsnav/detail/io/skinned_mesh_file.hpp"
#include "support/data.hpp"
#include "support/files.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

/// A bent tube of two joints, in centimetres below a node that is none of them, with two clips.
TestGltf tube() {
  TestGltf g;
  std::vector<float> positions, weights, uvs;
  std::vector<std::uint8_t> joints;
  std::vector<std::uint16_t> triangles, colors;
  for (int ring = 0; ring < 6; ++ring) {
    for (int k = 0; k < 4; ++k) {
      const float x = static_cast<float>(10 * (k % 2)), y = static_cast<float>(10 * (k / 2));
      positions.insert(positions.end(), {x, y, static_cast<float>(20 * ring)});
      const float w = static_cast<float>(ring) / 5;
      weights.insert(weights.end(),
                     {ring == 3 ? 0.8f * (1 - w) : 1 - w, ring == 3 ? 0.8f * w : w, 0, 0});
      joints.insert(joints.end(),
                    {1, 0, 7, 0});  // the file lists the child first; weight 0 may name any joint
      uvs.insert(uvs.end(), {0, w});
      colors.insert(colors.end(), {65535, 0, static_cast<std::uint16_t>(65535 * ring / 5)});
      if (ring < 5) {
        const auto v = static_cast<std::uint16_t>(4 * ring + k),
                   n = static_cast<std::uint16_t>(4 * ring + (k + 1) % 4);
        const auto up = static_cast<std::uint16_t>(v + 4), next = static_cast<std::uint16_t>(n + 4);
        triangles.insert(triangles.end(), {v, n, up, n, next, up});
      }
    }
  }
  // Inverse binds: the first joint at the origin, the second 50 up, turned by 90 degrees about x.
  const std::vector<float> binds{1, 0, 0, 0, 0, 0, -1, 0, 0, 1, 0, 0, 0, -50, 0, 1,
                                 1, 0, 0, 0, 0, 1, 0,  0, 0, 0, 1, 0, 0, 0,   0, 1};
  json attributes = {{"POSITION", g.add(positions, "VEC3", 5126)},
                     {"JOINTS_0", g.add(joints, "VEC4", 5121)},
                     {"WEIGHTS_0", g.add(weights, "VEC4", 5126)},
                     {"TEXCOORD_0", g.add(uvs, "VEC2", 5126)},
                     {"COLOR_0", g.add(colors, "VEC3", 5123, true)}};
  g.doc["materials"] =
      json::array({{{"pbrMetallicRoughness", {{"baseColorFactor", {0.5, 0.25, 1.0, 1.0}}}}}});
  g.doc["meshes"].push_back({{"primitives", json::array({{{"attributes", attributes},
                                                          {"indices", g.add(triangles, "SCALAR", 5123)},
                                                          {"material", 0}}})}});
  const double h = std::sqrt(0.5);
  g.doc["nodes"] =
      json::array({{{"name", "scene"},
                    {"scale", {0.01, 0.01, 0.01}},
                    {"rotation", {-h, 0, 0, h}},
                    {"children", {1, 4}}},
                   {{"name", "hip"}, {"translation", {3, 4, 5}}, {"children", {2}}},
                   {{"name", "between"}, {"translation", {0, 0, 20}}, {"children", {3}}},
                   {{"name", "hip"}, {"translation", {0, 0, 30}}, {"rotation", {h, 0, 0, h}}},
                   {{"mesh", 0}, {"skin", 0}, {"translation", {100, 100, 100}}}});
  g.doc["skins"].push_back({{"joints", {3, 1}}, {"inverseBindMatrices", g.add(binds, "MAT4", 5126)}});
  const std::size_t even = g.add(std::vector<float>{0.5f, 0.75f, 1.0f}, "SCALAR", 5126);
  const std::size_t uneven = g.add(std::vector<float>{0.0f, 0.2f, 0.9f}, "SCALAR", 5126);
  const float s = static_cast<float>(h);
  const std::size_t turns = g.add(std::vector<float>{0, 0, 0, 1, s, 0, 0, s, 0, -1, 0, 0}, "VEC4", 5126);
  const std::size_t ways = g.add(std::vector<float>{0, 0, 30, 0, 5, 30, 10, 0, 30}, "VEC3", 5126);
  const std::size_t cubic = g.add(std::vector<float>{0, 0,  0, 1, 2, 3, 9, 0, -9, 1, 1, 1, 4, 5,
                                                     6, -7, 2, 0, 3, 3, 3, 0, 0,  9, 0, 0, 0},
                                  "VEC3", 5126);
  const auto channel = [](int sampler, int node, const char* path) {
    return json{{"sampler", sampler}, {"target", {{"node", node}, {"path", path}}}};
  };
  g.doc["animations"] = json::array(
      {{{"name", "even"},
        {"channels", json::array({channel(0, 1, "rotation"), channel(0, 3, "rotation"),
                                  channel(1, 3, "translation")})},
        {"samplers",
         json::array({{{"input", even}, {"output", turns}}, {{"input", even}, {"output", ways}}})}},
       {{"channels", json::array({channel(0, 1, "translation"), channel(1, 3, "rotation"),
                                  channel(2, 2, "translation")})},
        {"samplers",
         json::array({{{"input", uneven}, {"output", cubic}, {"interpolation", "CUBICSPLINE"}},
                      {{"input", uneven}, {"output", turns}},
                      {{"input", uneven}, {"output", ways}, {"interpolation", "STEP"}}})}}});
  return g;
}

/// The mesh posed by the library: joints from the pose, vertices by their weights.
std::vector<Vec3d> posed(const SkinnedMesh& mesh, const LocalPose& pose) {
  std::vector<Affine3<double>> joints;
  forward_kinematics(mesh.skeleton, pose, joints);
  const auto binds = mesh.skeleton.bind_inverses();
  std::vector<Vec3d> out;
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    Vec3d sum = pose.root;
    for (std::size_t k = v * mesh.influences; k < (v + 1) * mesh.influences; ++k) {
      const std::size_t j = mesh.joint_indices[k];
      sum += (joints[j] * (binds[j] * mesh.positions[v])) * static_cast<double>(mesh.weights[k]);
    }
    out.push_back(sum);
  }
  return out;
}

/// Greatest distance of vertices from the truth at a clip's time.
double apart(const io::LoadedSkinnedMesh& m, const GltfTruth& truth, int clip, double begin,
             double time) {
  LocalPose pose = m.pose;
  if (clip >= 0) m.clips[static_cast<std::size_t>(clip)].clip.pose({time}, pose);
  const auto a = posed(m.mesh, pose), b = truth.vertices(clip, static_cast<long double>(begin + time));
  REQUIRE(a.size() == b.size());
  double worst = 0;
  for (std::size_t v = 0; v < a.size(); ++v) worst = std::max(worst, norm(a[v] - b[v]));
  return worst;
}

}  // namespace

TEST_CASE("gltf skin: every vertex is where the file's own matrices put it") {
  TempFolder folder("gltf");
  for (const char* name : {"tube.gltf", "tube.glb"}) {
    tube().write(folder / name);
    const auto m = io::load_gltf_skin(folder / name);
    CAPTURE(m.status().message());
    REQUIRE(m.ok());
    CHECK(m->mesh.skeleton.names == std::vector<std::string>{"hip", "hip#2"});
    CHECK(m->mesh.skeleton.parents == std::vector<std::int32_t>{-1, 0});
    CHECK(m->report.unequal_weights == 4);
    CHECK(m->report.least_weight_sum == doctest::Approx(0.8));
    CHECK(m->report.rigid_error < 1e-9);
    CHECK(m->mesh.materials.at(0).factor == Vec3d{0.5, 0.25, 1.0});
    CHECK(norm(m->mesh.colors.at(9) - Vec3d{1, 0, std::floor(65535 * 0.4) / 65535}) < 1e-9);
    const GltfTruth truth(folder / name);
    CHECK(apart(*m, truth, -1, 0, 0) < 1e-7);
    REQUIRE(m->clips.size() == 2);
    CHECK(m->clips[0].name == "even");
    CHECK(m->clips[0].clip.frame_rate == doctest::Approx(4));
    CHECK(m->clips[0].clip.frames() == 5);  // its first key, at 0.5 s, holds from 0 on
    CHECK(m->clips[1].name == "clip1");
    CHECK(m->clips[1].clip.frame_rate == 60);
    CHECK(m->clips[1].clip.frames() == 55);
    for (const double t : {0.0, 0.25, 0.5, 0.75, 1.0}) CHECK(apart(*m, truth, 0, 0, t) < 1e-7);
    for (int k = 0; k < 55; ++k) CHECK(apart(*m, truth, 1, 0, k / 60.0) < 1e-6);
    // The bind pose stands on the scene's floor: z of the file is up.
    double low = 9, high = -9;
    for (const Vec3d& p : m->mesh.positions) low = std::min(low, p.y), high = std::max(high, p.y);
    CHECK(high - low == doctest::Approx(1.0).epsilon(1e-5));
  }
}

TEST_CASE("gltf skin: what is wrong is named") {
  TempFolder folder("gltf_bad");
  const auto fails = [&](auto change, Errc code, const std::string& part, bool glb = false) {
    TestGltf g = tube();
    change(g);
    const auto path = folder / (glb ? "some.glb" : "some.gltf");
    g.write(path);
    const Status s = io::load_gltf_skin(path).status();
    CAPTURE(s.message());
    CHECK(s.code() == code);
    CHECK(contains(s.message(), "some."));
    CHECK(contains(s.message(), part));
  };
  const Errc bad = Errc::invalid_file, no = Errc::unsupported;
  fails([](auto& g) { g.doc["asset"]["version"] = "1.0"; }, no, "version '\"1.0\"'");
  fails([](auto& g) { g.doc.erase("asset"); }, bad, "asset.version");
  fails([](auto& g) { g.doc["extensionsRequired"] = {"KHR_draco_mesh_compression"}; }, no,
        "KHR_draco_mesh_compression");
  fails([](auto& g) { g.doc.erase("skins"); }, no, "no skin");
  fails([](auto& g) { g.doc["skins"][0]["joints"] = {3, 3}; }, bad, "joints[1]");
  fails([](auto& g) { g.doc["skins"][0]["joints"] = {3, 9}; }, bad, "joints[1]");
  fails([](auto& g) { g.doc["nodes"][3]["children"] = {1}; }, bad, "nodes[1] hangs on two nodes");
  fails([](auto& g) { g.doc["nodes"][0]["children"] = {4}, g.doc["nodes"][3]["children"] = {1}; }, bad,
        "its own ancestor");
  fails(
      [](auto& g) {
        g.doc["nodes"][1]["rotation"] = {0, 0, 0, 0};
      },
      bad, "nodes[1]: 'rotation' is zero");
  fails([](auto& g) { g.doc["nodes"][1]["scale"] = {1, 1}; }, bad, "nodes[1]: 'scale' is 2 values");
  fails([](auto& g) { g.doc["accessors"][0]["count"] = 25; }, bad,
        "accessors[0]: 25 elements 12 bytes apart");
  fails([](auto& g) { g.doc["accessors"][0]["count"] = 40000000; }, bad, "accessors[0]");
  fails([](auto& g) { g.doc["accessors"][0]["type"] = "VEC2"; }, bad, "'VEC2', must be VEC3");
  fails([](auto& g) { g.doc["accessors"][0]["componentType"] = 5124; }, bad, "'componentType' is 5124");
  fails([](auto& g) { g.doc["bufferViews"][0]["byteLength"] = 1 << 30; }, bad,
        "bufferViews[0]: 1073741824 bytes");
  fails([](auto& g) { g.doc["meshes"][0]["primitives"][0]["mode"] = 1; }, no, "'mode' is '1'");
  fails([](auto& g) { g.doc["meshes"][0]["primitives"][0]["attributes"].erase("WEIGHTS_0"); }, bad,
        "must come together");
  const auto put = [](TestGltf& g, std::size_t accessor, std::size_t at, auto value) {
    const std::size_t offset = g.doc["bufferViews"][accessor]["byteOffset"];
    std::memcpy(g.bytes.data() + offset + at * sizeof value, &value, sizeof value);
  };
  fails([&](auto& g) { put(g, 0, 4, std::nanf("")); }, bad, "element 1 is");
  fails([&](auto& g) { put(g, 2, 0, -0.5f); }, bad, "vertex 0 has weight -0.5");
  fails([&](auto& g) { put(g, 2, 0, 0.0f); }, bad, "weights of vertex 0 are all zero");
  fails([&](auto& g) { put(g, 1, 0, std::uint8_t{2}); }, bad, "vertex 0 names joint 2");
  fails([&](auto& g) { put(g, 5, 0, std::uint16_t{24}); }, bad, "corner 24 of 24");
  fails([&](auto& g) { put(g, 6, 1, 0.5f); }, bad,
        "inverse bind of joint \"hip#2\" is not rigid times a scale");
  fails([&](auto& g) { put(g, 7, 1, 0.25f); }, bad, "key 1 is at 0.25");
  fails([](auto& g) { g.doc["animations"][0]["samplers"][0]["interpolation"] = "MAGIC"; }, bad, "MAGIC");
  fails([](auto& g) { g.doc["animations"][0]["channels"][0]["target"]["path"] = "colour"; }, bad,
        "colour");
  fails([](auto& g) { g.bytes.resize(100); }, bad, "its buffer has 100", true);
  write_file(folder / "some.gltf", "{");
  CHECK(contains(io::load_gltf_skin(folder / "some.gltf").status().message(), "not valid JSON"));
  CHECK(io::load_gltf_skin(folder / "none.gltf").code() == Errc::file_not_found);
  TestGltf g = tube();
  g.write(folder / "some.gltf");
  std::filesystem::remove(folder / "some buffer.bin");
  CHECK(contains(io::load_gltf_skin(folder / "some.gltf").status().message(), "some buffer.bin"));
  json escaping = json::parse(read_file(folder / "some.gltf"));
  escaping["buffers"][0]["uri"] = "../secret.bin";
  write_file(folder / "some.gltf", escaping.dump());
  CHECK(contains(io::load_gltf_skin(folder / "some.gltf").status().message(), "no file beside it"));
}

TEST_CASE(
    "gltf skin: damaged files are refused or read, and take no memory that they have no bytes for") {
  TempFolder folder("gltf_fuzz");
  tube().write(folder / "some.glb");
  const std::string whole = read_file(folder / "some.glb");
  std::mt19937 generator(5);
  int refused = 0;
  for (int i = 0; i < 3000; ++i) {
    std::string text = whole;
    for (int k = 0; k < 1 + i % 3; ++k) {
      const std::size_t at = generator() % text.size();
      if (i % 10 == 0)
        text.resize(std::max<std::size_t>(at, 1));
      else
        text[at] = i % 2 == 0 ? "0123456789-.e,[]"[generator() % 16] : static_cast<char>(generator());
    }
    write_file(folder / "some.glb", text);
    reset_largest_allocation();
    const auto m = io::load_gltf_skin(folder / "some.glb");
    REQUIRE(largest_allocation() < 16000000);
    REQUIRE((m.ok() || contains(m.status().message(), "some.glb")));
    refused += m.ok() ? 0 : 1;
  }
  std::printf("gltf skin: of 3000 damaged files %d were refused\n", refused);
  CHECK(refused > 1000);
}

TEST_CASE("gltf skin: real files, every clip") {
  struct Case {
    const char* name;
    std::size_t joints, clips;
    double height_low, height_high;
  };
  for (const Case& c :
       {Case{"cesium_man.gltf", 19, 1, 1.3, 1.6}, Case{"lumberjack.glb", 53, 3, 1.5, 1.9},
        Case{"rigged_simple.gltf", 2, 1, 1, 20}}) {
    const std::string path = data_file(std::string("avatars/") + c.name);
    if (path.empty()) continue;
    const auto m = io::load_gltf_skin(path);
    CAPTURE(m.status().message());
    REQUIRE(m.ok());
    CHECK(m->mesh.skeleton.size() == c.joints);
    REQUIRE(m->clips.size() == c.clips);
    const GltfTruth truth(path);
    double worst = apart(*m, truth, -1, 0, 0);
    for (std::size_t k = 0; k < m->clips.size(); ++k) {
      const MotionClip& clip = m->clips[k].clip;
      for (std::size_t f = 0; f < clip.frames(); f += std::max<std::size_t>(1, clip.frames() / 5)) {
        worst = std::max(
            worst, apart(*m, truth, static_cast<int>(k), 0, static_cast<double>(f) / clip.frame_rate));
      }
    }
    double low = 9, high = -9;
    for (const Vec3d& p : posed(m->mesh, m->pose)) low = std::min(low, p.y), high = std::max(high, p.y);
    std::printf("%s: %zu vertices, %.2f m high, rigid joints are off by %.3f mm (reported %.3f mm)\n",
                c.name, m->mesh.positions.size(), high - low, 1e3 * worst, 1e3 * m->report.rigid_error);
    for (const std::string& w : m->report.warnings) std::printf("  %s\n", w.c_str());
    CHECK(worst < 1.5 * m->report.rigid_error + 1e-5);
    CHECK(high - low > c.height_low);
    CHECK(high - low < c.height_high);
  }
}

namespace {

/// The tube three times over, each by a skin of its own on the same joints: the second lists them the
/// other way round, the third is bound in another space (two units a unit, moved and turned).
TestGltf tube_in_parts() {
  TestGltf g = tube();
  const json primitive = g.doc["meshes"][0]["primitives"][0];
  const auto floats = [&](std::size_t accessor) {
    const json& view = g.doc["bufferViews"][accessor];
    std::vector<float> out(view["byteLength"].get<std::size_t>() / 4);
    std::memcpy(out.data(), g.bytes.data() + view["byteOffset"].get<std::size_t>(), 4 * out.size());
    return out;
  };
  std::vector<std::uint8_t> swapped;
  for (int v = 0; v < 24; ++v) swapped.insert(swapped.end(), {0, 1, 7, 1});
  const std::vector<float> binds = floats(6), positions = floats(0);
  std::vector<float> other_order(binds.begin() + 16, binds.end());
  other_order.insert(other_order.end(), binds.begin(), binds.begin() + 16);
  json second = primitive, third = primitive;
  second["attributes"]["JOINTS_0"] = g.add(swapped, "VEC4", 5121);
  // By hand: q = (2 y + 1, -2 x, 2 z) takes the third's vertices p' to the tube's own p; p' = (-p.y, p.x
  // - 1, p.z) / 2.
  std::vector<float> moved, moved_binds;
  for (std::size_t v = 0; v < positions.size(); v += 3) {
    moved.insert(moved.end(), {-positions[v + 1] / 2, (positions[v] - 1) / 2, positions[v + 2] / 2});
  }
  const float map[4][4] = {{0, 2, 0, 1}, {-2, 0, 0, 0}, {0, 0, 2, 0}, {0, 0, 0, 1}};
  for (std::size_t joint = 0; joint < 2; ++joint) {
    for (std::size_t column = 0; column < 4; ++column) {
      for (std::size_t row = 0; row < 4; ++row) {
        float sum = 0;
        for (std::size_t k = 0; k < 4; ++k) sum += binds[16 * joint + 4 * k + row] * map[k][column];
        moved_binds.push_back(sum);
      }
    }
  }
  third["attributes"]["POSITION"] = g.add(moved, "VEC3", 5126);
  g.doc["meshes"].push_back({{"primitives", json::array({second})}});
  g.doc["meshes"].push_back({{"primitives", json::array({third})}});
  g.doc["skins"][0]["name"] = "coat";
  g.doc["skins"].push_back(
      {{"name", "hat"}, {"joints", {1, 3}}, {"inverseBindMatrices", g.add(other_order, "MAT4", 5126)}});
  g.doc["skins"].push_back(
      {{"joints", {3, 1}}, {"inverseBindMatrices", g.add(moved_binds, "MAT4", 5126)}});
  g.doc["nodes"].push_back({{"mesh", 1}, {"skin", 1}});
  g.doc["nodes"].push_back({{"mesh", 2}, {"skin", 2}});
  return g;
}

}  // namespace

TEST_CASE("gltf skin: skins that share joints are one body") {
  TempFolder folder("gltf_parts");
  tube_in_parts().write(folder / "parts.glb");
  tube().write(folder / "tube.glb");
  const auto m = io::load_gltf_skin(folder / "parts.glb");
  CAPTURE(m.status().message());
  REQUIRE(m.ok());
  CHECK(m->report.skins == 3);
  CHECK(m->report.skins_in_file == 3);
  CHECK(m->mesh.skeleton.names == std::vector<std::string>{"hip", "hip#2"});
  REQUIRE(m->mesh.positions.size() == 72);
  CHECK(m->report.vertices == 72);
  const GltfTruth truth(folder / "tube.glb");
  LocalPose pose;
  for (const double time : {0.0, 0.6, 1.0}) {
    m->clips.at(0).clip.pose({time}, pose);
    const auto got = posed(m->mesh, pose), want = truth.vertices(0, static_cast<long double>(time));
    for (std::size_t v = 0; v < 72; ++v)
      CHECK(norm(got[v] - want[v % 24]) < (time == 0.6 ? 2e-3 : 1e-6));
  }
  // One or two of them, by name and by index.
  const auto hat = io::load_gltf_skin(folder / "parts.glb", {.skins = {"hat"}});
  REQUIRE(hat.ok());
  CHECK(hat->mesh.positions.size() == 24);
  CHECK(hat->report.skins == 1);
  const auto two = io::load_gltf_skin(folder / "parts.glb", {.skins = {"2", "coat"}});
  REQUIRE(two.ok());
  CHECK(two->mesh.positions.size() == 48);
  const Status none = io::load_gltf_skin(folder / "parts.glb", {.skins = {"shoe"}}).status();
  CHECK(none.code() == Errc::invalid_argument);
  CHECK(contains(none.message(), "no skin is \"shoe\"; there are 0 '\"coat\"', 1 '\"hat\"', 2"));
}

TEST_CASE("gltf skin: skins of two rigs are named, and either can be chosen") {
  TempFolder folder("gltf_rigs");
  TestGltf g = tube_in_parts();
  // A joint of its own for the second.
  g.doc["nodes"].push_back({{"name", "stick"}, {"children", {8}}});
  g.doc["nodes"].push_back({{"name", "tip"}});
  g.doc["skins"][1]["joints"] = {7, 8};
  g.write(folder / "rigs.glb");
  const Status s = io::load_gltf_skin(folder / "rigs.glb").status();
  CAPTURE(s.message());
  CHECK(s.code() == Errc::unsupported);
  CHECK(contains(
      s.message(),
      "rigs.glb: its skins have more than one rig: \"coat\" (skins[0], 24 vertices), (skins[2], 24"));
  CHECK(contains(s.message(),
                 "on one; \"hat\" (skins[1], 24 vertices) on others. Choose skins of one rig"));
  CHECK(io::load_gltf_skin(folder / "rigs.glb", {.skins = {"coat", "2"}})->mesh.positions.size() == 48);
  // Shared joints that a second map would have to take to different places: two rigs as well.
  TestGltf bent = tube_in_parts();
  bent.doc["skins"][1]["joints"] = {3, 1};
  bent.write(folder / "bent.glb");
  CHECK(io::load_gltf_skin(folder / "bent.glb").code() == Errc::unsupported);
}

TEST_CASE("gltf skin: a unit of the file may be a centimetre") {
  TempFolder folder("gltf_scale");
  TestGltf g = tube();
  g.write(folder / "a.glb");
  g.doc["nodes"][0]["scale"] = {1, 1, 1};  // 0.01 before
  g.write(folder / "b.glb");
  const auto a = io::load_gltf_skin(folder / "a.glb"),
             b = io::load_gltf_skin(folder / "b.glb", {.scale = 0.01}),
             large = io::load_gltf_skin(folder / "b.glb");
  REQUIRE(a.ok());
  REQUIRE(b.ok());
  REQUIRE(large.ok());
  for (std::size_t clip = 0; clip < 2; ++clip) {
    LocalPose p, q;
    for (const double time : {0.0, 0.5}) {
      a->clips.at(clip).clip.pose({time}, p);
      b->clips.at(clip).clip.pose({time}, q);
      const auto want = posed(a->mesh, p), got = posed(b->mesh, q);
      for (std::size_t v = 0; v < want.size(); ++v) CHECK(norm(want[v] - got[v]) < 1e-7);
    }
  }
  CHECK(norm(large->mesh.positions[5] - b->mesh.positions[5] * 100.0) < 1e-4);
  for (const double bad : {0.0, -1.0, std::nan("")}) {
    CHECK(contains(io::load_gltf_skin(folder / "a.glb", {.scale = bad}).status().message(),
                   "GltfOptions.scale"));
  }
}

TEST_CASE("gltf skin: a clip begins at 0 with its first key, and says so") {
  TempFolder folder("gltf_late");
  tube().write(folder / "a.glb");
  const auto m = io::load_gltf_skin(folder / "a.glb");
  REQUIRE(m.ok());
  CHECK(m->clips.at(0).clip.duration() == doctest::Approx(1.0));
  LocalPose begin, first;
  m->clips[0].clip.pose({0.0}, begin);
  m->clips[0].clip.pose({0.5}, first);
  const auto a = posed(m->mesh, begin), b = posed(m->mesh, first);
  for (std::size_t v = 0; v < a.size(); ++v) CHECK(norm(a[v] - b[v]) < 1e-9);
  std::size_t told = 0;
  for (const std::string& w : m->report.warnings) {
    told += contains(w, "clip \"even\": its first key is at 0.500000 s and holds from 0 s on") ? 1 : 0;
  }
  CHECK(told == 1);
}

TEST_CASE("gltf clips: a file without a skin moves joints by the names of its nodes") {
  TempFolder folder("gltf_clips");
  TestGltf g = tube();
  g.write(folder / "a.glb");
  const auto m = io::load_gltf_skin(folder / "a.glb");
  REQUIRE(m.ok());
  g.doc.erase("skins");
  g.doc.erase("meshes");
  g.doc["nodes"][4] = {{"name", "lamp"}};
  g.write(folder / "clips.gltf");
  const auto clips = io::load_gltf_clips(folder / "clips.gltf", m->mesh.skeleton);
  CAPTURE(clips.status().message());
  REQUIRE(clips.ok());
  REQUIRE(clips->clips.size() == 2);
  for (std::size_t k = 0; k < 2; ++k) {
    CHECK(clips->clips[k].name == m->clips[k].name);
    CHECK(clips->clips[k].clip.root_translation == m->clips[k].clip.root_translation);
    CHECK(clips->clips[k].clip.translations == m->clips[k].clip.translations);
    CHECK(clips->clips[k].clip.rotations.size() == m->clips[k].clip.rotations.size());
    CHECK(clips->clips[k].clip.frame_rate == m->clips[k].clip.frame_rate);
  }
  // A joint that no node is called keeps its rest pose on its parent.
  g.doc["nodes"][3]["name"] = "knee";
  g.write(folder / "clips.gltf");
  const auto part = io::load_gltf_clips(folder / "clips.gltf", m->mesh.skeleton);
  REQUIRE(part.ok());
  CHECK(contains(part->warnings.at(0), "keep their rest pose: \"hip#2\""));
  const Affine3<double>& rest = m->mesh.skeleton.rest_local[1];
  for (std::size_t t = 0; t < 5; ++t) {
    CHECK(norm(part->clips[0].clip.translations[2 * t + 1] - rest.translation) < 1e-9);
  }
  g.doc["nodes"][1]["name"] = "pelvis";
  g.write(folder / "clips.gltf");
  const Status none = io::load_gltf_clips(folder / "clips.gltf", m->mesh.skeleton).status();
  CHECK(none.code() == Errc::invalid_argument);
  CHECK(contains(
      none.message(),
      "clips.gltf: its nodes have not the names of the skeleton's joints: there is no \"hip\""));
  g.doc.erase("animations");
  g.write(folder / "clips.gltf");
  CHECK(contains(io::load_gltf_clips(folder / "clips.gltf", m->mesh.skeleton).status().message(),
                 "no animation"));
}
