// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

#include "gsnav/core/backend.hpp"
#include "gsnav/core/status.hpp"
#include "gsnav/detail/eval/oracle_blend.hpp"
#include "gsnav/detail/eval/oracle_config.hpp"
#include "gsnav/detail/eval/oracle_project.hpp"
#include "gsnav/detail/eval/oracle_ray.hpp"

// Images of Gaussians in float64, judged by nothing but their definition: no tiles, no float, no
// approximation. What the errors of every renderer here are measured against; made for tests and
// reports, not for speed.

namespace gsnav::eval {

namespace detail {

/// Checks the inputs and calls f(scene) with the scene of the config's kind.
template <Backend B, class F>
Status with_oracle_scene(B& backend, std::span<const GaussianSet> sets, const Camera& camera,
                         const OracleConfig& config, const F& f) {
  if (Status s = validate(config, camera); !s) return s;
  std::size_t total = 0;
  for (const GaussianSet& set : sets) {
    if (Status s = gsnav::validate(set); !s) return s;
    total += set.gaussians.size();
  }
  if (total > std::numeric_limits<std::uint32_t>::max()) {
    return {Errc::unsupported, "more than 2^32 Gaussians in one render"};
  }
  if (config.kind == OracleKind::ray) {
    f(make_oracle_scene<RayModel>(backend, sets, camera, config));
  } else {
    f(make_oracle_scene<EwaModel>(backend, sets, camera, config));
  }
  return {};
}

}  // namespace detail

/// The float64 image of sets of Gaussians, as one sorted list, from one camera. The backend, whose
/// memory is the host's, only shares out the work: rows in parallel, the same bits for any number of
/// threads. Memory, above the images: at most 350 bytes a visible Gaussian (a drawn one for `boxed` =
/// false), 64 MiB of row lists, and for OracleOrder::per_ray 24 MiB a thread (more only where one pixel
/// is under a million Gaussians). Errors: invalid_argument or unsupported, naming the field.
///
///     gsnav::OpenMPBackend backend;
///     auto truth = gsnav::eval::oracle_render(backend, {{cloud.set()}}, camera).value();  // truth.rgb,
///     ...
template <Backend B>
requires is_host_backend<B> Result<OracleFrames> oracle_render(B& backend,
                                                               std::span<const GaussianSet> sets,
                                                               const Camera& camera,
                                                               const OracleConfig& config = {}) {
  OracleFrames frames;
  if (Status s = detail::with_oracle_scene(backend, sets, camera, config,
                                           [&](const auto& scene) {
                                             detail::render_rows(backend, scene, scene.rect.y0,
                                                                 scene.rect.y1, frames);
                                           });
      !s) {
    return s;
  }
  if (Status s = backend.synchronize(); !s) return s;
  return frames;
}
template <Backend B>
requires is_host_backend<B> Result<OracleFrames> oracle_render(B& backend, const GaussianSet& set,
                                                               const Camera& camera,
                                                               const OracleConfig& config = {}) {
  return oracle_render(backend, std::span(&set, 1), camera, config);
}

}  // namespace gsnav::eval
