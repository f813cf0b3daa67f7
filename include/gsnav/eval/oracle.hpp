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
#include "gsnav/detail/render/validate_set.hpp"

// Reference renderer: float64 images of Gaussians straight from the definition, without tiles or
// approximations. The errors of all renderers are measured against it. For tests and reports; it is
// slow.

namespace gsnav::eval {

namespace detail {

/// Checks the inputs and calls f(scene) with the scene type of `config.kind`.
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

/// Renders the float64 reference image of sets of Gaussians. All sets are blended in one depth order.
///
/// @code
/// gsnav::OpenMPBackend backend;
/// auto truth = gsnav::eval::oracle_render(backend, {{cloud.set()}}, camera).value();
/// // truth.rgb, ...
/// @endcode
///
/// The backend must be a host backend. It distributes rows over threads; the result is bit-identical for
/// any number of threads. Memory on top of the images: at most 350 bytes per visible Gaussian (with
/// `boxed` = false, per drawn Gaussian) and 64 MiB of row lists. OracleOrder::per_ray adds 24 MiB per
/// thread, or more if over a million Gaussians cover one pixel.
/// @return invalid_argument or unsupported, with the field at fault.
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
/// Renders the float64 reference image of one set of Gaussians.
template <Backend B>
requires is_host_backend<B> Result<OracleFrames> oracle_render(B& backend, const GaussianSet& set,
                                                               const Camera& camera,
                                                               const OracleConfig& config = {}) {
  return oracle_render(backend, std::span(&set, 1), camera, config);
}

}  // namespace gsnav::eval
