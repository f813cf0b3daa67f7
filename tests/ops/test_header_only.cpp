// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <typeinfo>

#include "ops/backends.hpp"
#include "ops/header_only_openmp.hpp"
#include "support/scenes.hpp"

using namespace gsnav;
using namespace gsnav_test;

TEST_CASE("a program may link a unit that uses OpenMP header-only with the compiled component") {
  const GaussianCloud cloud = random_cloud(21, {.count = 2000});
  const Camera camera = Camera::look_at({0, 0, 0}, {0, 0, 4}, {0, -1, 0}, 64, 48, 70);
  OpenMPBackend compiled(2);
  CHECK(header_only_name() != typeid(OpenMPBackend).name());
  CHECK(header_only_name().find("header_only_") != std::string::npos);
  CHECK(std::string(typeid(OpenMPBackend).name()).find("header_only_") == std::string::npos);
  CHECK(render_header_only(cloud, camera) == render<float>(compiled, {cloud.set()}, camera).rgb);
}
