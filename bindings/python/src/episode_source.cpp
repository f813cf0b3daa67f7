// SPDX-License-Identifier: Apache-2.0
#include "episode_source.hpp"

#include <string>
#include <utility>

#include "fields.hpp"

namespace gsnav::python {

EpisodeSource episode_source(std::shared_ptr<PythonSource> source) {
  return
      [source = std::move(source)](std::size_t environment, std::size_t count) -> Result<BatchEpisode> {
        const HoldGil gil;
        const std::string call =
            "next_episode(" + std::to_string(environment) + ", " + std::to_string(count) + ")";
        try {
          const nb::object made = source->function(environment, count);
          BatchEpisode episode;
          if (nb::try_cast(made, episode, false)) return episode;
          if (nb::try_cast(made, episode.episode, false)) return episode;
          return {Errc::invalid_argument,
                  call + " returned " + type_of(made) + ": return a BatchEpisode or a PointNavEpisode"};
        } catch (nb::python_error& e) {
          source->error.emplace(std::move(e));
          return {Errc::invalid_argument, call + " raised an exception"};
        }
      };
}

}  // namespace gsnav::python
