// SPDX-License-Identifier: Apache-2.0
#pragma once

// Scenes and images: Gaussian clouds, meshes, cameras, and the renderer on a device chosen at run time.
// Link gsnav::device. For a backend chosen at compile time, see BasicRenderer
// (scene/basic_renderer.hpp). To prepare a cloud before drawing (filtering, levels of detail), see
// scene/prepare.hpp.

#include "gsnav/core/status.hpp"
#include "gsnav/detail/frame/color_space.hpp"
#include "gsnav/detail/scene/load_report.hpp"
#include "gsnav/detail/scene/placed_meshes.hpp"
#include "gsnav/detail/scene/surface_material.hpp"
#include "gsnav/detail/scene/textured_scene.hpp"
#include "gsnav/detail/scene/triangle_mesh.hpp"
#include "gsnav/device/device.hpp"
#include "gsnav/device/renderer.hpp"
#include "gsnav/image/camera.hpp"
#include "gsnav/math/similarity.hpp"
#include "gsnav/render/config.hpp"
#include "gsnav/render/frames.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"
#include "gsnav/scene/lod_cut.hpp"
#include "gsnav/scene/lod_tree.hpp"
#include "gsnav/scene/mesh_scene.hpp"
#include "gsnav/sim/scene.hpp"
#include "gsnav/version.hpp"
