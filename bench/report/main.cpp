// SPDX-License-Identifier: Apache-2.0
// gsnav-report measures speed against error.
#include <csignal>
#include <cstdio>
#include <exception>

#include "options.hpp"
#include "runner.hpp"

int main(int argc, char** argv) {
  int exit_code = 0;
  const auto options = gsnav_report::parse_options(argc, argv, exit_code);
  if (!options) return exit_code;
  try {
    const gsnav::Result<bool> complete = gsnav_report::run_report(*options);
    if (!complete) {
      std::fprintf(stderr, "gsnav-report: %s\n", complete.message().c_str());
      return 1;
    }
    if (!*complete) return 128 + SIGINT;
  } catch (const std::exception& e) {  // out of memory
    std::fprintf(stderr, "gsnav-report: %s\n", e.what());
    return 1;
  }
  return 0;
}
