// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include "allocations.hpp"
#include "check_refused.hpp"
#include "zip.hpp"
#include "zip_file.hpp"

using namespace gsnav;
using namespace gsnav_test;
using io::detail::ZipReader;

namespace {

/// Error of opening an archive and reading its first entry.
Status read_first(const std::string& archive, const std::string& name = "a.txt") {
  reset_largest_allocation();
  const auto zip = ZipReader::open(bytes_of(archive), "some.zip");
  if (!zip) return zip.status();
  return zip->read(name).status();
}

void check_archive_fails(const std::string& archive, Errc code, const std::string& part) {
  check_refused(read_first(archive), code, "some.zip", part);
  CHECK(largest_allocation() < 2000000);
}

std::string text_of(std::size_t n) {
  std::string out;
  for (std::size_t i = 0; out.size() < n; ++i) out += std::to_string(i * i) + ' ';
  return out;
}

}  // namespace

TEST_CASE("zip: stored and deflated entries, comments, streamed writers") {
  for (const char* comment : {"", "a comment with PK\x05\x06 in it and some more text behind"}) {
    for (const bool streamed : {false, true}) {
      const std::string archive = make_zip({{"a.txt", text_of(100000), true},
                                            {"b/", ""},
                                            {"b/c.txt", text_of(70), false},
                                            {"empty", "", false}},
                                           comment, streamed);
      const auto zip = ZipReader::open(bytes_of(archive), "some.zip").value();
      CHECK(zip.names() == std::vector<std::string>{"a.txt", "b/c.txt", "empty"});
      const auto content = [&](const std::string& name) {
        const auto bytes = zip.read(name).value();
        return std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size());
      };
      CHECK(content("a.txt") == text_of(100000));
      CHECK(content("b/c.txt") == text_of(70));
      CHECK(content("empty").empty());
      CHECK(zip.contains("empty"));
      CHECK_FALSE(zip.contains("b"));
      CHECK(zip.read("b").code() == Errc::file_not_found);
    }
  }
  CHECK(ZipReader::open(bytes_of(make_zip({})), "some.zip").value().names().empty());
}

TEST_CASE("zip: names that leave the folder") {
  for (const char* name :
       {"../a.txt", "a/../../b", "/etc/passwd", "..", "a\\b", "c:a.txt", "a\nb", ""}) {
    check_archive_fails(make_zip({{name, "x"}}), Errc::invalid_file, "leaves the archive's folder");
  }
  CHECK(read_first(make_zip({{"..a.txt", "x"}}), "..a.txt").ok());
  CHECK(read_first(make_zip({{"a../b", "x"}}), "a../b").ok());
  check_archive_fails(make_zip({{"a.txt", "x"}, {"a.txt", "y"}}), Errc::invalid_file, "comes twice");
}

TEST_CASE("zip: sizes and offsets that lie") {
  ZipFileEntry e{"a.txt", text_of(1000), true};
  const auto with = [&e](auto change) {
    ZipFileEntry copy = e;
    change(copy);
    return make_zip({copy});
  };
  REQUIRE(read_first(make_zip({e})).ok());
  check_archive_fails(with([](auto& x) { x.size = 999; }), Errc::invalid_file, "size promised");
  check_archive_fails(with([](auto& x) { x.size = 1100; }), Errc::invalid_file, "size promised");
  check_archive_fails(with([](auto& x) { x.size = 0xfffffffe; }), Errc::invalid_file, "implausible");
  check_archive_fails(with([](auto& x) { x.packed = 100; }), Errc::invalid_file, "size promised");
  const auto longer = static_cast<std::uint32_t>(deflate_raw(e.content).size() + 4);
  check_archive_fails(with([&](auto& x) { x.packed = longer; }), Errc::invalid_file, "size promised");
  check_archive_fails(with([](auto& x) { x.packed = 0xfffffffe; }), Errc::invalid_file,
                      "not inside the file");
  check_archive_fails(with([](auto& x) { x.offset = 7; }), Errc::invalid_file, "no local header");
  check_archive_fails(with([](auto& x) { x.offset = 0xfffffffe; }), Errc::invalid_file,
                      "no local header");
  check_archive_fails(with([](auto& x) { x.bad_crc = true; }), Errc::invalid_file, "checksum");
  check_archive_fails(with([](auto& x) { x.flags = 1; }), Errc::unsupported, "encrypted");
  check_archive_fails(with([](auto& x) { x.method = 12; }), Errc::unsupported, "method 12");
  check_archive_fails(with([](auto& x) { x.method = 0; }), Errc::invalid_file, "implausible");
  e.deflated = false;
  check_archive_fails(with([](auto& x) { x.size = 5; }), Errc::invalid_file, "implausible");
  check_archive_fails(with([](auto& x) { x.method = 8; }), Errc::invalid_file, "size promised");
}

TEST_CASE("zip: a bomb is refused before memory is asked for") {
  check_archive_fails(make_zip({{"a.txt", std::string(50000000, 'x'), true}}), Errc::invalid_file,
                      "implausible");
}

TEST_CASE("zip: cut off anywhere") {
  const std::string archive = make_zip({{"a.txt", text_of(300), true}, {"b.txt", text_of(100), false}});
  for (std::size_t n = 0; n < archive.size(); ++n) {
    const std::string cut = archive.substr(0, n);
    REQUIRE(read_first(cut).code() == Errc::invalid_file);
    // The end of the archive is whole, the front is missing.
    const Status behind = read_first(archive.substr(archive.size() - n));
    REQUIRE_FALSE(behind.ok());
  }
}

TEST_CASE("zip: directories that lie") {
  const std::string archive = make_zip({{"a.txt", text_of(300), true}});
  const std::size_t end = archive.size() - 22;
  const auto with = [&](std::size_t at, auto value) {
    std::string out = archive;
    std::memcpy(out.data() + end + at, &value, sizeof value);
    return out;
  };
  const auto both = [&](std::uint16_t count) {
    std::string out = with(8, count);
    std::memcpy(out.data() + end + 10, &count, sizeof count);
    return out;
  };
  // Lengths of the name, the extra field and the comment that run out of the directory.
  const std::size_t record = end - (46 + 5 + 3 + 2);
  for (const std::size_t field : {28u, 30u, 32u}) {
    for (const int length : {9, 60000}) {
      std::string out = archive;
      const auto value = static_cast<std::uint16_t>(length);
      std::memcpy(out.data() + record + field, &value, sizeof value);
      check_archive_fails(out, Errc::invalid_file, "entry 0 is cut off");
    }
  }
  check_archive_fails(both(2), Errc::invalid_file, "entry 1 of 2");
  check_archive_fails(both(65535), Errc::invalid_file, "zip64");
  check_archive_fails(with(8, std::uint16_t{7}), Errc::unsupported, "volumes");
  check_archive_fails(with(4, std::uint16_t{1}), Errc::unsupported, "volumes");
  check_archive_fails(with(12, std::uint32_t{3}), Errc::invalid_file, "entry 0");
  check_archive_fails(with(12, std::uint32_t{0x7fffffff}), Errc::invalid_file, "not inside the file");
  check_archive_fails(with(16, std::uint32_t{0x7fffffff}), Errc::invalid_file, "not inside the file");
  check_archive_fails(with(16, std::uint32_t{0}), Errc::invalid_file, "entry 0");
  check_archive_fails(with(20, std::uint16_t{5}), Errc::invalid_file, "no zip archive");
}
