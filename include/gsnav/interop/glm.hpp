// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>

#include "gsnav/core/view.hpp"
#include "gsnav/detail/interop/conventions.hpp"

// Conversions between gsnav and GLM. `as_` functions copy nothing: the result points into the argument
// and must not outlive it. `to_` and `from_` functions copy, because GLM stores matrices by columns and
// a macro decides the order of its quaternions.

namespace gsnav::interop {

/// GLM vector with three components.
template <class S>
using GlmVec3 = glm::vec<3, S, glm::defaultp>;
/// GLM 3 x 3 matrix.
template <class S>
using GlmMat3 = glm::mat<3, 3, S, glm::defaultp>;
/// GLM 4 x 4 matrix.
template <class S>
using GlmMat4 = glm::mat<4, 4, S, glm::defaultp>;
/// GLM quaternion.
template <class S>
using GlmQuat = glm::qua<S, glm::defaultp>;

static_assert(sizeof(GlmVec3<float>) == sizeof(Vec3f) && sizeof(GlmVec3<double>) == sizeof(Vec3d),
              "GLM's default types must be packed (no GLM_FORCE_DEFAULT_ALIGNED_GENTYPES)");

// ---- zero copy

/// A vector as a GLM vector.
template <class S>
GlmVec3<S>& as_glm(Vec3<S>& v) noexcept {
  return reinterpret_cast<GlmVec3<S>&>(v);
}
/// A vector as a read-only GLM vector.
template <class S>
const GlmVec3<S>& as_glm(const Vec3<S>& v) noexcept {
  return reinterpret_cast<const GlmVec3<S>&>(v);
}
/// Deleted: a reference to a temporary would dangle.
template <class S>
void as_glm(const Vec3<S>&& v) = delete;
/// Points as an array of `points.size` GLM vectors. Returns a pointer to the first.
template <class S>
GlmVec3<S>* as_glm(View<Vec3<S>> points) noexcept {
  return reinterpret_cast<GlmVec3<S>*>(points.data);
}
/// Points as a read-only array of `points.size` GLM vectors. Returns a pointer to the first.
template <class S>
const GlmVec3<S>* as_glm(View<const Vec3<S>> points) noexcept {
  return reinterpret_cast<const GlmVec3<S>*>(points.data);
}

/// View of n GLM vectors.
template <class S>
View<Vec3<S>> as_view(GlmVec3<S>* points, std::size_t n) noexcept {
  return {reinterpret_cast<Vec3<S>*>(points), n};
}
/// Read-only view of n GLM vectors.
template <class S>
View<const Vec3<S>> as_view(const GlmVec3<S>* points, std::size_t n) noexcept {
  return {reinterpret_cast<const Vec3<S>*>(points), n};
}

// ---- copies

/// Copies a vector to GLM.
template <class S>
GlmVec3<S> to_glm(const Vec3<S>& v) noexcept {
  return {v.x, v.y, v.z};
}
/// Copies a GLM vector to a Vec3.
template <class S>
Vec3<S> from_glm(const GlmVec3<S>& v) noexcept {
  return {v.x, v.y, v.z};
}

/// Copies a matrix to GLM.
template <class S>
GlmMat3<S> to_glm(const Mat3<S>& m) noexcept {
  return {to_glm(m.column(0)), to_glm(m.column(1)), to_glm(m.column(2))};
}
/// Copies a GLM matrix to a Mat3.
template <class S>
Mat3<S> from_glm(const GlmMat3<S>& m) noexcept {
  return transpose(Mat3<S>{{from_glm(m[0]), from_glm(m[1]), from_glm(m[2])}});
}

/// Copies a quaternion to GLM.
template <class S>
GlmQuat<S> to_glm(const Quat<S>& q) noexcept {
  GlmQuat<S> r;  // set by name: the order of the constructor's arguments depends on GLM's version
  r.w = q.w, r.x = q.x, r.y = q.y, r.z = q.z;
  return r;
}
/// Copies a GLM quaternion to a Quat.
template <class S>
Quat<S> from_glm(const GlmQuat<S>& q) noexcept {
  return {q.w, q.x, q.y, q.z};
}

/// Converts an affine map to a 4 x 4 matrix.
template <class S>
GlmMat4<S> to_glm(const Affine3<S>& a) noexcept {
  GlmMat4<S> m(to_glm(a.linear));
  m[3] = {to_glm(a.translation), S(1)};
  return m;
}
/// Converts a 4 x 4 matrix whose last row is 0 0 0 1 to an affine map. The last row is not checked.
template <class S>
Affine3<S> from_glm(const GlmMat4<S>& m) noexcept {
  return {from_glm(GlmMat3<S>(m)), from_glm(GlmVec3<S>(m[3]))};
}

/// Converts a similarity to a 4 x 4 matrix.
inline glm::dmat4 to_glm(const Similarity& s) noexcept { return to_glm(affine_from(s)); }
/// Similarity of a model matrix that only rotates, scales uniformly and translates.
/// @return invalid_argument for any other matrix.
template <class S>
Result<Similarity> similarity_from(const GlmMat4<S>& model) {
  return similarity_from(affine_cast<double>(from_glm(model)));
}

// ---- cameras

/// Camera::viewmat from a view matrix. glm::lookAt uses OpenGL's axes.
template <class S>
Affine3<double> viewmat_from(const GlmMat4<S>& view, CameraAxes axes = CameraAxes::opengl) noexcept {
  return view_with_axes(affine_cast<double>(from_glm(view)), axes);
}
/// View matrix of a camera, for drawing with another renderer from the same viewpoint.
inline glm::dmat4 view_to_glm(const Camera& camera, CameraAxes axes = CameraAxes::opengl) noexcept {
  return to_glm(view_with_axes(camera.viewmat, axes));
}

/// Camera of an OpenGL view and perspective projection (glm::lookAt with glm::perspective or
/// glm::frustum) for a viewport of w x h pixels. Its near plane is gsnav's default.
/// @return invalid_argument if the projection is not a right-handed perspective or is skewed.
template <class S>
Result<Camera> camera_from_opengl(const GlmMat4<S>& view, const GlmMat4<S>& projection, int w, int h) {
  const auto p = [&](int row, int column) { return static_cast<double>(projection[column][row]); };
  if (!(p(3, 2) == -1 && p(3, 3) == 0 && p(0, 0) > 0 && p(1, 1) > 0 && p(0, 1) == 0 && p(1, 0) == 0)) {
    return Status(Errc::invalid_argument,
                  "the projection is no perspective of OpenGL's right-handed kind");
  }
  Camera c;
  c.viewmat = viewmat_from(view);
  c.width = w;
  c.height = h;
  c.fx = 0.5 * w * p(0, 0);
  c.fy = 0.5 * h * p(1, 1);
  c.cx = 0.5 * w * (1 - p(0, 2));
  c.cy = 0.5 * h * (1 + p(1, 2));
  return c;
}

}  // namespace gsnav::interop
