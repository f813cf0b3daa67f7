// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "gsnav/core/status.hpp"
#include "gsnav/detail/scene/textured_scene.hpp"
#include "gsnav/scene/mesh_scene.hpp"

namespace gsnav {

/// A surface ready to be drawn: one mesh for each part, and where the parts stand.
struct PlacedMeshes {
  MeshScene meshes;                                ///< The meshes, one for each part.
  std::vector<TexturedScene::Instance> instances;  ///< Where the parts stand.
  std::vector<std::string> warnings;  ///< A line for each thing that is drawn differently than the file
                                      ///< asks for.

  /// All instances in the world, for BasicRenderer::set_meshes on host backends. Their ids count up from
  /// `first_id`. Valid while this object lives and no mesh is added.
  std::vector<MeshInstance> in_world(const Similarity& world_from_scene = {},
                                     std::uint32_t first_id = 0) const& {
    std::vector<MeshInstance> all;
    for (const TexturedScene::Instance& i : instances) {
      all.push_back(meshes.instance(i.part, world_from_scene * i.world_from_part,
                                    first_id + static_cast<std::uint32_t>(all.size())));
    }
    return all;
  }
  /// Deleted for temporaries, because instances refer to the meshes.
  std::vector<MeshInstance> in_world(const Similarity& world_from_scene = {},
                                     std::uint32_t first_id = 0) const&& = delete;
};

/// Makes meshes from a surface as files describe it (io::load_textured_scene). Parts with the same
/// texture share its mip chain. Error: invalid_argument naming the part, texture or instance that does
/// not fit.
inline Result<PlacedMeshes> placed_meshes(TexturedScene scene) {
  PlacedMeshes out;
  out.warnings = std::move(scene.warnings);
  std::vector<std::shared_ptr<const MeshTexture>> textures(scene.textures.size());
  for (std::size_t p = 0; p < scene.parts.size(); ++p) {
    TexturedPart& part = scene.parts[p];
    const SurfaceMaterial& material = part.material;
    const auto named = [&](const Status& s) {
      return Status(s.code(), "TexturedScene.parts[" + std::to_string(p) + "]: " + s.message());
    };
    SurfaceMesh mesh;
    if (material.texture >= 0) {
      const std::size_t t = static_cast<std::size_t>(material.texture);
      if (t >= textures.size()) {
        return named({Errc::invalid_argument,
                      "texture " + std::to_string(t) + " of " + std::to_string(textures.size())});
      }
      if (textures[t] == nullptr) {
        const TextureImage& picture = scene.textures[t];
        auto made = MeshTexture::make(picture.width, picture.height, picture.rgba);
        if (!made) return named(made.status());
        textures[t] = std::make_shared<const MeshTexture>(std::move(*made));
      }
      mesh.texture = textures[t];
    }
    mesh.geometry = std::move(part.geometry);
    mesh.normals = std::move(part.normals);
    mesh.colors = std::move(part.colors);
    mesh.uvs = std::move(part.uvs);
    mesh.base_color = vec_cast<float>(material.factor);
    mesh.two_sided = material.double_sided;
    mesh.unlit = material.unlit;
    mesh.alpha_mode = material.blend              ? MeshAlpha::blend
                      : material.alpha_cutoff > 0 ? MeshAlpha::mask
                                                  : MeshAlpha::opaque;
    mesh.base_alpha = static_cast<float>(material.alpha);
    mesh.alpha_cutoff = static_cast<float>(material.alpha_cutoff);
    mesh.alphas = std::move(part.alphas);
    if (auto added = out.meshes.add(std::move(mesh)); !added) return named(added.status());
  }
  for (std::size_t i = 0; i < scene.instances.size(); ++i) {
    if (scene.instances[i].part >= out.meshes.size()) {
      return Status(Errc::invalid_argument, "TexturedScene.instances[" + std::to_string(i) + "]: part " +
                                                std::to_string(scene.instances[i].part) + " of " +
                                                std::to_string(out.meshes.size()));
    }
  }
  out.instances = std::move(scene.instances);
  return out;
}

}  // namespace gsnav
