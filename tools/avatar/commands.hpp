// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gsnav/core/status.hpp"
#include "options.hpp"

namespace gsnav_avatar {

gsnav::Status make_from_mesh(const MeshCommand& command, bool makehuman);
gsnav::Status make_walk(const WalkCommand& command);
gsnav::Status make_strip(const StripCommand& command);

}  // namespace gsnav_avatar
