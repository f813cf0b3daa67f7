// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdio>

#include "gsnav/device/device.hpp"

namespace CLI {
class App;
}

namespace gsnav_tools {

/// Adds `--device`, with the default "best". Other names than those of the machine's devices are
/// rejected with a list of these.
/// @param float64 Set to true by "serial64". Null: that name is not available.
/// @param use Begins the help text: "device to render on".
void add_device_option(CLI::App& app, gsnav::Device& device, bool* float64 = nullptr,
                       const char* use = "device to render on");

/// Throws CLI::ValidationError if GSNAV_ISA names no instruction set. For programs without --device.
void check_instruction_set();

/// Prints "device: " and the device's description on one line.
void print_device(const gsnav::Device& device, std::FILE* out);

}  // namespace gsnav_tools
