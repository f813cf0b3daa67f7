// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cassert>
#include <cstddef>
#include <type_traits>

#include "gsnav/core/view.hpp"
#include "gsnav/detail/interop/conventions.hpp"

// Eigen over gsnav's arrays and the other way. `as_` functions copy nothing: what they return points
// into their argument and lives no longer. `to_` and `from_` functions copy, where layouts differ.

namespace gsnav::interop {

/// [N][3] points, one a row: the layout of View<Vec3<S>>.
template <class S>
using EigenPoints = Eigen::Matrix<S, Eigen::Dynamic, 3, Eigen::RowMajor>;
/// [H][W] image, row 0 the top.
template <class S>
using EigenImage = Eigen::Matrix<S, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
/// One channel of an [H][W][C] image.
template <class S>
using EigenChannelMap =
    Eigen::Map<const EigenImage<S>, Eigen::Unaligned, Eigen::Stride<Eigen::Dynamic, Eigen::Dynamic>>;

// ---- zero copy: gsnav's memory as Eigen

/// Views it as an Eigen type, without a copy.
template <class S>
Eigen::Map<Eigen::Matrix<S, 3, 1>> as_eigen(Vec3<S>& v) noexcept {
  return Eigen::Map<Eigen::Matrix<S, 3, 1>>(&v.x);
}
/// Views it as an Eigen type, without a copy.
template <class S>
Eigen::Map<const Eigen::Matrix<S, 3, 1>> as_eigen(const Vec3<S>& v) noexcept {
  return Eigen::Map<const Eigen::Matrix<S, 3, 1>>(&v.x);
}
template <class S>
void as_eigen(const Vec3<S>&& v) = delete;

/// Views it as an Eigen type, without a copy.
template <class S>
Eigen::Map<Eigen::Matrix<S, 3, 3, Eigen::RowMajor>> as_eigen(Mat3<S>& m) noexcept {
  return Eigen::Map<Eigen::Matrix<S, 3, 3, Eigen::RowMajor>>(&m.row[0].x);
}
/// Views it as an Eigen type, without a copy.
template <class S>
Eigen::Map<const Eigen::Matrix<S, 3, 3, Eigen::RowMajor>> as_eigen(const Mat3<S>& m) noexcept {
  return Eigen::Map<const Eigen::Matrix<S, 3, 3, Eigen::RowMajor>>(&m.row[0].x);
}
template <class S>
void as_eigen(const Mat3<S>&& m) = delete;

/// Points, [N][3].
template <class S>
Eigen::Map<EigenPoints<S>> as_eigen(View<Vec3<S>> points) noexcept {
  return {reinterpret_cast<S*>(points.data), static_cast<Eigen::Index>(points.size), 3};
}
template <class S>
Eigen::Map<const EigenPoints<S>> as_eigen(View<const Vec3<S>> points) noexcept {
  return {reinterpret_cast<const S*>(points.data), static_cast<Eigen::Index>(points.size), 3};
}

/// An array of numbers as a column.
template <class S>
requires std::is_arithmetic_v<S>
auto as_eigen(View<S> values) noexcept {
  using Column = Eigen::Matrix<std::remove_const_t<S>, Eigen::Dynamic, 1>;
  using Mapped = std::conditional_t<std::is_const_v<S>, const Column, Column>;
  return Eigen::Map<Mapped>(values.data, static_cast<Eigen::Index>(values.size));
}

/// An image [H][W], for instance one camera of Frames::median_depth. `pixels` holds height x width
/// values.
template <class S>
requires std::is_arithmetic_v<S>
auto as_eigen(View<S> pixels, std::size_t height, std::size_t width) noexcept {
  assert(pixels.size == height * width);
  using Image = EigenImage<std::remove_const_t<S>>;
  using Mapped = std::conditional_t<std::is_const_v<S>, const Image, Image>;
  return Eigen::Map<Mapped>(pixels.data, static_cast<Eigen::Index>(height),
                            static_cast<Eigen::Index>(width));
}

/// Channel c of an image [H][W][channels], for instance the red of Frames::rgb.
template <class S>
EigenChannelMap<S> channel_as_eigen(View<const S> pixels, std::size_t height, std::size_t width,
                                    std::size_t c, std::size_t channels = 3) noexcept {
  assert(pixels.size == height * width * channels && c < channels);
  return {pixels.data + c, static_cast<Eigen::Index>(height), static_cast<Eigen::Index>(width),
          Eigen::Stride<Eigen::Dynamic, Eigen::Dynamic>(static_cast<Eigen::Index>(width * channels),
                                                        static_cast<Eigen::Index>(channels))};
}

// ---- zero copy: Eigen's memory as gsnav

namespace detail {
template <class M>
inline constexpr bool points_lie_together =
    M::IsRowMajor ? M::ColsAtCompileTime == 3 : M::RowsAtCompileTime == 3;
}  // namespace detail

/// Points of an Eigen matrix: N x 3 by rows or 3 x N by columns (Eigen's default). Others would need a
/// copy and do not compile.
template <class Derived>
View<Vec3<typename Derived::Scalar>> as_view(Eigen::PlainObjectBase<Derived>& m) noexcept {
  static_assert(detail::points_lie_together<Derived>,
                "points must lie together: N x 3 RowMajor or 3 x N");
  return {reinterpret_cast<Vec3<typename Derived::Scalar>*>(m.data()),
          static_cast<std::size_t>(m.size() / 3)};
}
template <class Derived>
View<const Vec3<typename Derived::Scalar>> as_view(const Eigen::PlainObjectBase<Derived>& m) noexcept {
  static_assert(detail::points_lie_together<Derived>,
                "points must lie together: N x 3 RowMajor or 3 x N");
  return {reinterpret_cast<const Vec3<typename Derived::Scalar>*>(m.data()),
          static_cast<std::size_t>(m.size() / 3)};
}
template <class Derived>
void as_view(const Eigen::PlainObjectBase<Derived>&& m) = delete;

// ---- copies

/// Copies it to an Eigen type.
template <class S>
Eigen::Matrix<S, 3, 1> to_eigen(const Vec3<S>& v) {
  return {v.x, v.y, v.z};
}
/// Copies it to an Eigen type.
template <class S>
Eigen::Matrix<S, 3, 3> to_eigen(const Mat3<S>& m) {
  return as_eigen(m);
}
/// gsnav stores w x y z, Eigen x y z w.
template <class S>
Eigen::Quaternion<S> to_eigen(const Quat<S>& q) {
  return Eigen::Quaternion<S>(q.w, q.x, q.y, q.z);
}
template <class S>
Eigen::Transform<S, 3, Eigen::Affine> to_eigen(const Affine3<S>& a) {
  Eigen::Transform<S, 3, Eigen::Affine> t = Eigen::Transform<S, 3, Eigen::Affine>::Identity();
  t.linear() = as_eigen(a.linear);
  t.translation() = as_eigen(a.translation);
  return t;
}
/// A rigid map; the linear part must be a rotation.
template <class S>
Eigen::Transform<S, 3, Eigen::Isometry> to_isometry(const Affine3<S>& a) {
  Eigen::Transform<S, 3, Eigen::Isometry> t = Eigen::Transform<S, 3, Eigen::Isometry>::Identity();
  t.linear() = as_eigen(a.linear);
  t.translation() = as_eigen(a.translation);
  return t;
}
/// Copies it to an Eigen type.
inline Eigen::Affine3d to_eigen(const Similarity& s) { return to_eigen(affine_from(s)); }

/// Copies it from an Eigen type.
template <class Derived>
auto from_eigen(const Eigen::MatrixBase<Derived>& m) {
  using S = typename Derived::Scalar;
  if constexpr (Derived::RowsAtCompileTime == 3 && Derived::ColsAtCompileTime == 3) {
    Mat3<S> r;
    as_eigen(r) = m;
    return r;
  } else {
    static_assert(Derived::SizeAtCompileTime == 3, "a 3-vector or a 3 x 3 matrix");
    return Vec3<S>{m.derived().coeff(0), m.derived().coeff(1), m.derived().coeff(2)};
  }
}
/// Copies it from an Eigen type.
template <class Derived>
Quat<typename Derived::Scalar> from_eigen(const Eigen::QuaternionBase<Derived>& q) {
  return {q.w(), q.x(), q.y(), q.z()};
}
/// Copies it from an Eigen type.
template <class S, int Mode, int Options>
Affine3<S> from_eigen(const Eigen::Transform<S, 3, Mode, Options>& t) {
  static_assert(Mode != Eigen::Projective, "a projective map is not affine");
  return {from_eigen(t.linear().eval()), from_eigen(t.translation().eval())};
}
/// Where an asset stands, from a map that rotates, scales evenly and translates; an error where it does
/// anything else.
template <int Mode, int Options>
Result<Similarity> similarity_from(const Eigen::Transform<double, 3, Mode, Options>& t) {
  return similarity_from(from_eigen(t));
}

/// A camera's viewmat from a world-to-camera isometry with the given axes.
template <int Mode, int Options>
Affine3<double> viewmat_from(const Eigen::Transform<double, 3, Mode, Options>& view, CameraAxes axes) {
  return view_with_axes(from_eigen(view), axes);
}

}  // namespace gsnav::interop
