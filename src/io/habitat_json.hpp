// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "gsnav/detail/io/habitat_dataset.hpp"
#include "json.hpp"

// Shared by the readers of a Habitat dataset's files.

namespace gsnav::io::habitat {

Result<detail::Json> load_object(const std::filesystem::path& path);

/// Keys without effect here, each with the file that had it first.
class LeftOut {
 public:
  void add(const detail::Json& object, const std::set<std::string_view>& known, const std::string& at) {
    for (const auto& [key, value] : object.items()) {
      if (!known.contains(key)) first_.emplace(key, at);
    }
  }
  void report(std::vector<std::string>& warnings) const {
    for (const auto& [key, at] : first_) warnings.push_back(at + ": '" + key + "' is left out");
  }

 private:
  std::map<std::string, std::string> first_;
};

/// Text of `key`; empty if it is missing.
Result<std::string> text(const detail::Json& object, const char* key, const std::string& at);

/// Reads the members of `object` that describe a stage into `out`. Members that are missing keep their
/// values. Assets are relative to `folder`.
Status read_stage(const detail::Json& object, const std::filesystem::path& folder, const std::string& at,
                  StageConfig& out, LeftOut& left_out);

}  // namespace gsnav::io::habitat
