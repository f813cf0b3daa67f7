// SPDX-License-Identifier: Apache-2.0
#pragma once

// A scene by its name, with all that belongs to it. Link gsnav::open.

#include "gsnav/detail/open/open_scene.hpp"
