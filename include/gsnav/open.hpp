// SPDX-License-Identifier: Apache-2.0
#pragma once

// Opens a scene by its name, together with its NavMesh and settings. Link gsnav::open.

#include "gsnav/detail/open/open_scene.hpp"
