// SPDX-License-Identifier: Apache-2.0
#include "device_option.hpp"

#include <CLI/CLI.hpp>
#include <string>

namespace gsnav_tools {

void add_device_option(CLI::App& app, gsnav::Device& device, bool* float64, const char* use) {
  const auto read = [&device, float64](const std::string& name) {
    if (float64 != nullptr && name == "serial64") {
      *float64 = true;
      return;
    }
    const auto found = gsnav::Device::parse(name);
    if (!found) throw CLI::ValidationError("--device", found.message());
    device = *found;
  };
  std::string what = std::string(use) +
                     ": best (a GPU if there is one, else cpu), cpu, cpu:THREADS, cuda, cuda:NUMBER, "
                     "serial";
  if (float64 != nullptr) what += ", serial64 (the float64 reference)";
  app.add_option_function<std::string>("--device", read, what)->default_str("best")->force_callback();
}

void check_instruction_set() {
  const auto cpu = gsnav::Device::parse("cpu");
  if (cpu.code() == gsnav::Errc::invalid_argument) throw CLI::ValidationError(cpu.message());
}

void print_device(const gsnav::Device& device, std::FILE* out) {
  std::fprintf(out, "device: %s\n", device.description().c_str());
}

}  // namespace gsnav_tools
