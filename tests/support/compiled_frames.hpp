// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "gsnav/backends/serial.hpp"
#include "gsnav/detail/render/instantiate.hpp"
#include "gsnav/scene/basic_renderer.hpp"

// What tests render and skin with on the serial backend, compiled once for all of them
// (compiled_frames.cpp): a test that draws includes this. ops/backends.hpp has it too.
//
// Backends of tests that derive from SerialBackend or ToyBackend, with a stage of their own, draw by the
// large kernels of that one. To be used outside of namespaces.
#define GSNAV_TEST_KERNELS(EXTERN, B)                                                          \
  EXTERN template void B::parallel_for(std::size_t, const gsnav::ProjectChunk<float>&);        \
  EXTERN template void B::parallel_for(std::size_t, const gsnav::FillFragments<float>&);       \
  EXTERN template void B::parallel_for(std::size_t, const gsnav::WriteMeshTriangles<float>&);  \
  EXTERN template void B::parallel_for(std::size_t, const gsnav::ShadeMeshRow<float>&);        \
  EXTERN template void B::parallel_for(std::size_t, const gsnav::RasterizeMeshTile<float>&);   \
  EXTERN template void B::parallel_for(std::size_t, const gsnav::SkinGaussian<float, float>&); \
  EXTERN template void B::parallel_for(std::size_t, const gsnav::SkinGaussianStretched<float, float>&)

GSNAV_TEST_KERNELS(extern, gsnav::SerialBackend);
namespace gsnav {
GSNAV_FRAME_FUNCTIONS(extern, float, SerialBackend);
GSNAV_FRAME_FUNCTIONS(extern, double, SerialBackend);
GSNAV_SKIN_FUNCTIONS(extern, SerialBackend);
}  // namespace gsnav
