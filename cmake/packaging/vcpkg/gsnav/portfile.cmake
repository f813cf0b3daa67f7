# SPDX-License-Identifier: Apache-2.0
# An overlay port that builds the tree it lies in:
#   vcpkg install gsnav --overlay-ports=<gsnav>/cmake/packaging/vcpkg
get_filename_component(SOURCE_PATH "${CURRENT_PORT_DIR}/../../../.." ABSOLUTE)

vcpkg_check_linkage(ONLY_STATIC_LIBRARY)
vcpkg_check_features(OUT_FEATURE_OPTIONS FEATURE_OPTIONS
  FEATURES
    io GSNAV_IO
    sim GSNAV_NAV
    sim GSNAV_SIM
    tools GSNAV_TOOLS
    cuda GSNAV_CUDA
)
vcpkg_cmake_configure(
  SOURCE_PATH "${SOURCE_PATH}"
  OPTIONS ${FEATURE_OPTIONS} -DGSNAV_EXAMPLES=OFF -DGSNAV_EVAL=ON
)
vcpkg_cmake_install()
vcpkg_cmake_config_fixup(CONFIG_PATH lib/cmake/gsnav)
if("tools" IN_LIST FEATURES)
  vcpkg_copy_tools(AUTO_CLEAN TOOL_NAMES gsnav-render gsnav-convert gsnav-navmesh gsnav-avatar gsnav-eval gsnav-replay
                   gsnav-scene gsnav-viewer)
endif()
vcpkg_fixup_pkgconfig()
file(REMOVE_RECURSE "${CURRENT_PACKAGES_DIR}/debug/include" "${CURRENT_PACKAGES_DIR}/debug/share")
vcpkg_install_copyright(FILE_LIST "${SOURCE_PATH}/LICENSE")
