// SPDX-License-Identifier: Apache-2.0
#include "parse_options.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <functional>
#include <initializer_list>
#include <sstream>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include "gsnav/core/text.hpp"
#include "gsnav/version.hpp"

namespace gsnav_tools {
namespace {

constexpr std::size_t kHelpColumns = 100;

std::string program_name;  ///< For check_stdout().

/// Ends the program with kFailed if its output was lost, for instance on a full disk.
void check_stdout() {
  if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return;
  // An error of an earlier line may have been followed by other errors, of files that are not there.
  const bool known =
      errno == ENOSPC || errno == EDQUOT || errno == EIO || errno == EPIPE || errno == EBADF;
  std::fprintf(stderr, "%s: cannot write the output: %s\n", program_name.c_str(),
               known ? std::strerror(errno) : "a part of it is lost");
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

/// Why `text` is no value for an option of this type, or an empty text. CLI11 itself reads empty values
/// as 0, lets numbers wrap round or saturate, and takes leading zeros for octal: they are removed here.
std::string check_number(const std::string& type, std::string& text) {
  const std::string shown = text.empty() ? "an empty value" : text;
  const bool is_unsigned = type.starts_with("UINT");
  if (type.starts_with("FLOAT")) {
    const char* const begin = text.c_str() + (text.starts_with('+') ? 1 : 0);
    const char* const end = text.c_str() + text.size();
    double value = 0;
    const auto [read, error] = std::from_chars(begin, end, value);
    if (read != end || error == std::errc::invalid_argument) return shown + ": must be a number";
    if (error != std::errc()) value = std::strtod(begin, nullptr);  // 0 or infinity
    // NaN lies outside no range, so checks of ranges accept it.
    if (!std::isfinite(value)) return shown + ": must be finite";
  } else if (is_unsigned || type.starts_with("INT")) {
    const std::size_t sign = text.starts_with('+') || text.starts_with('-') ? 1 : 0;
    if (text.size() == sign || text.find_first_not_of("0123456789", sign) != std::string::npos)
      return shown + ": must be a whole number";
    const std::size_t digit = std::min(text.find_first_not_of('0', sign), text.size() - 1);
    text = (text.front() == '-' ? "-" : "") + text.substr(digit);
    if (is_unsigned && text.front() == '-') return shown + ": must not be negative";
    const char *const begin = text.c_str(), *const end = begin + text.size();
    std::uint64_t natural = 0;
    std::int64_t whole = 0;
    const std::errc error =
        is_unsigned ? std::from_chars(begin, end, natural).ec : std::from_chars(begin, end, whole).ec;
    if (error != std::errc()) return shown + ": is too large";
  }
  return {};
}

/// Lets options with numbers take numbers only: finite ones that fit their type.
void check_numbers(CLI::App& app) {
  for (CLI::Option* option : app.get_options()) {
    const std::string type = option->get_type_name();
    if (type.empty() || option->get_items_expected_max() == 0) continue;  // a flag
    option->transform(CLI::Validator([type](std::string& v) { return check_number(type, v); }, ""));
  }
  for (CLI::App* command : app.get_subcommands({})) check_numbers(*command);
}

/// The message with numbers of very many digits, such as the largest one, in short form.
std::string shortened(const std::string& message) {
  constexpr std::size_t kLongest = 40;
  std::string out;
  for (std::size_t i = 0; i < message.size();) {
    const std::size_t end = std::min(message.find_first_not_of("0123456789", i), message.size());
    if (end - i > kLongest) {
      out += std::string(1, message[i]) + "e" + std::to_string(end - i - 1);
      i = end;
      if (i < message.size() && message[i] == '.')
        i = std::min(message.find_first_not_of("0123456789", i + 1), message.size());
    } else {
      out.append(message, i, std::max(end, i + 1) - i);
      i = std::max(end, i + 1);
    }
  }
  return out;
}

/// Error message for a word like "--out=", after which CLI11 would take the next word. Else empty.
std::string missing_value(int argc, const char* const* argv) {
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word == "--") break;
    if (word.starts_with("--") && word.ends_with('=')) return word + " has no value";
  }
  return {};
}

/// Error message for a list such as "--sizes 64x64,", whose empty element CLI11 would drop. Else empty.
std::string empty_element(const CLI::App& app, int argc, const char* const* argv) {
  const CLI::Option* option = nullptr;
  for (int i = 1; i < argc; ++i) {
    std::string word = argv[i], name = word.substr(0, word.find('='));
    if (word == "--") break;
    if (word.starts_with("--")) {
      option = app.get_option_no_throw(name);
      if (name == word) continue;
      word.erase(0, name.size() + 1);
    }
    if (option == nullptr || option->get_delimiter() == '\0') continue;
    const std::string mark(1, option->get_delimiter());
    if (word.starts_with(mark) || word.ends_with(mark) || word.find(mark + mark) != std::string::npos)
      return option->get_name() + ": " + word + ": an element is empty";
  }
  return {};
}

/// Whether one of the words asks for help (-h, --help) or the version.
bool asks_for(std::initializer_list<std::string_view> options, int argc, const char* const* argv) {
  for (int i = 1; i < argc && std::string_view(argv[i]) != "--"; ++i) {
    if (std::find(options.begin(), options.end(), argv[i]) != options.end()) return true;
  }
  return false;
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
  check_numbers(app);
  app.set_version_flag("--version", name + " " + version());
  std::setvbuf(stdout, nullptr, _IOLBF, BUFSIZ);  // Line buffering keeps output to a pipe in order with
                                                  // errors.
  program_name = name;
  static const int registered = std::atexit(check_stdout);
  static_cast<void>(registered);
  try {
    if (const std::string missing = missing_value(argc, argv); !missing.empty())
      throw CLI::ValidationError(missing);
    if (const std::string empty = empty_element(app, argc, argv); !empty.empty())
      throw CLI::ValidationError(empty);
    app.parse(argc, argv);
    if (check) check();
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() != 0 && asks_for({"-h", "--help"}, argc, argv)) {
      std::fputs(gsnav::printable(wrapped(app.help())).c_str(), stdout);  // whatever else is wrong
      return 0;
    }
    if (error.get_exit_code() != 0 && asks_for({"--version"}, argc, argv)) {
      std::printf("%s %s\n", name.c_str(), version().c_str());
      return 0;
    }
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
    if (status != 0) std::fprintf(stderr, "%s: ", name.c_str());
    std::fputs(gsnav::printable(shortened(err.str())).c_str(), stderr);
    return status == 0 ? 0 : kUsage;
  }
  return {};
}

int fail(const std::string& program, const std::string& message) {
  std::fprintf(stderr, "%s: %s\n", program.c_str(), gsnav::printable(message).c_str());
  return kFailed;
}

}  // namespace gsnav_tools
