// SPDX-License-Identifier: Apache-2.0
// What names of files may do to a terminal, and files that were made of an asset's former content.
#include <doctest/doctest.h>

#include <chrono>
#include <filesystem>
#include <string>

#include "gsnav/core/status.hpp"
#include "gsnav/core/text.hpp"
#include "gsnav/detail/io/read_or_build.hpp"
#include "gsnav/io/scene_file.hpp"
#include "support/files.hpp"

using namespace gsnav;
using namespace gsnav_test;
namespace fs = std::filesystem;

TEST_CASE("printable: control characters and what is no UTF-8 are written out, all else stays") {
  for (const char* same : {"", "room.ply", "a b\tc\nd",
                           "Stra\xc3\x9f"
                           "e",
                           "\xe5\xae\xb6.ply", "\xf0\x9f\x8f\xa0"}) {
    CHECK(printable(same) == same);
  }
  CHECK(printable("a\x1b]0;x\x07") == "a\\x1B]0;x\\x07");
  CHECK(printable(std::string("a\0b", 3)) ==
        "a\\x00"
        "b");
  CHECK(printable("\x7f\r") == "\\x7F\\x0D");
  CHECK(printable("\xc2\x9b"
                  "31m") == "\\xC2\\x9B31m");  // CSI as one character of UTF-8
  CHECK(printable("\x9b"
                  "31m\xff") == "\\x9B31m\\xFF");  // and as one byte
  CHECK(printable("\xe5\xae") == "\\xE5\\xAE");    // cut off
  CHECK(printable("\xc0\xaf") == "\\xC0\\xAF");    // longer than it need be
  // Every string of two bytes becomes printable, and stays so.
  for (int a = 0; a < 256; ++a) {
    for (int b = 0; b < 256; ++b) {
      const std::string made = printable(std::string{static_cast<char>(a), static_cast<char>(b)});
      REQUIRE(printable(made) == made);
    }
  }
}

TEST_CASE("errors and reports hold no control characters of a file's name") {
  const TempFolder folder("printable");
  const std::string name = (folder / "a\x1b[31m.ply").string();
  const auto missing = io::load_scene(name);
  CHECK(contains(missing.message(), "a\\x1B[31m.ply: no such file"));
  CHECK(missing.message().find('\x1b') == std::string::npos);
  LoadReport report;
  report.source = name;
  report.warnings.push_back("\x1b[0m");
  CHECK(io::report_text(report).find('\x1b') == std::string::npos);
}

TEST_CASE(
    "caches of an asset's former content are removed, those of other settings and of other assets "
    "stay") {
  const TempFolder folder("stale");
  const auto age = [&](const char* name, int hours) {
    write_file(folder / name, "x");
    fs::last_write_time(folder / name, fs::file_time_type::clock::now() - std::chrono::hours(hours));
  };
  age("room.ply", 5);
  age("room.ply.0123456789abcdef.lod", 1);  // just made
  age("room.ply.1123456789abcdef.lod", 3);  // of this content, by other settings
  age("room.ply.2123456789abcdef.lod", 9);  // of what was there before
  age("room.ply.2123456789abcdef.vis", 9);
  age("room.ply.notes.of.mine12.lod", 9);
  age("room.ply.lod", 9);
  age("room2.ply.2123456789abcdef.lod", 9);
  io::detail::remove_stale_caches(folder / "room.ply.0123456789abcdef.lod");
  CHECK(fs::exists(folder / "room.ply.0123456789abcdef.lod"));
  CHECK(fs::exists(folder / "room.ply.1123456789abcdef.lod"));
  CHECK_FALSE(fs::exists(folder / "room.ply.2123456789abcdef.lod"));
  CHECK(fs::exists(folder / "room.ply.2123456789abcdef.vis"));
  CHECK(fs::exists(folder / "room.ply.notes.of.mine12.lod"));
  CHECK(fs::exists(folder / "room.ply.lod"));
  CHECK(fs::exists(folder / "room2.ply.2123456789abcdef.lod"));
  // Of a folder, the newest file in it counts.
  fs::create_directory(folder / "set");
  age("set/meta.json", 2);
  fs::last_write_time(folder / "set", fs::file_time_type::clock::now() - std::chrono::hours(50));
  age("set.0123456789abcdef.vis", 1);
  age("set.1123456789abcdef.vis", 3);
  io::detail::remove_stale_caches(folder / "set.0123456789abcdef.vis");
  CHECK(fs::exists(folder / "set.0123456789abcdef.vis"));
  CHECK_FALSE(fs::exists(folder / "set.1123456789abcdef.vis"));
  // Nothing to compare with: nothing is removed.
  fs::remove(folder / "room.ply");
  io::detail::remove_stale_caches(folder / "room.ply.0123456789abcdef.lod");
  CHECK(fs::exists(folder / "room.ply.1123456789abcdef.lod"));
}
