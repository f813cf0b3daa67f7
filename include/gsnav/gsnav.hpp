// SPDX-License-Identifier: Apache-2.0
#pragma once

// Everything that needs only a C++20 compiler. Add a backend (gsnav/backends/...), and link
// gsnav::avatar for the functions in avatar/. nav, io, sim and interop need other libraries and have
// headers of their own.

#include "gsnav/avatar.hpp"
#include "gsnav/core/backend.hpp"
#include "gsnav/core/buffer.hpp"
#include "gsnav/core/rng.hpp"
#include "gsnav/core/status.hpp"
#include "gsnav/core/view.hpp"
#include "gsnav/detail/core/parallel.hpp"
#include "gsnav/detail/render/at_time.hpp"
#include "gsnav/detail/scene/describe_cloud.hpp"
#include "gsnav/detail/scene/edit_cloud.hpp"
#include "gsnav/detail/scene/load_report.hpp"
#include "gsnav/detail/scene/temporal_gaussians.hpp"
#include "gsnav/detail/scene/triangle_mesh.hpp"
#include "gsnav/math/aabb.hpp"
#include "gsnav/math/capsule.hpp"
#include "gsnav/math/functions.hpp"
#include "gsnav/math/mat.hpp"
#include "gsnav/math/quat.hpp"
#include "gsnav/math/similarity.hpp"
#include "gsnav/math/vec.hpp"
#include "gsnav/render/config.hpp"
#include "gsnav/render/render.hpp"
#include "gsnav/scene/basic_renderer.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"
#include "gsnav/skin/skin.hpp"
#include "gsnav/sweep/sweep.hpp"
#include "gsnav/version.hpp"
