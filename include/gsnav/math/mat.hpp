// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>

#include "gsnav/math/vec.hpp"

namespace gsnav {

/// 3x3 matrix in row-major order: `m(i, j)` is row i, column j. Vectors are columns: y = M x.
template <class L>
struct Mat3 {
  Vec3<L> row[3]{};  ///< the three rows

  /// Element in row i, column j.
  GSNAV_HD constexpr L& operator()(int i, int j) noexcept { return row[i][j]; }
  /// Element in row i, column j, read-only.
  GSNAV_HD constexpr const L& operator()(int i, int j) const noexcept { return row[i][j]; }

  /// The identity matrix.
  GSNAV_HD static constexpr Mat3 identity() noexcept {
    return {{{L(1), L(0), L(0)}, {L(0), L(1), L(0)}, {L(0), L(0), L(1)}}};
  }
  /// Column j.
  GSNAV_HD constexpr Vec3<L> column(int j) const noexcept { return {row[0][j], row[1][j], row[2][j]}; }
};

using Mat3f = Mat3<float>;   ///< 3x3 matrix of floats
using Mat3d = Mat3<double>;  ///< 3x3 matrix of doubles

/// Transposed matrix.
template <class L>
GSNAV_HD constexpr Mat3<L> transpose(const Mat3<L>& m) noexcept {
  return {{m.column(0), m.column(1), m.column(2)}};
}

/// Matrix times column vector.
template <class L>
GSNAV_HD Vec3<L> operator*(const Mat3<L>& m, const Vec3<L>& v) noexcept {
  return {dot(m.row[0], v), dot(m.row[1], v), dot(m.row[2], v)};
}

/// Matrix product.
template <class L>
GSNAV_HD Mat3<L> operator*(const Mat3<L>& a, const Mat3<L>& b) noexcept {
  const Mat3<L> bt = transpose(b);
  Mat3<L> r;
  for (int i = 0; i < 3; ++i) {
    r.row[i] = {dot(a.row[i], bt.row[0]), dot(a.row[i], bt.row[1]), dot(a.row[i], bt.row[2])};
  }
  return r;
}

/// All elements times s.
template <class L>
GSNAV_HD Mat3<L> operator*(const Mat3<L>& m, L s) noexcept {
  return {{m.row[0] * s, m.row[1] * s, m.row[2] * s}};
}

/// Sum by elements.
template <class L>
GSNAV_HD Mat3<L> operator+(const Mat3<L>& a, const Mat3<L>& b) noexcept {
  return {{a.row[0] + b.row[0], a.row[1] + b.row[1], a.row[2] + b.row[2]}};
}

/// Determinant.
template <class L>
GSNAV_HD L determinant(const Mat3<L>& m) noexcept {
  return dot(m.row[0], cross(m.row[1], m.row[2]));
}

/// Cofactor matrix: det(m) times the transposed inverse. Each element has an error of at most 1.5 ulp.
template <class L>
GSNAV_HD Mat3<L> cofactors(const Mat3<L>& m) noexcept {
  return {{cross(m.row[1], m.row[2]), cross(m.row[2], m.row[0]), cross(m.row[0], m.row[1])}};
}

/// Cofactor matrix by plain fma. The error is a rounding of m's greatest elements. That suffices for the
/// polar factor of a matrix with det > 0.1, but not for needle shapes; use cofactors() for those.
template <class L>
GSNAV_HD Mat3<L> rough_cofactors(const Mat3<L>& m) noexcept {
  return {{rough_cross(m.row[1], m.row[2]), rough_cross(m.row[2], m.row[0]),
           rough_cross(m.row[0], m.row[1])}};
}

/// Inverse matrix. Not finite if det(m) is 0.
template <class L>
GSNAV_HD Mat3<L> inverse(const Mat3<L>& m) noexcept {
  const Mat3<L> c = cofactors(m);
  return transpose(c) * (L(scalar_of<L>(1)) / dot(m.row[0], c.row[0]));
}

/// Conversion of the elements to type T.
template <class T, class U>
GSNAV_HD constexpr Mat3<T> mat_cast(const Mat3<U>& m) noexcept {
  return {{vec_cast<T>(m.row[0]), vec_cast<T>(m.row[1]), vec_cast<T>(m.row[2])}};
}

/// Largest element of m m^T - 1, which is 0 for a rotation or a reflection. Infinite unless m is finite.
inline double distance_from_orthogonal(const Mat3<double>& m) noexcept {
  const Mat3<double> gram = m * transpose(m);
  double worst = 0;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      const double off = abs(gram(i, j) - (i == j ? 1.0 : 0.0));
      if (!(off <= worst)) worst = is_finite(off) ? off : std::numeric_limits<double>::infinity();
    }
  }
  return worst;
}

/// Affine map x -> linear * x + translation: the upper three rows of a 4x4 matrix.
template <class L>
struct Affine3 {
  Mat3<L> linear = Mat3<L>::identity();  ///< linear part
  Vec3<L> translation{};                 ///< translation, in the units of x
};

/// Applies the map to the point v.
template <class L>
GSNAV_HD Vec3<L> operator*(const Affine3<L>& a, const Vec3<L>& v) noexcept {
  return a.linear * v + a.translation;
}

/// Composition of maps: b first, then a.
template <class L>
GSNAV_HD Affine3<L> operator*(const Affine3<L>& a, const Affine3<L>& b) noexcept {
  return {a.linear * b.linear, a * b.translation};
}

/// Conversion of the elements to type T.
template <class T, class U>
GSNAV_HD constexpr Affine3<T> affine_cast(const Affine3<U>& a) noexcept {
  return {mat_cast<T>(a.linear), vec_cast<T>(a.translation)};
}

/// Inverse of a rigid map. The linear part must be a rotation matrix.
template <class L>
GSNAV_HD Affine3<L> rigid_inverse(const Affine3<L>& a) noexcept {
  const Mat3<L> rt = transpose(a.linear);
  return {rt, -(rt * a.translation)};
}

}  // namespace gsnav
