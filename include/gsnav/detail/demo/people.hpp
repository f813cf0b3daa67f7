// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "gsnav/detail/demo/floor_plan.hpp"
#include "gsnav/detail/sim/task.hpp"
#include "gsnav/sim/scene.hpp"

namespace gsnav {

/// Colour of the clothes of person `index`, also used for marks in maps. Display-referred.
Vec3d person_color(std::size_t index) noexcept;

/// Largest number of people that walking_people makes.
inline constexpr std::size_t kMaxPeople = 1000;

/// People on random paths over the largest island of `walkways`. Use a NavMesh for a body wider than
/// that of the agent, so that their shoulders stay clear of furniture. Paths keep 0.75 m from earlier
/// paths where possible. All paths have one period, so every round is the same. The same arguments give
/// the same people.
/// @param density factor on the number of their Gaussians, within HumanoidOptions' range.
/// @param progress receives the share that is done, before each person. An exception ends the work.
/// @return the people, or nothing_navigable if there is no place for any, or invalid_argument if density
/// is not finite or count is above kMaxPeople.
Result<std::vector<AvatarActor>> walking_people(const NavMesh& walkways, std::size_t count,
                                                std::uint64_t seed, double density = 1.0,
                                                const std::function<void(double)>& progress = {});

/// The embedded flat with its NavMesh for the body of `task`, and people who walk in it. `density` is
/// that of the flat's Gaussians alone. `progress` is that of walking_people. Errors: those of the parts.
Result<SimulatorScene> default_simulator_scene(std::size_t people = 3, std::uint64_t seed = 1,
                                               double density = 1.0, const TaskConfig& task = {},
                                               const std::function<void(double)>& progress = {});

/// The flat of make_floor_plan(`plan`) with its NavMesh for the body of `task`, and people who walk in
/// it. `density` is that of the Gaussians of the flat and of the people. With SurfaceKind::mesh the flat
/// has triangles in place of Gaussians, with an equal NavMesh and equal people. `progress` is that of
/// walking_people. Errors: those of the parts.
Result<SimulatorScene> planned_simulator_scene(const FloorPlanOptions& plan, std::size_t people = 0,
                                               std::uint64_t seed = 1, double density = 1.0,
                                               const TaskConfig& task = {},
                                               SurfaceKind kind = SurfaceKind::gaussians,
                                               const std::function<void(double)>& progress = {});

}  // namespace gsnav
