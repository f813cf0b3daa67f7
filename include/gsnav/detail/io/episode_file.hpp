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

/// What load_episodes returns.
struct EpisodeFile {
  std::vector<PointNavEpisode> episodes;  ///< Episodes in the order of the file.
  std::vector<std::string> warnings;      ///< keys and goals that are left out, each once
};

/// Reads Habitat-Lab's PointNav and ImageNav episodes, `.json` or `.json.gz`. A file without episodes
/// stands for those of the files in `content/` beside it, by name. Of an episode: episode_id (text or
/// number), scene_id, start_position, start_rotation (x, y, z, w in the file), goals (the first one's
/// position and radius), info.geodesic_distance and, of files written here, info.start_time.
///
/// Errors name the file, the episode and the key: file_not_found; invalid_file; unsupported (JSON nested
/// deeper, or gzip that grows more, than `limits` allow; more than 1 GiB of text); invalid_argument
/// (`limits`); out_of_memory. Never throws.
Result<EpisodeFile> load_episodes(const std::filesystem::path& path, const ReadLimits& limits = {});

/// Writes episodes so that Habitat-Lab reads them; gzip where the name ends in `.gz`. The same episodes
/// give the same bytes, and read back the same numbers. Errors: file_not_found (parent folder),
/// write_failed; invalid_argument naming episode and field (a number that is not finite).
Status save_episodes(const std::filesystem::path& path, std::span<const PointNavEpisode> episodes);

}  // namespace gsnav::io
