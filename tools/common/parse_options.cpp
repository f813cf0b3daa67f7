// SPDX-License-Identifier: Apache-2.0
#include "parse_options.hpp"

#include <CLI/CLI.hpp>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <functional>
#include <sstream>
#include <string>
#include <vector>

#include "gsnav/core/printable.hpp"
#include "gsnav/version.hpp"

namespace gsnav_tools {
namespace {

constexpr std::size_t kHelpColumns = 100;

std::string program_name;  ///< For check_stdout().

/// Ends the program with kFailed if its output was lost, for instance on a full disk.
void check_stdout() {
  if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return;
  std::fprintf(stderr, "%s: cannot write the output: %s\n", program_name.c_str(), std::strerror(errno));
  std::_Exit(kFailed);
}

std::string version() {
  return std::to_string(GSNAV_VERSION_MAJOR) + "." + std::to_string(GSNAV_VERSION_MINOR) + "." +
         std::to_string(GSNAV_VERSION_PATCH);
}

/// Error message for an unknown option, with a suggestion. Empty if all options are known.
std::string unknown_option(const CLI::App& app) {
  for (const std::string& word : app.remaining(true)) {
    if (!word.starts_with("-")) continue;
    const std::string option = word.substr(0, word.find('='));
    for (const CLI::Option* known : app.get_options()) {
      if (known->get_lnames().empty()) continue;
      const std::string name = "--" + known->get_lnames()[0];
      if (name.starts_with(option) || option.starts_with(name))
        return "there is no option " + option + "; did you mean " + name + "?";
    }
    return "there is no option " + option;
  }
  return {};
}

/// Error message for a word that is no command, where the program has commands. Else empty.
std::string unknown_command(const CLI::App& app) {
  if (app.get_require_subcommand_min() == 0 || !app.get_subcommands().empty()) return {};
  const std::vector<std::string> rest = app.remaining(true);
  if (rest.empty() || rest.front().starts_with("-")) return {};
  return "there is no command " + rest.front();
}

/// Makes negative numbers errors where an option takes an unsigned one. CLI11 would wrap them round.
void refuse_negative(CLI::App& app) {
  for (CLI::Option* option : app.get_options()) {
    if (option->get_type_name() != "UINT") continue;
    option->check(CLI::Validator(
        [](const std::string& v) {
          return v.starts_with('-') ? v + ": must not be negative" : std::string();
        },
        ""));
  }
  for (CLI::App* command : app.get_subcommands({})) refuse_negative(*command);
}

/// Column at which the lines that continue `line` begin: that of its description, or of its text.
std::size_t description_column(const std::string& line) {
  const std::size_t text = line.find_first_not_of(' ');
  if (text == std::string::npos) return 0;
  const std::size_t gap = line.find("  ", text);
  const std::size_t column = gap == std::string::npos ? text : line.find_first_not_of(' ', gap);
  return column < kHelpColumns / 2 ? column : text;
}

/// `help` with the words of each line beyond `kHelpColumns` on lines of their own, under its
/// description.
std::string wrapped(const std::string& help) {
  std::istringstream lines(help);
  std::string out;
  for (std::string line; std::getline(lines, line); out += line + "\n") {
    const std::size_t column = description_column(line);
    while (line.size() > kHelpColumns) {
      const std::size_t space = line.rfind(' ', kHelpColumns);
      if (space == std::string::npos || space <= column) break;
      out += line.substr(0, space) + "\n";
      line = std::string(column, ' ') + line.substr(space + 1);
    }
  }
  return out;
}

}  // namespace

std::optional<int> parse_options(CLI::App& app, int argc, const char* const* argv,
                                 const std::function<void()>& check) {
  const std::string name = argc > 0 ? std::filesystem::path(argv[0]).filename().string() : "";
  app.name(name);
  refuse_negative(app);
  app.set_version_flag("--version", name + " " + version());
  std::setvbuf(stdout, nullptr, _IOLBF, BUFSIZ);  // Line buffering keeps output to a pipe in order with
                                                  // errors.
  program_name = name;
  static const int registered = std::atexit(check_stdout);
  static_cast<void>(registered);
  try {
    app.parse(argc, argv);
    if (check) check();
  } catch (const CLI::ParseError& error) {
    std::string unknown = unknown_command(app);
    if (unknown.empty()) unknown = unknown_option(app);
    if (!unknown.empty() && error.get_exit_code() != 0) {
      std::fprintf(stderr, "%s: %s\nRun with --help for more information.\n", name.c_str(),
                   gsnav::printable(unknown).c_str());
      return kUsage;
    }
    std::ostringstream out, err;
    const int status = app.exit(error, out, err);
    std::fputs(gsnav::printable(wrapped(out.str())).c_str(), stdout);
    std::fputs(gsnav::printable(err.str()).c_str(), stderr);
    return status == 0 ? 0 : kUsage;
  }
  return {};
}

int fail(const std::string& program, const std::string& message) {
  std::fprintf(stderr, "%s: %s\n", program.c_str(), gsnav::printable(message).c_str());
  return kFailed;
}

}  // namespace gsnav_tools
