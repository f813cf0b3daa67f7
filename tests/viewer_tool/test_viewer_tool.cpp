// SPDX-License-Identifier: Apache-2.0
// The viewer as people run it: a process, its page and its streams.
#include <doctest/doctest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "../../tools/eval/run.hpp"
#include "gsnav/backends/openmp.hpp"
#include "http_client.hpp"
#include "picture.hpp"
#include "support/command.hpp"
#include "support/files.hpp"
#include "support/process.hpp"

using namespace gsnav_test;
using Json = nlohmann::json;

namespace {

constexpr int kWidth = 320, kHeight = 240;
const std::vector<std::string> kScene{"--avatars", "2", "--episodes", "2", "--width", "320", "--height", "240", "--threads", "2"};

/// The viewer in a process of its own, at a free port.
class Viewer {
 public:
  Viewer() {
    std::vector<std::string> words{GSNAV_VIEWER, "--port", "0", "--paused"};
    words.insert(words.end(), kScene.begin(), kScene.end());
    process_.emplace(words, folder_.path());
    std::string line;
    for (int i = 0; i < 6000 && !line.ends_with('\n') && process_->runs(); ++i) {
      usleep(20000);
      line = read_file(folder_ / "log");
    }
    REQUIRE(line.starts_with("http://127.0.0.1:"));
    port = std::atoi(line.c_str() + line.rfind(':') + 1);
  }

  /// How it ends when it is asked to.
  int end() {
    process_->signal(SIGTERM);
    return process_->wait(20);
  }
  Json tell(const std::string& message) const { return Json::parse(body_of(request(port, "POST /control", message)), nullptr, false); }
  /// The next frame of a panel: one that was begun after this was asked for.
  std::string jpeg(const std::string& panel) const {
    Client c(port);
    c.send("GET /stream/" + panel + " HTTP/1.0\r\n\r\n");
    const std::string mark = "Content-Length: ";
    while (true) {
      const std::size_t at = c.text.find(mark), body = c.text.find("\r\n\r\n", at);
      if (at != std::string::npos && body != std::string::npos) {
        const auto length = static_cast<std::size_t>(std::atoi(c.text.c_str() + at + mark.size()));
        if (c.text.size() >= body + 4 + length) return c.text.substr(body + 4, length);
      }
      REQUIRE(c.more());
    }
  }
  gsnav::io::PngImage frame(const std::string& panel) const {
    const std::string bytes = jpeg(panel);
    return gsnav::io::detail::decode_jpeg(bytes_of(bytes), panel).value();
  }

  int port = 0;

 private:
  TempFolder folder_{"viewer"};
  std::optional<Process> process_;
};

/// PSNR of two 8-bit pictures of one size, dB.
double psnr(const std::vector<std::uint16_t>& a, const std::vector<std::uint16_t>& b) {
  REQUIRE(a.size() == b.size());
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += std::pow(static_cast<double>(a[i]) - b[i], 2);
  return 10 * std::log10(255.0 * 255.0 * static_cast<double>(a.size()) / std::max(sum, 1e-9));
}

/// What an agent there sees, drawn by the library.
std::vector<std::uint16_t> truth(const Json& state) {
  gsnav_eval::Options o;
  o.avatars = 2;
  o.episodes = 2;
  o.width = kWidth;
  o.height = kHeight;
  const auto stage = gsnav_eval::prepare(o).value();
  gsnav::OpenMPBackend backend(2);
  auto sim = gsnav::Simulator<gsnav::OpenMPBackend>::create(backend, stage.scene, stage.config).value();
  gsnav::PointNavEpisode episode = stage.episodes[0];
  episode.start_time = state["time"].get<double>();
  sim.reset(episode).value();
  gsnav::WorldState at = sim.state();
  at.agent.position = {state["position"][0].get<double>(), state["position"][1].get<double>(), state["position"][2].get<double>()};
  at.agent.yaw = state["yaw"].get<double>();
  at.agent.pitch = state["pitch"].get<double>();
  REQUIRE(sim.set_state(at).ok());
  const auto rgb = sim.observe().value()["rgb"];
  std::vector<std::uint8_t> bytes(rgb.size());
  gsnav::to_bytes(rgb, bytes);
  return {bytes.begin(), bytes.end()};
}

}  // namespace

TEST_CASE("the viewer serves its page and its streams and nothing else") {
  Viewer v;
  const std::string page = request(v.port, "GET /");
  CHECK(status_of(page) == 200);
  CHECK(contains(page, "/stream/color"));
  for (const char* path : {"/index.html", "/../../../etc/passwd", "/stream", "/stream/", "/stream/color/..", "/stream/%2e%2e", "/favicon.ico",
                           "/control/"}) {
    CHECK(status_of(request(v.port, std::string("GET ") + path)) == 404);
  }
  CHECK(status_of(request(v.port, "GET /control")) == 405);
  CHECK(status_of(request(v.port, "POST /stream/color")) == 405);
  const std::string refused = request(v.port, "POST /control", "forward=7");
  CHECK(status_of(refused) == 400);
  CHECK(contains(refused, "forward"));
  CHECK(status_of(converse(v.port, "GET / HTTP/1.1\r\nHost: evil.example:80\r\n\r\n")) == 403);
  CHECK(v.jpeg("color").starts_with("\xff\xd8\xff"));
  CHECK(v.end() == 0);
}

TEST_CASE("the colour stream is what the library draws there, and steering changes it") {
  Viewer v;
  v.jpeg("color");
  const Json start = v.tell("");
  REQUIRE(start.is_object());
  const auto first = v.frame("color");
  CHECK(first.width == kWidth);
  CHECK(first.height == kHeight);
  CHECK(psnr(first.samples, truth(start)) > 28);
  CHECK(v.frame("depth").samples != first.samples);
  CHECK(v.frame("map").samples != first.samples);

  // Time stands still, but for who moves it; a turn is a turn.
  CHECK(start["paused"] == true);
  v.tell("turn=0.5&tilt=-0.2&time=7.5");
  const auto turned = v.frame("color");
  const Json there = v.tell("");
  CHECK(there["time"].get<double>() == doctest::Approx(7.5));
  CHECK(std::remainder(there["yaw"].get<double>() - start["yaw"].get<double>() - 0.5, 6.283185307179586) == doctest::Approx(0));
  CHECK(there["pitch"].get<double>() == doctest::Approx(-0.2));
  CHECK(there["position"] == start["position"]);
  CHECK(psnr(turned.samples, truth(there)) > 28);
  CHECK(psnr(turned.samples, first.samples) < 25);

  // A walk is counted; overlays are drawn over the same view.
  for (int i = 0; i < 4; ++i) {
    v.tell("forward=-1&left=0.5");
    v.jpeg("map");
  }
  v.tell("forward=0&left=0");
  v.jpeg("map");
  v.jpeg("map");
  const Json walked = v.tell("");
  CHECK(walked["metrics"]["path_length"].get<double>() > 0.05);
  CHECK(walked["metrics"]["steps"].get<int>() >= 4);
  CHECK(walked["time"].get<double>() == doctest::Approx(7.5));
  const auto plain = v.frame("color");
  v.tell("navmesh=1&capsules=1");
  CHECK(v.frame("color").samples != plain.samples);

  v.tell("stop=1");
  v.jpeg("map");
  v.jpeg("map");
  CHECK(v.tell("")["done"] == true);
  v.tell("next=1");
  v.jpeg("map");
  v.jpeg("map");
  const Json next = v.tell("");
  CHECK(next["done"] == false);
  CHECK(next["episode"] != start["episode"]);
  CHECK(v.end() == 0);
}

TEST_CASE("half-open connections leave the viewer alone") {
  Viewer v;
  Client silent(v.port), half(v.port), reader(v.port);
  half.send("GET /stream/color HTTP/1.1\r\nHo");
  reader.send("GET /stream/color HTTP/1.0\r\n\r\n");  // and never reads
  CHECK(v.jpeg("color").starts_with("\xff\xd8\xff"));
  CHECK(status_of(half.all()) == 408);
  CHECK(v.end() == 0);
}

TEST_CASE("a browser shows the scene") {
#if !defined(GSNAV_CHROMIUM)
  MESSAGE("skipped: no chromium here");
#else
  Viewer v;
  v.jpeg("color");
  const auto frame = v.frame("color");
  const TempFolder folder("browser");
  const std::string arguments = "60 " + quoted(GSNAV_CHROMIUM) +
                                " --headless --no-sandbox --disable-gpu --disable-dev-shm-usage --no-first-run --user-data-dir=profile "
                                "--window-size=1280,800 --timeout=4000 --screenshot=page.png http://127.0.0.1:" + std::to_string(v.port) + "/";
  const Outcome browser = run_command("timeout", arguments, folder.path());
  CAPTURE(browser.text);
  REQUIRE(std::filesystem::exists(folder / "page.png"));
  const auto page = gsnav::io::load_png(folder / "page.png").value();
  if (const char* keep = std::getenv("GSNAV_KEEP_SCREENSHOT")) std::filesystem::copy_file(folder / "page.png", keep);
  // The colour panel is shown pixel by pixel: somewhere on the page is the frame itself.
  const auto channels = static_cast<std::size_t>(page.channels), width = static_cast<std::size_t>(page.width);
  double best = 1e9;
  for (std::size_t y0 = 0; y0 + kHeight <= static_cast<std::size_t>(page.height); ++y0) {
    for (std::size_t x0 = 0; x0 + kWidth <= width; ++x0) {
      double sum = 0;
      int n = 0;
      for (std::size_t k = 0; k < 64 && sum <= best * 64 * 3; ++k) {
        const std::size_t x = (k * 37 + 11) % kWidth, y = (k * 53 + 7) % kHeight;
        for (std::size_t c = 0; c < 3; ++c, ++n) {
          sum += std::abs(static_cast<double>(page.samples[((y0 + y) * width + x0 + x) * channels + c]) -
                          frame.samples[(y * kWidth + x) * 3 + c]);
        }
      }
      if (n == 64 * 3) best = std::min(best, sum / n);
    }
  }
  CHECK(best < 3.0);  // of 255; a frame moved by a few pixels differs by more than ten
#endif
}
