// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <string>

namespace CLI {
class App;
}

namespace gsnav_tools {

// Exit statuses of all programs.
inline constexpr int kFailed = 1;  ///< The task failed.
inline constexpr int kUsage = 2;   ///< The command line is invalid.

/// Reads the command line and adds --version. Prints help, the version or an error. Help and version are
/// printed whatever else the command line says, and whatever GSNAV_ISA is. Control characters
/// of arguments are printed as \xHH, so that a file name cannot control the terminal. From now on the
/// program ends with kFailed if text could not be written to stdout. Numbers of options must be finite
/// and fit their types.
/// @param check Checks combinations of options. It throws CLI::ValidationError.
/// @return nothing if the program continues, else the exit status.
std::optional<int> parse_options(CLI::App& app, int argc, const char* const* argv,
                                 const std::function<void()>& check = {});

/// Prints "PROGRAM: `message`" to stderr. Returns kFailed.
int fail(const std::string& program, const std::string& message);

}  // namespace gsnav_tools
