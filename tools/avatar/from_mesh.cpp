// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <utility>
#include <vector>

#include "clips.hpp"
#include "commands.hpp"
#include "gsnav/io.hpp"
#include "gsnav/math/aabb.hpp"
#include "gsnav/rigging.hpp"

namespace gsnav_avatar {

using namespace gsnav;

namespace {

using Poses = std::vector<std::vector<Affine3<double>>>;

Result<io::LoadedSkinnedMesh> load_mesh(const MeshCommand& c, bool makehuman) {
  if (!makehuman) {
    io::GltfOptions options;
    options.skins = c.skins;
    options.scale = c.scale;
    return io::load_gltf_skin(c.input, options);
  }
  io::MakeHumanOptions options;
  options.scale = c.scale;
  options.skeleton = c.skeleton;
  options.weights = c.weights;
  for (const auto& [file, amount] : c.targets) options.targets.emplace_back(file, amount);
  return io::load_makehuman(c.input, options);
}

/// The requested clip: one of the mesh file, or of another file.
Result<MotionClip> clip_of(const MeshCommand& c, const io::LoadedSkinnedMesh& mesh) {
  std::string names;
  for (const io::NamedClip& n : mesh.clips) {
    if (n.name == c.clip.clip) return n.clip;
    names += (names.empty() ? "" : ", ") + n.name;
  }
  if (c.clip.clip.find('.') == std::string::npos) {
    return {Errc::invalid_argument, c.input + ": there is no clip '" + c.clip.clip +
                                        "'; there are: " + (names.empty() ? "none" : names)};
  }
  ClipSource source = c.clip;
  const std::string extension =
      std::filesystem::path(source.clip.substr(0, source.clip.rfind(':'))).extension().string();
  if (!(source.scale > 0) && (extension == ".glb" || extension == ".gltf")) source.scale = c.scale;
  return load_clip(source, mesh.mesh.skeleton);
}

/// Largest extent along an axis, metres.
double size_of(const SkinnedMesh& mesh) {
  Aabb<double> box{};
  for (const Vec3d& p : mesh.positions) box.add(p);
  const Vec3d size = box.high - box.low;
  return max(size.x, max(size.y, size.z));
}

/// Transforms from joints to the root at `count` times of the clip.
Poses poses_of(const Skeleton& skeleton, const MotionClip& clip, std::size_t count) {
  Poses out(count);
  LocalPose pose;
  for (std::size_t k = 0; k < count; ++k) {
    MotionInput at;
    at.time = clip.duration() * static_cast<double>(k) / static_cast<double>(count);
    clip.pose(at, pose);
    forward_kinematics(skeleton, pose, out[k]);
  }
  return out;
}

Status write_driver(const MeshCommand& c, const AvatarAsset& asset, const MotionClip& clip) {
  io::DriverFrames frames;
  frames.joints = asset.skeleton.size();
  const auto count = static_cast<std::size_t>(std::floor(clip.duration() * frames.frame_rate)) + 1;
  LocalPose pose;
  std::vector<Affine3<double>> globals;
  for (std::size_t t = 0; t < count; ++t) {
    MotionInput at;
    at.time = static_cast<double>(t) / frames.frame_rate;
    clip.pose(at, pose);
    forward_kinematics(asset.skeleton, pose, globals);
    for (auto& m : globals) m.translation += pose.root;
    frames.matrices.insert(frames.matrices.end(), globals.begin(), globals.end());
    auto& row = frames.capsules.emplace_back();
    for (const ProxyCapsule& p : asset.capsules)
      row.push_back({globals[p.joint] * p.p0, globals[p.joint] * p.p1, p.radius});
  }
  if (Status s = io::save_driver(c.driver, frames); !s) return s;
  std::printf("%s: %zu frames at %g per second, %zu capsules\n", printable(c.driver).c_str(), count,
              frames.frame_rate, asset.capsules.size());
  return {};
}

}  // namespace

Status make_from_mesh(const MeshCommand& c, bool makehuman) {
  auto loaded = load_mesh(c, makehuman);
  if (!loaded) return loaded.status();
  const SkinnedMesh& mesh = loaded->mesh;
  const SkinnedMeshReport& report = loaded->report;
  std::printf("%s: %zu vertices, %zu triangles, %zu joints, %zu clips", printable(c.input).c_str(),
              mesh.positions.size(), mesh.triangles.size(), mesh.skeleton.size(), loaded->clips.size());
  if (!makehuman) std::printf("; %zu of %zu skins", report.skins, report.skins_in_file);
  std::printf("\n");
  for (const std::string& w : loaded->report.warnings) std::printf("  %s\n", printable(w).c_str());
  MotionClip clip;
  clip.joints = mesh.skeleton.size();
  clip.rotations = loaded->pose.rotations;
  clip.translations = loaded->pose.translations;
  clip.root_translation = {loaded->pose.root};
  if (!c.clip.clip.empty()) {
    auto own = clip_of(c, *loaded);
    if (!own) return own.status();
    clip = std::move(*own);
  }
  constexpr std::size_t kPoses = 24;
  const Poses poses = poses_of(mesh.skeleton, clip, std::min(kPoses, clip.frames()));
  MeshAvatarOptions options;
  options.gaussians = c.gaussians;
  options.seed = c.seed;
  options.shade = c.shade;
  options.weights.influences = c.influences;
  options.weights.poses.assign(
      poses.begin(),
      poses.begin() + static_cast<std::ptrdiff_t>(std::min<std::size_t>(8, poses.size())));
  auto made = make_mesh_avatar(mesh, options);
  if (made.code() == Errc::unsupported) {
    char text[200];
    std::snprintf(text, sizeof text,
                  " (it is %.4g m large); --scale sets metres a unit, %.4g for centimetres",
                  size_of(mesh), c.scale / 100);
    return {made.code(), c.input + ": " + made.message() + text};
  }
  if (!made) return made.status();
  AvatarAsset& asset = made->asset;
  asset.idle = loaded->pose;
  if (c.skinning == "dual-quaternion") asset.skinning = Skinning::dual_quaternion;
  if (c.skinning == "stretched") {
    if (Status s = bake_weight_gradients(asset); !s) return s;
  }
  std::printf(
      "%zu Gaussians on %.2f m2, %.2f mm apart; %d weights each of at most %zu, off by %.3f mm (%zu by "
      "more than 0.2 "
      "mm)\n",
      asset.size(), made->area, 1e3 * made->spacing, made->weights.influences,
      made->weights.most_weights, 1e3 * made->weights.position_error, made->weights.needs_more);
  CapsuleFitOptions fit;
  fit.percentile = c.percentile;
  const auto capsules = fit_body_capsules(asset, poses, fit);
  if (!capsules) return capsules.status();
  const CapsuleReport thin = measure_capsules(asset, habitat_capsules(asset.skeleton), poses);
  std::printf(
      "%zu capsules (percentile %.4f) hold %.2f %% of the centres in the worst of %zu poses, the others "
      "lie up to %.1f "
      "cm "
      "outside; over-cover %.1f cm mean, %.1f cm p99\n",
      capsules->capsules, capsules->percentile, 100 * capsules->contained_least, capsules->poses,
      100 * capsules->outside_greatest, 100 * capsules->over_mean, 100 * capsules->over_p99);
  std::printf(
      "of the body's %.1f l they leave %.2f %% uncovered (%.2f %% in the worst pose) and cover %.0f %% "
      "of its volume outside\n",
      1e3 * capsules->body_volume, 100 * capsules->uncovered_mean, 100 * capsules->uncovered_greatest,
      100 * capsules->over_volume);
  std::printf(
      "by Habitat-GS's rule: %zu capsules hold %.2f %%, the others lie up to %.1f cm outside; %.1f %% "
      "of the volume "
      "uncovered\n",
      thin.capsules, 100 * thin.contained_least, 100 * thin.outside_greatest, 100 * thin.uncovered_mean);
  if (Status s = io::save_avatar(c.out, asset); !s) return s;
  std::printf("%s: written\n", printable(c.out).c_str());
  return c.driver.empty() ? Status() : write_driver(c, asset, clip);
}

}  // namespace gsnav_avatar
