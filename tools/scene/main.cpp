// SPDX-License-Identifier: Apache-2.0
// gsnav-scene: makes scenes and people by code alone.
#include <cstdio>
#include <string>

#include "../common/parse_options.hpp"
#include "../common/progress.hpp"
#include "gsnav/core/replace_file.hpp"
#include "gsnav/core/text.hpp"
#include "gsnav/io.hpp"
#include "options.hpp"

namespace gsnav_scene {
namespace {

using gsnav::Result;
using gsnav::Status;

/// Checks, before the scene is made, that its files can be written.
Status outputs_status(const Outputs& o) {
  if (!o.folder.empty()) {
    if (Status s = gsnav::make_output_folder(o.folder); !s) return s;
  }
  if (Status s = gsnav::io::check_scene_output(o.scene); !s) return s;
  for (const std::string* path : {&o.mesh, &o.cameras}) {
    if (path->empty()) continue;
    if (Status s = gsnav::check_output_path(*path); !s) return s;
  }
  return {};
}

Result<gsnav::DefaultScene> make(const SceneCommand& c, const gsnav::SceneSampling& sampling) {
  if (!c.rooms) return gsnav::make_default_scene(sampling);
  const auto plan = gsnav::make_floor_plan(c.plan);
  if (!plan) return plan.status();
  std::printf("%zu rooms on %.1f x %.1f m, %zu doors, %zu windows, %zu pieces of furniture:",
              plan->rooms.size(), plan->outline.width(), plan->outline.depth(), plan->doors.size(),
              plan->windows.size(), plan->furniture.size());
  for (const gsnav::PlannedRoom& r : plan->rooms) {
    std::printf("%s %s %.1f m2", &r == plan->rooms.data() ? "" : ",", gsnav::name_of(r.kind),
                r.inside.area());
  }
  std::printf("\n");
  return gsnav::make_planned_scene(*plan, sampling);
}

Status run(const SceneCommand& c) {
  if (Status s = outputs_status(c.out); !s) return s;
  gsnav::SceneSampling sampling = c.sampling;
  const auto print = gsnav_tools::progress_printer();
  sampling.progress = [&](double share) { print("Gaussians", share); };
  const auto scene = make(c, sampling);
  if (!scene) return scene.status();
  if (Status s = gsnav::io::save_scene(c.out.scene, scene->cloud); !s) return s;
  std::printf("%s: %zu Gaussians\n", gsnav::printable(c.out.scene).c_str(), scene->cloud.size());
  if (!c.out.mesh.empty()) {
    if (Status s = gsnav::io::save_obj(c.out.mesh, scene->vertices, scene->triangles); !s) return s;
    std::printf("%s: %zu triangles\n", gsnav::printable(c.out.mesh).c_str(), scene->triangles.size());
  }
  if (!c.out.cameras.empty()) {
    const auto views = gsnav::indoor_views(*scene, c.views);
    if (!views) return views.status();
    if (Status s = gsnav::io::save_cameras(c.out.cameras, *views); !s) return s;
    std::printf("%s: %zu views of %d x %d\n", gsnav::printable(c.out.cameras).c_str(), views->size(),
                c.views.width, c.views.height);
  }
  return {};
}

Status run(const HumanoidCommand& c) {
  const bool avatar = gsnav::lower_case(c.out).ends_with(".npz");
  if (Status s = avatar ? gsnav::check_output_path(c.out) : gsnav::io::check_scene_output(c.out); !s) {
    return s;
  }
  gsnav::HumanoidOptions options = c.seed == 0 ? gsnav::HumanoidOptions{} : gsnav::random_person(c.seed);
  options.gaussians = c.gaussians;
  const auto person = gsnav::try_make_humanoid(options);
  if (!person) return person.status();
  const Status s =
      avatar ? gsnav::io::save_avatar(c.out, *person) : gsnav::io::save_scene(c.out, person->cloud);
  if (!s) return s;
  std::printf("%s: %zu Gaussians", gsnav::printable(c.out).c_str(), person->size());
  if (avatar) {
    std::printf(", %zu joints, %zu capsules", person->skeleton.size(), person->capsules.size());
  }
  std::printf(", %.2f m tall\n", options.height);
  return {};
}

}  // namespace
}  // namespace gsnav_scene

int main(int argc, char** argv) {
  int exit_code = 0;
  const auto options = gsnav_scene::parse_options(argc, argv, exit_code);
  if (!options) return exit_code;
  const gsnav::Status s =
      options->scene ? gsnav_scene::run(*options->scene) : gsnav_scene::run(*options->humanoid);
  if (s.ok()) return 0;
  return gsnav_tools::fail("gsnav-scene", s.message());
}
