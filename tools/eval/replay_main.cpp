// SPDX-License-Identifier: Apache-2.0
// gsnav-replay: an episode of an evaluation once more, from any camera.
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <vector>

#include "../common/overlay.hpp"
#include "../common/parse_options.hpp"
#include "gsnav/core/printable.hpp"
#include "gsnav/core/replace_file.hpp"
#include "gsnav/io.hpp"
#include "gsnav/io/image_file.hpp"
#include "pictures.hpp"

namespace gsnav_eval {
namespace {

using gsnav::Errc;
using gsnav::Status;
using gsnav::Vec3d;
namespace fs = std::filesystem;

struct ReplayOptions {
  std::size_t episode = 0;
  std::vector<double> eye, target;  // none: the agent's own camera
  std::string frames = "replay";
  std::string video;
  int every = 1;
};

/// Frames into ffmpeg's standard input. ffmpeg writes to a file aside, which takes the video's name once
/// it is whole.
class Video {
 public:
  Video() = default;
  Video(const Video&) = delete;
  Video& operator=(const Video&) = delete;
  ~Video() {
    pipe_.reset();
    std::error_code none;
    if (!aside_.empty()) fs::remove(aside_, none);
  }

  Status open(const std::string& path, int width, int height, double rate) {
    if (path.find_first_of("'\\\n") != std::string::npos)
      return {Errc::invalid_argument, "--video: quotes in the path"};
    path_ = path;
    aside_ = fs::path(path).replace_extension(std::to_string(::getpid()) + ".part" +
                                              fs::path(path).extension().string());
    char command[512];
    const int n = std::snprintf(
        command, sizeof command,
        "ffmpeg -y -loglevel error -f rawvideo -pix_fmt rgb24 -s %dx%d -r %g -i - "
        "-vf 'pad=ceil(iw/2)*2:ceil(ih/2)*2' -pix_fmt yuv420p '%s'",  // its colour is at half the size
        width, height, rate, aside_.c_str());
    if (n < 0 || n >= static_cast<int>(sizeof command))
      return {Errc::invalid_argument, "--video: the path is too long"};
    std::signal(SIGPIPE, SIG_IGN);  // an ffmpeg that ends early is reported, not died of
    pipe_.reset(popen(command, "w"));
    if (pipe_ == nullptr) return {Errc::unsupported, "--video: ffmpeg cannot be run"};
    return {};
  }
  Status add(const std::vector<std::uint8_t>& rgb) {
    if (std::fwrite(rgb.data(), 1, rgb.size(), pipe_.get()) == rgb.size()) return {};
    return {Errc::unsupported, "--video: ffmpeg takes no frames; is it installed?"};
  }
  Status close() {
    if (pclose(pipe_.release()) != 0)
      return {Errc::unsupported, "--video: ffmpeg failed; is it installed?"};
    return gsnav::replace_file(path_, [this](gsnav::OutputFile& out) -> Status {
      std::ifstream in(aside_, std::ios::binary);
      for (std::vector<char> part(1 << 16); in;) {
        in.read(part.data(), static_cast<std::streamsize>(part.size()));
        out.write(part.data(), static_cast<std::size_t>(in.gcount()));
      }
      return in.eof() ? Status() : Status(Errc::invalid_file, aside_.string() + ": cannot be read");
    });
  }

 private:
  struct Close {
    void operator()(std::FILE* f) const noexcept { pclose(f); }
  };
  std::unique_ptr<std::FILE, Close> pipe_;
  fs::path path_, aside_;
};

/// Where everything was at each step, [T]...
struct Track {
  std::vector<double> positions, yaws, times, clearances;
  Status save(const fs::path& path) const {
    const std::size_t n = yaws.size();
    const std::array<gsnav::io::NpzEntry, 4> arrays{{{"positions", {n, 3}, std::span(positions)},
                                                     {"yaws", {n}, std::span(yaws)},
                                                     {"times", {n}, std::span(times)},
                                                     {"avatar_clearance", {n}, std::span(clearances)}}};
    return gsnav::io::save_npz(path, arrays);
  }
};

/// A picture with the agent's body drawn into it.
std::vector<std::uint8_t> with_agent(const std::vector<std::uint8_t>& rgb, const gsnav::Camera& camera,
                                     const std::vector<float>& depth, const gsnav::World& world) {
  gsnav_tools::Canvas canvas(camera.width, camera.height, {0, 0, 0});
  canvas.paste(rgb.data(), camera.width, camera.height, 0, 0);
  const double radius = world.config().agent_radius, height = world.config().agent_height;
  const Vec3d at = world.agent().position;
  const gsnav::Capsule<double> body{at + Vec3d{0, radius, 0}, at + Vec3d{0, height - radius, 0}, radius};
  gsnav_tools::draw_capsule({canvas, camera, depth}, body, {0.05f, 0.30f, 0.85f}, 0.85f);
  return canvas.bytes();
}

Status run(const Options& o, const ReplayOptions& r) {
  if (Status s = r.video.empty() ? Status() : gsnav::check_output_path(r.video); !s) return s;
  if (Status s = gsnav::make_output_folder(r.frames); !s) return s;
  if (Status s = gsnav::check_output_path(fs::path(r.frames) / "track.npz"); !s) return s;
  const auto stage = prepare(o);
  if (!stage) return stage.status();
  const auto journal = Journal::load(o.out, o, *stage);
  if (!journal) return journal.status();
  for (const std::string& note : journal->notes()) {
    std::fprintf(stderr, "%s\n", gsnav::printable(note).c_str());
  }
  const auto found = journal->records().find(r.episode);
  if (found == journal->records().end()) {
    return {Errc::invalid_argument,
            "--episode " + std::to_string(r.episode) + ": the journal has no such episode"};
  }
  auto sim = make_simulator(o, *stage);
  if (!sim) return sim.status();
  std::optional<Video> video;
  if (!r.video.empty()) {
    video.emplace();
    const double rate = 1.0 / (stage->config.task.control_period * r.every);
    if (Status s = video->open(r.video, o.width, o.height, rate); !s) return s;
  }
  Track track;
  const auto look = [&](Simulator& s, std::size_t step) -> Status {
    const gsnav::AgentPose& agent = s.agent();
    track.positions.insert(track.positions.end(),
                           {agent.position.x, agent.position.y, agent.position.z});
    track.yaws.push_back(agent.yaw);
    track.times.push_back(s.clock());
    track.clearances.push_back(s.world().last_step().avatar_clearance);
    if (step % static_cast<std::size_t>(r.every) != 0) return {};
    gsnav::Camera camera = gsnav::sensor_camera(stage->config.sensors.front(), agent.position,
                                                agent.rotation(), agent.pitch);
    if (!r.eye.empty()) {
      const Vec3d eye{r.eye[0], r.eye[1], r.eye[2]}, target{r.target[0], r.target[1], r.target[2]};
      const Vec3d down = target - eye;
      const bool steep = std::hypot(down.x, down.z) < 1e-6 * gsnav::norm(down);
      camera = gsnav::Camera::look_at(eye, target, steep ? Vec3d{0, 0, -1} : Vec3d{0, 1, 0}, o.width,
                                      o.height, o.hfov);
    }
    const auto frame = s.render(camera, gsnav::kRgb | gsnav::kMedianDepth);
    if (!frame) return frame.status();
    std::vector<std::uint8_t> rgb((*frame)->rgb.size());
    gsnav::to_bytes((*frame)->rgb, rgb);
    if (!r.eye.empty()) rgb = with_agent(rgb, camera, (*frame)->median_depth, s.world());
    if (video) return video->add(rgb);
    char name[32];
    std::snprintf(name, sizeof name, "%05zu.png", step);
    return gsnav::io::save_png_rgb8(fs::path(r.frames) / name, rgb, o.width, o.height);
  };
  if (Status s = replay(*sim, stage->episodes[r.episode], found->second, look); !s) return s;
  if (video) {
    if (Status s = video->close(); !s) return s;
  }
  return track.save(fs::path(r.frames) / "track.npz");
}

}  // namespace
}  // namespace gsnav_eval

int main(int argc, char** argv) try {
  gsnav_eval::Options o;
  gsnav_eval::ReplayOptions r;
  CLI::App app{
      "Plays an episode of an evaluation again, by its recorded actions.\nWrites images from any camera "
      "as PNG files, and all positions as track.npz.\nThe journal in --out supplies the options of the "
      "evaluation. Files may have moved, and camera options may\ndiffer; options that would change what "
      "happens are refused.\nExample: gsnav-replay --out eval --episode 3 --eye 5 2.5 4 --target 5 0 4 "
      "--frames above"};
  gsnav_eval::add_world_options(app, o);
  app.add_option("--episode", r.episode, "number of the episode, from 0")->capture_default_str();
  app.add_option("--eye", r.eye,
                 "position of a fixed camera: X Y Z metres; default: the camera of the agent")
      ->expected(3);
  app.add_option("--target", r.target, "point that the camera of --eye looks at: X Y Z metres")
      ->expected(3)
      ->needs("--eye");
  app.get_option("--eye")->needs("--target");
  app.add_option("--frames", r.frames, "folder for images and track.npz")->capture_default_str();
  app.add_option("--video", r.video, "video file to write instead of PNG files (.mp4, needs ffmpeg)");
  app.add_option("--every", r.every, "draw one frame per this number of actions")
      ->capture_default_str()
      ->check(CLI::Range(1, 100000));
  if (const auto status = gsnav_tools::parse_options(app, argc, argv)) return *status;
  gsnav::Status s;
  if (const auto recorded = gsnav_eval::Journal::recorded_options(o.out); !recorded) {
    s = recorded.status();
  } else if (s = gsnav_eval::take_options(app, *recorded, o); !s) {
    s = {s.code(), o.out + "/journal.jsonl: line 1: " + s.message()};
  } else if (s = gsnav_eval::Journal::check_options(o.out, o, false); s) {
    s = gsnav_eval::run(o, r);
  }
  if (!s) std::fprintf(stderr, "gsnav-replay: %s\n", s.message().c_str());
  return s ? 0 : 1;
} catch (const std::exception& e) {
  std::fprintf(stderr, "gsnav-replay: %s\n", e.what());
  return 1;
}
