// SPDX-License-Identifier: Apache-2.0
#pragma once

// Preparation and inspection of clouds before they are drawn: editing, spatial order, levels of detail,
// visible sets, packed storage, needed SH bands, the ledger of a frame. Functions with much work take a
// backend (gsnav/backends/...).

#include "gsnav/detail/scene/content_hash.hpp"
#include "gsnav/detail/scene/describe_cloud.hpp"
#include "gsnav/detail/scene/drop_bands.hpp"
#include "gsnav/detail/scene/edit_cloud.hpp"
#include "gsnav/detail/scene/ledger.hpp"
#include "gsnav/detail/scene/lod_build.hpp"
#include "gsnav/detail/scene/lod_greedy.hpp"
#include "gsnav/detail/scene/lod_levels.hpp"
#include "gsnav/detail/scene/lod_merge.hpp"
#include "gsnav/detail/scene/needed_bands.hpp"
#include "gsnav/detail/scene/point_tree.hpp"
#include "gsnav/detail/scene/scene_bands.hpp"
#include "gsnav/detail/scene/sh_rotation.hpp"
#include "gsnav/detail/scene/spatial_order.hpp"
#include "gsnav/detail/scene/temporal_edit.hpp"
#include "gsnav/detail/scene/temporal_gaussians.hpp"
#include "gsnav/detail/scene/up_axis.hpp"
#include "gsnav/detail/scene/views_around.hpp"
#include "gsnav/scene/packed_cloud.hpp"
#include "gsnav/scene/visible_sets.hpp"
