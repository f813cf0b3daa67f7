// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <iterator>
#include <utility>
#include <vector>

#include "casters.hpp"
#include "gsnav/render/frames.hpp"

namespace gsnav::python {

/// Frames<float> as numpy arrays. An image that was not requested is None.
struct PythonFrames {
  std::size_t cameras = 0, height = 0, width = 0;
  nb::object rgb, alpha, median_depth, expected_depth, accumulated_depth, first_hit_depth;
  std::vector<RenderStats> stats;
};

/// New arrays for the images of cameras, which are rendered in parts.
class FrameArrays {
 public:
  /// `single` leaves the axis of cameras out.
  FrameArrays(std::size_t cameras, bool single) : single_(single) { made_.cameras = cameras; }
  /// Copies the images of the next cameras.
  void add(const Frames<float>& part);
  /// The arrays, once all cameras are there.
  PythonFrames take() { return std::move(made_); }

 private:
  PythonFrames made_;
  float* data_[std::size(Frames<float>::kVectors)] = {};
  bool single_;
};

/// Copies the images into new arrays. `single` leaves the axis of cameras out.
PythonFrames python_frames(const Frames<float>& frames, bool single);
void bind_frames(nb::module_& m);

}  // namespace gsnav::python
