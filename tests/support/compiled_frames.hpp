// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gsnav/backends/serial.hpp"
#include "gsnav/detail/render/instantiate.hpp"
#include "gsnav/scene/basic_renderer.hpp"

// What tests render and skin with on the serial backend, compiled once for all of them
// (compiled_frames.cpp): a test that draws includes this. ops/backends.hpp has it too.
namespace gsnav {
GSNAV_FRAME_FUNCTIONS(extern, float, SerialBackend);
GSNAV_FRAME_FUNCTIONS(extern, double, SerialBackend);
GSNAV_SKIN_FUNCTIONS(extern, SerialBackend);
}  // namespace gsnav
