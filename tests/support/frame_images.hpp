// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gsnav/scene/basic_renderer.hpp"

namespace gsnav_test {

/// f(image of a, the same image of b) for every kind of image that frames may have.
template <class A, class B, class F>
void for_each_image(A& a, B& b, const F& f) {
  f(a.rgb, b.rgb);
  f(a.alpha, b.alpha);
  f(a.median_depth, b.median_depth);
  f(a.expected_depth, b.expected_depth);
  f(a.accumulated_depth, b.accumulated_depth);
  f(a.first_hit_depth, b.first_hit_depth);
}

}  // namespace gsnav_test
