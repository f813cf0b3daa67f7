# SPDX-License-Identifier: Apache-2.0
# What is published beside the headers names their version.
foreach(_place IN ITEMS "cmake/packaging/vcpkg/gsnav/vcpkg.json|\"version\": \"${VERSION}\""
                        "CITATION.cff|version: ${VERSION}\n" "CHANGELOG.md|## [${VERSION}]")
  string(REPLACE "|" ";" _place "${_place}")
  list(GET _place 0 _file)
  list(GET _place 1 _wanted)
  file(READ "${SOURCE_DIR}/${_file}" _text)
  string(FIND "${_text}" "${_wanted}" _at)
  if(_at EQUAL -1)
    message(SEND_ERROR "${_file} does not name the version of gsnav/version.hpp: ${_wanted}")
  endif()
endforeach()
