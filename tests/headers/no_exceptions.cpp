// SPDX-License-Identifier: Apache-2.0
// A frame without exceptions and RTTI.
#include "gsnav/backends/serial.hpp"
#include "gsnav/gsnav.hpp"

std::size_t scratch_of_second_unit();

int main() {
  using namespace gsnav;
  // One Gaussian half a metre wide, two metres ahead.
  GaussianCloud cloud;
  const float values[11] = {0, 0, 2, 1, 0, 0, 0, 0.5f, 0.5f, 0.5f, 0.9f};
  for (std::size_t k = 0; k < 3; ++k) cloud.means[k] = {values[k]};
  for (std::size_t k = 0; k < 4; ++k) cloud.quats[k] = {values[3 + k]};
  for (std::size_t k = 0; k < 3; ++k) cloud.scales[k] = {values[7 + k]};
  cloud.opacities = {values[10]};
  cloud.sh0 = {1, 1, 1};

  SerialBackend backend;
  BasicRenderer<float, SerialBackend> renderer(backend);
  const Camera camera = Camera::look_at({0, 0, 0}, {0, 0, 1}, {0, -1, 0}, 32, 32, 90);
  const auto frames = renderer.render(cloud.set(), camera);
  if (!frames || !(frames.value().alpha[16 * 32 + 16] > 0.8f)) return 1;

  RenderConfig impossible;
  impossible.tuning.tile_size = 7;
  renderer.set_config(impossible);
  if (renderer.render(cloud.set(), camera).code() != Errc::invalid_argument) return 2;
  return scratch_of_second_unit() == 0 ? 0 : 3;
}
