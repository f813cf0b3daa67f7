// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

namespace gsnav_test {

/// How a program ended and what it printed.
struct Outcome {
  bool ok = false;
  std::string text;

  bool says(const char* part) const { return text.find(part) != std::string::npos; }
};

inline std::string quoted(const std::filesystem::path& p) {
  return std::string(1, '"').append(p.string()).append("\"");
}

/// Runs a program in `folder`, by the shell's reading of `arguments`; what it prints goes to the file
/// `log` there.
inline Outcome run_command(const char* program, const std::string& arguments,
                           const std::filesystem::path& folder) {
  std::string command = "cd ";
  command.append(quoted(folder)).append(" && ").append(quoted(program)).append(" ");
  command.append(arguments).append(" > log 2>&1");
  Outcome out;
  out.ok = std::system(command.c_str()) == 0;
  std::ifstream log(folder / "log", std::ios::binary);
  out.text.assign(std::istreambuf_iterator<char>(log), {});
  return out;
}

}  // namespace gsnav_test
