// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "../common/map.hpp"
#include "../eval/run.hpp"
#include "controls.hpp"
#include "gsnav/device/renderer.hpp"

namespace gsnav_viewer {

enum class Panel : std::size_t { color, depth, map };

struct SessionOptions {
  double rate = 20.0;  ///< frames a second at most; an action takes one frame's time
  double speed = 1.2;  ///< metres a second at full speed
  double depth_near = 0.3, depth_far = 7.0;  ///< range of depth colours, metres
  bool paused = false;
  int quality = 85;  ///< of JPEG
};

/// An agent that is steered through a scene by hand, and its pictures. One thread runs it; any number of
/// others ask for frames and steer by that. Where no frame was asked for within kLinger nothing is drawn
/// and no time passes.
class Session {
 public:
  /// Errors: what World::create reports; invalid_argument (no episode).
  static gsnav::Result<std::unique_ptr<Session>> create(const gsnav_eval::Options& options,
                                                        gsnav_eval::Stage stage,
                                                        const SessionOptions& how);

  /// Draws until stop(). Errors: what stepping and rendering report, exceptions among it.
  gsnav::Status run();
  void stop();

  /// Applies a message of the page (controls.hpp), waits for a frame newer than its `seen`, half a
  /// second at most, and returns the newest: a line of JSON, which has `frame` (its number, 0: none yet)
  /// and `sizes` (bytes of the JPEG images of colour, depth and map), then these images. Without `seen`
  /// the frame is one that was begun after the call.
  gsnav::Result<std::string> frame(std::string_view message);

 private:
  using Clock = std::chrono::steady_clock;
  Session(const gsnav_eval::Options& options, gsnav_eval::Stage stage, const SessionOptions& how,
          gsnav::World world, gsnav::Renderer renderer, gsnav::Renderer without_people);

  gsnav::Status begin_episode(std::size_t number);
  gsnav::Status advance(const Controls& c, int actions);
  gsnav::Status draw(const Controls& c);
  gsnav::Status draw_view(const Controls& c, const gsnav::CapsuleSet& bodies);
  gsnav::Status draw_map(const Controls& c, const gsnav::CapsuleSet& bodies);
  gsnav::Status draw_frames();
  gsnav::Status publish(Panel panel, std::span<const std::uint8_t> rgb);
  std::string describe(const Controls& c, std::uint64_t number) const;
  gsnav::Status put_time(double t);

  gsnav_eval::Stage stage_;
  SessionOptions how_;
  std::vector<std::string> depth_colors_;
  std::string scene_name_;
  gsnav::World world_;
  gsnav::Renderer renderer_, without_people_;
  gsnav::Frames<float> frames_;
  std::vector<std::array<gsnav::Vec3d, 3>>
      walkable_;  // triangles of the NavMesh's islands that are no table tops
  gsnav_tools::MapFrame map_frame_;
  gsnav_tools::Canvas ground_;
  std::vector<gsnav::Vec3d> way_, shortest_;
  std::size_t episode_ = 0;
  double frame_seconds_ = 0.0, rate_ = 0.0;  // of the last frame; of the last ones

  mutable std::mutex mutex_;
  std::condition_variable news_;
  Controls controls_;
  Clock::time_point last_message_{}, last_wait_{};
  std::uint64_t begun_ = 0, published_ = 0;
  int waiting_ = 0;
  bool changed_ = false;  // a message came since the last frame began, or a request that has seen none
  std::array<std::string, 3> drawn_;                          // JPEG images of the frame at hand
  std::string newest_ = "{\"frame\":0,\"sizes\":[0,0,0]}\n";  // the last frame, as frame() returns it
  bool stopped_ = false;
};

}  // namespace gsnav_viewer
