// SPDX-License-Identifier: Apache-2.0
#pragma once

// Content for programs that run without any file: the embedded flat, people made by code, and their
// walks. Link gsnav::demo.

#include "gsnav/detail/demo/default_scene.hpp"
#include "gsnav/detail/demo/floor_plan.hpp"
#include "gsnav/detail/demo/gait.hpp"
#include "gsnav/detail/demo/humanoid.hpp"
#include "gsnav/detail/demo/indoor_views.hpp"
#include "gsnav/detail/demo/people.hpp"
