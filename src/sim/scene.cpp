// SPDX-License-Identifier: Apache-2.0
#include "gsnav/sim/scene.hpp"

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "gsnav/detail/scene/needed_bands.hpp"
#include "gsnav/detail/scene/view_cells.hpp"
#include "gsnav/scene/lod_tree.hpp"
#include "gsnav/scene/packed_cloud.hpp"

namespace gsnav {

SortOrder SceneAsset::sort_order() const noexcept {
  return packed != nullptr ? packed->rest.sort_order : cloud->sort_order;
}

Status validate(const SimulatorScene& scene) {
  if (scene.navmesh == nullptr) return {Errc::invalid_argument, "SimulatorScene.navmesh is null"};
  return validate_assets(scene);
}

Status validate_assets(const SimulatorScene& scene) {
  for (std::size_t i = 0; i < scene.assets.size(); ++i) {
    const SceneAsset& a = scene.assets[i];
    const auto bad = [i](const char* what) {
      return Status(Errc::invalid_argument, "SimulatorScene.assets[" + std::to_string(i) + "]." + what);
    };
    if (a.cloud == nullptr && a.packed == nullptr) return bad("cloud is null");
    if (a.cloud != nullptr && a.packed != nullptr)
      return bad("packed and cloud are both set: set only one of them");
    const std::size_t chunks = (a.packed != nullptr ? a.packed->view() : a.cloud->view()).chunk_count();
    if (a.bands != nullptr && a.bands->chunk_sh_degrees.size() != chunks)
      return bad("bands have another number of chunks than the cloud");
  }
  for (std::size_t i = 0; i < scene.meshes.size(); ++i) {
    if (scene.meshes[i].surface == nullptr) {
      return {Errc::invalid_argument,
              "SimulatorScene.meshes[" + std::to_string(i) + "].surface is null"};
    }
  }
  return {};
}

Status validate_detail(const SimulatorScene& scene, const DetailChoice& choice) {
  if (choice.lod) {
    if (Status s = validate(*choice.lod); !s) return s;
  }
  for (std::size_t i = 0; i < scene.assets.size(); ++i) {
    const SceneAsset& a = scene.assets[i];
    const auto bad = [i](const std::string& field, const std::string& what) {
      return Status(Errc::invalid_argument, "SimulatorConfig." + field + ": SimulatorScene.assets[" +
                                                std::to_string(i) + "]." + what);
    };
    const bool trees = choice.has_trees();
    if (a.packed != nullptr && (trees || choice.visible_sets)) {
      return bad(trees ? "lod" : "visible_sets", "packed: this needs Gaussians in `cloud`");
    }
    if (choice.visible_sets &&
        (a.visible == nullptr || a.visible->cloud_chunks != a.cloud->view().chunk_count())) {
      return bad("visible_sets",
                 std::string("visible is ") +
                     (a.visible == nullptr ? "null: build_visible_sets makes it" : "of another cloud"));
    }
    if (!trees) continue;
    if (a.lod != nullptr && a.lod->cloud_chunks() == a.cloud->view().chunk_count()) continue;
    return bad("lod", std::string("lod is ") +
                          (a.lod == nullptr ? "null: build_lod makes it" : "of another cloud"));
  }
  return {};
}

void append_bodies(const SimulatorScene& scene, double t0, double t1, std::vector<DynamicCapsule>& out,
                   const CapsuleSet* before) {
  std::span<const CapsuleSet::Group> there;  // One group per avatar.
  if (before != nullptr) there = before->groups();
  for (std::size_t i = 0; i < scene.avatars.size(); ++i) {
    const auto number = static_cast<std::uint32_t>(i);
    View<const DynamicCapsule> of_it;
    while (!there.empty() && before->capsules_of(there.front())[0].avatar < number)
      there = there.subspan(1);
    if (!there.empty() && before->capsules_of(there.front())[0].avatar == number)
      of_it = before->capsules_of(there.front());
    scene.avatars[i].dynamic_capsules(t0, t1, number, out, of_it);
  }
}

}  // namespace gsnav
