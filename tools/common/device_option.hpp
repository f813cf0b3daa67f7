// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "gsnav/device/device.hpp"

namespace gsnav_tools {

/// Adds `--device`, by default "best". A name that is no device of this machine is refused with a list
/// of those that are. `float64` is set by "serial64"; null: there is no such name.
inline void add_device_option(CLI::App& app, gsnav::Device& device, bool* float64 = nullptr) {
  const auto read = [&device, float64](const std::string& name) {
    if (float64 != nullptr && name == "serial64") {
      *float64 = true;
      return;
    }
    const auto found = gsnav::Device::parse(name);
    if (!found) throw CLI::ValidationError("--device", found.message());
    device = *found;
  };
  std::string what =
      "what renders: best (a GPU if there is one, else cpu), cpu, cpu:THREADS, cuda, cuda:NUMBER, "
      "serial";
  if (float64 != nullptr) what += ", serial64 (the float64 reference)";
  app.add_option_function<std::string>("--device", read, what)->default_str("best")->force_callback();
}

}  // namespace gsnav_tools
