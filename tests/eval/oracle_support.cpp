// SPDX-License-Identifier: Apache-2.0
#include "eval/oracle_support.hpp"

#include <span>

namespace gsnav_test {

gsnav::eval::OracleFrames oracle(const std::vector<gsnav::GaussianSet>& sets,
                                 const gsnav::Camera& camera, const gsnav::eval::OracleConfig& config) {
  OracleBackend backend;
  return gsnav::eval::oracle_render(backend, std::span(sets), camera, config).value();
}

}  // namespace gsnav_test
