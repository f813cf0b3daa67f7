# SPDX-License-Identifier: Apache-2.0
# A user without CMake: flags from pkg-config, one call of the compiler.
set(ENV{PKG_CONFIG_PATH} "${STAGE}/share/pkgconfig")
foreach(_query --cflags --libs --modversion)
  execute_process(COMMAND "${PKG_CONFIG}" ${_query} gsnav OUTPUT_VARIABLE _answer${_query}
                  OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
endforeach()
if(NOT "${_answer--libs}" STREQUAL "" OR NOT "${_answer--modversion}" STREQUAL "${VERSION}")
  message(FATAL_ERROR "libs '${_answer--libs}', version '${_answer--modversion}'")
endif()
separate_arguments(_cflags UNIX_COMMAND "${_answer--cflags}")
file(MAKE_DIRECTORY "${WORK}")
execute_process(COMMAND "${CXX}" -std=c++20 -O1 ${_cflags} "${MAIN}" -o "${WORK}/consumer"
                COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND "${WORK}/consumer" COMMAND_ERROR_IS_FATAL ANY)
