// SPDX-License-Identifier: Apache-2.0
#pragma once

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

/// Copies the images into new arrays. `single` leaves the axis of cameras out.
PythonFrames python_frames(const Frames<float>& frames, bool single);
void bind_frames(nb::module_& m);

}  // namespace gsnav::python
