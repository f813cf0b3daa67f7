// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdio>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "commands.hpp"
#include "gsnav/avatar/actor.hpp"
#include "gsnav/demo.hpp"
#include "gsnav/device/renderer.hpp"
#include "gsnav/io.hpp"
#include "gsnav/io/image_file.hpp"
#include "gsnav/io/scene_file.hpp"

namespace gsnav_avatar {

using namespace gsnav;

namespace {

/// Scene around the walker. Empty if none was named.
Result<std::optional<GaussianCloud>> load_surroundings(const StripCommand& c) {
  if (c.flat) {
    auto flat = make_default_scene();
    if (!flat) return flat.status();
    return std::optional<GaussianCloud>(std::move(flat->cloud));
  }
  if (c.scene.empty()) return std::optional<GaussianCloud>();
  auto scene = io::load_scene(c.scene);
  if (!scene) return scene.status();
  return std::optional<GaussianCloud>(std::move(scene->cloud));
}

}  // namespace

Status make_strip(const StripCommand& c) {
  auto avatar = io::load_avatar(c.avatar);
  if (!avatar) return avatar.status();
  const auto asset = std::make_shared<const AvatarAsset>(std::move(avatar->asset));
  auto driver = io::load_driver(c.driver, asset->skeleton);
  if (!driver) return driver.status();
  driver->clip.end = ClipEnd::hold;
  const double duration = driver->clip.duration(), begin = min(c.begin, duration),
               end = c.end > 0 ? min(c.end, duration) : duration;
  const auto actor =
      AvatarActor::create(asset, std::make_shared<const MotionClip>(std::move(driver->clip)));
  if (!actor) return actor.status();
  auto surroundings = load_surroundings(c);
  if (!surroundings) return surroundings.status();

  SimulatorScene scene;
  scene.avatars.push_back(*actor);
  if (surroundings->has_value()) {
    scene.assets.push_back({std::make_shared<const GaussianCloud>(std::move(**surroundings))});
    // (x, y, z) of a scene with Z up is (x, z, -y) here.
    if (c.z_up)
      scene.assets.back().world_from_asset = {axis_angle(Vec3d{1, 0, 0}, -1.5707963267948966), {}, 1.0};
  }
  const auto device = Device::parse("cpu");
  if (!device) return device.status();
  auto renderer = Renderer::create(*device, std::make_shared<const SimulatorScene>(std::move(scene)));
  if (!renderer) return renderer.status();
  const Camera camera = Camera::look_at(c.eye, c.target, {0, 1, 0}, c.width, c.height, c.fov);
  const auto width = static_cast<std::size_t>(c.width), height = static_cast<std::size_t>(c.height),
             row = 3 * width, frames = static_cast<std::size_t>(c.frames);
  std::vector<float> strip(row * frames * height);
  Frames<float> image;
  for (std::size_t k = 0; k < frames; ++k) {
    const double time =
        frames == 1 ? begin
                    : begin + (end - begin) * static_cast<double>(k) / static_cast<double>(frames - 1);
    if (Status s = renderer->render(std::span(&camera, 1), image, time); !s) return s;
    for (std::size_t y = 0; y < height; ++y) {
      std::copy_n(image.rgb.begin() + static_cast<std::ptrdiff_t>(y * row), row,
                  strip.begin() + static_cast<std::ptrdiff_t>((y * frames + k) * row));
    }
  }
  if (Status s = io::save_png_rgb(c.out, strip, c.width * c.frames, c.height); !s) return s;
  std::printf("%s: %d pictures from %.2f to %.2f s\n", printable(c.out).c_str(), c.frames, begin, end);
  return {};
}

}  // namespace gsnav_avatar
