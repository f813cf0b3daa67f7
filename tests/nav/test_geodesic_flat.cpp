// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include "gsnav/detail/demo/default_scene.hpp"
#include "metric_check.hpp"
#include "support/random_cases.hpp"

using namespace gsnav;

TEST_CASE("geodesic: a metric on the default flat") {
  const DefaultScene flat = make_default_scene(0.1).value();
  gsnav_test::check_metric(NavMesh::build({}, flat.vertices, flat.triangles).value(),
                           gsnav_test::cases(100000));
}
