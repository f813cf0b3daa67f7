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
  double rate = 20.0;  ///< Largest number of frames per second. An action takes the time of one frame.
  double speed = 1.2;  ///< Full speed, m/s.
  double depth_near = 0.3, depth_far = 7.0;  ///< Range of the depth colours, metres.
  bool paused = false;
  int quality = 85;  ///< JPEG quality.
};

/// An agent that is steered through a scene by hand, and its pictures. One thread runs it. Other threads
/// request frames and steer with these requests. If no frame is requested within kLinger, nothing is
/// drawn and no time passes.
class Session {
 public:
  /// Creates a session.
  /// @return the errors of World::create; invalid_argument if there are no episodes.
  static gsnav::Result<std::unique_ptr<Session>> create(const gsnav_eval::Options& options,
                                                        gsnav_eval::Stage stage,
                                                        const SessionOptions& how);

  /// Draws frames until stop().
  /// @return errors of stepping and rendering, exceptions included.
  gsnav::Status run();
  void stop();

  /// Applies a message of the page (controls.hpp) and waits up to half a second for a frame newer than
  /// its `seen`. Returns the newest frame: a line of JSON, followed by JPEG images of colour, depth and
  /// map. The JSON has `frame` (its number; 0: none yet) and `sizes` (bytes of the images). Without
  /// `seen`, the frame was started after the call.
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
      walkable_;  // Triangles of the NavMesh's islands, except table tops.
  gsnav_tools::MapFrame map_frame_;
  gsnav_tools::Canvas ground_;
  std::vector<gsnav::Vec3d> way_, shortest_;
  std::size_t episode_ = 0;
  double frame_seconds_ = 0.0, rate_ = 0.0;  // Duration of the last frame, and mean rate of the last
                                             // ones.

  mutable std::mutex mutex_;
  std::condition_variable news_;
  Controls controls_;
  Clock::time_point last_message_{}, last_wait_{};
  std::uint64_t begun_ = 0, published_ = 0;
  int waiting_ = 0;
  bool changed_ = false;  // A message arrived since the last frame was started, or a request that has
                          // seen no frame.
  std::array<std::string, 3> drawn_;                          // JPEG images of the current frame.
  std::string newest_ = "{\"frame\":0,\"sizes\":[0,0,0]}\n";  // The last frame, as frame() returns it.
  bool stopped_ = false;
};

}  // namespace gsnav_viewer
