// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>

namespace gsnav_tools {

/// Returns a function that prints progress to stderr, from the third second of a task on, with an
/// estimate of the remaining time. On a terminal it overwrites one line; elsewhere it prints a line
/// every ten seconds. Call it with the name of a task and the completed fraction, 0 to 1.
std::function<void(const std::string& task, double share)> progress_printer();

}  // namespace gsnav_tools
