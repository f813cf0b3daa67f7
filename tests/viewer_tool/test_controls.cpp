// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include "../../tools/viewer/controls.hpp"

using namespace gsnav_viewer;

TEST_CASE("messages change what they mention; turns add up and commands are once") {
  Controls c;
  REQUIRE(gsnav_viewer::apply("forward=1&turn=0.25&paused=1", c).ok());
  REQUIRE(gsnav_viewer::apply("turn=-0.5&tilt=0.1&time=12.5", c).ok());
  CHECK(c.forward == 1.0);
  CHECK(c.turn == -0.25);
  CHECK(c.tilt == 0.1);
  CHECK(c.paused);
  CHECK(c.time == 12.5);
  REQUIRE(gsnav_viewer::apply("", c).ok());
  c.forget_commands();
  CHECK(c.forward == 1.0);
  CHECK(c.paused);
  CHECK(c.turn == 0.0);
  CHECK_FALSE(c.time.has_value());
}

TEST_CASE("a bad message names its field and changes nothing") {
  for (const char* message : {"forward=2", "left=-1.01", "forward=nan", "turn=inf", "turn=1e400",
                              "time=-1", "time=1e9", "paused=2", "stop=yes", "next", "next=", "=1", "&",
                              "fly=1", "forward=1 ", "forward=0x1", "paused=0.5"}) {
    Controls c;
    CAPTURE(message);
    const auto s = gsnav_viewer::apply(std::string("left=1&") + message, c);
    CHECK(s.code() == gsnav::Errc::invalid_argument);
    CHECK(s.message().find(std::string(message).substr(0, std::string(message).find_first_of("=&"))) !=
          std::string::npos);
    CHECK(c.left == 0.0);
  }
}
