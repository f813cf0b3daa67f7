// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cstdio>
#include <functional>
#include <random>

#include "allocations.hpp"
#include "check_cloud.hpp"
#include "glb_file.hpp"
#include "gsnav/detail/io/cameras_file.hpp"
#include "gsnav/detail/io/gltf.hpp"
#include "gsnav/detail/io/ksplat.hpp"
#include "gsnav/detail/io/mesh_file.hpp"
#include "gsnav/detail/io/ply.hpp"
#include "gsnav/detail/io/sog.hpp"
#include "gsnav/detail/io/splat.hpp"
#include "gsnav/detail/io/spz.hpp"
#include "gsnav/io/image_file.hpp"
#include "ksplat_file.hpp"
#include "ply_compressed_file.hpp"
#include "sog_file.hpp"
#include "splat_file.hpp"
#include "spz_file.hpp"
#include "support/sanitized.hpp"

// Files with a byte changed, dropped or doubled: a loader returns a Status that names the file or a
// result that is whole, and asks for no more memory than such a small file can need.

using namespace gsnav;
using namespace gsnav_test;

namespace {

constexpr std::size_t kMostMemory = 8000000;

/// Number of mutations to try: n, or a quarter of it under sanitizers, which fuzzers use for longer.
constexpr int tried(int n) { return kSanitized ? n / 4 : n; }

std::string mutated(const std::string& text, std::mt19937& generator) {
  std::string out = text;
  const int times = generator() % 4 == 0 ? 3 : 1;
  for (int k = 0; k < times; ++k) {
    const std::size_t at = generator() % out.size();
    switch (generator() % 6) {
      case 0:
        out.erase(at, 1 + generator() % 4);
        break;
      case 1:
        out.insert(at, 1, static_cast<char>(generator()));
        break;
      case 2:
        out[at] = static_cast<char>(out[at] ^ (1 << (generator() % 8)));
        break;
      case 3:
        out[at] = "0123456789-.eE,[]{}\" \n"[generator() % 22];
        break;
      default:
        out[at] = static_cast<char>(generator());
        break;
    }
    if (out.empty()) out = "x";
  }
  return out;
}

struct Tally {
  int ok = 0, failed = 0;
};

/// Feeds `n` mutations to `load`, which returns the Status.
Tally feed(const std::string& text, int n, unsigned seed, const std::string& name,
           const std::function<Status(const std::string&)>& load) {
  std::mt19937 generator(seed);
  Tally tally;
  for (int i = 0; i < n; ++i) {
    const std::string bad = mutated(text, generator);
    reset_largest_allocation();
    const Status s = load(bad);
    CAPTURE(i);
    CAPTURE(s.message());
    REQUIRE(largest_allocation() < kMostMemory);
    REQUIRE((s.ok() || contains(s.message(), name)));
    REQUIRE(s.code() != Errc::out_of_memory);
    ++(s.ok() ? tally.ok : tally.failed);
  }
  std::printf("%s: of %d mutations %d were refused\n", name.c_str(), n, tally.failed);
  return tally;
}

Status check_cloud(const Result<LoadedCloud>& loaded) {
  if (loaded) check_consistent(*loaded);
  return loaded.status();
}

}  // namespace

TEST_CASE("mutations: ply") {
  for (const char* format : {"binary_little_endian", "binary_big_endian", "ascii"}) {
    PlyFile file;
    file.format = format;
    file.properties = inria_properties(9);
    file.properties[1].second = "double";
    file.rows = random_rows(6, 9, 2);
    file.before_header = "element face 2\nproperty list uchar short a\n";
    file.before_rows = file.format == "ascii" ? "1 5\n0\n" : std::string("\1\0\5\0", 4);
    const Tally t = feed(file.text(), tried(3000), 1, "some.ply", [](const std::string& text) {
      return check_cloud(io::parse_ply(bytes_of(text), "some.ply"));
    });
    CHECK(t.ok > tried(100));
    CHECK(t.failed > tried(100));
    // Only the header: there every byte counts.
    const std::string rows = file.text().substr(file.header().size());
    feed(file.header(), tried(3000), 2, "some.ply", [&](const std::string& header) {
      return check_cloud(io::parse_ply(bytes_of(header + rows), "some.ply"));
    });
  }
}

TEST_CASE("mutations: compressed ply") {
  CompressedPlyFile file;
  file.rest = 9;
  file.rows = random_rows(6, 9, 2);
  const Tally t = feed(file.text(), tried(3000), 9, "some.ply", [](const std::string& text) {
    return check_cloud(io::parse_ply(bytes_of(text), "some.ply"));
  });
  CHECK(t.ok > tried(100));
  CHECK(t.failed > tried(100));
  const std::string rows = file.text().substr(file.header().size());
  feed(file.header(), tried(3000), 10, "some.ply", [&](const std::string& header) {
    return check_cloud(io::parse_ply(bytes_of(header + rows), "some.ply"));
  });
}

TEST_CASE("mutations: splat") {
  const Tally t =
      feed(splat_text(random_rows(6, 0, 2)), tried(3000), 11, "some.splat", [](const std::string& text) {
        return check_cloud(io::parse_splat(bytes_of(text), "some.splat"));
      });
  CHECK(t.ok > tried(100));
  CHECK(t.failed > tried(100));
}

TEST_CASE("mutations: spz, as it is and inside of its gzip stream") {
  SpzFile file;
  file.degree = 1;
  file.rows = random_rows(6, 9, 2);
  for (const std::uint32_t version : {1u, 2u, 3u}) {
    file.version = version;
    const auto load = [](const std::string& text) {
      return check_cloud(io::parse_spz(bytes_of(text), "some.spz"));
    };
    CHECK(feed(file.text(), tried(2000), 12, "some.spz", load).failed > tried(1000));
    const Tally t = feed(file.payload(), tried(2000), 13, "some.spz",
                         [&](const std::string& payload) { return load(gzip(payload)); });
    CHECK(t.ok > tried(100));
    CHECK(t.failed > tried(100));
    const std::string rest = file.payload().substr(16);
    feed(file.payload().substr(0, 16), tried(2000), 14, "some.spz",
         [&](const std::string& header) { return load(gzip(header + rest)); });
  }
}

TEST_CASE("mutations: spz 4") {
  SpzFile file;
  file.version = 4;
  file.degree = 1;
  file.flags = 2;
  file.rows = random_rows(6, 9, 2);
  std::string extension;
  put(extension, std::uint32_t{7});
  put(extension, std::uint32_t{3});
  const std::string text = file.plain(extension + "abc"), rest = text.substr(32);
  const auto load = [](const std::string& bytes) {
    return check_cloud(io::parse_spz(bytes_of(bytes), "some.spz"));
  };
  const Tally t = feed(text, tried(4000), 17, "some.spz", load);
  CHECK(t.ok > tried(100));
  CHECK(t.failed > tried(1000));
  feed(text.substr(0, 32), tried(2000), 18, "some.spz",
       [&](const std::string& header) { return load(header + rest); });
}

TEST_CASE("mutations: gltf") {
  GlbFile file;
  file.degree = 1;
  file.rows = random_rows(3, 9, 2);
  file.nodes = R"([{"children":[1],"scale":[2,2,2]},{"mesh":0,"rotation":[0,0,1,0]}])";
  const std::string json = file.json(), binary = file.binary();
  const Tally t = feed(json, tried(6000), 19, "some.glb", [&](const std::string& text) {
    const std::string glb = GlbFile::glb(text, binary);
    return check_cloud(io::parse_gltf(bytes_of(glb), "some.glb"));
  });
  CHECK(t.ok > tried(100));
  CHECK(t.failed > tried(1000));
  feed(file.text(), tried(3000), 20, "some.glb",
       [&](const std::string& text) { return check_cloud(io::parse_gltf(bytes_of(text), "some.glb")); });
}

TEST_CASE("mutations: ksplat") {
  for (const int level : {0, 1, 2}) {
    KsplatFile file;
    file.level = level;
    file.empty_sections = 0;
    file.sections = {{1, random_rows(6, 9, 2), 0}, {0, random_rows(5, 0, 3), 1}};
    const std::string text = file.text();
    const auto load = [](const std::string& bytes) {
      return check_cloud(io::parse_ksplat(bytes_of(bytes), "some.ksplat"));
    };
    // The parts of the headers that are read, and the data; what lies between is padding.
    const std::size_t main = 44, section = 42, first = KsplatFile::kHeader,
                      second = first + KsplatFile::kSectionHeader,
                      data = second + KsplatFile::kSectionHeader;
    const std::size_t parts[][2] = {{0, main}, {first, section}, {second, section}};
    for (const auto& part_of : parts) {
      const std::size_t from = part_of[0], size = part_of[1];
      feed(text.substr(from, size), tried(1000), 15, "some.ksplat", [&](std::string part) {
        part.resize(size);
        return load(text.substr(0, from) + part + text.substr(from + size));
      });
    }
    feed(text.substr(data), tried(1000), 16, "some.ksplat",
         [&](const std::string& bytes) { return load(text.substr(0, data) + bytes); });
  }
}

TEST_CASE("mutations: each file of a SOG, and its bundle") {
  TempFolder folder("mutations");
  SogFile f(2);
  f.make_files();
  f.write_folder(folder / "set");
  for (const auto& [name, content] : f.files) {
    const Tally t = feed(content, tried(name == "meta.json" ? 2000 : 300), 3, (folder / "set").string(),
                         [&, file = name](const std::string& text) {
                           write_file(folder / "set" / file, text);
                           return check_cloud(io::load_sog(folder / "set"));
                         });
    CHECK(t.failed > tried(20));
    write_file(folder / "set" / name, content);
  }
  for (const bool deflated : {false, true}) {
    const Tally t = feed(f.bundle(deflated), tried(2000), 4, "a.sog", [&](const std::string& text) {
      write_file(folder / "a.sog", text);
      return check_cloud(io::load_sog(folder / "a.sog"));
    });
    CHECK(t.failed > tried(1000));
  }
}

TEST_CASE("mutations: cameras, images, arrays, meshes") {
  TempFolder folder("mutations_other");
  const std::vector<Camera> cameras(2);
  REQUIRE(io::save_cameras(folder / "a.json", cameras).ok());
  feed(read_file(folder / "a.json"), tried(3000), 5, "a.json", [&](const std::string& text) {
    write_file(folder / "a.json", text);
    return io::load_cameras(folder / "a.json").status();
  });
  REQUIRE(io::save_png_rgb(folder / "a.png", std::vector<float>(75, 0.3f), 5, 5).ok());
  feed(read_file(folder / "a.png"), tried(2000), 6, "a.png", [&](const std::string& text) {
    write_file(folder / "a.png", text);
    return io::load_png(folder / "a.png").status();
  });
  REQUIRE(io::save_npy(folder / "a.npy", std::vector<float>(6), std::vector<std::size_t>{2, 3}).ok());
  feed(read_file(folder / "a.npy"), tried(3000), 7, "a.npy", [&](const std::string& text) {
    write_file(folder / "a.npy", text);
    const auto a = io::load_npy(folder / "a.npy");
    if (a) CHECK(a->values.size() <= 6);
    return a.status();
  });
  feed("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\nf -1/2/3 -2//4 -3\n", tried(3000), 8, "a.obj",
       [&](const std::string& text) {
         write_file(folder / "a.obj", text);
         const auto m = io::load_obj(folder / "a.obj");
         if (m) {
           for (const auto& t : m->triangles) {
             for (const std::uint32_t v : t) REQUIRE(v < m->vertices.size());
           }
         }
         return m.status();
       });
}
