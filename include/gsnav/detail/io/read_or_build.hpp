// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <utility>

#include "gsnav/core/status.hpp"

namespace gsnav::io::detail {

/// Removes the files beside `path` (ASSET.HASH.lod) that have another hash and are older than ASSET, or,
/// of a folder, than a file in it: they were made of content that is no longer there. Newer ones are of
/// other settings, and stay.
void remove_stale_caches(const std::filesystem::path& path) noexcept;

/// Fills `out` (`built`, `warning`, and `value`, one of its members) with what `path` has, else with
/// what is built and then written there; files of an earlier content of the asset then go. `load(path)`
/// and `build()` give a Result, `save(path, value)` a Status. A file that cannot be taken, and a folder
/// that cannot be written, are warnings. Errors: those of `build`.
template <class Cached, class T, class Load, class Build, class Save>
Result<Cached> read_or_build(const std::filesystem::path& path, T Cached::*value, const Load& load,
                             const Build& build, const Save& save) {
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
  if (Status s = save(path, out.*value); !s) {
    out.warning = s.message();
  } else {
    remove_stale_caches(path);
  }
  return out;
}

}  // namespace gsnav::io::detail
