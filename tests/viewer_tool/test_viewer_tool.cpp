// SPDX-License-Identifier: Apache-2.0
// The viewer as people run it: a process, its page and its frames.
#include <doctest/doctest.h>
#include <sys/stat.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "../../tools/eval/run.hpp"
#include "gsnav/detail/demo/default_scene.hpp"
#include "gsnav/detail/io/ply.hpp"
#include "gsnav/device/simulator.hpp"
#include "http_client.hpp"
#include "picture.hpp"
#include "support/command.hpp"
#include "support/files.hpp"
#include "support/process.hpp"

using namespace gsnav_test;
using Json = nlohmann::json;

namespace {

constexpr int kWidth = 320, kHeight = 240;
constexpr double kDensity = 0.25;  // each viewer makes the flat anew
const std::vector<std::string> kScene{"--avatars", "2",   "--episodes", "2",     "--width",   "320",
                                      "--height",  "240", "--device",   "cpu:2", "--density", "0.25"};

/// The viewer in a process of its own, at a free port.
class Viewer {
 public:
  explicit Viewer(const std::vector<std::string>& more = {}) {
    std::vector<std::string> words{GSNAV_VIEWER, "--port", "0", "--paused"};
    words.insert(words.end(), kScene.begin(), kScene.end());
    words.insert(words.end(), more.begin(), more.end());
    process_.emplace(words, folder_.path());
    std::string line;  // the last: what there is to say of the scene comes before it
    const auto said = [&] { return contains(line, "http://127.0.0.1:") && line.ends_with('\n'); };
    for (int i = 0; i < 6000 && !said() && process_->runs(); ++i) {
      usleep(20000);
      line = read_file(folder_ / "log");
    }
    REQUIRE(said());
    port = std::atoi(line.c_str() + line.rfind(':') + 1);
  }

  /// How it ends when it is asked to.
  int end() {
    process_->signal(SIGTERM);
    return process_->wait(20);
  }
  /// A frame as the page gets it.
  struct Frame {
    Json state;
    std::string jpeg[3];  ///< colour, depth, map
  };
  /// A frame that was begun after this was asked for, or after `message` has had its effect. An answer
  /// comes after half a second, without pictures where the first frame is still being drawn.
  Frame frame(const std::string& message = "") const {
    Frame f = parse(body_of(request(port, "POST /frame", message)));
    for (int again = 0; again < 120 && f.jpeg[0].empty(); ++again)
      f = parse(body_of(request(port, "POST /frame", "")));
    return f;
  }
  static Frame parse(const std::string& body) {
    Frame f;
    const std::size_t line = body.find('\n');
    f.state = Json::parse(body.substr(0, line), nullptr, false);
    REQUIRE(f.state.is_object());
    std::size_t at = line + 1;
    for (std::size_t k = 0; k < 3; ++k) {
      const auto size = f.state["sizes"][k].get<std::size_t>();
      f.jpeg[k] = body.substr(at, size);
      at += size;
    }
    CHECK(at == body.size());
    return f;
  }
  static gsnav::io::PngImage picture(const Frame& f, std::size_t panel) {
    return gsnav::io::detail::decode_jpeg(bytes_of(f.jpeg[panel]), "panel").value();
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
  o.density = kDensity;
  o.avatars = 2;
  o.episodes = 2;
  o.width = kWidth;
  o.height = kHeight;
  const auto stage = gsnav_eval::prepare(o).value();
  auto sim =
      gsnav::Simulator::create(gsnav::Device::parse("cpu:2").value(), stage.scene, stage.config).value();
  gsnav::PointNavEpisode episode = stage.episodes[0];
  episode.start_time = state["time"].get<double>();
  sim.reset(episode).value();
  gsnav::WorldState at = sim.state();
  at.agent.position = {state["position"][0].get<double>(), state["position"][1].get<double>(),
                       state["position"][2].get<double>()};
  at.agent.yaw = state["yaw"].get<double>();
  at.agent.pitch = state["pitch"].get<double>();
  REQUIRE(sim.set_state(at).ok());
  const auto rgb = sim.observe().value()["rgb"];
  std::vector<std::uint8_t> bytes(rgb.size());
  gsnav::to_bytes(rgb, bytes);
  return {bytes.begin(), bytes.end()};
}

}  // namespace

TEST_CASE("the viewer serves its page and its frames and nothing else") {
  Viewer v;
  const std::string page = request(v.port, "GET /");
  CHECK(status_of(page) == 200);
  CHECK(contains(page, "/frame"));
  for (const char* path : {"/index.html", "/../../../etc/passwd", "/stream/color", "/frame/",
                           "/frame/..", "/frame/%2e%2e", "/favicon.ico", "/control"}) {
    CHECK(status_of(request(v.port, std::string("GET ") + path)) == 404);
  }
  CHECK(status_of(request(v.port, "GET /frame")) == 405);
  CHECK(status_of(request(v.port, "POST /")) == 405);
  const std::string refused = request(v.port, "POST /frame", "forward=7");
  CHECK(status_of(refused) == 400);
  CHECK(contains(refused, "forward"));
  CHECK(status_of(converse(
            v.port, "GET / HTTP/1.1\r\nHost: evil.example:80\r\nConnection: close\r\n\r\n")) == 403);
  const auto frame = v.frame();
  for (const std::string& jpeg : frame.jpeg) CHECK(jpeg.starts_with("\xff\xd8\xff"));
  CHECK(frame.state["depth"]["colors"].size() == 9);
  CHECK(v.end() == 0);
}

TEST_CASE("the colour picture is what the library draws there, and steering changes it") {
  Viewer v;
  const auto at_start = v.frame();
  const Json start = at_start.state;
  const auto first = Viewer::picture(at_start, 0);
  CHECK(first.width == kWidth);
  CHECK(first.height == kHeight);
  CHECK(psnr(first.samples, truth(start)) > 28);
  CHECK(Viewer::picture(at_start, 1).samples != first.samples);
  CHECK(Viewer::picture(at_start, 2).samples != first.samples);

  // Time stands still, but for who moves it; a turn is a turn.
  CHECK(start["paused"] == true);
  const auto after_turn = v.frame("turn=0.5&tilt=-0.2&time=7.5");
  const auto turned = Viewer::picture(after_turn, 0);
  const Json there = after_turn.state;
  CHECK(there["time"].get<double>() == doctest::Approx(7.5));
  CHECK(std::remainder(there["yaw"].get<double>() - start["yaw"].get<double>() - 0.5,
                       6.283185307179586) == doctest::Approx(0));
  CHECK(there["pitch"].get<double>() == doctest::Approx(-0.2));
  CHECK(there["position"] == start["position"]);
  CHECK(psnr(turned.samples, truth(there)) > 28);
  CHECK(psnr(turned.samples, first.samples) < 25);

  // A walk is counted; overlays are drawn over the same view.
  for (int i = 0; i < 4; ++i) v.frame("forward=-1&left=0.5");
  const Json walked = v.frame("forward=0&left=0").state;
  CHECK(walked["metrics"]["path_length"].get<double>() > 0.05);
  CHECK(walked["metrics"]["steps"].get<int>() >= 4);
  CHECK(walked["time"].get<double>() == doctest::Approx(7.5));
  const auto plain = Viewer::picture(v.frame(), 0);
  CHECK(Viewer::picture(v.frame("navmesh=1&capsules=1"), 0).samples != plain.samples);

  // What is shown is in the state, for the boxes of other tabs.
  const Json shown = v.frame("people=0").state;
  CHECK(shown["people"] == false);
  CHECK(shown["capsules"] == true);
  CHECK(shown["navmesh"] == true);
  CHECK(v.frame("stop=1").state["done"] == true);
  const Json next = v.frame("next=1").state;
  CHECK(next["done"] == false);
  CHECK(next["episode"] != start["episode"]);
  CHECK(v.end() == 0);
}

TEST_CASE("a request waits for a frame newer than the one it has seen") {
  Viewer v;
  std::uint64_t seen = 0;
  for (int i = 0; i < 6; ++i) {
    const auto f = v.frame(seen == 0 ? "" : "seen=" + std::to_string(seen));
    const auto number = f.state["frame"].get<std::uint64_t>();
    CHECK(number > seen);
    seen = number;
  }
  CHECK(v.frame("seen=9000000000").state["frame"].get<std::uint64_t>() >
        seen);  // another process's number
  CHECK(v.end() == 0);
}

TEST_CASE("eight tabs at once each get their frames over one connection") {
  Viewer v;
  std::vector<std::thread> tabs;
  std::atomic<int> whole{0};
  for (int t = 0; t < 8; ++t) {
    tabs.emplace_back([&] {
      Client c(v.port);
      std::string seen;
      for (int i = 0; i < 5; ++i) {
        const std::string message = seen.empty() ? "" : "seen=" + seen;
        c.text.clear();
        c.send(
            "POST /frame HTTP/1.1\r\nHost: localhost\r\nSec-Fetch-Site: "
            "same-origin\r\nContent-Length: " +
            std::to_string(message.size()) + "\r\n\r\n" + message);
        const std::string mark = "Content-Length: ";
        while (true) {
          const std::size_t at = c.text.find(mark), body = c.text.find("\r\n\r\n", at);
          if (at != std::string::npos && body != std::string::npos &&
              c.text.size() ==
                  body + 4 + static_cast<std::size_t>(std::atoi(c.text.c_str() + at + mark.size()))) {
            const Json state = Json::parse(
                c.text.substr(body + 4, c.text.find('\n', body + 4) - body - 4), nullptr, false);
            if (state.is_object() && status_of(c.text) == 200) seen = state["frame"].dump();
            break;
          }
          if (!c.more()) return;
        }
      }
      ++whole;
    });
  }
  for (std::thread& t : tabs) t.join();
  CHECK(whole == 8);
  CHECK(v.end() == 0);
}

TEST_CASE("half-open connections leave the viewer alone") {
  Viewer v;
  Client silent(v.port), half(v.port), reader(v.port);
  half.send("POST /frame HTTP/1.1\r\nHo");
  reader.send("POST /frame HTTP/1.0\r\n\r\n");  // and never reads
  CHECK(v.frame().jpeg[0].starts_with("\xff\xd8\xff"));
  CHECK(status_of(half.all()) == 408);
  CHECK(v.end() == 0);
}

TEST_CASE("a scene whose name is no UTF-8 is shown") {
  const TempFolder folder("viewer_name");
  const std::string name = (folder / "fl\xff\xc3.ply").string();
  const auto cloud = gsnav::make_default_scene(0.05).value().cloud;
  REQUIRE(gsnav::io::save_ply(name, cloud).ok());
  Viewer v({"--scene", name, "--up", "y"});
  const auto f = v.frame();
  CHECK(contains(f.state["scene"].get<std::string>(), "\xef\xbf\xbd"));
  CHECK(f.jpeg[0].starts_with("\xff\xd8\xff"));
  CHECK(v.end() == 0);
}

TEST_CASE("memory that runs out while a frame is drawn is said, and ends the viewer with 1") {
  const TempFolder folder("viewer_memory");
  // What a page of this size takes is refused by the system; loading takes less.
  Process limited(
      {"/bin/bash", "-c",
       "ulimit -v 650000; exec " + quoted(GSNAV_VIEWER) +
           " --port 0 --paused --density 0.05 --avatars 0 --episodes 1 --device cpu:1 --width "
           "4096 --height 4096"},
      folder.path());
  std::string line;
  for (int i = 0; i < 3000 && !contains(line, "http://") && limited.runs(); ++i) {
    usleep(20000);
    line = read_file(folder / "log");
  }
  if (contains(line, "http://")) {
    const std::size_t at = line.rfind(':');
    request(std::atoi(line.c_str() + at + 1), "POST /frame");
  }
  CHECK(limited.wait(30) == 1);
  CHECK(contains(read_file(folder / "log"), "gsnav-viewer: "));
}

TEST_CASE("a port that is taken is said before anything is loaded, and a signal ends the loading") {
  Viewer v;
  const TempFolder folder("viewer_port");
  const auto begin = std::chrono::steady_clock::now();
  Process second({GSNAV_VIEWER, "--port", std::to_string(v.port), "--scene", "/nonexistent.ply"},
                 folder.path());
  CHECK(second.wait(30) == 1);
  const std::string log = read_file(folder / "log");
  CHECK(contains(log, std::to_string(v.port)));
  CHECK_FALSE(contains(log, "nonexistent"));
  // A scene that never ends: a pipe without a writer.
  const std::string pipe = (folder / "never.ply").string();
  REQUIRE(mkfifo(pipe.c_str(), 0600) == 0);
  Process loading({GSNAV_VIEWER, "--port", "0", "--scene", pipe}, folder.path());
  usleep(500000);
  if (loading.runs()) loading.signal(SIGINT);
  CHECK(loading.wait(10) != 0);
  CHECK(std::chrono::steady_clock::now() - begin < std::chrono::seconds(40));
  CHECK(v.end() == 0);
}

TEST_CASE("two browsers at once show the scene, without scrolling at 1280 x 720") {
#if !defined(GSNAV_CHROMIUM)
  MESSAGE("skipped: no chromium here");
#else
  Viewer v;
  const auto frame = Viewer::picture(v.frame(), 0);
  const TempFolder folders[2] = {TempFolder("browser_a"), TempFolder("browser_b")};
  std::vector<std::unique_ptr<Process> > browsers;
  for (const TempFolder& folder : folders) {
    // Its clock stands while it waits for an answer, so that slow machines show as many frames.
    browsers.push_back(std::make_unique<Process>(
        std::vector<std::string>{GSNAV_CHROMIUM, "--headless", "--no-sandbox", "--disable-gpu",
                                 "--disable-dev-shm-usage", "--no-first-run", "--user-data-dir=profile",
                                 "--window-size=1280,720", "--virtual-time-budget=3000",
                                 "--screenshot=page.png",
                                 "http://127.0.0.1:" + std::to_string(v.port) + "/"},
        folder.path()));
  }
  for (std::size_t b = 0; b < 2; ++b) {
    browsers[b]->wait(60);
    CAPTURE(read_file(folders[b] / "log"));
    REQUIRE(std::filesystem::exists(folders[b] / "page.png"));
    const auto page = gsnav::io::load_png(folders[b] / "page.png").value();
    // The colour panel is shown pixel by pixel: somewhere on the page is the frame itself.
    const auto channels = static_cast<std::size_t>(page.channels),
               width = static_cast<std::size_t>(page.width);
    double best = 1e9;
    for (std::size_t y0 = 0; y0 + kHeight <= static_cast<std::size_t>(page.height); ++y0) {
      for (std::size_t x0 = 0; x0 + kWidth <= width; ++x0) {
        double sum = 0;
        int n = 0;
        for (std::size_t k = 0; k < 64 && sum <= best * 64 * 3; ++k) {
          const std::size_t x = (k * 37 + 11) % kWidth, y = (k * 53 + 7) % kHeight;
          for (std::size_t c = 0; c < 3; ++c, ++n) {
            sum +=
                std::abs(static_cast<double>(page.samples[((y0 + y) * width + x0 + x) * channels + c]) -
                         frame.samples[(y * kWidth + x) * 3 + c]);
          }
        }
        if (n == 64 * 3) best = std::min(best, sum / n);
      }
    }
    CHECK(best < 3.0);  // of 255; a frame moved by a few pixels differs by more than ten
    // A page that scrolls has a bar at its right edge.
    std::size_t other = 0;
    for (std::size_t y = 60; y < static_cast<std::size_t>(page.height); ++y) {
      for (std::size_t c = 0; c < 3; ++c) {
        other += page.samples[(y * width + width - 3) * channels + c] !=
                 page.samples[(60 * width + width - 3) * channels + c];
      }
    }
    CHECK(other == 0);
  }
#endif
}
