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

// What the files of a Habitat dataset have in common.

namespace gsnav::io::habitat {

Result<detail::Json> load_object(const std::filesystem::path& path);

/// Keys that change nothing here, each with the file that had it first.
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

/// Text of `key`; empty where it is missing.
Result<std::string> text(const detail::Json& object, const char* key, const std::string& at);

/// What `object` says about a stage on top of what `out` has; assets lie beside `folder`.
Status read_stage(const detail::Json& object, const std::filesystem::path& folder, const std::string& at,
                  StageConfig& out, LeftOut& left_out);

}  // namespace gsnav::io::habitat
