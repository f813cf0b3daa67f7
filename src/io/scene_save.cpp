// SPDX-License-Identifier: Apache-2.0
#include "file.hpp"
#include "gsnav/core/lower_case.hpp"
#include "gsnav/io/gltf.hpp"
#include "gsnav/io/ply.hpp"
#include "gsnav/io/scene_file.hpp"
#include "gsnav/io/sog.hpp"
#include "gsnav/io/splat.hpp"
#include "gsnav/io/spz.hpp"

namespace gsnav::io {

Status save_scene(const std::filesystem::path& path, const GaussianCloud& cloud) {
  if (!cloud.shN_half.empty()) {
    return detail::guarded(path.string(), [&] {
      GaussianCloud widened = cloud;
      expand_sh(widened);
      return save_scene(path, widened);
    });
  }
  const std::string name = lower_case(path.filename().string());
  if (name.ends_with(".compressed.ply")) return save_compressed_ply(path, cloud);
  if (name.ends_with(".ply")) return save_ply(path, cloud);
  if (name.ends_with(".splat")) return save_splat(path, cloud);
  if (name.ends_with(".spz")) return save_spz(path, cloud);
  if (name.ends_with(".sog") || name == "meta.json") return save_sog(path, cloud);
  if (name.ends_with(".glb")) return save_glb(path, cloud);
  return {Errc::unsupported,
          path.string() +
              ": not a name that is written here: .ply, .compressed.ply, .splat, .spz, .sog, meta.json "
              "or .glb"};
}

}  // namespace gsnav::io
