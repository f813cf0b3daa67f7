// SPDX-License-Identifier: Apache-2.0
#include "runner_reference.hpp"

#include <span>
#include <utility>

#include "gsnav/backends/openmp.hpp"
#include "gsnav/eval.hpp"
#include "gsnav/eval/oracle.hpp"

namespace gsnav_report {

using namespace gsnav;

std::string reference_hash(const std::string& scene_hash, const Camera& camera, Oracle oracle,
                           SortOrder order) {
  Hasher h;
  h.text(scene_hash);
  hash_camera(h, camera);
  h.text(std::string(to_string(oracle)));
  h.value(order);
  h.value(kOracleVersion);
  return h.hex();
}

Result<Reference> render_reference(const GaussianSet& set, const Camera& camera, Oracle oracle,
                                   SortOrder order, int threads) {
  OpenMPBackend backend(threads);
  const std::span<const GaussianSet> sets(&set, 1);
  eval::OracleConfig config;
  config.rules.sort_order = order;
  config.order = eval::OracleOrder::float32_key;
  if (oracle == Oracle::contract_f64) config.order = eval::OracleOrder::float64;
  if (oracle == Oracle::untruncated) config.kind = eval::OracleKind::untruncated;
  if (oracle == Oracle::ray || oracle == Oracle::ray_key) config.kind = eval::OracleKind::ray;
  if (oracle == Oracle::ray) config.order = eval::OracleOrder::per_ray;
  Result<eval::OracleFrames> frames = oracle == Oracle::photo4
                                          ? eval::oracle_photo(backend, sets, camera, 4, config)
                                          : eval::oracle_render(backend, sets, camera, config);
  if (!frames) return frames.status();
  Reference r;
  r.width = camera.width;
  r.height = camera.height;
  r.rgb.assign(frames->rgb.begin(), frames->rgb.end());
  r.alpha.assign(frames->alpha.begin(), frames->alpha.end());
  r.depth.assign(frames->median_depth.begin(), frames->median_depth.end());
  r.evaluations = frames->counts.evaluations;
  if (oracle == Oracle::contract) {
    r.undecided = std::move(frames->undecided);
    r.undecided_depth = std::move(frames->undecided_depth);
  }
  return r;
}

}  // namespace gsnav_report
