// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cassert>
#include <cstddef>
#include <type_traits>

#include "gsnav/core/view.hpp"
#include "gsnav/detail/interop/conventions.hpp"

// Conversions between gsnav and Eigen. `as_` functions copy nothing: the result points into the argument
// and must not outlive it. `to_` and `from_` functions copy, because layouts differ.

namespace gsnav::interop {

/// [N][3] points, one per row: the layout of View<Vec3<S>>.
template <class S>
using EigenPoints = Eigen::Matrix<S, Eigen::Dynamic, 3, Eigen::RowMajor>;
/// [H][W] image, top row first.
template <class S>
using EigenImage = Eigen::Matrix<S, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
/// One channel of an [H][W][C] image.
template <class S>
using EigenChannelMap =
    Eigen::Map<const EigenImage<S>, Eigen::Unaligned, Eigen::Stride<Eigen::Dynamic, Eigen::Dynamic>>;

// ---- zero copy: gsnav's memory as Eigen

/// Eigen map of a vector.
template <class S>
Eigen::Map<Eigen::Matrix<S, 3, 1>> as_eigen(Vec3<S>& v) noexcept {
  return Eigen::Map<Eigen::Matrix<S, 3, 1>>(&v.x);
}
/// Read-only Eigen map of a vector.
template <class S>
Eigen::Map<const Eigen::Matrix<S, 3, 1>> as_eigen(const Vec3<S>& v) noexcept {
  return Eigen::Map<const Eigen::Matrix<S, 3, 1>>(&v.x);
}
/// Deleted: a map of a temporary would dangle.
template <class S>
void as_eigen(const Vec3<S>&& v) = delete;

/// Eigen map of a matrix.
template <class S>
Eigen::Map<Eigen::Matrix<S, 3, 3, Eigen::RowMajor>> as_eigen(Mat3<S>& m) noexcept {
  return Eigen::Map<Eigen::Matrix<S, 3, 3, Eigen::RowMajor>>(&m.row[0].x);
}
/// Read-only Eigen map of a matrix.
template <class S>
Eigen::Map<const Eigen::Matrix<S, 3, 3, Eigen::RowMajor>> as_eigen(const Mat3<S>& m) noexcept {
  return Eigen::Map<const Eigen::Matrix<S, 3, 3, Eigen::RowMajor>>(&m.row[0].x);
}
/// Deleted: a map of a temporary would dangle.
template <class S>
void as_eigen(const Mat3<S>&& m) = delete;

/// Eigen map of N points, [N][3].
template <class S>
Eigen::Map<EigenPoints<S>> as_eigen(View<Vec3<S>> points) noexcept {
  return {reinterpret_cast<S*>(points.data), static_cast<Eigen::Index>(points.size), 3};
}
/// Read-only Eigen map of N points, [N][3].
template <class S>
Eigen::Map<const EigenPoints<S>> as_eigen(View<const Vec3<S>> points) noexcept {
  return {reinterpret_cast<const S*>(points.data), static_cast<Eigen::Index>(points.size), 3};
}

/// Eigen map of an array of numbers, as a column vector.
template <class S>
requires std::is_arithmetic_v<S>
auto as_eigen(View<S> values) noexcept {
  using Column = Eigen::Matrix<std::remove_const_t<S>, Eigen::Dynamic, 1>;
  using Mapped = std::conditional_t<std::is_const_v<S>, const Column, Column>;
  return Eigen::Map<Mapped>(values.data, static_cast<Eigen::Index>(values.size));
}

/// Eigen map of an image [H][W], for instance one camera of Frames::median_depth. `pixels` holds height
/// * width values.
template <class S>
requires std::is_arithmetic_v<S>
auto as_eigen(View<S> pixels, std::size_t height, std::size_t width) noexcept {
  assert(pixels.size == height * width);
  using Image = EigenImage<std::remove_const_t<S>>;
  using Mapped = std::conditional_t<std::is_const_v<S>, const Image, Image>;
  return Eigen::Map<Mapped>(pixels.data, static_cast<Eigen::Index>(height),
                            static_cast<Eigen::Index>(width));
}

/// Eigen map of channel c of an image [H][W][channels], for instance red of Frames::rgb.
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

/// View of the points in an Eigen matrix, without a copy. The matrix must be N x 3 row-major or 3 x N
/// column-major (Eigen's default); others do not compile.
template <class Derived>
View<Vec3<typename Derived::Scalar>> as_view(Eigen::PlainObjectBase<Derived>& m) noexcept {
  static_assert(detail::points_lie_together<Derived>,
                "points must lie together: N x 3 RowMajor or 3 x N");
  return {reinterpret_cast<Vec3<typename Derived::Scalar>*>(m.data()),
          static_cast<std::size_t>(m.size() / 3)};
}
/// Read-only view of the points in an Eigen matrix, of the layouts above.
template <class Derived>
View<const Vec3<typename Derived::Scalar>> as_view(const Eigen::PlainObjectBase<Derived>& m) noexcept {
  static_assert(detail::points_lie_together<Derived>,
                "points must lie together: N x 3 RowMajor or 3 x N");
  return {reinterpret_cast<const Vec3<typename Derived::Scalar>*>(m.data()),
          static_cast<std::size_t>(m.size() / 3)};
}
/// Deleted: a view of a temporary would dangle.
template <class Derived>
void as_view(const Eigen::PlainObjectBase<Derived>&& m) = delete;

// ---- copies

/// Copies a vector to Eigen.
template <class S>
Eigen::Matrix<S, 3, 1> to_eigen(const Vec3<S>& v) {
  return {v.x, v.y, v.z};
}
/// Copies a matrix to Eigen.
template <class S>
Eigen::Matrix<S, 3, 3> to_eigen(const Mat3<S>& m) {
  return as_eigen(m);
}
/// Copies a quaternion to Eigen. gsnav stores w x y z, Eigen x y z w.
template <class S>
Eigen::Quaternion<S> to_eigen(const Quat<S>& q) {
  return Eigen::Quaternion<S>(q.w, q.x, q.y, q.z);
}
/// Copies an affine map to Eigen.
template <class S>
Eigen::Transform<S, 3, Eigen::Affine> to_eigen(const Affine3<S>& a) {
  Eigen::Transform<S, 3, Eigen::Affine> t = Eigen::Transform<S, 3, Eigen::Affine>::Identity();
  t.linear() = as_eigen(a.linear);
  t.translation() = as_eigen(a.translation);
  return t;
}
/// Copies a rigid map to Eigen. The linear part must be a rotation.
template <class S>
Eigen::Transform<S, 3, Eigen::Isometry> to_isometry(const Affine3<S>& a) {
  Eigen::Transform<S, 3, Eigen::Isometry> t = Eigen::Transform<S, 3, Eigen::Isometry>::Identity();
  t.linear() = as_eigen(a.linear);
  t.translation() = as_eigen(a.translation);
  return t;
}
/// Copies a similarity to Eigen, as an affine map.
inline Eigen::Affine3d to_eigen(const Similarity& s) { return to_eigen(affine_from(s)); }

/// Copies an Eigen 3-vector or 3 x 3 matrix to a Vec3 or Mat3.
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
/// Copies an Eigen quaternion to a Quat.
template <class Derived>
Quat<typename Derived::Scalar> from_eigen(const Eigen::QuaternionBase<Derived>& q) {
  return {q.w(), q.x(), q.y(), q.z()};
}
/// Copies an affine Eigen transform to an Affine3.
template <class S, int Mode, int Options>
Affine3<S> from_eigen(const Eigen::Transform<S, 3, Mode, Options>& t) {
  static_assert(Mode != Eigen::Projective, "a projective map is not affine");
  return {from_eigen(t.linear().eval()), from_eigen(t.translation().eval())};
}
/// Similarity of a transform that only rotates, scales uniformly and translates.
/// @return invalid_argument for any other transform.
template <int Mode, int Options>
Result<Similarity> similarity_from(const Eigen::Transform<double, 3, Mode, Options>& t) {
  return similarity_from(from_eigen(t));
}

/// Camera::viewmat from a world-to-camera transform with the given camera axes.
template <int Mode, int Options>
Affine3<double> viewmat_from(const Eigen::Transform<double, 3, Mode, Options>& view, CameraAxes axes) {
  return view_with_axes(from_eigen(view), axes);
}

}  // namespace gsnav::interop
