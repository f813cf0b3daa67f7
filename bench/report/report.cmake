# SPDX-License-Identifier: Apache-2.0
# Script of the target `report`:
#   cmake -DREPORT=... -DOUT=... -DSCENES=... -DSOURCE=... [-DKERNELS=...] -P report.cmake
execute_process(COMMAND git -C "${SOURCE}" describe --always --dirty
                OUTPUT_VARIABLE commit OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
# Waiting threads do not spin, because cores may be shared.
set(ENV{OMP_WAIT_POLICY} passive)
set(options ${SCENES} --acceptance --out "${OUT}" --docs "${OUT}/approximations.md")
if(commit)
  list(APPEND options --commit "${commit}")
endif()
file(MAKE_DIRECTORY "${OUT}")
if(KERNELS)
  execute_process(COMMAND "${KERNELS}" "--benchmark_out=${OUT}/kernels.json" --benchmark_out_format=json
                  COMMAND_ERROR_IS_FATAL ANY)
  list(APPEND options --benchmarks "${OUT}/kernels.json")
endif()
execute_process(COMMAND "${REPORT}" ${options} COMMAND_ERROR_IS_FATAL ANY)
