# SPDX-License-Identifier: Apache-2.0
# gsnav::interop_eigen, interop_glm and interop_dlpack, where the package is found. Their headers are part of
# gsnav::gsnav; these targets only add the other library's include folder.

# gsnav_interop(name package target)
function(gsnav_interop name package target)
  find_package(${package} CONFIG QUIET)
  if(TARGET ${target})
    add_library(gsnav_interop_${name} INTERFACE)
    add_library(gsnav::interop_${name} ALIAS gsnav_interop_${name})
    target_link_libraries(gsnav_interop_${name} INTERFACE gsnav ${target})
    set_target_properties(gsnav_interop_${name} PROPERTIES GSNAV_INTEROP_PACKAGE ${target})
  endif()
endfunction()

gsnav_interop(eigen Eigen3 Eigen3::Eigen)
gsnav_interop(glm glm glm::glm)
gsnav_interop(dlpack dlpack dlpack::dlpack)
