# SPDX-License-Identifier: Apache-2.0
# Finds libwebp: its own CMake package where there is one, else the files (Debian's libwebp-dev).
# Defines the imported target WebP::webp.

find_package(WebP CONFIG QUIET)
if(NOT TARGET WebP::webp)
  find_path(WebP_INCLUDE_DIR NAMES webp/decode.h)
  find_library(WebP_LIBRARY NAMES webp)
  mark_as_advanced(WebP_INCLUDE_DIR WebP_LIBRARY)
endif()

include(FindPackageHandleStandardArgs)
if(TARGET WebP::webp)
  set(WebP_target WebP::webp)
  find_package_handle_standard_args(WebP REQUIRED_VARS WebP_target)
else()
  find_package_handle_standard_args(WebP REQUIRED_VARS WebP_LIBRARY WebP_INCLUDE_DIR)
  if(WebP_FOUND)
    add_library(WebP::webp UNKNOWN IMPORTED)
    set_target_properties(WebP::webp PROPERTIES IMPORTED_LOCATION "${WebP_LIBRARY}"
                          INTERFACE_INCLUDE_DIRECTORIES "${WebP_INCLUDE_DIR}")
  endif()
endif()
