// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <glm/gtc/matrix_transform.hpp>
#include <vector>

#include "gsnav/interop/glm.hpp"
#include "interop/random.hpp"

using namespace gsnav;
using namespace gsnav::interop;
using namespace gsnav_test;

TEST_CASE_TEMPLATE("GLM vectors lie over gsnav's memory", S, float, double) {
  std::vector<Vec3<S>> points(3);
  GlmVec3<S>* g = as_glm(view_of(points));
  CHECK(static_cast<void*>(g) == static_cast<void*>(points.data()));
  g[2].y = S(5);
  CHECK(points[2].y == S(5));
  CHECK(&as_glm(points[1]).x == &points[1].x);

  std::vector<GlmVec3<S>> other{{1, 2, 3}, {4, 5, 6}};
  const View<Vec3<S>> view = as_view(other.data(), other.size());
  CHECK(&view[0].x == &other[0].x);
  CHECK(view.size == 2);
  CHECK(view[1] == Vec3<S>{4, 5, 6});
}

TEST_CASE("rotations and transforms agree with GLM's") {
  Rng rng(3);
  for (int i = 0; i < 1000; ++i) {
    const Quatd q = random_rotation(rng), r = random_rotation(rng);
    const Vec3d v = random_vector(rng, 10);
    CHECK(norm(from_glm(to_glm(q) * to_glm(v)) - rotate(q, v)) < 1e-13);
    CHECK(norm(from_glm(glm::mat3_cast(to_glm(q)) * to_glm(v)) - rotate(q, v)) < 1e-13);
    CHECK(norm(from_glm(to_glm(rotation_matrix(q)) * to_glm(v)) - rotate(q, v)) < 1e-13);
    CHECK(angle_between(from_glm(to_glm(q) * to_glm(r)), q * r) < 1e-14);
    const Quatd back = from_glm(to_glm(q));
    CHECK((back.w == q.w && back.x == q.x && back.y == q.y && back.z == q.z));
    CHECK(from_glm(to_glm(rotation_matrix(q))).row[1] == rotation_matrix(q).row[1]);

    const Similarity s = random_similarity(rng);
    const glm::dvec4 moved = to_glm(s) * glm::dvec4(to_glm(v), 1.0);
    CHECK(norm(from_glm(glm::dvec3(moved)) - s * v) < 1e-11);
    const Similarity again = interop::similarity_from(to_glm(s)).value();
    CHECK(angle_between(again.rotation, s.rotation) < 1e-13);
    CHECK(again.scale == doctest::Approx(s.scale).epsilon(1e-14));
    CHECK(again.translation == s.translation);
  }
  CHECK_FALSE(interop::similarity_from(glm::scale(glm::dmat4(1.0), glm::dvec3(1, 2, 1))).ok());
  CHECK_FALSE(interop::similarity_from(glm::scale(glm::dmat4(1.0), glm::dvec3(-1, 1, 1))).ok());
}

TEST_CASE("glm::lookAt and Camera::look_at are one camera") {
  Rng rng(4);
  for (int i = 0; i < 300; ++i) {
    const Vec3d eye = random_vector(rng, 10), target = eye + random_vector(rng), up{0, 1, 0};
    if (norm(cross(target - eye, up)) < 1e-3) continue;
    const Camera ours = Camera::look_at(eye, target, up, 64, 48, 60);
    const glm::dmat4 view = glm::lookAt(to_glm(eye), to_glm(target), to_glm(up));
    const Vec3d v = random_vector(rng, 10);
    CHECK(norm(viewmat_from(view) * v - ours.viewmat * v) < 1e-12);
    const glm::dvec4 difference = (view_to_glm(ours) - view) * glm::dvec4(to_glm(v), 1.0);
    CHECK(glm::length(difference) < 1e-12);
  }
}

TEST_CASE("an OpenGL projection gives the same pixels") {
  Rng rng(5);
  const int w = 80, h = 60;
  const glm::dmat4 view = glm::lookAt(glm::dvec3(1, 2, 3), glm::dvec3(0, 1, 0), glm::dvec3(0, 1, 0));
  // Off centre and of unequal focal lengths.
  const glm::dmat4 projection = glm::frustum(-0.1, 0.14, -0.08, 0.05, 0.1, 50.0);
  const Camera camera = camera_from_opengl(view, projection, w, h).value();
  for (int i = 0; i < 300; ++i) {
    const Vec3d v = random_vector(rng, 3);
    const Vec3d c = camera.viewmat * v;
    if (c.z < 0.2) continue;
    const glm::dvec4 clip = projection * (view * glm::dvec4(to_glm(v), 1.0));
    const double column = 0.5 * w * (clip.x / clip.w + 1), row = 0.5 * h * (1 - clip.y / clip.w);
    CHECK(camera.fx * c.x / c.z + camera.cx == doctest::Approx(column).epsilon(1e-12));
    CHECK(camera.fy * c.y / c.z + camera.cy == doctest::Approx(row).epsilon(1e-12));
  }
  const Camera plain =
      camera_from_opengl(view, glm::perspective(glm::radians(60.0), 1.0, 0.1, 9.0), 64, 64).value();
  const Camera expected = Camera{}.set_hfov(64, 64, 60);
  CHECK(plain.fx == doctest::Approx(expected.fx));
  CHECK(plain.fy == doctest::Approx(expected.fy));
  CHECK(plain.cx == expected.cx);
  CHECK_FALSE(camera_from_opengl(view, glm::ortho(-1.0, 1.0, -1.0, 1.0), w, h).ok());
  CHECK(camera_from_opengl(glm::mat4(view), glm::mat4(projection), w, h).ok());
}
