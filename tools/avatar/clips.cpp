// SPDX-License-Identifier: Apache-2.0
#include "clips.hpp"

#include <cstdio>
#include <filesystem>
#include <utility>
#include <vector>

#include "gsnav/io.hpp"
#include "gsnav/rigging.hpp"

namespace gsnav_avatar {

using namespace gsnav;

Result<MotionClip> load_clip(const ClipSource& source, const Skeleton& skeleton) {
  // FILE, or FILE:NAME for one clip of a file with several.
  std::string file = source.clip, name;
  if (const std::size_t colon = file.rfind(':'); colon != file.npos && !std::filesystem::exists(file)) {
    name = file.substr(colon + 1);
    file.resize(colon);
  }
  const std::string extension = std::filesystem::path(file).extension().string();
  io::LoadedMotion motion;
  if (extension == ".npz") {
    auto driver = io::load_driver(file, skeleton);
    if (!driver) return driver.status();
    return std::move(driver->clip);
  }
  if (extension == ".bvh") {
    auto m = io::load_bvh(file, {source.scale > 0 ? source.scale : 1.0, source.z_up});
    if (!m) return m.status();
    motion = std::move(*m);
  } else if (extension == ".amc") {
    io::AmcOptions options;
    options.scale = source.scale;
    options.z_up = source.z_up;
    auto m = io::load_amc(source.asf, file, options);
    if (!m) return m.status();
    motion = std::move(*m);
  } else if (extension == ".glb" || extension == ".gltf") {
    io::GltfOptions options;
    if (source.scale > 0) options.scale = source.scale;
    auto m = io::load_gltf_skin(file, options);
    std::vector<io::NamedClip> clips;
    if (m) {
      motion.skeleton = m->mesh.skeleton;
      clips = std::move(m->clips);
    } else {  // For example a file without a skinned mesh: read its motion alone.
      auto bare = io::load_gltf_clips(file, skeleton, options);
      if (!bare) return bare.status();
      for (const std::string& w : bare->warnings) std::printf("  %s\n", printable(w).c_str());
      motion.skeleton = skeleton;
      clips = std::move(bare->clips);
    }
    bool found = false;
    for (io::NamedClip& c : clips) {
      if (found || (!name.empty() && c.name != name)) continue;
      motion.clip = std::move(c.clip);
      found = true;
    }
    if (!found) return {Errc::invalid_argument, file + ": there is no clip '" + name + "' in it"};
  } else {
    return {Errc::unsupported, file + ": no motion that is read here (.bvh, .amc, .glb, .gltf, .npz)"};
  }
  if (motion.skeleton.names == skeleton.names && motion.skeleton.parents == skeleton.parents)
    return std::move(motion.clip);
  const auto options = match_joints(motion.skeleton, skeleton);
  if (!options) return {options.code(), file + ": " + options.message()};
  return retarget(motion.clip, motion.skeleton, skeleton, *options);
}

}  // namespace gsnav_avatar
