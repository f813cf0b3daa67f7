// SPDX-License-Identifier: Apache-2.0
#pragma once

/// The library's version; CMake reads these three lines.
#define GSNAV_VERSION_MAJOR 0
/// Grows when functions are added or changed.
#define GSNAV_VERSION_MINOR 2
/// Grows when only errors are mended.
#define GSNAV_VERSION_PATCH 0
