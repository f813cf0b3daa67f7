// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <cstdio>
#include <optional>
#include <sstream>

#include "gsnav/core/printable.hpp"

namespace gsnav_tools {

/// Prints what CLI11 says of an error, or its help. Control characters of arguments become \xHH, so that
/// a file name cannot steer a terminal. Returns CLI11's exit status, 0 for help.
inline int print_parse_error(const CLI::App& app, const CLI::ParseError& error) {
  std::ostringstream out, err;
  const int status = app.exit(error, out, err);
  std::fputs(gsnav::printable(out.str()).c_str(), stdout);
  std::fputs(gsnav::printable(err.str()).c_str(), stderr);
  return status;
}

/// Reads the command line. Returns nothing if the program goes on, else the status to exit with.
inline std::optional<int> parse_options(CLI::App& app, int argc, const char* const* argv) {
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return print_parse_error(app, error);
  }
  return {};
}

}  // namespace gsnav_tools
