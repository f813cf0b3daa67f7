# SPDX-License-Identifier: Apache-2.0
# 64-bit ARM by Debian's cross compiler (g++-aarch64-linux-gnu); tests run under qemu-aarch64 (qemu-user).
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(CMAKE_C_COMPILER aarch64-linux-gnu-gcc)
set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)

# Libraries of the machine that compiles are of no use here.
set(CMAKE_FIND_ROOT_PATH /usr/aarch64-linux-gnu)
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)

find_program(GSNAV_QEMU_AARCH64 NAMES qemu-aarch64 qemu-aarch64-static DOC "User-mode emulator of the tests")
mark_as_advanced(GSNAV_QEMU_AARCH64)
if(GSNAV_QEMU_AARCH64)
  set(CMAKE_CROSSCOMPILING_EMULATOR "${GSNAV_QEMU_AARCH64};-L;/usr/aarch64-linux-gnu")
endif()
