# SPDX-License-Identifier: Apache-2.0
# Decides whether gsnav::cuda is built (GSNAV_CUDA=AUTO|ON|OFF|EMULATED) and enables the language where it is.
# Inside another project the default is OFF. AUTO needs an nvcc of CUDA 12 or later (C++20); ON stops where
# there is none.
# EMULATED runs device code on the host, for tests: a C++ compiler reads it, no toolkit is needed (docs/notes/cuda.md).
set(_default OFF)
if(PROJECT_IS_TOP_LEVEL)
  set(_default AUTO)
endif()
set(GSNAV_CUDA ${_default} CACHE STRING "Build gsnav::cuda: AUTO, ON, OFF or EMULATED")
set_property(CACHE GSNAV_CUDA PROPERTY STRINGS AUTO ON OFF EMULATED)
set(GSNAV_BUILD_CUDA OFF)

if(GSNAV_CUDA STREQUAL "EMULATED")
  if(NOT CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64" OR NOT CMAKE_SYSTEM_NAME STREQUAL "Linux")
    message(FATAL_ERROR "GSNAV_CUDA=EMULATED: threads are switched by code for x86-64 and Linux; use OFF here.")
  endif()
  if(GSNAV_BENCH)
    message(FATAL_ERROR "GSNAV_CUDA=EMULATED: what it takes says nothing about a GPU; set GSNAV_BENCH=OFF.")
  endif()
elseif(GSNAV_CUDA)
  find_program(GSNAV_NVCC NAMES nvcc HINTS ENV CUDA_PATH PATHS /usr/local/cuda/bin DOC "nvcc")
  mark_as_advanced(GSNAV_NVCC)
  set(_nvcc_version 0)
  if(GSNAV_NVCC)
    execute_process(COMMAND "${GSNAV_NVCC}" --version OUTPUT_VARIABLE _nvcc_text ERROR_QUIET)
    if(_nvcc_text MATCHES "release ([0-9]+\\.[0-9]+)")
      set(_nvcc_version ${CMAKE_MATCH_1})
    endif()
  endif()
  if(_nvcc_version VERSION_GREATER_EQUAL 12)
    set(GSNAV_BUILD_CUDA ON)
  elseif(NOT GSNAV_CUDA STREQUAL "AUTO")
    message(FATAL_ERROR "GSNAV_CUDA=${GSNAV_CUDA} needs nvcc of CUDA 12 or later; found: "
                        "'${GSNAV_NVCC}' (${_nvcc_version}). Set CUDA_PATH, or GSNAV_CUDA=OFF.")
  endif()
endif()

if(GSNAV_BUILD_CUDA)
  if(NOT DEFINED CMAKE_CUDA_COMPILER AND NOT DEFINED ENV{CUDACXX})
    set(CMAKE_CUDA_COMPILER "${GSNAV_NVCC}")
  endif()
  # All that the toolkit knows from 75 on, the newest also as PTX for later ones.
  if(NOT DEFINED CMAKE_CUDA_ARCHITECTURES)
    set(_arches 75 80 86 89 90)
    if(_nvcc_version VERSION_GREATER_EQUAL 12.8)
      list(APPEND _arches 100 120)
    endif()
    list(POP_BACK _arches _newest)
    list(TRANSFORM _arches APPEND "-real")
    set(CMAKE_CUDA_ARCHITECTURES ${_arches} ${_newest})
  endif()
  enable_language(CUDA)
  find_package(CUDAToolkit REQUIRED)
  message(STATUS "gsnav::cuda: CUDA ${_nvcc_version}, architectures ${CMAKE_CUDA_ARCHITECTURES}")
endif()

# gsnav_cuda_options(target): how device code is compiled.
function(gsnav_cuda_options target)
  # No contraction: kernels call fma themselves, which gives the same bits as the CPU.
  # -std by hand: CMake 3.25 does not know that nvcc has C++20.
  # 2810: nvcc takes the assignment of a nodiscard class for a value dropped.
  target_compile_options(${target} PRIVATE
    $<$<COMPILE_LANGUAGE:CUDA>:-std=c++20 -fmad=false -diag-suppress=2810 -Xcompiler=-Wall,-Wextra>)
  if(GSNAV_WERROR)
    target_compile_options(${target} PRIVATE $<$<COMPILE_LANGUAGE:CUDA>:-Werror=all-warnings>)
  endif()
endfunction()
