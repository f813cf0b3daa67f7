// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "../../examples/nav_loop/map.hpp"
#include "../eval/run.hpp"
#include "controls.hpp"
#include "gsnav/backends/openmp.hpp"

namespace gsnav_viewer {

enum class Panel : std::size_t { color, depth, map };

struct SessionOptions {
  double rate = 20.0;        ///< frames a second at most; an action takes one frame's time
  double speed = 1.2;        ///< metres a second at full speed
  double depth_near = 0.3, depth_far = 7.0;  ///< range of depth colours, metres
  bool paused = false;
  int quality = 85;          ///< of JPEG
};

/// Somebody who walks through a scene, and what they see. One thread runs it; any number of others steer and watch.
/// While nobody watches nothing is drawn and no time passes.
class Session {
 public:
  /// Errors: what World::create reports; invalid_argument (no episode).
  static gsnav::Result<std::unique_ptr<Session>> create(const gsnav_eval::Options& options, gsnav_eval::Stage stage,
                                                        const SessionOptions& how);

  /// Draws until stop(). Errors: what stepping and rendering report.
  gsnav::Status run();
  void stop();

  /// Applies a message of the page (controls.hpp) and returns what there is to say, as JSON.
  gsnav::Result<std::string> control(std::string_view message);

  /// One who watches a panel. Its first frame was begun after it came.
  class Watcher {
   public:
    Watcher(Session& session, Panel panel);
    /// Waits for a frame newer than the last: a JPEG, empty where there is none yet, nothing at the end.
    std::optional<std::string> next();

   private:
    Session* session_;
    Panel panel_;
    std::uint64_t seen_;
  };

 private:
  using Clock = std::chrono::steady_clock;
  Session(const gsnav_eval::Options& options, gsnav_eval::Stage stage, const SessionOptions& how, gsnav::World world);

  gsnav::Status begin_episode(std::size_t number);
  gsnav::Status advance(const Controls& c, int actions);
  gsnav::Status draw(const Controls& c);
  gsnav::Status draw_view(const Controls& c, const gsnav::CapsuleSet& bodies);
  gsnav::Status draw_map(const Controls& c, const gsnav::CapsuleSet& bodies);
  gsnav::Status publish(Panel panel, std::span<const std::uint8_t> rgb);
  std::string describe(const Controls& c) const;
  gsnav::Status put_time(double t);

  gsnav_eval::Stage stage_;
  SessionOptions how_;
  std::string scene_name_;
  gsnav::World world_;
  gsnav::OpenMPBackend backend_;
  gsnav::SceneOnBackend<gsnav::OpenMPBackend> scene_;
  gsnav::Renderer<float, gsnav::OpenMPBackend> renderer_;
  gsnav::Frames<float> frames_;
  std::vector<std::array<gsnav::Vec3d, 3>> walkable_;  // triangles of the NavMesh's islands that are no table tops
  nav_loop::MapFrame map_frame_;
  nav_loop::Canvas ground_;
  std::vector<gsnav::Vec3d> way_, shortest_;
  std::size_t episode_ = 0;
  double frame_seconds_ = 0.0, rate_ = 0.0;  // of the last frame; of the last ones

  mutable std::mutex mutex_;
  std::condition_variable news_;
  Controls controls_;
  Clock::time_point last_message_{};
  std::uint64_t begun_ = 0, published_ = 0;
  int waiting_ = 0;
  bool changed_ = false;  // a message or somebody new came since the last frame began
  std::array<std::string, 3> images_, drawn_;
  std::string state_ = "{}";
  bool stopped_ = false;
};

}  // namespace gsnav_viewer
