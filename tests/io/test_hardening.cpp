// SPDX-License-Identifier: Apache-2.0
// What hostile files do, by name, over all readers of scenes; each format's own tests have the details.
#include <doctest/doctest.h>
#include <fcntl.h>
#include <unistd.h>

#include <cstdint>
#include <cstring>
#include <limits>
#include <string>

#include "allocations.hpp"
#include "avatar_npz.hpp"
#include "check_refused.hpp"
#include "glb_file.hpp"
#include "gsnav/detail/io/gltf.hpp"
#include "gsnav/detail/io/ksplat.hpp"
#include "gsnav/detail/io/npz_file.hpp"
#include "gsnav/detail/io/ply.hpp"
#include "gsnav/detail/io/sog.hpp"
#include "gsnav/detail/io/temporal_file.hpp"
#include "gsnav/io/scene_file.hpp"
#include "ksplat_file.hpp"
#include "ply_compressed_file.hpp"
#include "sog_file.hpp"
#include "support/scenes.hpp"
#include "temporal_rows_of.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

SogFile sog(int bands = 0) {
  SogFile file(bands);
  file.make_files();
  return file;
}

Result<LoadedCloud> load(const TempFolder& folder, const std::string& name, const std::string& content) {
  write_file(folder / name, content);
  return io::load_scene(folder / name);
}

PlyFile small_ply() {
  PlyFile file;
  file.properties = inria_properties(0);
  file.rows = random_rows(5, 0, 3);
  return file;
}

/// Refused, or all that was kept is finite.
void check_finite(const Result<LoadedCloud>& loaded) {
  if (!loaded) {
    CHECK_FALSE(loaded.message().empty());
    return;
  }
  const GaussianCloud& c = loaded->cloud;
  for (std::size_t i = 0; i < c.size(); ++i) {
    CHECK(is_finite(c.mean(i)));
    for (const auto& plane : c.scales) CHECK(plane[i] >= 0);
    for (const auto& plane : c.quats) CHECK(is_finite(plane[i]));
    CHECK(c.opacities[i] >= 0);
  }
  for (const float v : c.sh0) CHECK(is_finite(v));
  for (const float v : c.shN) CHECK(is_finite(v));
}

const float kNan = std::numeric_limits<float>::quiet_NaN();

}  // namespace

TEST_CASE("hardening: zip bombs") {
  const TempFolder folder("bombs");
  // One entry that unpacks to a thousand times its size.
  SogFile bomb = sog();
  bomb.files["means_l.webp"] = std::string(50000000, 'x');
  write_file(folder / "bomb.sog", bomb.bundle(true));
  reset_largest_allocation();
  check_refused(io::load_scene(folder / "bomb.sog"), Errc::invalid_file, "bomb.sog", "implausible");
  CHECK(largest_allocation() < 2000000);
  // A size that only the directory claims.
  ZipFileEntry array{"network.tfgs.fdgs._xyz.npy", "some bytes", true};
  array.size = 0xfffffff0;
  write_file(folder / "bomb.npz", make_zip({array}));
  reset_largest_allocation();
  check_refused(io::load_scene(folder / "bomb.npz"), Errc::invalid_file, "bomb.npz", "implausible");
  CHECK(largest_allocation() < 2000000);
  // Pictures of 16383 x 16383 pixels in some bytes.
  SogFile wide = sog();
  for (auto& [name, content] : wide.files) {
    if (!name.ends_with(".webp")) continue;
    const std::uint32_t size = 16382u | 16382u << 14;
    REQUIRE(content.substr(12, 4) == "VP8L");
    std::memcpy(content.data() + 21, &size, sizeof size);
  }
  write_file(folder / "wide.sog", wide.bundle(false));
  reset_largest_allocation();
  check_refused(io::load_scene(folder / "wide.sog"), Errc::invalid_file, "wide.sog", "too few");
  CHECK(largest_allocation() < 2000000);
}

TEST_CASE("hardening: path traversal in bundles") {
  const TempFolder folder("traversal");
  write_file(folder / "secret.webp", "secret");
  std::filesystem::create_directories(folder / "set");
  const SogFile file = sog();
  for (const char* name :
       {"../secret.webp", "/etc/passwd", "a/../../secret.webp", "..\\\\secret.webp", "c:secret.webp"}) {
    CAPTURE(name);
    SogFile outside = file;
    outside.files["meta.json"] = replaced(file.files.at("meta.json"), "scales.webp", name);
    outside.write_folder(folder / "set");
    CHECK(io::load_scene(folder / "set").code() == Errc::invalid_file);
    write_file(folder / "a.sog", outside.bundle(false));
    CHECK(io::load_scene(folder / "a.sog").code() == Errc::invalid_file);
    CHECK(load(folder, "b.sog", make_zip({{name, "x"}})).code() == Errc::invalid_file);
    GlbFile gltf;
    gltf.rows = random_rows(3, 0, 4);
    gltf.uri = name;
    CHECK_FALSE(load(folder, "a.gltf", gltf.json()).ok());
    const std::string set = std::string(R"({"lodLevels":1,"filenames":[")") + name +
                            R"("],"tree":{"lods":{"0":{"file":0,)" + R"("offset":0,"count":1}}}})";
    CHECK(load(folder, "lod-meta.json", set).code() == Errc::invalid_file);
  }
}

TEST_CASE("hardening: integer overflow") {
  const TempFolder folder("overflow");
  reset_largest_allocation();
  // Counts whose product with the size of a row is 2^64, or is negative as a signed number.
  for (const char* count : {"4611686018427387904", "4611686018427387905", "2305843009213693952"}) {
    PlyFile file = small_ply();
    file.before_header = std::string("element pad ") + count + "\nproperty uint a\n";
    check_refused(io::parse_ply(bytes_of(file.text()), "a"), Errc::invalid_file, "a", "'pad' promises");
    file.before_header.clear();
    file.count = count;
    check_refused(load(folder, "a.ply", file.text()), Errc::invalid_file, "a.ply", "'vertex' promises");
    const std::string meta =
        replaced(sog().files.at("meta.json"), "\"count\":13", std::string("\"count\":") + count);
    SogFile wrapped = sog();
    wrapped.files["meta.json"] = meta;
    CHECK_FALSE(load(folder, "a.sog", wrapped.bundle(false)).ok());
    GlbFile gltf;
    gltf.rows = random_rows(3, 0, 4);
    const std::string text = gltf.json();
    for (const char* key : {"\"count\":3", "\"byteOffset\":0"}) {
      const std::string changed =
          replaced(text, key, std::string(key, std::strchr(key, ':')) + ":" + count);
      check_refused(io::parse_gltf(bytes_of(GlbFile::glb(changed, gltf.binary())), "a"),
                    Errc::invalid_file, "a", "");
    }
    const std::string set =
        std::string(R"({"lodLevels":1,"filenames":["a.sog"],"tree":{"lods":{"0":{"file":0,"offset":)") +
        count + R"(,"count":)" + count + "}}}}";
    CHECK_FALSE(load(folder, "lod-meta.json", set).ok());
  }
  // An array of 2^32 x 2^32 values.
  write_npz(folder / "a.npz", {{"a", {{1}, {7}}}});
  const std::string npy =
      std::string("\x93NUMPY\x01\x00", 8) + std::string("\x60\x00", 2) +
      "{'descr': '<f4', 'fortran_order': False, 'shape': (4294967296, 4294967296), }";
  std::string padded = npy;
  padded.resize(10 + 0x60, ' ');
  write_file(folder / "b.npz", make_zip({{"a.npy", padded + "1234"}}));
  check_refused(io::NpzFile::open(folder / "b.npz").value().read("a"), Errc::invalid_file, "b.npz",
                "do not fit");
  CHECK(largest_allocation() < 2000000);
}

TEST_CASE("hardening: files beyond 4 GiB") {
  const TempFolder folder("large");
  constexpr std::uint64_t kFar = (std::uint64_t{1} << 32) + 4096;
  // Sparse: the bytes between take no room on the disk.
  const auto sparse = [&](const std::string& name, const std::string& front, std::uint64_t at,
                          const std::string& back) {
    const int fd = ::open((folder / name).c_str(), O_CREAT | O_TRUNC | O_WRONLY, 0600);
    REQUIRE(fd >= 0);
    const bool there =
        ::pwrite(fd, front.data(), front.size(), 0) == static_cast<ssize_t>(front.size()) &&
        ::pwrite(fd, back.data(), back.size(), static_cast<off_t>(at)) ==
            static_cast<ssize_t>(back.size());
    ::close(fd);
    return there;
  };
  PlyFile file = small_ply();
  const std::string rows = file.text().substr(file.header().size());
  file.before_header = "element pad " + std::to_string(kFar / 4) + "\nproperty uint a\n";
  const std::string header = file.header();
  if (!sparse("a.ply", header, header.size() + kFar, rows)) {
    MESSAGE("skipped: this file system takes no file of 4 GiB");
    return;
  }
  const std::string plain = small_ply().text();
  reset_largest_allocation();
  const auto loaded = io::load_ply(folder / "a.ply");
  REQUIRE(loaded.ok());
  CHECK(loaded->cloud.means == io::parse_ply(bytes_of(plain), "a").value().cloud.means);
  // What follows the rows is told, not read.
  REQUIRE(sparse("b.ply", plain, kFar, "x"));
  const auto stray = io::load_ply(folder / "b.ply");
  REQUIRE(stray.ok());
  REQUIRE(stray->report.warnings.size() == 1);
  CHECK(contains(stray->report.warnings[0], std::to_string(kFar + 1 - plain.size()) + " stray bytes"));
  // No header at all, or a count of no records.
  REQUIRE(sparse("a.ksplat", std::string(8, '\0'), kFar, "x"));
  CHECK_FALSE(io::load_scene(folder / "a.ksplat").ok());
  REQUIRE(sparse("a.splat", std::string(32, '\0'), kFar, "x"));
  CHECK(io::load_scene(folder / "a.splat").code() == Errc::invalid_file);
  CHECK(largest_allocation() < 8000000);
}

TEST_CASE("hardening: truncated streams of every format that is written") {
  const TempFolder folder("truncated");
  CloudOptions options;
  options.count = 60;
  const GaussianCloud cloud = random_cloud(4, options);
  for (const char* name : {"a.ply", "a.compressed.ply", "a.splat", "a.spz", "a.sog", "a.glb"}) {
    CAPTURE(name);
    REQUIRE(io::save_scene(folder / name, cloud).ok());
    const std::string whole = read_file(folder / name);
    REQUIRE(load(folder, name, whole).ok());
    for (std::size_t n = 0; n < whole.size(); n += whole.size() / 150 + 1) {
      const bool records =
          std::string(name) == "a.splat" && n % 32 == 0 && n != 0;  // shorter, and whole
      CHECK(load(folder, name, whole.substr(0, n)).ok() == records);
    }
  }
}

TEST_CASE("hardening: duplicate properties") {
  const TempFolder folder("twice");
  for (const char* name : {"x", "opacity", "nx"}) {
    PlyFile file = small_ply();
    file.properties.emplace_back(name, "float");
    check_refused(io::parse_ply(bytes_of(file.text()), "a"), Errc::invalid_file, "a", "comes twice");
  }
  PlyFile moving = temporal_file(3, 3, 5);
  moving.properties.emplace_back("t", "float");
  check_refused(io::parse_temporal_ply(bytes_of(moving.text()), "a"), Errc::invalid_file, "a", "'t'");
  CompressedPlyFile packed;
  packed.rows = random_rows(5, 0, 6);
  const std::string text = packed.text();
  check_refused(io::parse_ply(bytes_of(replaced(text, "packed_scale", "packed_color")), "a"),
                Errc::invalid_file, "a", "comes twice");
  SogFile file = sog();
  write_file(folder / "a.sog", make_zip({{"meta.json", file.meta()}, {"meta.json", "{}"}}));
  check_refused(io::load_sog(folder / "a.sog"), Errc::invalid_file, "a.sog", "comes twice");
  // Of a member that comes twice in JSON the last counts; it is checked as if it were alone.
  file.files["meta.json"] = replaced(file.meta(), "\"count\":13", "\"count\":13,\"count\":4000000000");
  write_file(folder / "b.sog", file.bundle(false));
  check_refused(io::load_sog(folder / "b.sog"), Errc::invalid_file, "b.sog", "4000000000");
}

TEST_CASE("hardening: huge headers") {
  const TempFolder folder("huge");
  // Longer than any writer's, and lengths that claim more than there is.
  std::string endless = "ply\nformat ascii 1.0\n";
  while (endless.size() < 1100000) endless += "comment " + std::string(1000, 'x') + "\n";
  check_refused(load(folder, "a.ply", endless), Errc::invalid_file, "a.ply", "longer than 1 MiB");
  for (const std::uint32_t length : {0x7fffffffu, 0xffffffffu}) {
    std::string npy("\x93NUMPY\x02\x00", 8);
    put(npy, length);
    write_file(folder / "a.npz", make_zip({{"a.npy", npy + "{}"}}));
    reset_largest_allocation();
    check_refused(io::NpzFile::open(folder / "a.npz").value().read("a"), Errc::invalid_file, "a.npz",
                  "cut off");
    std::string glb = "glTF";
    for (const std::uint32_t v : {2u, length, length}) put(glb, v);
    CHECK(io::parse_gltf(bytes_of(glb + "JSON{}"), "a").code() == Errc::invalid_file);
    std::string spz = "NGSP";
    for (const std::uint32_t v : {4u, 3u, 0x05000c00u, length}) put(spz, v);
    spz.resize(64);
    CHECK_FALSE(load(folder, "a.spz", spz).ok());
    CHECK(largest_allocation() < 2000000);
  }
  SogFile file = sog();
  file.files["meta.json"] = "{\"a\":\"" + std::string(3000000, 'x') + "\"}";
  CHECK(load(folder, "a.sog", file.bundle(true)).code() == Errc::invalid_file);
}

TEST_CASE("hardening: NaN in headers") {
  const TempFolder folder("nan");
  CHECK_FALSE(load(folder, "a.ply", replaced(small_ply().text(), "vertex 5", "vertex nan")).ok());
  CompressedPlyFile packed;
  packed.rows = random_rows(5, 0, 6);
  for (std::size_t k = 0; k < 18; ++k) {  // each bound of the chunk
    std::string text = packed.text();
    std::memcpy(text.data() + packed.header().size() + sizeof kNan * k, &kNan, sizeof kNan);
    const auto loaded = io::parse_ply(bytes_of(text), "a");
    check_finite(loaded);
    REQUIRE(loaded.ok());
    CHECK(loaded->report.dropped_non_finite == 5);
  }
  KsplatFile buckets;
  buckets.level = 2;
  buckets.sections = {{1, random_rows(6, 9, 7), 0}};
  for (const std::size_t at : {std::size_t{36}, std::size_t{40}, KsplatFile::kHeader + 16}) {
    std::string text = buckets.text();
    KsplatFile::set(text, at, kNan);
    check_finite(io::parse_ksplat(bytes_of(text), "a"));
  }
  for (const char* number : {"NaN", "1e999", "-1e999", "null"}) {
    CAPTURE(number);
    SogFile file = sog();
    const std::string meta = file.meta();
    for (const char* key : {"\"mins\":[", "\"maxs\":[", "\"codebook\":["}) {
      const std::size_t from = meta.find(key) + std::strlen(key), end = meta.find(',', from);
      file.files["meta.json"] = meta.substr(0, from) + number + meta.substr(end);
      CHECK_FALSE(load(folder, "a.sog", file.bundle(false)).ok());
    }
    GlbFile gltf;
    gltf.rows = random_rows(3, 0, 4);
    gltf.nodes = std::string(R"([{"mesh":0,"translation":[0,)") + number + ",0]}]";
    check_finite(io::parse_gltf(bytes_of(gltf.text()), "a"));
  }
  TestArrays arrays = temporal_arrays(temporal_file(4, 3, 8).rows, 3, "network.tfgs.fdgs.");
  for (const double v :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    for (const char* name : {"network.scene_scale", "network.time_dilation"}) {
      TestArrays bad = arrays;
      bad[name] = {{1}, {v}};
      write_npz(folder / "a.npz", bad);
      check_refused(io::load_scene(folder / "a.npz"), Errc::invalid_file, "a.npz", name);
    }
  }
}
