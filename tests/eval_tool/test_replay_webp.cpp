// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include "gsnav/io/image_file.hpp"
#include "support/command.hpp"
#include "support/files.hpp"

using namespace gsnav_test;

namespace {

/// What the chunks of an animated WebP say (RIFF container, little-endian).
struct Animation {
  std::uint32_t width = 0, height = 0;
  std::vector<std::uint32_t> milliseconds;  ///< of each frame
};

std::uint32_t number_at(const std::string& bytes, std::size_t at, std::size_t size) {
  std::uint32_t value = 0;
  for (std::size_t k = 0; k < size; ++k)
    value |= static_cast<std::uint32_t>(static_cast<unsigned char>(bytes.at(at + k))) << 8 * k;
  return value;
}

Animation animation_of(const std::string& bytes) {
  REQUIRE(bytes.substr(0, 4) == "RIFF");
  REQUIRE(bytes.substr(8, 4) == "WEBP");
  CHECK(number_at(bytes, 4, 4) + 8 == bytes.size());
  Animation a;
  for (std::size_t at = 12; at < bytes.size();) {
    const std::string name = bytes.substr(at, 4);
    const std::size_t size = number_at(bytes, at + 4, 4);
    if (name == "VP8X") {
      a.width = number_at(bytes, at + 12, 3) + 1;
      a.height = number_at(bytes, at + 15, 3) + 1;
    }
    if (name == "ANMF") a.milliseconds.push_back(number_at(bytes, at + 20, 3));
    at += 8 + size + size % 2;
  }
  return a;
}

}  // namespace

TEST_CASE("a replay becomes an animated WebP, with pictures between steps") {
  const TempFolder folder("webp");
  const std::string options =
      "--density 0.05 --avatars 1 --episodes 1 --max-steps 12 --width 64 --height 48 --out out ";
  REQUIRE(run_command(GSNAV_EVAL, options + "--pictures 0", folder.path()).ok);
  const auto replay = [&](const std::string& more) {
    return run_command(GSNAV_REPLAY, options + more, folder.path());
  };
  const auto made = replay("--video walk.webp --per-action 2 --first 2 --last 5");
  CAPTURE(made.text);
#if defined(GSNAV_HAS_WEBPMUX)
  REQUIRE(made.ok);
  const Animation a = animation_of(read_file(folder / "walk.webp"));
  CHECK(a.width == 64);
  CHECK(a.height == 48);
  // The picture after action 2, and two for each of the actions 3 to 5; an action takes 250 ms.
  CHECK(a.milliseconds == std::vector<std::uint32_t>(7, 125));
#else
  CHECK(made.says("no libwebpmux"));
#endif

  // Every second picture is the one without --per-action; one between differs from both its neighbours.
  REQUIRE(replay("--frames plain").ok);
  REQUIRE(replay("--frames between --per-action 2 --first 2 --last 5").ok);
  const auto picture = [&](const std::string& name) {
    return gsnav::io::load_png(folder / name).value().samples;
  };
  CHECK(picture("between/00000.png") == picture("plain/00002.png"));
  CHECK(picture("between/00002.png") == picture("plain/00003.png"));
  CHECK(picture("between/00006.png") == picture("plain/00005.png"));
  CHECK_FALSE(std::filesystem::exists(folder / "between/00007.png"));
  CHECK(picture("between/00001.png") != picture("between/00000.png"));
  CHECK(picture("between/00001.png") != picture("between/00002.png"));

  // The agent's own view lies in the corner, in a white frame; the rest of the picture stays.
  const std::string corner = "--eye 5 2.5 4 --target 5 0 4 --every 100 --frames ";
  REQUIRE(replay(corner + "bare").ok);
  REQUIRE(replay(corner + "inset --inset").ok);
  const auto bare = picture("bare/00000.png"), inset = picture("inset/00000.png");
  const auto pixel = [](const std::vector<std::uint16_t>& p, std::size_t x, std::size_t y) {
    return std::vector<std::uint16_t>(p.begin() + static_cast<std::ptrdiff_t>(3 * (y * 64 + x)),
                                      p.begin() + static_cast<std::ptrdiff_t>(3 * (y * 64 + x) + 3));
  };
  CHECK(pixel(inset, 64 - 16 - 8 - 1, 40 - 6) == std::vector<std::uint16_t>(3, 255));
  CHECK(std::equal(bare.begin(), bare.begin() + 3 * 64 * 20, inset.begin()));
  CHECK_FALSE(replay("--frames none --inset").ok);  // it needs a camera that stands
}
