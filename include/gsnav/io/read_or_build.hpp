// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <utility>

#include "gsnav/core/status.hpp"

namespace gsnav::io::detail {

/// Fills `out` (`built`, `warning`, and `value`, one of its members) with what `path` has, else with what is built and
/// then written there. `load(path)` and `build()` give a Result, `save(path, value)` a Status. A file that cannot be
/// taken, and a folder that cannot be written, are warnings. Errors: those of `build`.
template <class Cached, class T, class Load, class Build, class Save>
Result<Cached> read_or_build(const std::filesystem::path& path, T Cached::*value, const Load& load, const Build& build,
                             const Save& save) {
  Cached out;
  Result<T> read = load(path);
  if (read) {
    out.*value = std::move(*read);
    return out;
  }
  if (read.code() != Errc::file_not_found) out.warning = read.message();
  Result<T> made = build();
  if (!made) return made.status();
  out.*value = std::move(*made);
  out.built = true;
  if (Status s = save(path, out.*value); !s) out.warning = s.message();
  return out;
}

}  // namespace gsnav::io::detail
