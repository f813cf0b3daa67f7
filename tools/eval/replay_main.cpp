// SPDX-License-Identifier: Apache-2.0
// gsnav-replay: shows an episode of an evaluation again, from any camera.
#include <CLI/CLI.hpp>
#include <array>
#include <cmath>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <limits>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "../common/check_values.hpp"
#include "../common/overlay.hpp"
#include "../common/parse_options.hpp"
#include "gsnav/core/replace_file.hpp"
#include "gsnav/core/text.hpp"
#include "gsnav/io.hpp"
#include "gsnav/io/image_file.hpp"
#include "pictures.hpp"
#include "video.hpp"

namespace gsnav_eval {
namespace {

using gsnav::Errc;
using gsnav::Status;
using gsnav::Vec3d;
namespace fs = std::filesystem;

struct ReplayOptions {
  std::size_t episode = 0;
  std::vector<double> eye, target;  // empty: the agent's own camera
  std::string frames = "replay";
  std::string video;
  int every = 1;
  int per_action = 1;
  std::size_t first = 0, last = std::numeric_limits<std::size_t>::max();  // actions that are drawn
  bool inset = false;
};

/// Positions and other values at each step. All have the shape [T]...
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

/// Pose of the agent at one moment.
struct AgentMoment {
  double time = 0;  ///< seconds on the scene's clock
  gsnav::AgentPose agent;
};

/// The moment between a (t = 0) and b (t = 1). The agent moves in a straight line and turns by the
/// smaller angle.
AgentMoment between(const AgentMoment& a, const AgentMoment& b, double t) {
  AgentMoment m = b;
  if (t == 1) return m;
  m.time = a.time + t * (b.time - a.time);
  m.agent.position = a.agent.position + (b.agent.position - a.agent.position) * t;
  m.agent.yaw = a.agent.yaw + t * std::remainder(b.agent.yaw - a.agent.yaw, 2 * std::numbers::pi);
  m.agent.pitch = a.agent.pitch + t * (b.agent.pitch - a.agent.pitch);
  return m;
}

/// Draws pictures of moments of an episode.
class EpisodePainter {
 public:
  static gsnav::Result<EpisodePainter> create(const Options& o, const ReplayOptions& r,
                                              const Stage& stage) {
    gsnav::RenderOptions options;
    options.render = stage.config.render;
    options.detail = gsnav::detail_choice(stage.config);
    options.render.outputs = gsnav::kRgb | gsnav::kMedianDepth;
    auto renderer = gsnav::Renderer::create(o.device, stage.scene, options);
    if (!renderer) return renderer.status();
    EpisodePainter p(std::move(*renderer));
    p.own_ = stage.config.sensors.front();
    p.radius_ = stage.config.task.agent_radius;
    p.height_ = stage.config.task.agent_height;
    if (!r.eye.empty()) {
      const Vec3d eye{r.eye[0], r.eye[1], r.eye[2]}, target{r.target[0], r.target[1], r.target[2]};
      const Vec3d down = target - eye;
      const bool steep = std::hypot(down.x, down.z) < 1e-6 * gsnav::norm(down);
      p.fixed_ = gsnav::Camera::look_at(eye, target, steep ? Vec3d{0, 0, -1} : Vec3d{0, 1, 0}, o.width,
                                        o.height, o.hfov);
    }
    p.inset_ = r.inset;
    return p;
  }

  /// Picture of the chosen camera, [height][width][3] bytes.
  gsnav::Result<std::vector<std::uint8_t>> paint(const AgentMoment& m) {
    if (!fixed_) return view(own_camera(m, 1), m.time);
    auto rgb = view(*fixed_, m.time);
    if (!rgb) return rgb;
    gsnav_tools::Canvas canvas(fixed_->width, fixed_->height, {0, 0, 0});
    canvas.paste(rgb->data(), fixed_->width, fixed_->height, 0, 0);
    const Vec3d at = m.agent.position;
    const gsnav::Capsule<double> body{at + Vec3d{0, radius_, 0}, at + Vec3d{0, height_ - radius_, 0},
                                      radius_};
    gsnav_tools::draw_capsule({canvas, *fixed_, frames_.median_depth}, body, {0.05f, 0.30f, 0.85f},
                              0.85f);
    if (inset_) {
      constexpr int kShare = 4, kFrame = 2;  // a quarter of the picture's width, in a white frame
      const gsnav::Camera camera = own_camera(m, kShare);
      rgb = view(camera, m.time);
      if (!rgb) return rgb;
      const int x = fixed_->width - camera.width - 4 * kFrame,
                y = fixed_->height - camera.height - 4 * kFrame;
      canvas.rect(x - kFrame, y - kFrame, camera.width + 2 * kFrame, camera.height + 2 * kFrame,
                  {1, 1, 1}, 1);
      canvas.paste(rgb->data(), camera.width, camera.height, x, y);
    }
    return canvas.bytes();
  }

 private:
  explicit EpisodePainter(gsnav::Renderer renderer) : renderer_(std::move(renderer)) {}

  /// The agent's own camera with an image that is `share` times smaller.
  gsnav::Camera own_camera(const AgentMoment& m, int share) const {
    gsnav::SensorSpec spec = own_;
    for (int& side : spec.resolution) side /= share;
    return gsnav::sensor_camera(spec, m.agent.position, m.agent.rotation(), m.agent.pitch);
  }
  gsnav::Result<std::vector<std::uint8_t>> view(const gsnav::Camera& camera, double time) {
    if (Status s = renderer_.render({&camera, 1}, frames_, time); !s) return s;
    std::vector<std::uint8_t> rgb(frames_.rgb.size());
    gsnav::to_bytes(frames_.rgb, rgb);
    return rgb;
  }

  gsnav::Renderer renderer_;
  gsnav::Frames<float> frames_;  // reused for every picture
  gsnav::SensorSpec own_;
  std::optional<gsnav::Camera> fixed_;
  double radius_ = 0, height_ = 0;
  bool inset_ = false;
};

/// Follows a replay: records its track, and writes pictures to a folder or a video.
class Recorder {
 public:
  Recorder(const Options& o, const ReplayOptions& r, EpisodePainter painter)
      : options_(o), replay_(r), painter_(std::move(painter)) {}

  Status open(double control_period) {
    if (replay_.video.empty()) return {};
    const double rate = replay_.per_action / (control_period * replay_.every);
    auto video = open_video(replay_.video, options_.width, options_.height, rate);
    if (video) video_ = std::move(*video);
    return video.status();
  }
  Status look(Simulator& s, std::size_t step) {
    const AgentMoment now{s.clock(), s.agent()};
    const Vec3d& at = now.agent.position;
    track_.positions.insert(track_.positions.end(), {at.x, at.y, at.z});
    track_.yaws.push_back(now.agent.yaw);
    track_.times.push_back(now.time);
    track_.clearances.push_back(s.world().last_step().avatar_clearance);
    if (step % static_cast<std::size_t>(replay_.every) != 0 || step > replay_.last) return {};
    const AgentMoment before = std::exchange(last_, now);
    if (step < replay_.first) return {};
    for (int k = step <= replay_.first ? replay_.per_action : 1; k <= replay_.per_action; ++k) {
      const auto rgb = painter_.paint(between(before, now, static_cast<double>(k) / replay_.per_action));
      if (!rgb) return rgb.status();
      if (Status added = add(step, *rgb); !added) return added;
    }
    return {};
  }
  Status close() {
    if (video_ != nullptr) {
      if (Status s = video_->close(); !s) return s;
    }
    return track_.save(fs::path(replay_.frames) / "track.npz");
  }

 private:
  Status add(std::size_t step, const std::vector<std::uint8_t>& rgb) {
    if (video_ != nullptr) return video_->add(rgb);
    char name[32];
    const std::size_t number = replay_.per_action == 1 ? step : pictures_++;
    std::snprintf(name, sizeof name, "%05zu.png", number);
    return gsnav::io::save_png_rgb8(fs::path(replay_.frames) / name, rgb, options_.width,
                                    options_.height);
  }

  const Options& options_;
  const ReplayOptions& replay_;
  EpisodePainter painter_;
  std::unique_ptr<Video> video_;
  Track track_;
  AgentMoment last_;
  std::size_t pictures_ = 0;
};

Status run(const Options& o, const ReplayOptions& r) {
  if (Status s = r.video.empty() ? Status() : gsnav::check_output_path(r.video); !s) return s;
  if (Status s = gsnav::make_output_folder(r.frames); !s) return s;
  if (Status s = gsnav::check_output_path(fs::path(r.frames) / "track.npz"); !s) return s;
  if (Status s = r.video.empty() ? gsnav_tools::check_files_in(r.frames, {".png"}) : Status(); !s)
    return s;
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
            "--episode " + std::to_string(r.episode) + ": " +
                (journal->records().empty()
                     ? "the journal has no episodes"
                     : "the journal has " + std::to_string(journal->records().size()) + ", from " +
                           std::to_string(journal->records().begin()->first) + " to " +
                           std::to_string(journal->records().rbegin()->first))};
  }
  const std::size_t actions = found->second.actions.size();
  if (static_cast<std::size_t>(r.first) > actions) {
    return {Errc::invalid_argument, "--first " + std::to_string(r.first) + ": episode " +
                                        std::to_string(r.episode) + " has " + std::to_string(actions) +
                                        " actions"};
  }
  auto sim = make_simulator(o, *stage);
  if (!sim) return sim.status();
  auto painter = EpisodePainter::create(o, r, *stage);
  if (!painter) return painter.status();
  Recorder recorder(o, r, std::move(*painter));
  if (Status s = recorder.open(stage->config.task.control_period); !s) return s;
  const auto look = [&](Simulator& s, std::size_t step) { return recorder.look(s, step); };
  if (Status s = replay(*sim, stage->episodes[r.episode], found->second, look); !s) return s;
  return recorder.close();
}

}  // namespace
}  // namespace gsnav_eval

int main(int argc, char** argv) try {
  gsnav_eval::Options o;
  gsnav_eval::ReplayOptions r;
  CLI::App app{
      "Plays an episode of an evaluation again, by its recorded actions.\nWrites images from any camera "
      "as PNG files, and all positions as track.npz.\nThe journal in --out supplies the options of the "
      "evaluation. Files may have moved, and camera options may differ. Options that would change what "
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
  gsnav_tools::check_output_name(
      app.add_option(
          "--video", r.video,
          "video file to write instead of PNG files: .webp (animated), or .mp4 (needs ffmpeg)"),
      gsnav_tools::ends_in({".webp", ".mp4"}));
  app.add_option("--every", r.every, "draw one frame per this number of actions")
      ->capture_default_str()
      ->check(CLI::Range(1, 100000));
  app.add_option("--per-action", r.per_action,
                 "images per action; the agent moves in a straight line between two steps")
      ->capture_default_str()
      ->check(CLI::Range(1, 100));
  app.add_option("--first", r.first, "first action to draw; 0 is the start")->capture_default_str();
  app.add_option("--last", r.last, "last action to draw (default: the end)");
  app.add_flag("--inset", r.inset, "draw the agent's own view in the corner")->needs("--eye");
  const auto check = [&r] {
    gsnav_tools::check_eye_and_target(r.eye, r.target);
    if (r.first > r.last) throw CLI::ValidationError("--first", "is after --last");
  };
  if (const auto status = gsnav_tools::parse_options(app, argc, argv, check)) return *status;
  gsnav::Status s = gsnav_eval::can_write_video(r.video);
  if (!s) {
    std::fprintf(stderr, "gsnav-replay: %s\n", s.message().c_str());
    return 1;
  }
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
