// SPDX-License-Identifier: Apache-2.0
#define GSNAV_OPENMP_HEADER_ONLY
#include "ops/header_only_openmp.hpp"

#include <typeinfo>

#include "gsnav/backends/openmp.hpp"
#include "gsnav/scene/basic_renderer.hpp"

namespace gsnav_test {

std::vector<float> render_header_only(const gsnav::GaussianCloud& cloud, const gsnav::Camera& camera) {
  gsnav::OpenMPBackend backend(2);
  gsnav::BasicRenderer renderer(backend);
  return renderer.render(cloud.set(), camera).value().rgb;
}
std::string header_only_name() { return typeid(gsnav::OpenMPBackend).name(); }

}  // namespace gsnav_test
