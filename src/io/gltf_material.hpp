// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "gltf_file.hpp"
#include "gsnav/detail/scene/surface_material.hpp"

namespace gsnav::io::detail {

/// The base colour of a material.
struct GltfMaterial {
  SurfaceMaterial surface;
  std::size_t texcoord = 0;                        ///< The TEXCOORD_n of its texture.
  std::array<double, 6> uv_map{1, 0, 0, 0, 1, 0};  ///< KHR_texture_transform: u' = m0 u + m1 v + m2, v'
                                                   ///< = m3 u + m4 v + m5.

  std::array<double, 2> uv(double u, double v) const noexcept {
    return {uv_map[0] * u + uv_map[1] * v + uv_map[2], uv_map[3] * u + uv_map[4] * v + uv_map[5]};
  }
};

/// Reads materials and their images, each image once: PNG, JPEG or WebP, in the file or next to it.
class GltfMaterials {
 public:
  /// Appends images to `textures`, and a line to `warnings` for each thing left out or changed.
  GltfMaterials(const GltfFile& file, std::vector<TextureImage>& textures,
                std::vector<std::string>& warnings)
      : file_(file), textures_(textures), warnings_(warnings) {}

  /// The material of a primitive, each read once; white if it has none. Errors: invalid_file,
  /// file_not_found.
  Result<GltfMaterial> of(const Json& primitive, const std::string& where);

 private:
  Result<GltfMaterial> read(std::size_t index);
  Status read_texture(const Json& info, const std::string& where, GltfMaterial& out);
  Status read_uv_map(const Json& transform, const std::string& where, GltfMaterial& out) const;
  Result<std::int32_t> picture(const Json& texture, std::size_t index);
  Result<TextureImage> decode(std::size_t image) const;

  const GltfFile& file_;
  std::vector<TextureImage>& textures_;
  std::vector<std::string>& warnings_;
  std::map<std::size_t, GltfMaterial> material_of_;
  std::map<std::size_t, std::int32_t> texture_of_;  ///< Texture of each image that was read; -1 if it
                                                    ///< could not be read.
  std::size_t pixels_ = 0;                          ///< Number of pixels of all textures.
};

}  // namespace gsnav::io::detail
