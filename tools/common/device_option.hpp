// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gsnav/device/device.hpp"

namespace CLI {
class App;
}

namespace gsnav_tools {

/// Adds `--device`, by default "best". A name that is no device of this machine is refused with a list
/// of those that are. `float64` is set by "serial64"; null: there is no such name.
void add_device_option(CLI::App& app, gsnav::Device& device, bool* float64 = nullptr);

}  // namespace gsnav_tools
