// SPDX-License-Identifier: Apache-2.0
// gsnav-report measures speed against error.
#include <cstdio>
#include <exception>

#include "options.hpp"
#include "runner.hpp"

int main(int argc, char** argv) {
  int exit_code = 0;
  const auto options = gsnav_report::parse_options(argc, argv, exit_code);
  if (!options) return exit_code;
  try {
    if (const gsnav::Status s = gsnav_report::run_report(*options); !s) {
      std::fprintf(stderr, "gsnav-report: %s\n", s.message().c_str());
      return 1;
    }
  } catch (const std::exception& e) {  // out of memory
    std::fprintf(stderr, "gsnav-report: %s\n", e.what());
    return 1;
  }
  return 0;
}
