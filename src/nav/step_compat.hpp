// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gsnav/detail/nav/step.hpp"

namespace gsnav::detail {

/// See StepCompat::habitat_gs. The input must be valid.
StepResult step_as_habitat_gs(const NavMesh& mesh, const AgentState& agent, const Vec3d& desired,
                              const CapsuleSet& bodies, const StepOptions& options);

}  // namespace gsnav::detail
