// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "gsnav/image/camera.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"

namespace gsnav_test {

/// A frame in colour, by a translation unit that uses OpenMPBackend header-only, without optimisation.
std::vector<float> render_header_only(const gsnav::GaussianCloud& cloud, const gsnav::Camera& camera);
/// What that unit calls its OpenMPBackend.
std::string header_only_name();

}  // namespace gsnav_test
