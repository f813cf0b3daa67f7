// SPDX-License-Identifier: Apache-2.0
// The same templates in a second unit: what is defined twice does not link.
#include "gsnav/backends/serial.hpp"
#include "gsnav/gsnav.hpp"

std::size_t scratch_of_second_unit();

std::size_t scratch_of_second_unit() {
  gsnav::SerialBackend backend;
  const gsnav::BasicRenderer<float, gsnav::SerialBackend> renderer(backend);
  return renderer.scratch_bytes();
}
