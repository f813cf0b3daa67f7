# SPDX-License-Identifier: Apache-2.0
# Finds libwebp: its own CMake package where there is one, else the files (Debian's libwebp-dev).
# Defines the imported targets WebP::webp and, where animations can be written, WebP::libwebpmux.

find_package(WebP CONFIG QUIET)
if(NOT TARGET WebP::webp)
  find_path(WebP_INCLUDE_DIR NAMES webp/decode.h)
  find_library(WebP_LIBRARY NAMES webp)
  find_library(WebP_MUX_LIBRARY NAMES webpmux)
  mark_as_advanced(WebP_INCLUDE_DIR WebP_LIBRARY WebP_MUX_LIBRARY)
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
if(WebP_FOUND AND WebP_MUX_LIBRARY AND NOT TARGET WebP::libwebpmux)
  add_library(WebP::libwebpmux UNKNOWN IMPORTED)
  set_target_properties(WebP::libwebpmux PROPERTIES IMPORTED_LOCATION "${WebP_MUX_LIBRARY}"
                        INTERFACE_INCLUDE_DIRECTORIES "${WebP_INCLUDE_DIR}" INTERFACE_LINK_LIBRARIES WebP::webp)
endif()
