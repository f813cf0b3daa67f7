// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "cache.hpp"
#include "csv.hpp"
#include "gsnav/backends/openmp.hpp"
#include "gsnav/backends/serial.hpp"
#include "gsnav/core/status.hpp"
#include "gsnav/scene/basic_renderer.hpp"
#include "gsnav/scene/lod_tree.hpp"
#include "gsnav/scene/prepare.hpp"
#include "options.hpp"
#include "runner_metrics.hpp"
#include "runner_timing.hpp"
#include "scenes.hpp"
#include "storage.hpp"

namespace gsnav_report {

/// Makes the render rows of one scene.
class SceneRunner {
 public:
  /// `stamp` holds the columns that all rows of the run share. All arguments must outlive the runner.
  SceneRunner(const Options& options, const Scene& scene, const ReferenceCache& cache, CsvFile& csv,
              const Row& stamp)
      : options_(options),
        scene_(scene),
        cache_(cache),
        csv_(csv),
        stamp_(stamp),
        openmp_(options.threads) {}

  /// Renders a setting and adds a row for each of its oracles. Rows that the file already has are not
  /// made again.
  gsnav::Status run(const Setting& setting);

  /// Saves pictures of the worst view for each size and profile, by the largest colour error among the
  /// rows.
  gsnav::Status save_worst_views();

 private:
  struct Outcome {
    gsnav::Frames<float> frames;
    PairedTiming timing;       ///< beside the profile exact of the whole cloud
    gsnav::CullCounts culled;  ///< zeros if a knob is set, and for arrays outside host memory
    std::size_t scratch_bytes = 0;
    std::uint64_t peak_memory = 0;
    bool cell_known = true;  ///< false: with the profile visible, no cell has what the camera sees
  };
  struct Named {
    std::string hash;
    std::shared_ptr<const Reference> reference;
  };

  gsnav::Camera camera(const Setting& s) const;
  int threads(const Setting& s) const;
  /// Bytes of one Gaussian that a frame of a sensor reads.
  static std::uint64_t row_bytes(const gsnav::GaussianCloud& cloud, const std::string& sensor) noexcept;
  std::string key(const Setting& s, Oracle oracle) const;
  /// The scene's levels of detail, read from the file beside the scene's or built. Null if the setting
  /// does not use them.
  gsnav::Result<const gsnav::LodTree*> tree_of(const Setting& s);
  /// @param cloud that of the scene, or the same in another storage
  template <class Cloud>
  gsnav::Result<Outcome> render(const Setting& s, const Cloud& cloud, int runs);
  template <class B, class Cloud>
  gsnav::Result<Outcome> render_on(B& backend, const Setting& s, const Cloud& cloud, int runs);
  gsnav::Result<Named> reference(const Setting& s, Oracle oracle);
  gsnav::Status save_worst_view(const ImageSize& size, const std::string& profile);

  const Options& options_;
  const Scene& scene_;
  const ReferenceCache& cache_;
  CsvFile& csv_;
  const Row& stamp_;
  gsnav::OpenMPBackend openmp_;
  gsnav::SerialBackend serial_;
  Judge judge_;
  std::optional<gsnav::LodTree> tree_;
  std::optional<StoredPacked> packed_;
  std::deque<Named> recent_;  // references of the current view
};

}  // namespace gsnav_report
