// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "cache.hpp"
#include "gsnav/core/status.hpp"
#include "gsnav/frame/gaussians.hpp"
#include "jobs.hpp"

namespace gsnav_report {

/// Version of the oracles. Raise it when an oracle's image changes, so that older cached references are
/// no longer found.
inline constexpr int kOracleVersion = 1;

/// Hash of all data that a reference depends on.
std::string reference_hash(const std::string& scene_hash, const gsnav::Camera& camera, Oracle oracle,
                           gsnav::SortOrder order);

/// Renders the reference of a whole image on `threads` threads (0: all).
gsnav::Result<Reference> render_reference(const gsnav::GaussianSet& set, const gsnav::Camera& camera,
                                          Oracle oracle, gsnav::SortOrder order, int threads);

}  // namespace gsnav_report
