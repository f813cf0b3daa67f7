// SPDX-License-Identifier: Apache-2.0
#pragma once

/// Major version of the library. CMake reads the three version macros from this file.
#define GSNAV_VERSION_MAJOR 0
/// Minor version of the library.
#define GSNAV_VERSION_MINOR 2
/// Patch version of the library.
#define GSNAV_VERSION_PATCH 0
