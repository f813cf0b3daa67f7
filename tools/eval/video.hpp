// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "gsnav/core/status.hpp"

namespace gsnav_eval {

/// A video file that is written picture by picture. The file gets its name when it is complete.
class Video {
 public:
  virtual ~Video() = default;
  /// Adds a picture, [height][width][3] bytes.
  virtual gsnav::Status add(const std::vector<std::uint8_t>& rgb) = 0;
  /// Finishes the file. Without this call a file that existed before is kept.
  virtual gsnav::Status close() = 0;
};

/// Checks, before any work, that a video can be written: a path that ends in .webp, or ffmpeg on the
/// PATH. An empty path is right. Errors: unsupported, with a remedy.
gsnav::Status can_write_video(const std::string& path);

/// Opens a video of `rate` pictures per second. A path that ends in .webp gives an animated WebP by
/// libwebpmux, every other path a video by ffmpeg. Errors: invalid_argument (the path, sizes),
/// unsupported (ffmpeg cannot be run; a build without libwebpmux).
gsnav::Result<std::unique_ptr<Video>> open_video(const std::string& path, int width, int height,
                                                 double rate);

}  // namespace gsnav_eval
