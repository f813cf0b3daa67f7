# SPDX-License-Identifier: Apache-2.0
# `cpack` in the build folder, or the target `package`: gsnav_<version>-1_<architecture>.deb (where dpkg is) and
# gsnav-<version>-<system>-<processor>.tar.gz. Both hold programs, libraries, headers and the CMake package.

# ---- notices of the header-only libraries that are compiled into the programs
set(_notices nlohmann-json3-dev libcli11-dev)
foreach(_package IN LISTS _notices)
  if(EXISTS "/usr/share/doc/${_package}/copyright")
    install(FILES "/usr/share/doc/${_package}/copyright"
            DESTINATION "${CMAKE_INSTALL_DOCDIR}/third_party" RENAME "${_package}")
  endif()
endforeach()
install(FILES "${PROJECT_SOURCE_DIR}/cmake/packaging/copyright" "${PROJECT_SOURCE_DIR}/CHANGELOG.md"
        DESTINATION "${CMAKE_INSTALL_DOCDIR}")

set(CPACK_PACKAGE_NAME gsnav)
set(CPACK_PACKAGE_VERSION "${PROJECT_VERSION}")
set(CPACK_PACKAGE_VENDOR "gsnav")
set(CPACK_PACKAGE_CONTACT "gsnav maintainers <maintainers@gsnav.invalid>" CACHE STRING
    "Maintainer of the package that cpack makes")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "Gaussian splatting and navigation simulation for C++20")
set(_gpu)
if(TARGET gsnav_cuda)
  set(_gpu ", also on NVIDIA GPUs")
endif()
set(CPACK_PACKAGE_DESCRIPTION
    "Renders scenes of 3D Gaussians, animates Gaussian avatars and steps agents on\n\
navigation meshes among them${_gpu}. This package has the\n\
programs gsnav-render, gsnav-convert, gsnav-navmesh, gsnav-avatar, gsnav-eval,\n\
gsnav-replay, gsnav-scene and gsnav-viewer, the static libraries, the headers,\n\
the CMake package (find_package(gsnav)) and pkg-config files.")
set(CPACK_RESOURCE_FILE_LICENSE "${PROJECT_SOURCE_DIR}/LICENSE")
set(CPACK_VERBATIM_VARIABLES ON)
set(CPACK_STRIP_FILES ON)
set(CPACK_SYSTEM_NAME "${CMAKE_SYSTEM_NAME}-${CMAKE_SYSTEM_PROCESSOR}")
set(CPACK_GENERATOR TGZ)

# ---- Debian: what programs load is found by dpkg-shlibdeps; what a program that links the libraries needs besides
# is recommended.
find_program(GSNAV_DPKG_SHLIBDEPS NAMES dpkg-shlibdeps DOC "dpkg-shlibdeps (dpkg-dev), for the Debian package")
mark_as_advanced(GSNAV_DPKG_SHLIBDEPS)
if(GSNAV_DPKG_SHLIBDEPS)
  list(APPEND CPACK_GENERATOR DEB)
  set(_recommends g++ cmake)
  if(TARGET gsnav_io)
    list(APPEND _recommends libpng-dev libwebp-dev libzstd-dev zlib1g-dev)
    if(TARGET JPEG::JPEG)
      list(APPEND _recommends libjpeg-dev)
    endif()
  endif()
  if(TARGET gsnav_nav)
    list(APPEND _recommends librecast-dev)
  endif()
  list(JOIN _recommends ", " CPACK_DEBIAN_PACKAGE_RECOMMENDS)
  set(CPACK_DEBIAN_PACKAGE_SUGGESTS "libeigen3-dev, libglm-dev, libdlpack-dev, ffmpeg")
  set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
  set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
  set(CPACK_DEBIAN_PACKAGE_SECTION science)
  set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
  set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
endif()
set(GSNAV_PACKAGES ${CPACK_GENERATOR})  # CPack leaves its source generators in CPACK_GENERATOR
include(CPack)
