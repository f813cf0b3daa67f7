// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <initializer_list>
#include <string>
#include <vector>

#include "gsnav/core/status.hpp"

// Rules for values that several programs take. What breaks one is an error of usage: exit status 2,
// before any work.

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace gsnav_tools {

/// Says whether a file of this name can be written.
using OutputCheck = std::function<gsnav::Status(const std::string&)>;

/// A check that accepts the `extensions`, such as ".png", in upper and lower case. A device or a pipe
/// may have any name.
OutputCheck ends_in(std::vector<std::string> extensions);

/// Refuses names of an output file whose extension names no format that can be written: `check` calls
/// them unsupported. Its other errors are left to the program, which names them before its work.
void check_output_name(CLI::Option* option, OutputCheck check);

/// Refuses one of the known values of an option, because a program has no use for it.
void refuse_value(CLI::App& app, const std::string& option, const std::string& value,
                  const std::string& why);

/// Checks that a program can write its files into a folder that exists: no name in the folder with one
/// of these endings is a folder, or a file that must not be written.
gsnav::Status check_files_in(const std::filesystem::path& folder,
                             std::initializer_list<const char*> endings);

/// Adds --crop, the box X0 Y0 Z0 X1 Y1 Z1, whose corners must be in order.
/// @param group Heading in --help. Empty: that of options without one.
void add_crop_option(CLI::App& app, std::vector<double>& crop, const std::string& what,
                     const std::string& group = {});

/// Throws CLI::ValidationError if --eye and --target, x y z each, are the same point. Nothing is checked
/// if both are empty.
void check_eye_and_target(const std::vector<double>& eye, const std::vector<double>& target);

}  // namespace gsnav_tools
