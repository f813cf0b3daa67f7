# SPDX-License-Identifier: Apache-2.0
# Finds Recast and Detour without a CMake config of Recast (Debian's librecast-dev).
# Defines the imported targets Recast::Recast and Recast::Detour.

find_path(RecastNavigation_INCLUDE_DIR NAMES Recast.h PATH_SUFFIXES recastnavigation)
find_library(RecastNavigation_RECAST_LIBRARY NAMES Recast)
find_library(RecastNavigation_DETOUR_LIBRARY NAMES Detour)

include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(RecastNavigation REQUIRED_VARS
  RecastNavigation_RECAST_LIBRARY RecastNavigation_DETOUR_LIBRARY RecastNavigation_INCLUDE_DIR)

if(RecastNavigation_FOUND)
  foreach(_lib Recast Detour)
    string(TOUPPER ${_lib} _LIB)
    if(NOT TARGET Recast::${_lib})
      add_library(Recast::${_lib} UNKNOWN IMPORTED)
      set_target_properties(Recast::${_lib} PROPERTIES
        IMPORTED_LOCATION "${RecastNavigation_${_LIB}_LIBRARY}"
        INTERFACE_INCLUDE_DIRECTORIES "${RecastNavigation_INCLUDE_DIR}")
    endif()
  endforeach()
endif()
mark_as_advanced(RecastNavigation_INCLUDE_DIR RecastNavigation_RECAST_LIBRARY
                 RecastNavigation_DETOUR_LIBRARY)
