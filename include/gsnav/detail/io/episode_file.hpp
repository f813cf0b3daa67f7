// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "gsnav/core/status.hpp"
#include "gsnav/detail/io/read_limits.hpp"
#include "gsnav/detail/nav/episode.hpp"

namespace gsnav::io {

/// The episodes that load_episodes read.
struct EpisodeFile {
  std::vector<PointNavEpisode> episodes;  ///< Episodes in the order of the file.
  std::vector<std::string> warnings;      ///< Keys and goals that were left out, each named once.
};

/// Reads PointNav and ImageNav episodes of Habitat-Lab, `.json` or `.json.gz`. For a file without
/// episodes, the files in the folder `content/` next to it are read, in order of their names. Keys of an
/// episode: episode_id (text or number), scene_id, start_position, start_rotation (x, y, z, w), goals
/// (position and radius of the first), info.geodesic_distance, and info.start_time in files written by
/// gsnav.
///
/// Errors name the file, the episode and the key: file_not_found; invalid_file; unsupported (JSON nested
/// deeper, or gzip that expands more, than `limits` allow; more than 1 GiB of text); invalid_argument
/// (`limits`); out_of_memory. Never throws.
Result<EpisodeFile> load_episodes(const std::filesystem::path& path, const ReadLimits& limits = {});

/// Writes episodes for Habitat-Lab, compressed by gzip if the name ends in `.gz`. The same episodes give
/// the same bytes, and reading them gives the same numbers. Errors: file_not_found (parent folder);
/// write_failed; invalid_argument naming the episode and the field of a number that is not finite.
Status save_episodes(const std::filesystem::path& path, std::span<const PointNavEpisode> episodes);

}  // namespace gsnav::io
