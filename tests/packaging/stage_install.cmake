# SPDX-License-Identifier: Apache-2.0
# Installs into STAGE by way of another folder: what only works where it was installed breaks here.
file(REMOVE_RECURSE "${STAGE}" "${STAGE}-first")
execute_process(COMMAND "${CMAKE_COMMAND}" --install "${BUILD_DIR}" --prefix "${STAGE}-first"
                        --config "${CONFIG}"
                COMMAND_ERROR_IS_FATAL ANY OUTPUT_QUIET)
file(RENAME "${STAGE}-first" "${STAGE}")

# Nothing that is installed as text may name the folders it was built in.
file(GLOB_RECURSE _files "${STAGE}/*.cmake" "${STAGE}/*.pc" "${STAGE}/*.hpp")
foreach(_file IN LISTS _files)
  file(READ "${_file}" _text)
  foreach(_folder "${BUILD_DIR}" "${SOURCE_DIR}/" "${STAGE}-first")
    string(FIND "${_text}" "${_folder}" _at)
    if(NOT _at EQUAL -1)
      message(SEND_ERROR "${_file} names ${_folder}")
    endif()
  endforeach()
endforeach()
list(LENGTH _files _count)
message(STATUS "${_count} headers and package files installed")
