// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <type_traits>

#include "gsnav/core/status.hpp"
#include "gsnav/image/camera.hpp"
#include "gsnav/math/similarity.hpp"

// Shared parts of the interop headers: memory layouts, camera axes, decomposition of matrices.

namespace gsnav::interop {

namespace detail {
/// True if T consists of N values of type S without gaps, so that matrices of other libraries can be
/// mapped onto it.
template <class T, class S, int N>
inline constexpr bool is_packed =
    sizeof(T) == N * sizeof(S) &&
    alignof(T) == alignof(S) && std::is_standard_layout_v<T>&& std::is_trivially_copyable_v<T>;
static_assert(is_packed<Vec3f, float, 3> && is_packed<Vec3d, double, 3>);
static_assert(is_packed<Mat3f, float, 9> && is_packed<Mat3d, double, 9>);
static_assert(is_packed<Quatf, float, 4> && is_packed<Quatd, double, 4>);
}  // namespace detail

/// Axes of a camera's own frame.
enum class CameraAxes {
  opencv,  ///< x right, y down, z forward: gsnav's axes
  opengl,  ///< x right, y up, -z forward: OpenGL, glm::lookAt, Habitat
};

/// Converts a world-to-camera map from the given camera axes to OpenCV axes, or back. Turning a camera
/// half round its x axis is its own inverse.
template <class S>
Affine3<S> view_with_axes(const Affine3<S>& view, CameraAxes axes) noexcept {
  if (axes == CameraAxes::opencv) return view;
  const Mat3<S>& m = view.linear;
  const Vec3<S>& t = view.translation;
  return {{{m.row[0], -m.row[1], -m.row[2]}}, {t.x, -t.y, -t.z}};
}

/// Decomposes an affine map into a similarity.
/// @return invalid_argument if the map is not finite, mirrors, or shears or scales unevenly by more than
///   `tolerance` (relative).
inline Result<Similarity> similarity_from(const Affine3<double>& a, double tolerance = 1e-4) {
  const BadArgument bad{"not a similarity: the map "};
  const double volume = determinant(a.linear);
  if (!is_finite(volume) || !is_finite(a.translation)) return bad("is not finite");
  if (!(volume > 0)) return bad("mirrors or flattens");
  const double scale = std::cbrt(volume);
  const Mat3d rotation = a.linear * (1.0 / scale);
  if (!(distance_from_orthogonal(rotation) <= tolerance)) return bad("shears or scales unevenly");
  return Similarity{quat_from_matrix(rotation), a.translation, scale};
}

/// Affine map of a similarity.
inline Affine3<double> affine_from(const Similarity& s) noexcept {
  return {rotation_matrix(s.rotation) * s.scale, s.translation};
}

}  // namespace gsnav::interop
