// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <utility>

#include "gsnav/core/status.hpp"

namespace gsnav::io::detail {

/// Removes stale caches: files next to `path` (ASSET.HASH.lod) with another hash that are older than
/// ASSET, or for a folder older than any file in it. They were made from content that no longer exists.
/// Newer ones belong to other settings and stay.
void remove_stale_caches(const std::filesystem::path& path) noexcept;

/// Reads `path`, or else builds the value and writes it there, which removes the caches of an earlier
/// content of the asset. A file that cannot be used and a folder that cannot be written only give a
/// warning.
/// @param value the member of `Cached` that is filled, next to `built` and `warning`.
/// @param load,build return a Result<T>.
/// @param save returns a Status.
/// @return the value, or an error of `build`.
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
