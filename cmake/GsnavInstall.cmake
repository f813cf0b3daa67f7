# SPDX-License-Identifier: Apache-2.0
# Headers, libraries, CMake package and pkg-config files. Each compiled component has an export of
# its own, so that a user needs the dependencies of the components asked for and no others.
include(CMakePackageConfigHelpers)
include(GsnavPkgConfig)

set(_package_dir "${CMAKE_INSTALL_LIBDIR}/cmake/gsnav")

# ---- headers: all layers, and those of every backend
install(DIRECTORY "${PROJECT_SOURCE_DIR}/include/gsnav" DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}")
file(GLOB _backends LIST_DIRECTORIES true "${PROJECT_SOURCE_DIR}/backends/*")
foreach(_backend IN LISTS _backends)
  if(IS_DIRECTORY "${_backend}/gsnav")
    install(DIRECTORY "${_backend}/gsnav" DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}")
  endif()
endforeach()

install(TARGETS gsnav EXPORT gsnavTargets)
install(EXPORT gsnavTargets NAMESPACE gsnav:: DESTINATION "${_package_dir}")
_gsnav_pc_headers()

# ---- components. The arguments of find_package for each namespace that a component may link; a link
# that is not in the table stops the configure, so no dependency can be forgotten.
set(_package_OpenMP "OpenMP COMPONENTS CXX")
set(_package_Recast "RecastNavigation")
set(_package_PNG "PNG")
set(_package_JPEG "JPEG")
set(_package_ZLIB "ZLIB")
set(_package_WebP "WebP")
set(_package_Zstd "Zstd")
set(_package_nlohmann_json "nlohmann_json")
set(_package_Threads "Threads")
set(_package_CUDA "CUDAToolkit")

get_property(_components GLOBAL PROPERTY GSNAV_COMPONENTS)
set(GSNAV_COMPONENT_NAMES)
set(GSNAV_COMPONENT_LISTS)
foreach(_target IN LISTS _components)
  string(REGEX REPLACE "^gsnav_" "" _name "${_target}")
  set(_links)
  set(_packages)
  set(_namespaces)
  get_target_property(_libraries ${_target} LINK_LIBRARIES)
  foreach(_library IN LISTS _libraries)
    string(REGEX REPLACE "::.*" "" _namespace "${_library}")
    if(_library MATCHES "^gsnav(_|::)(.+)")
      if(NOT CMAKE_MATCH_2 STREQUAL "gsnav")
        list(APPEND _links ${CMAKE_MATCH_2})
      endif()
    elseif(DEFINED _package_${_namespace})
      list(APPEND _packages "${_package_${_namespace}}")
      list(APPEND _namespaces ${_namespace})
    elseif(NOT _library MATCHES "^(gsnav$|::@|\\$<BUILD_INTERFACE:)")
      message(FATAL_ERROR "${_target} links ${_library}: add its package to cmake/GsnavInstall.cmake")
    endif()
  endforeach()
  list(REMOVE_DUPLICATES _packages)
  foreach(_link IN LISTS _links)
    if(NOT _link IN_LIST GSNAV_COMPONENT_NAMES)
      message(FATAL_ERROR "${_target} links gsnav_${_link}, which is not built before it")
    endif()
  endforeach()
  list(APPEND GSNAV_COMPONENT_NAMES ${_name})
  _gsnav_pc_component(${_target} ${_name} "${_links}" "${_namespaces}")
  list(TRANSFORM _packages REPLACE "(.+)" "\"\\1\"")
  list(JOIN _packages " " _packages)
  list(JOIN _links " " _links)
  string(APPEND GSNAV_COMPONENT_LISTS
         "set(_gsnav_links_${_name} ${_links})\nset(_gsnav_packages_${_name} ${_packages})\n")

  # 0.x: each minor version may break the ABI.
  set_target_properties(${_target} PROPERTIES VERSION ${PROJECT_VERSION}
                        SOVERSION ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})
  install(TARGETS ${_target} EXPORT ${_target}Targets
          ARCHIVE DESTINATION "${CMAKE_INSTALL_LIBDIR}" LIBRARY DESTINATION "${CMAKE_INSTALL_LIBDIR}"
          RUNTIME DESTINATION "${CMAKE_INSTALL_BINDIR}")
  install(EXPORT ${_target}Targets NAMESPACE gsnav:: DESTINATION "${_package_dir}")
endforeach()
list(JOIN GSNAV_COMPONENT_NAMES " " GSNAV_COMPONENT_NAMES)

# ---- the CMake package
configure_package_config_file("${PROJECT_SOURCE_DIR}/cmake/gsnavConfig.cmake.in"
  "${PROJECT_BINARY_DIR}/cmake/gsnavConfig.cmake" INSTALL_DESTINATION "${_package_dir}"
  NO_SET_AND_CHECK_MACRO)
write_basic_package_version_file("${PROJECT_BINARY_DIR}/cmake/gsnavConfigVersion.cmake"
  COMPATIBILITY SameMinorVersion)
file(GLOB _find_modules "${PROJECT_SOURCE_DIR}/cmake/Find*.cmake")
install(FILES "${PROJECT_BINARY_DIR}/cmake/gsnavConfig.cmake"
  "${PROJECT_BINARY_DIR}/cmake/gsnavConfigVersion.cmake" ${_find_modules} DESTINATION "${_package_dir}")

install(FILES "${PROJECT_SOURCE_DIR}/LICENSE" DESTINATION "${CMAKE_INSTALL_DOCDIR}")
