# SPDX-License-Identifier: Apache-2.0
# A user without CMake: flags from pkg-config, one call of the compiler; headers only, then with each of COMPONENTS.
set(ENV{PKG_CONFIG_PATH} "${STAGE}/share/pkgconfig:${STAGE}/${LIBDIR}/pkgconfig")
foreach(_query --cflags --libs --modversion)
  execute_process(COMMAND "${PKG_CONFIG}" ${_query} gsnav OUTPUT_VARIABLE _answer${_query}
                  OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
endforeach()
if(NOT "${_answer--libs}" STREQUAL "" OR NOT "${_answer--modversion}" STREQUAL "${VERSION}")
  message(FATAL_ERROR "libs '${_answer--libs}', version '${_answer--modversion}'")
endif()
separate_arguments(_cflags UNIX_COMMAND "${_answer--cflags}")
file(MAKE_DIRECTORY "${WORK}")
execute_process(COMMAND "${CXX}" -std=c++20 ${_cflags} "${MAIN}" -o "${WORK}/consumer"
                COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND "${WORK}/consumer" COMMAND_ERROR_IS_FATAL ANY)

string(REPLACE "," ";" COMPONENTS "${COMPONENTS}")
set(_modules)
set(_with)
foreach(_component IN LISTS COMPONENTS)
  list(APPEND _modules gsnav-${_component})
  string(TOUPPER ${_component} _upper)
  list(APPEND _with -DWITH_${_upper})
endforeach()
execute_process(COMMAND "${PKG_CONFIG}" --cflags --libs ${_modules} OUTPUT_VARIABLE _flags
                OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
separate_arguments(_flags UNIX_COMMAND "${_flags}")
execute_process(COMMAND "${CXX}" -std=c++20 ${_with} "${MAIN}" -o "${WORK}/components" ${_flags}
                COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND "${WORK}/components" WORKING_DIRECTORY "${WORK}" COMMAND_ERROR_IS_FATAL ANY)
