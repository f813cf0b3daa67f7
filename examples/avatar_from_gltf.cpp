// SPDX-License-Identifier: Apache-2.0
// Makes a Gaussian avatar from a rigged mesh and renders it.
// usage: avatar_from_gltf RIGGED.glb [DEVICE]; writes avatar.npz and avatar.png
#include <cstdio>
#include <memory>

#include "gsnav/device/renderer.hpp"
#include "gsnav/io.hpp"
#include "gsnav/rigging.hpp"

int main(int argc, char** argv) try {
  if (argc < 2) return std::puts("usage: avatar_from_gltf RIGGED.glb [DEVICE]"), 2;
  auto device = gsnav::Device::parse(argc > 2 ? argv[2] : "best").value();
  // [snippet: make]
  auto file = gsnav::io::load_gltf_skin(argv[1]).value();
  auto made = gsnav::make_mesh_avatar(file.mesh, {.gaussians = 20000}).value();

  // [/snippet]
  // [snippet: capsules]
  // Capsules that cover the body in the pose of the file. Pass the poses of a clip to cover a motion.
  std::vector<gsnav::Affine3<double>> pose;
  gsnav::forward_kinematics(made.asset.skeleton, file.pose, pose);
  auto fit = gsnav::fit_body_capsules(made.asset, {pose}).value();
  gsnav::io::save_avatar("avatar.npz", made.asset).throw_if_error();
  // [/snippet]
  std::printf("%zu Gaussians, %zu joints, %zu capsules\n", made.asset.cloud.size(),
              made.asset.skeleton.size(), fit.capsules);

  // [snippet: render]
  // The avatar stands at the origin and faces -Z. The image shows it one second into its first clip.
  std::shared_ptr<const gsnav::MotionSource> motion;
  if (!file.clips.empty()) motion = std::make_shared<gsnav::MotionClip>(file.clips[0].clip);
  auto asset = std::make_shared<const gsnav::AvatarAsset>(std::move(made.asset));
  auto scene = std::make_shared<gsnav::SimulatorScene>();
  scene->avatars.push_back(gsnav::AvatarActor::create(asset, motion).value());
  auto camera = gsnav::Camera::look_at({1, 1.5, -2.5}, {0, 0.9, 0}, {0, 1, 0}, 240, 320, 60);
  auto renderer = gsnav::Renderer::create(device, scene).value();
  auto frames = renderer.render({&camera, 1}, 1.0).value();
  gsnav::io::save_png_rgb("avatar.png", frames.rgb, 240, 320).throw_if_error();
  // [/snippet]
} catch (const std::exception& e) {
  return std::fprintf(stderr, "%s\n", e.what()), 1;
}
