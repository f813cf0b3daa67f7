// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdio>

#include "gsnav/device/device.hpp"

namespace CLI {
class App;
}

namespace gsnav_tools {

/// Adds `--device`, by default "best". A name that is no device of this machine is refused with a list
/// of those that are. `float64` is set by "serial64"; null: there is no such name.
void add_device_option(CLI::App& app, gsnav::Device& device, bool* float64 = nullptr);

/// Prints "device: " and the device's description on one line.
void print_device(const gsnav::Device& device, std::FILE* out);

}  // namespace gsnav_tools
