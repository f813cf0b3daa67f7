# SPDX-License-Identifier: Apache-2.0
# The target `docs` makes the API site in <build>/site/html, where Doxygen and Python are installed.

find_program(GSNAV_DOXYGEN doxygen DOC "Makes the API site")
find_package(Python3 3.8 QUIET COMPONENTS Interpreter)
mark_as_advanced(GSNAV_DOXYGEN)
if(GSNAV_DOXYGEN AND Python3_FOUND)
  add_custom_target(docs COMMAND Python3::Interpreter "${PROJECT_SOURCE_DIR}/tools/make_site.py"
                                 --out "${PROJECT_BINARY_DIR}/site" --doxygen "${GSNAV_DOXYGEN}"
                    COMMENT "Making the API site" USES_TERMINAL VERBATIM)
endif()
