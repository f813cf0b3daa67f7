// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "gsnav/detail/sim/task.hpp"
#include "gsnav/sim/scene.hpp"

namespace gsnav {

/// Colour of person `index`'s clothes and of their marks in maps, display-referred.
Vec3d person_color(std::size_t index) noexcept;

/// People on random ways over the largest island of `walkways` (a NavMesh for a body wider than the
/// agent's keeps their shoulders off the furniture). Ways are drawn until one keeps 0.75 m from those
/// before it, where that can be had; all have one period, so what holds for one round holds for ever.
/// The same arguments give the same people; `density` scales the number of their Gaussians, as far as
/// HumanoidOptions allows. Errors: nothing_navigable where nobody finds a place; invalid_argument where
/// density is not finite.
Result<std::vector<AvatarActor>> walking_people(const NavMesh& walkways, std::size_t count,
                                                std::uint64_t seed, double density = 1.0);

/// The embedded flat with its NavMesh for a body as of `task` and people who walk in it; `density`: of
/// the flat's Gaussians, not of people's (walking_people). Errors: what the parts report.
Result<SimulatorScene> default_simulator_scene(std::size_t people = 3, std::uint64_t seed = 1,
                                               double density = 1.0, const TaskConfig& task = {});

}  // namespace gsnav
