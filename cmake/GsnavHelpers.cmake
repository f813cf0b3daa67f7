# SPDX-License-Identifier: Apache-2.0
# Shared by every CMakeLists.txt of the project.

# Warnings and arithmetic of the project's own translation units. Contraction is off so that float
# results do not depend on whether the compiler sees an fma: kernels that need an fma call fma().
function(gsnav_private_options target)
  target_compile_features(${target} PRIVATE cxx_std_20)
  set_target_properties(${target} PROPERTIES CXX_EXTENSIONS OFF)
  target_compile_options(${target} PRIVATE
    $<$<COMPILE_LANGUAGE:CXX>:-Wall -Wextra -Wconversion -Wshadow -ffp-contract=off>)
  if(CMAKE_UNITY_BUILD)
    # clang compares names with those of the files before; the preset clang reads each alone.
    target_compile_options(${target} PRIVATE $<$<COMPILE_LANG_AND_ID:CXX,Clang>:-Wno-shadow>)
  endif()
  if(GSNAV_WERROR)
    target_compile_options(${target} PRIVATE $<$<COMPILE_LANGUAGE:CXX>:-Werror>)
  endif()
endfunction()

# gsnav_library(name SOURCES ... PUBLIC libs... PRIVATE libs...): a compiled component gsnav::<name>.
function(gsnav_library name)
  cmake_parse_arguments(ARG "" "" "SOURCES;PUBLIC;PRIVATE" ${ARGN})
  add_library(gsnav_${name} ${ARG_SOURCES})
  add_library(gsnav::${name} ALIAS gsnav_${name})
  set_target_properties(gsnav_${name} PROPERTIES EXPORT_NAME ${name} POSITION_INDEPENDENT_CODE ON)
  gsnav_private_options(gsnav_${name})
  target_link_libraries(gsnav_${name} PUBLIC gsnav ${ARG_PUBLIC} PRIVATE ${ARG_PRIVATE})
  set_property(GLOBAL APPEND PROPERTY GSNAV_COMPONENTS gsnav_${name})
endfunction()

# gsnav_executable(name SOURCES ... LIBS ...)
function(gsnav_executable name)
  cmake_parse_arguments(ARG "" "" "SOURCES;LIBS" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  gsnav_private_options(${name})
  target_link_libraries(${name} PRIVATE gsnav ${ARG_LIBS})
endfunction()

set(GSNAV_BRIEF_TESTS_FLAGS "" CACHE STRING
    "Further options of the compiler for tests whose time is not in their own code (a list)")

# gsnav_brief_test(target): its own code takes longer to compile than to run. Sanitizers do not optimise it.
function(gsnav_brief_test target)
  target_compile_options(${target} PRIVATE "$<$<COMPILE_LANGUAGE:CXX>:${GSNAV_BRIEF_TESTS_FLAGS}>")
endfunction()

# gsnav_test(name SOURCES ... LIBS ...): a doctest executable that ctest runs. tests/support has main(), helpers and
# the renderers of all tests, compiled once; GSNAV_DATA_DIR reaches the tests as a definition.
function(gsnav_test name)
  cmake_parse_arguments(ARG "" "" "SOURCES;LIBS" ${ARGN})
  if(NOT TARGET gsnav_test_support)
    set(_tests ${PROJECT_SOURCE_DIR}/tests)
    add_library(gsnav_test_support STATIC ${_tests}/eval/oracle_support.cpp ${_tests}/support/compiled_frames.cpp
                                          ${_tests}/support/main.cpp ${_tests}/support/oracle.cpp)
    gsnav_private_options(gsnav_test_support)
    set_target_properties(gsnav_test_support PROPERTIES UNITY_BUILD OFF)
    target_link_libraries(gsnav_test_support PRIVATE gsnav doctest::doctest $<TARGET_NAME_IF_EXISTS:gsnav_openmp>)
    target_include_directories(gsnav_test_support PRIVATE ${PROJECT_SOURCE_DIR}/tests)
  endif()
  gsnav_executable(test_${name} SOURCES ${ARG_SOURCES} LIBS gsnav_test_support ${ARG_LIBS} gsnav_avatar
                                        doctest::doctest)
  target_include_directories(test_${name} PRIVATE ${PROJECT_SOURCE_DIR}/tests)
  target_compile_definitions(test_${name} PRIVATE GSNAV_DATA_DIR="${GSNAV_DATA_DIR}")
  set(_parts $<TARGET_PROPERTY:test_${name},GSNAV_PARTS>)
  add_test(NAME ${name} COMMAND test_${name} "$<$<BOOL:${_parts}>:-sfe=$<JOIN:${_parts},$<COMMA>>>"
           COMMAND_EXPAND_LISTS)
  set_tests_properties(${name} PROPERTIES TIMEOUT 900)
endfunction()

# gsnav_test_part(name test SOURCES ...): more files of an executable of gsnav_test, whose cases ctest runs as a test of
# their own. What files share is compiled once per executable.
function(gsnav_test_part name test)
  cmake_parse_arguments(ARG "" "" "SOURCES" ${ARGN})
  target_sources(test_${test} PRIVATE ${ARG_SOURCES})
  list(TRANSFORM ARG_SOURCES PREPEND "*/" OUTPUT_VARIABLE _files)
  set_property(TARGET test_${test} APPEND PROPERTY GSNAV_PARTS ${_files})
  list(JOIN _files "," _files)
  add_test(NAME ${name} COMMAND test_${test} -sf=${_files})
  set_tests_properties(${name} PROPERTIES TIMEOUT 900 FAIL_REGULAR_EXPRESSION "test cases: +0 ")
endfunction()
