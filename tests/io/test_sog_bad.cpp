// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include "allocations.hpp"
#include "gsnav/detail/io/sog.hpp"
#include "sog_file.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

/// Expects that the set fails as a folder and as a bundle, with all `parts` in the message.
void check_fails(const SogFile& f, Errc code, const std::vector<std::string>& parts) {
  TempFolder folder("sog_bad");
  f.write_folder(folder / "set");
  write_file(folder / "set.sog", f.bundle(true));
  for (const char* name : {"set", "set.sog"}) {
    reset_largest_allocation();
    const auto result = io::load_sog(folder / name);
    CHECK(largest_allocation() < 1000000);
    CAPTURE(result.message());
    CHECK(result.code() == code);
    CHECK(contains(result.message(), (folder / "set").string()));
    for (const std::string& part : parts) {
      CAPTURE(part);
      CHECK(contains(result.message(), part));
    }
  }
}

SogFile made(int bands = 0) {
  SogFile f(bands);
  f.make_files();
  return f;
}

/// The set with a piece of meta.json replaced.
SogFile with_meta(const std::string& from, const std::string& to, int bands = 0) {
  SogFile f = made(bands);
  std::string& meta = f.files["meta.json"];
  REQUIRE(contains(meta, from));
  meta.replace(meta.find(from), from.size(), to);
  return f;
}

}  // namespace

TEST_CASE("sog: each file that is missing is named") {
  for (const char* name : {"meta.json", "means_l.webp", "means_u.webp", "scales.webp", "quats.webp",
                           "sh0.webp", "shN_centroids.webp", "shN_labels.webp"}) {
    SogFile f = made(2);
    f.files.erase(name);
    check_fails(f, Errc::file_not_found, {name});
  }
}

TEST_CASE("sog: planes of another size, of no format, cut off") {
  for (const char* name : {"means_u.webp", "scales.webp", "quats.webp", "sh0.webp", "shN_labels.webp"}) {
    SogFile f = made(1);
    f.files[name] = SogPlane(5, 4).webp();
    check_fails(f, Errc::invalid_file, {name, "5 x 4", "5 x 3"});
    f.files[name] = "RIFF";
    check_fails(f, Errc::invalid_file, {name, "WebP"});
    const std::string whole = SogPlane(5, 3).webp();
    f.files[name] = whole.substr(0, whole.size() - 6);
    check_fails(f, Errc::invalid_file, {name});
    f.files[name] = SogPlane(5, 3).webp(false);
    check_fails(f, Errc::unsupported, {name, "lossless"});
  }
  SogFile f = made(3);
  for (const auto& [w, h] : {std::pair{959, 2}, {960, 1}, {960, 1025}, {512, 2}}) {
    f.files["shN_centroids.webp"] = SogPlane(w, h).webp();
    check_fails(f, Errc::invalid_file,
                {"shN_centroids.webp", std::to_string(w) + " x " + std::to_string(h), "960 x 2", "70"});
  }
}

TEST_CASE("sog: counts that the planes or the bytes cannot hold") {
  check_fails(with_meta("\"count\":13", "\"count\":16"), Errc::invalid_file,
              {"meta.json", "'count' is 16", "5 x 3"});
  check_fails(with_meta("\"count\":13", "\"count\":-1"), Errc::invalid_file, {"'count'", "-1"});
  check_fails(with_meta("\"count\":13", "\"count\":1.5"), Errc::invalid_file, {"'count'", "1.5"});
  check_fails(with_meta("\"count\":13", "\"count\":1e300"), Errc::invalid_file, {"'count'"});
  check_fails(with_meta("\"count\":13", "\"count\":\"13\""), Errc::invalid_file, {"'count'", "13"});
  check_fails(with_meta("\"count\":13,", ""), Errc::invalid_file, {"'count' is missing"});

  // Planes of one colour: hundreds of megabytes of pixels in some bytes of file.
  SogFile f = with_meta("\"count\":13", "\"count\":30000000");
  const std::string huge = SogPlane(6000, 6000).webp();
  CHECK(huge.size() < 50000);
  for (auto& [name, content] : f.files) {
    if (name != "meta.json") content = huge.substr(0, 1000);  // the header is all that is looked at
  }
  check_fails(f, Errc::invalid_file, {"30000000", "6000 x 6000"});
}

TEST_CASE("sog: codebooks") {
  for (const char* section : {"scales", "sh0", "shN"}) {
    SogFile f(1);
    (std::string(section) == "scales" ? f.scale_book
                                      : (std::string(section) == "sh0" ? f.dc_book : f.rest_book))
        .resize(40);
    SogPlane& plane = std::string(section) == "scales" ? f.scales
                      : std::string(section) == "sh0"  ? f.sh0
                                                       : f.centroids;
    for (std::size_t i = 0; i < plane.rgba.size(); ++i) plane.rgba[i] = i % 4 == 3 ? 200 : 39;
    f.make_files();
    TempFolder folder("sog_book");
    f.write_folder(folder.path());
    CHECK(io::load_sog(folder.path()).ok());  // short, but every index is inside
    for (int k = 0; k < 3; ++k) {
      SogFile bad = f;
      SogPlane& p = std::string(section) == "scales" ? bad.scales
                    : std::string(section) == "sh0"  ? bad.sh0
                                                     : bad.centroids;
      // Pixel 12 is the last Gaussian; entry 69 of the palette, which Gaussian 0 uses, is at 64*3 + 5*3.
      const std::size_t at = std::string(section) == "shN" ? 64 * 3 + 5 * 3 : 12;
      p.pixel(at)[k] = 40;
      bad.make_files();
      check_fails(
          bad, Errc::invalid_file,
          {"pixel " + std::to_string(at), "index 40", "40 entries",
           std::string(section) == "shN" ? "shN_centroids.webp" : std::string(section) + ".webp"});
    }
  }
  check_fails(with_meta("{\"codebook\":[-9,", "{\"codebook\":[null,"), Errc::invalid_file,
              {"scales", "'codebook[0]'", "null"});
  check_fails(with_meta("{\"codebook\":[-9,", "{\"codebook\":[1e999,"), Errc::invalid_file,
              {"meta.json"});
  check_fails(with_meta("{\"codebook\":[-9,", "{\"codebook\":[1,-9,"), Errc::invalid_file,
              {"scales: 'codebook'", "256"});
  check_fails(with_meta("{\"codebook\":[-9,", "{\"codebok\":[-9,"), Errc::invalid_file,
              {"scales: 'codebook'"});
}

TEST_CASE("sog: quaternion modes and palette labels out of range") {
  SogFile f(2);
  f.quats.pixel(12)[3] = 251;
  f.make_files();
  check_fails(f, Errc::invalid_file, {"quats.webp", "pixel 12", "251", "252 to 255"});
  SogFile g(2);
  g.labels.pixel(12)[0] = 70;
  g.make_files();
  check_fails(g, Errc::invalid_file, {"shN_labels.webp", "pixel 12", "label 70", "70 entries"});
  SogFile h(2);
  h.labels.pixel(3)[1] = 200;
  h.make_files();
  check_fails(h, Errc::invalid_file, {"shN_labels.webp", "pixel 3", "70 entries"});
  SogFile beyond(2);  // what follows the count belongs to nobody
  beyond.quats.pixel(13)[3] = 3;
  beyond.labels.pixel(14)[1] = 200;
  beyond.make_files();
  TempFolder folder("sog_beyond");
  beyond.write_folder(folder.path());
  CHECK(io::load_sog(folder.path()).value().cloud.size() == 13);
}

TEST_CASE("sog: meta.json that makes no sense") {
  check_fails(with_meta("\"version\":2", "\"version\":3"), Errc::unsupported,
              {"meta.json", "'version' is '3'"});
  check_fails(with_meta("\"version\":2", "\"version\":\"2\""), Errc::unsupported, {"'version'"});
  check_fails(with_meta("\"version\":2,", ""), Errc::invalid_file, {"version", "shape"});
  check_fails(with_meta("\"quats\":{", "\"quads\":{"), Errc::invalid_file, {"'quats'"});
  check_fails(with_meta("\"mins\":[-2.5,", "\"mins\":["), Errc::invalid_file,
              {"means: 'mins'", "2 values"});
  check_fails(with_meta("\"mins\":[-2.5,", "\"mins\":[\"a\","), Errc::invalid_file, {"'mins[0]'", "a"});
  check_fails(with_meta("[\"scales.webp\"]", "[]"), Errc::invalid_file, {"scales: 'files'"});
  check_fails(with_meta("[\"scales.webp\"]", "[7]"), Errc::invalid_file, {"scales: 'files'", "'7'"});
  for (const char* name :
       {"../scales.webp", "/etc/passwd", "a/../../b", "c:scales.webp", "", "a\\\\b"}) {
    check_fails(with_meta("[\"scales.webp\"]", std::string("[\"") + name + "\"]"), Errc::invalid_file,
                {"scales: 'files'", "same folder"});
  }
  check_fails(with_meta("\"bands\":2", "\"bands\":4", 2), Errc::invalid_file,
              {"shN: 'bands' is '4'", "1 to 3"});
  check_fails(with_meta("\"count\":70", "\"count\":65537", 2), Errc::invalid_file,
              {"shN: 'count'", "65537"});
  check_fails(with_meta("\"count\":13", "\"antialias\":1,\"count\":13"), Errc::invalid_file,
              {"'antialias'"});
  SogFile f = made();
  for (const char* text :
       {"", "{", "[]", "null", "{}", "{\"version\":2}", "\xff\xfe", "{\"means\":{}}"}) {
    f.files["meta.json"] = text;
    check_fails(f, Errc::invalid_file, {"meta.json"});
  }
  std::string deep;
  for (int i = 0; i < 200000; ++i) deep += "[";
  f.files["meta.json"] = deep;
  TempFolder folder("sog_deep");
  f.write_folder(folder.path());
  CHECK(io::load_sog(folder.path()).code() == Errc::unsupported);  // ReadLimits::json_depth
}

TEST_CASE("sog: version 1 with SH bands") {
  SogFile f = made();
  f.files["meta.json"] = R"({"means":{"shape":[13,3],"mins":[0,0,0],"maxs":[1,1,1],
    "files":["means_l.webp","means_u.webp"]},"scales":{"files":["scales.webp"]},
    "quats":{"files":["quats.webp"]},"sh0":{"files":["sh0.webp"]},"shN":{}})";
  check_fails(f, Errc::unsupported, {"meta.json", "version 1", "shN"});
}
