// SPDX-License-Identifier: Apache-2.0
#include "controls.hpp"

#include <charconv>
#include <cmath>

#include "gsnav/math/functions.hpp"

namespace gsnav_viewer {
namespace {

using gsnav::Errc;
using gsnav::Status;

bool read(std::string_view text, double& out) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), out);
  return error == std::errc{} && end == text.data() + text.size() && gsnav::is_finite(out);
}

constexpr double kMostTurn = 10.0;    // Radians per message.
constexpr double kMostTime = 100000;  // Seconds.

}  // namespace

Status apply(std::string_view message, Controls& controls) {
  Controls c = controls;
  c.seen.reset();
  c.steers = c.walks = false;
  const auto bad = [](std::string_view name, const char* rule) {
    return Status(Errc::invalid_argument, std::string(name.substr(0, 40)).append(": ").append(rule));
  };
  while (!message.empty()) {
    const std::size_t end = message.find('&');
    const std::string_view pair = message.substr(0, end);
    message.remove_prefix(end == std::string_view::npos ? message.size() : end + 1);
    const std::size_t equals = pair.find('=');
    const std::string_view name = pair.substr(0, equals);
    double v = 0;
    if (equals == std::string_view::npos || !read(pair.substr(equals + 1), v))
      return bad(name, "no number");
    const auto number = [&](double& to, double most) {
      to = v;
      return v >= -most && v <= most;
    };
    const auto flag = [&](bool& to) {
      to = v == 1;
      return v == 0 || v == 1;
    };
    bool good = false;
    double once = 0;
    c.steers = c.steers || name != "seen";
    c.walks = c.walks || name == "forward" || name == "left";
    if (name == "forward") {
      good = number(c.forward, 1);
    } else if (name == "left") {
      good = number(c.left, 1);
    } else if (name == "turn" || name == "tilt") {
      good = number(once, kMostTurn);
      (name == "turn" ? c.turn : c.tilt) += once;
    } else if (name == "time") {
      good = number(once, kMostTime) && once >= 0;
      c.time = once;
    } else if (name == "paused") {
      good = flag(c.paused);
    } else if (name == "people") {
      good = flag(c.people);
    } else if (name == "capsules") {
      good = flag(c.capsules);
    } else if (name == "navmesh") {
      good = flag(c.navmesh);
    } else if (name == "stop") {
      good = flag(c.stop);
    } else if (name == "next") {
      good = flag(c.next);
    } else if (name == "seen") {
      good = v >= 0 && v <= 9e15 && v == std::floor(v);
      if (good) c.seen = static_cast<std::uint64_t>(v);
    } else {
      return bad(name, "no such field");
    }
    if (!good) return bad(name, "out of range");
  }
  controls = c;
  return {};
}

}  // namespace gsnav_viewer
