// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "csv.hpp"
#include "gsnav/avatar/asset.hpp"
#include "gsnav/skin/skin.hpp"
#include "runner_timing.hpp"

namespace gsnav_report {

/// Times skinning of the asset's Gaussians on a backend. Writes the time for 100,000 of them into `row`.
template <class B, class Args>
gsnav::Status time_skinning(B& backend, const gsnav::AvatarAsset& asset, const Args& args, int runs,
                            Row& row) {
  gsnav::Status status;
  const Timing t = measure(
      [&] {
        status = gsnav::skin_gaussians<float>(backend, args);
        if (status.ok()) status = backend.synchronize();
      },
      runs, 5.0);
  const double per = 100000.0 / static_cast<double>(asset.size());
  row.set("influences", asset.influences).set("gaussians", static_cast<std::uint64_t>(asset.size()));
  row.set("time_p50_ms", t.p50_ms * per).set("time_p99_ms", t.p99_ms * per);
  row.set("items_per_second", 1e3 * static_cast<double>(asset.size()) / t.p50_ms);
  return status;
}

}  // namespace gsnav_report
