// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <span>
#include <string>
#include <vector>

#include "gsnav/detail/avatar/smpl_joints.hpp"
#include "gsnav/io/image_file.hpp"
#include "io/avatar_npz.hpp"
#include "io/glb_file.hpp"
#include "io/gltf_builder.hpp"
#include "io/sog_file.hpp"
#include "io/temporal_rows_of.hpp"
#include "support/files.hpp"
#include "zip.hpp"

// What both the fuzzer and the maker of its seeds know: how an input becomes a file. Checksums and
// compression would keep mutations from the parsers behind them, so that inputs of packed formats begin
// with a byte that says what the rest is: 0 the file itself, k the content of its part k - 1, the others
// being as the tests build them.

namespace gsnav_fuzz {

using namespace gsnav_test;

/// Parts of a zip archive by name.
using Parts = std::map<std::string, std::string>;

inline Parts sog_parts() {
  SogFile file(2);
  file.make_files();
  return file.files;
}

/// The entries of the npz that tests make of these arrays.
inline Parts npz_parts(const TestArrays& arrays) {
  TempFolder folder("fuzz_parts");
  write_npz(folder / "a.npz", arrays);
  const std::string text = read_file(folder / "a.npz");
  const auto zip = gsnav::io::detail::ZipReader::open(bytes_of(text), "a.npz").value();
  Parts out;
  for (const std::string& name : zip.names()) {
    const auto content = zip.read(name).value();
    out[name].assign(reinterpret_cast<const char*>(content.data()), content.size());
  }
  return out;
}

inline Parts avatar_parts() { return npz_parts(avatar_arrays(3, 24)); }

inline Parts driver_parts() {
  TestArrays arrays;
  arrays["joint_mats"] = identities(6);
  arrays["joint_mats"].shape = {2, 3, 4, 4};
  arrays["joint_mats_fps"] = {{1}, {30}};
  return npz_parts(arrays);
}

inline Parts temporal_parts() {
  return npz_parts(temporal_arrays(temporal_file(4, 6, 1).rows, 6, "network.tfgs.fdgs."));
}

/// A motion of one frame by SMPL's joints, and a body of two vertices for it.
inline Parts smpl_motion_parts() {
  TestArrays arrays;
  arrays["poses"] = {{1, 72}, std::vector<double>(72, 0.1)};
  arrays["trans"] = {{1, 3}, {1, 2, 3}};
  arrays["betas"] = {{1}, {0.5}};
  arrays["mocap_framerate"] = {{}, {60}};
  return npz_parts(arrays);
}

inline Parts smpl_model_parts() {
  TestArrays arrays;
  arrays["v_template"] = {{2, 3}, {0, 1, 2, 3, 4, 5}};
  arrays["shapedirs"] = {{2, 3, 1}, {0, 1, 0, 0, 1, 0}};
  TestArray regressor{{24, 2}, {}}, tree{{2, 24}, {}};
  for (const std::int32_t parent : gsnav::smpl_joint_parents()) {
    tree.values.push_back(parent);
    regressor.values.insert(regressor.values.end(), {0.25 * parent, 1.0});
  }
  tree.values.resize(48);
  arrays["J_regressor"] = regressor;
  arrays["kintree_table"] = tree;
  return npz_parts(arrays);
}

/// The files of a Habitat dataset.
inline Parts dataset_parts() {
  return {
      {"a.scene_dataset_config.json",
       R"({"stages":{"paths":{".json":["*.stage_config.json"]},"default_attributes":{"scale":2}},)"
       R"("scene_instances":{"paths":{".json":["."]}},"navmesh_instances":{"n":"a.navmesh"}})"},
      {"a.scene_instance.json",
       R"({"stage_instance":{"template_name":"a"},"navmesh_instance":"n","time_max":20.0,"time_loop":true,)"
       R"("gaussian_avatars":[{"name":"b","canonical_gaussians":"b.npz","driver":"d.npz","offset_y":1.0,"scale":1.5,)"
       R"("coord_transform":[[0,0,1,5],[0,1,0,0],[-1,0,0,0],[0,0,0,1]]},{"canonical_gaussians":"b.npz",)"
       R"("driver":{"smpl_params":"d.npz","trajectory":"t.npz"},"time_begin":2,"time_end":9}]})"},
      {"a.stage_config.json",
       R"({"render_asset":"a.gs.ply","collision_asset":"a.glb","up":[0,0,1],"front":[0,1,0],"units_to_meters":1})"}};
}

inline std::string zip_of(const Parts& parts) {
  std::vector<ZipFileEntry> entries;
  for (const auto& [name, content] : parts) entries.push_back({name, content, false});
  return make_zip(entries);
}

/// The archive that an input stands for.
inline std::string zip_of(const Parts& parts, const std::string& input) {
  if (input.empty() || input[0] == '\0') return input.substr(input.empty() ? 0 : 1);
  Parts changed = parts;
  const std::size_t part = (static_cast<unsigned char>(input[0]) - 1u) % parts.size();
  auto it = changed.begin();
  std::advance(it, static_cast<std::ptrdiff_t>(part));
  it->second = input.substr(1);
  return zip_of(changed);
}

/// Buffer of the glTF seeds.
inline GlbFile gltf_file() {
  GlbFile file;
  file.degree = 1;
  file.rows = random_rows(3, 9, 2);
  return file;
}

/// A textured triangle moved by two joints, with a clip: what the seeds of surfaces are made of.
inline TestGltf surface_file() {
  TestGltf g;
  const json attributes = {
      {"POSITION", g.add(std::vector<float>{0, 0, 0, 1, 0, 0, 0, 1, 0}, "VEC3", 5126)},
      {"NORMAL", g.add(std::vector<float>{0, 0, 1, 0, 0, 1, 0, 0, 1}, "VEC3", 5126)},
      {"TEXCOORD_0", g.add(std::vector<float>{0, 0, 1, 0, 0, 1}, "VEC2", 5126)},
      {"COLOR_0", g.add(std::vector<std::uint8_t>(12, 200), "VEC4", 5121, true)},
      {"JOINTS_0", g.add(std::vector<std::uint8_t>{0, 1, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0}, "VEC4", 5121)},
      {"WEIGHTS_0", g.add(std::vector<float>{0.5f, 0.5f, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0}, "VEC4", 5126)}};
  const std::size_t corners = g.add(std::vector<std::uint16_t>{0, 1, 2}, "SCALAR", 5123);
  const std::size_t times = g.add(std::vector<float>{0, 0.5f}, "SCALAR", 5126);
  const std::size_t turns = g.add(std::vector<float>{0, 0, 0, 1, 0, 1, 0, 0}, "VEC4", 5126);
  const TempFolder folder("fuzz_surface");
  gsnav::io::save_png_rgb(folder / "a", std::vector<float>(12, 0.3f), 2, 2).throw_if_error();
  const std::string picture = read_file(folder / "a");
  g.doc["bufferViews"].push_back(
      {{"buffer", 0}, {"byteOffset", g.bytes.size()}, {"byteLength", picture.size()}});
  g.bytes += picture;
  g.doc["images"] = {{{"bufferView", g.doc["bufferViews"].size() - 1}}};
  g.doc["textures"] = {{{"source", 0}}};
  g.doc["materials"] = {{{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}}};
  const json primitive = {{"attributes", attributes}, {"indices", corners}, {"material", 0}};
  g.doc["meshes"].push_back({{"primitives", json::array({primitive})}});
  g.doc["nodes"] =
      json::array({{{"children", {1}}}, {{"translation", {0, 1, 0}}}, {{"mesh", 0}, {"skin", 0}}});
  g.doc["skins"].push_back({{"joints", {0, 1}}});
  const json channel = {{"sampler", 0}, {"target", {{"node", 1}, {"path", "rotation"}}}};
  g.doc["animations"] = {{{"channels", json::array({channel})},
                          {"samplers", json::array({{{"input", times}, {"output", turns}}})}}};
  g.doc["buffers"] = {{{"byteLength", g.bytes.size()}}};
  return g;
}

}  // namespace gsnav_fuzz
