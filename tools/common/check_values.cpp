// SPDX-License-Identifier: Apache-2.0
#include "check_values.hpp"

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <system_error>
#include <utility>

#include "gsnav/core/replace_file.hpp"
#include "gsnav/core/text.hpp"

namespace gsnav_tools {
namespace {

namespace fs = std::filesystem;

std::string text_of(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%g", value);
  return text;
}

bool is_device_or_pipe(const std::string& path) {
  std::error_code ignored;
  const fs::file_status status = fs::status(path, ignored);
  return fs::exists(status) && !fs::is_regular_file(status) && !fs::is_directory(status);
}

}  // namespace

OutputCheck ends_in(std::vector<std::string> extensions) {
  return [extensions = std::move(extensions)](const std::string& path) -> gsnav::Status {
    const std::string name = gsnav::lower_case(path);
    std::string known;
    for (const std::string& extension : extensions) {
      if (name.ends_with(extension)) return {};
      known += (known.empty() ? "" : " or ") + extension;
    }
    if (is_device_or_pipe(path)) return {};
    return {gsnav::Errc::unsupported, path + ": unknown kind of file to write: use " + known};
  };
}

void check_output_name(CLI::Option* option, OutputCheck check) {
  option->check(CLI::Validator(
      [check = std::move(check)](const std::string& path) {
        const gsnav::Status s = check(path);
        return s.code() == gsnav::Errc::unsupported ? s.message() : std::string();
      },
      ""));
}

void refuse_value(CLI::App& app, const std::string& option, const std::string& value,
                  const std::string& why) {
  app.get_option(option)->check(CLI::Validator(
      [value, why](const std::string& given) { return given == value ? given + ": " + why : ""; }, ""));
}

gsnav::Status check_files_in(const fs::path& folder, std::initializer_list<const char*> endings) {
  std::error_code error;
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    const std::string name = at->path().filename().string();
    for (const char* ending : endings) {
      if (!name.ends_with(ending)) continue;
      if (gsnav::Status s = gsnav::check_output_path(at->path()); !s) return s;
    }
  }
  return {};
}

void add_crop_option(CLI::App& app, std::vector<double>& crop, const std::string& what,
                     const std::string& group) {
  const auto read = [&crop](const std::vector<double>& corners) {
    for (std::size_t k = 0; k < 3; ++k) {
      const double low = corners[k], high = corners[k + 3];
      const char axis = "XYZ"[k];
      if (low < high) continue;
      throw CLI::ValidationError("--crop", std::string(1, axis) + "0 " + text_of(low) +
                                               " must be below " + axis + "1 " + text_of(high));
    }
    crop = corners;
  };
  CLI::Option* option = app.add_option_function<std::vector<double>>("--crop", read, what)->expected(6);
  if (!group.empty()) option->group(group);
}

void check_eye_and_target(const std::vector<double>& eye, const std::vector<double>& target) {
  if (!eye.empty() && eye == target)
    throw CLI::ValidationError("--eye and --target", "are the same point; the camera looks nowhere");
}

}  // namespace gsnav_tools
