// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>

namespace gsnav_tools {

/// Prints on stderr what a program is at, from the third second of a task on, with the time that is left
/// as the share done so far lets one guess: a line that is written over on a terminal, a line every ten
/// seconds elsewhere. To be called with a task's name and the share of it that is done, 0 to 1.
std::function<void(const std::string& task, double share)> progress_printer();

}  // namespace gsnav_tools
