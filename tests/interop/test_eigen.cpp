// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <numeric>
#include <vector>

#include "gsnav/interop/eigen.hpp"
#include "interop/random.hpp"

using namespace gsnav;
using namespace gsnav::interop;
using namespace gsnav_test;

TEST_CASE_TEMPLATE("Eigen maps lie over gsnav's memory", S, float, double) {
  std::vector<Vec3<S>> points(5);
  const auto map = as_eigen(view_of(points));
  CHECK(map.data() == &points[0].x);
  CHECK(map.rows() == 5);
  as_eigen(view_of(points))(3, 2) = S(7);  // row 3, z
  CHECK(points[3].z == S(7));
  const auto& read_only = points;
  CHECK(as_eigen(view_of(read_only)).row(3)[2] == S(7));
  CHECK(as_eigen(view_of(read_only)).data() == &points[0].x);

  CHECK(as_eigen(points[1]).data() == &points[1].x);
  Mat3<S> m{{{1, 2, 3}, {4, 5, 6}, {7, 8, 9}}};
  CHECK(as_eigen(m).data() == &m.row[0].x);
  CHECK(as_eigen(m)(1, 2) == S(6));
  CHECK(as_eigen(m)(1, 2) == m(1, 2));

  std::vector<S> scalars(4, S(2));
  CHECK(as_eigen(view_of(scalars)).data() == scalars.data());
  CHECK(as_eigen(view_of(scalars))[3] == S(2));
}

TEST_CASE_TEMPLATE("images are maps", S, float, double) {
  constexpr std::size_t h = 4, w = 6;
  std::vector<S> rgb(h * w * 3), depth(h * w);
  std::iota(rgb.begin(), rgb.end(), S(0));
  std::iota(depth.begin(), depth.end(), S(0));
  const auto d = as_eigen(view_of(depth), h, w);
  CHECK(d.data() == depth.data());
  CHECK(d(2, 5) == depth[2 * w + 5]);
  const auto& const_rgb = rgb;
  for (std::size_t c = 0; c < 3; ++c) {
    const auto channel = channel_as_eigen(view_of(const_rgb), h, w, c);
    CHECK(channel.data() == rgb.data() + c);
    CHECK(channel.rows() == static_cast<Eigen::Index>(h));
    CHECK(channel(3, 5) == rgb[(3 * w + 5) * 3 + c]);
    CHECK(channel(1, 0) == rgb[w * 3 + c]);
  }
}

TEST_CASE_TEMPLATE("Eigen matrices of points are views", S, float, double) {
  EigenPoints<S> by_rows(4, 3);
  by_rows << 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11;
  CHECK(&as_view(by_rows).data->x == by_rows.data());
  CHECK(as_view(by_rows).size == 4);
  CHECK(as_view(by_rows)[2] == Vec3<S>{6, 7, 8});
  as_view(by_rows)[2].y = S(-1);
  CHECK(by_rows(2, 1) == S(-1));

  const Eigen::Matrix<S, 3, Eigen::Dynamic> by_columns = by_rows.transpose();
  CHECK(&as_view(by_columns).data->x == by_columns.data());
  CHECK(as_view(by_columns)[3] == Vec3<S>{9, 10, 11});
  // There and back is the same memory.
  CHECK(as_eigen(as_view(by_rows)).data() == by_rows.data());
}

TEST_CASE("rotations agree with Eigen's") {
  Rng rng(1);
  for (int i = 0; i < 1000; ++i) {
    const Quatd q = random_rotation(rng), r = random_rotation(rng);
    const Vec3d v = random_vector(rng, 10);
    const Eigen::Quaterniond e = to_eigen(q);
    const Eigen::Vector3d turned = e * to_eigen(v);
    CHECK((turned - to_eigen(rotate(q, v))).norm() < 1e-13);
    CHECK((e.toRotationMatrix() - to_eigen(rotation_matrix(q))).norm() < 1e-14);
    const Quatd product = from_eigen(to_eigen(q) * to_eigen(r));
    CHECK(angle_between(product, q * r) < 1e-14);
    // Copies change no bit.
    const Quatd back = from_eigen(e);
    CHECK((back.w == q.w && back.x == q.x && back.y == q.y && back.z == q.z));
    CHECK(from_eigen(to_eigen(v)) == v);
    CHECK(from_eigen(to_eigen(rotation_matrix(q))).row[1] == rotation_matrix(q).row[1]);
    CHECK(angle_between(from_eigen(Eigen::Quaterniond(e.toRotationMatrix())), q) < 1e-14);
  }
}

TEST_CASE("transforms agree with Eigen's") {
  Rng rng(2);
  for (int i = 0; i < 300; ++i) {
    const Similarity s = random_similarity(rng);
    const Vec3d v = random_vector(rng, 10);
    const Eigen::Affine3d a = to_eigen(s);
    CHECK((a * to_eigen(v) - to_eigen(s * v)).norm() < 1e-11);
    const Similarity back = interop::similarity_from(a).value();
    CHECK(angle_between(back.rotation, s.rotation) < 1e-13);
    CHECK(back.scale == doctest::Approx(s.scale).epsilon(1e-14));
    CHECK(back.translation == s.translation);

    const Affine3<double> rigid{rotation_matrix(s.rotation), s.translation};
    const Eigen::Isometry3d isometry = to_isometry(rigid);
    CHECK((isometry.inverse() * to_eigen(v) - to_eigen(rigid_inverse(rigid) * v)).norm() < 1e-12);
    CHECK(from_eigen(isometry).linear.row[2] == rigid.linear.row[2]);
  }
  Eigen::Affine3d uneven = Eigen::Affine3d::Identity();
  uneven.scale(Eigen::Vector3d(1, 1, 1.01));
  CHECK(interop::similarity_from(uneven).code() == Errc::invalid_argument);
  Eigen::Affine3d mirror = Eigen::Affine3d::Identity();
  mirror.scale(Eigen::Vector3d(1, 1, -1));
  CHECK(interop::similarity_from(mirror).code() == Errc::invalid_argument);
  uneven.translation().x() = std::numeric_limits<double>::quiet_NaN();
  CHECK(interop::similarity_from(uneven).code() == Errc::invalid_argument);
}

TEST_CASE("an OpenGL camera looks the same way") {
  const Camera camera = Camera::look_at({1, 2, 3}, {4, 1, -2}, {0, 1, 0}, 64, 48, 60);
  Eigen::Isometry3d gl = to_isometry(camera.viewmat);
  gl.prerotate(Eigen::AngleAxisd(3.14159265358979323846, Eigen::Vector3d::UnitX()));
  // The target lies ahead: on -z.
  CHECK((gl * Eigen::Vector3d(4, 1, -2)).z() == doctest::Approx(-std::sqrt(35.0)));
  const Affine3<double> viewmat = viewmat_from(gl, CameraAxes::opengl);
  CHECK(norm(viewmat * Vec3d{5, 6, 7} - camera.viewmat * Vec3d{5, 6, 7}) < 1e-13);
}
