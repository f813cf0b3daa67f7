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
inline constexpr int kFailed = 1;  ///< what was asked for could not be done
inline constexpr int kUsage = 2;   ///< the command line cannot be

/// Reads the command line; adds --version. Prints help, the version, or what is wrong: control
/// characters of arguments become \xHH, so that a file name cannot steer a terminal. Returns nothing if
/// the program goes on, else the status to exit with. `check` looks at options together and throws
/// CLI::ValidationError.
std::optional<int> parse_options(CLI::App& app, int argc, const char* const* argv,
                                 const std::function<void()>& check = {});

/// Prints "PROGRAM: `message`" on stderr. Returns kFailed.
int fail(const std::string& program, const std::string& message);

}  // namespace gsnav_tools
