// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <utility>

#include "gsnav/core/status.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"

namespace gsnav::io::detail {

/// Appends a part to a scene and sums the reports; warnings get the part's name. Errors: those of the
/// part, or that its filter or sort order does not fit.
inline Status merge_loaded(LoadedCloud& scene, Result<LoadedCloud> part, const std::string& name) {
  if (!part) return part.status();
  LoadReport& sum = scene.report;
  sum.add_counts(part->report);
  for (const std::string& w : part->report.warnings) sum.warnings.push_back(name + ": " + w);
  if (scene.cloud.size() == 0) {
    scene.cloud = std::move(part->cloud);
    return {};
  }
  if (Status s = append(scene.cloud, part->cloud); !s) return {s.code(), name + ": " + s.message()};
  return {};
}

}  // namespace gsnav::io::detail
