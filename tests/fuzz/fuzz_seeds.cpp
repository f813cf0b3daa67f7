// SPDX-License-Identifier: Apache-2.0
// fuzz_seeds FOLDER: small valid files for each reader, FOLDER/<reader>/<number>, by the tests' own
// builders.
#include <cstdio>

#include "caches.hpp"
#include "gsnav/detail/io/cameras_file.hpp"
#include "gsnav/detail/io/episode_file.hpp"
#include "gsnav/detail/nav/navmesh_file.hpp"
#include "gsnav/io/image_file.hpp"
#include "io/ksplat_file.hpp"
#include "io/ply_compressed_file.hpp"
#include "io/png_file.hpp"
#include "io/splat_file.hpp"
#include "nav/meshes.hpp"
#include "readers.hpp"
#include "webp.hpp"

using namespace gsnav;
using namespace gsnav_fuzz;

namespace {

class Seeds {
 public:
  explicit Seeds(std::filesystem::path folder) : folder_(std::move(folder)) {}
  void add(const std::string& reader, const std::string& content) {
    std::filesystem::create_directories(folder_ / reader);
    write_file(folder_ / reader / std::to_string(count_++), content);
  }
  void add_parts(const std::string& reader, const Parts& parts) {
    add(reader, '\0' + zip_of(parts));
    char part = 1;
    for (const auto& [name, content] : parts) add(reader, part++ + content);
  }

 private:
  std::filesystem::path folder_;
  int count_ = 0;
};

void add_ply(Seeds& seeds) {
  for (const char* format : {"binary_little_endian", "binary_big_endian", "ascii"}) {
    PlyFile file;
    file.format = format;
    file.properties = inria_properties(9);
    file.rows = random_rows(2, 9, 2);
    file.comments = "comment SplatRenderMode: mip\n";
    file.before_header = "element face 2\nproperty list uchar short a\n";
    file.before_rows = file.format == "ascii" ? "1 5\n0\n" : std::string("\1\0\5\0", 4);
    seeds.add("ply", file.text());
  }
  for (const bool ranges : {false, true}) {
    CompressedPlyFile file;
    file.colour_ranges = ranges;
    file.rest = ranges ? 9 : 0;
    file.rows = random_rows(3, file.rest, 2);
    seeds.add("ply", file.text());
  }
  PlyFile points;
  points.properties = {{"x", "float"},   {"y", "float"},     {"z", "float"},
                       {"red", "uchar"}, {"green", "uchar"}, {"blue", "uchar"}};
  for (int k = 0; k < 12; ++k) {
    points.rows.push_back({{"x", k}, {"y", k % 3}, {"z", 0}, {"red", 200}, {"green", k}, {"blue", 0}});
  }
  seeds.add("ply", points.text());
  const std::string head =
      "element vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n"
      "property list uchar int vertex_indices\nend_header\n";
  seeds.add("mesh_ply", "ply\nformat ascii 1.0\n" + head + "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n");
  std::string binary = "ply\nformat binary_little_endian 1.0\n" + head;
  for (const float v : {0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 1.f, 0.f}) put(binary, v);
  binary += '\3';
  for (const int corner : {0, 1, 2}) put(binary, corner);
  seeds.add("mesh_ply", binary);
}

void add_spz(Seeds& seeds) {
  for (const std::uint32_t version : {1u, 2u, 3u, 4u}) {
    SpzFile file;
    file.version = version;
    file.degree = 1;
    file.rows = random_rows(3, 9, 2);
    seeds.add("spz", '\0' + file.text());
    if (version < 4) seeds.add("spz", '\1' + file.payload());
    if (version < 4) continue;
    std::string planes = "\2" + file.head(6);
    put(planes, std::uint32_t{32});
    planes += std::string(12, '\0');
    for (const std::string& plane : file.planes()) planes += plane;
    seeds.add("spz", planes);
  }
}

void add_gltf(Seeds& seeds) {
  GlbFile file = gltf_file();
  seeds.add("gltf", '\0' + file.text());
  seeds.add("gltf", '\1' + file.json());
  file.nodes = R"([{"children":[1],"scale":[2,2,2]},{"mesh":0,"rotation":[0,0,1,0]}])";
  seeds.add("gltf", '\1' + file.json());
  const TestGltf surface = surface_file();
  seeds.add("surface", '\1' + surface.doc.dump());
  seeds.add("surface", '\0' + GlbFile::glb(surface.doc.dump(), surface.bytes));
  seeds.add("surface",
            std::string("\1") +
                R"({"asset":{"version":"2.0"},"nodes":[{"mesh":0}],"meshes":[{"primitives":[{"mode":4,)"
                R"("attributes":{"POSITION":0},"indices":1}]}],"accessors":[{"bufferView":0,)"
                R"("componentType":5126,"count":3,"type":"VEC3"},{"bufferView":1,"componentType":5121,)"
                R"("count":3,"type":"SCALAR"}],"bufferViews":[{"buffer":0,"byteLength":36},{"buffer":0,)"
                R"("byteOffset":3,"byteLength":3}],"buffers":[{"byteLength":40}]})");
}

void add_others(Seeds& seeds) {
  const std::vector<PlyRow> rows = random_rows(3, 0, 2);
  seeds.add("splat", splat_text(rows));
  for (const int level : {0, 1, 2}) {
    KsplatFile file;
    file.level = level;
    file.empty_sections = 0;
    file.sections = {{1, random_rows(5, 9, 2), 0}};
    seeds.add("ksplat", file.text());
  }
  seeds.add_parts("sog", sog_parts());
  seeds.add_parts("npz", avatar_parts());
  seeds.add_parts("driver", driver_parts());
  seeds.add_parts("4dgs_npz", temporal_parts());
  Parts motion = smpl_motion_parts();
  for (const auto& [name, content] : smpl_model_parts())
    motion["~" + name] = content;  // behind the motion's
  seeds.add_parts("smpl_motion", motion);
  for (const std::size_t degree : {0u, 3u, 9u})
    seeds.add("4dgs_ply", temporal_file(3, degree, 2).text());
  char part = 0;
  for (const auto& [name, content] : dataset_parts()) seeds.add("dataset", part++ + content);
  seeds.add(
      "amc",
      std::string(
          ":units\n  length 0.5\n  angle deg\n:root\n   order TX TY TZ RX RY RZ\n   axis XYZ\n"
          "   position 1 2 3\n   orientation 0 0 30\n:bonedata\n  begin\n   id 1\n   name arm\n"
          "   direction 0 1 0\n   length 4\n   axis 10 20 30 XYZ\n   dof rx ry rz\n"
          "   limits (-160.0 20.0)\n          (-70.0 70.0)\n  end\n:hierarchy\n  begin\n    root arm\n"
          "  end\n") +
          '\0' +
          ":DEGREES\n1\nroot 5 6 7 10 20 30\narm 40 50 60\n2\nroot -1 0 1 -170 3 4e1\narm 0 +5 -5.5\n");
  seeds.add(
      "makehuman",
      std::string(
          R"({"bones":{"arm":{"head":"a","tail":"b","parent":"base"},"base":{"head":"b","tail":"a",)"
          R"("parent":null}},"joints":{"a":[2,3],"b":[1,0]},"weights_file":"w.mhw"})") +
          '\0' + R"({"weights":{"base":[[0,1],[1,0.5],[2,0.25]],"arm":[[2,0.5],[3,0.3]]}})");
  seeds.add("lod_set",
            R"({"lodLevels":2,"environment":null,"filenames":["a.sog","b.sog"],"tree":{"bound":{},)"
            R"("children":[{"lods":{"0":{"file":0,"offset":0,"count":6}}},{"lods":{"0":{"file":0,)"
            R"("offset":6,"count":4},"1":{"file":1,"offset":0,"count":1}}}]}})");
  seeds.add("obj", "# a square\nv 0 0 0\nv 1 0 0 1\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\nf -1/2/3 -2//4 -3\n");
  seeds.add("bvh",
            "HIERARCHY\nROOT a\n{\n OFFSET 1 2 3\n CHANNELS 6 Xposition Zposition Yposition Yrotation "
            "Xrotation "
            "Zrotation\n JOINT b\n {\n  OFFSET 0 5 0\n  CHANNELS 1 Zrotation\n  End Site\n  {\n   "
            "OFFSET 0 1 0\n"
            "  }\n }\n}\nMOTION\nFrames: 2\nFrame Time: 0.05\n1 2 3 4 5 6 7\n1 2 3 -4 5 6 7e1\n");
  TempFolder folder("fuzz_seeds");
  io::save_cameras(folder / "a", std::vector<Camera>(2)).throw_if_error();
  seeds.add("cameras", read_file(folder / "a"));
  io::save_episodes(folder / "a", std::vector<PointNavEpisode>(2)).throw_if_error();
  seeds.add("episodes", read_file(folder / "a"));
  io::save_png_rgb(folder / "a", std::vector<float>(75, 0.3f), 5, 5).throw_if_error();
  seeds.add("png", read_file(folder / "a"));
  seeds.add("png", png(2, 3, 16, 0, std::string("\0\1\x2c\1\x2c\0\1\x2c\1\x2c\0\1\x2c\1\x2c", 15)));
  std::vector<std::uint8_t> ramp(3 * 20 * 18);
  for (std::size_t i = 0; i < ramp.size(); ++i) ramp[i] = static_cast<std::uint8_t>(i * i / 97);
  if (const auto jpeg = io::encode_jpeg(ramp, 20, 18)) {
    seeds.add("jpeg", {reinterpret_cast<const char*>(jpeg->data()), jpeg->size()});
  }
  io::detail::RgbaImage picture{9, 7, std::vector<std::uint8_t>(ramp.begin(), ramp.begin() + 4 * 9 * 7)};
  seeds.add("webp", io::detail::encode_webp(picture, "seed").value());
  io::save_npy(folder / "a", std::vector<float>(6), std::vector<std::size_t>{2, 3}).throw_if_error();
  seeds.add("npy", read_file(folder / "a"));
}

/// One tile and many: a floor, a box that borders cut, a ramp to a storey above, steps between tiles.
void add_navmesh(Seeds& seeds) {
  TempFolder folder("fuzz_navmesh");
  const auto add = [&](const Soup& soup, double cell, int tile_size) {
    NavMeshSettings settings;
    settings.agent_radius = 0.1;
    settings.cell_size = cell;
    settings.tile_size = tile_size;
    save_navmesh(NavMesh::build(settings, soup.vertices, soup.triangles).value(), folder / "a")
        .throw_if_error();
    seeds.add("navmesh", read_file(folder / "a"));
  };
  Soup floor;
  floor.floor(0, 0, 3, 3);
  for (const int tile_size : {0, 32, 24}) add(floor, 0.05, tile_size);
  Soup box = floor;
  box.box(1, 1.2, 2, 1.7, 0, 2);
  for (const int tile_size : {0, 16}) add(box, 0.1, tile_size);
  Soup storeys = floor;
  storeys.quad({3, 0, 1}, {3, 0, 2}, {5, 1, 2}, {5, 1, 1});
  storeys.floor(5, 1, 6, 2, 1);
  storeys.floor(2, 0, 5, 0.6, 2);
  for (const int tile_size : {0, 16, 32}) add(storeys, 0.1, tile_size);
}

/// What is cached beside a scene: of chunks alone, of rows too, and a tree with some values changed.
void add_caches(Seeds& seeds) {
  VisibleSets sets;
  sets.cell = 0.5;
  sets.focal = 128;
  sets.near_plane = 0.2;
  sets.min_weight = 1e-3;
  sets.cloud_chunks = cached_scene().view().chunk_count();
  sets.keys = {{-1, 0, 2}, {0, 0, 0}};
  sets.bits = {5, 3, 0};  // the second cell: chunks 0 and 1, of which rows follow
  for (std::uint32_t word = 0; word < 2 * kSeenRowWords; ++word)
    sets.bits.push_back(0xff00ffu << word % 8);
  sets.ends = {1, sets.bits.size()};
  TempFolder folder("fuzz_caches");
  io::save_visible_sets(folder / "a", sets, cached_scene()).throw_if_error();
  seeds.add("visible", '\0' + read_file(folder / "a"));
  seeds.add("visible", visible_input(sets));
  seeds.add("lod", std::string(1, '\1'));
  for (std::size_t array = 0; array < kLodArrays; ++array) {
    seeds.add("lod", std::string{'\1', static_cast<char>(array), '\5', '\0', '\0', '\0', '\0', '\0'});
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: fuzz_seeds FOLDER\n");
    return 1;
  }
  Seeds seeds(argv[1]);
  add_ply(seeds);
  add_spz(seeds);
  add_gltf(seeds);
  add_others(seeds);
  add_navmesh(seeds);
  add_caches(seeds);
  return 0;
}
