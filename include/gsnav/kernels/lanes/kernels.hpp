// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gsnav/kernels/lanes/bin_tiles.hpp"
#include "gsnav/kernels/lanes/capsule.hpp"
#include "gsnav/kernels/lanes/project_chunk.hpp"
#include "gsnav/kernels/lanes/rasterize_tile.hpp"
#include "gsnav/kernels/lanes/skin.hpp"
