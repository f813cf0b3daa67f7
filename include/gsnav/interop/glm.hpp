// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>

#include "gsnav/core/view.hpp"
#include "gsnav/detail/interop/conventions.hpp"

// GLM over gsnav's arrays and the other way. `as_` functions copy nothing: what they return points into
// their argument and lives no longer. `to_` and `from_` functions copy, because GLM's matrices are
// stored by columns and the order of its quaternions depends on a macro.

namespace gsnav::interop {

/// GLM's vector of three.
template <class S>
using GlmVec3 = glm::vec<3, S, glm::defaultp>;
/// GLM's 3 x 3 matrix.
template <class S>
using GlmMat3 = glm::mat<3, 3, S, glm::defaultp>;
/// GLM's 4 x 4 matrix.
template <class S>
using GlmMat4 = glm::mat<4, 4, S, glm::defaultp>;
/// GLM's quaternion.
template <class S>
using GlmQuat = glm::qua<S, glm::defaultp>;

static_assert(sizeof(GlmVec3<float>) == sizeof(Vec3f) && sizeof(GlmVec3<double>) == sizeof(Vec3d),
              "GLM's default types must be packed (no GLM_FORCE_DEFAULT_ALIGNED_GENTYPES)");

// ---- zero copy

/// Views it as a GLM type, without a copy.
template <class S>
GlmVec3<S>& as_glm(Vec3<S>& v) noexcept {
  return reinterpret_cast<GlmVec3<S>&>(v);
}
/// Views it as a GLM type, without a copy.
template <class S>
const GlmVec3<S>& as_glm(const Vec3<S>& v) noexcept {
  return reinterpret_cast<const GlmVec3<S>&>(v);
}
template <class S>
void as_glm(const Vec3<S>&& v) = delete;
/// First of an array of `points.size` GLM vectors.
template <class S>
GlmVec3<S>* as_glm(View<Vec3<S>> points) noexcept {
  return reinterpret_cast<GlmVec3<S>*>(points.data);
}
template <class S>
const GlmVec3<S>* as_glm(View<const Vec3<S>> points) noexcept {
  return reinterpret_cast<const GlmVec3<S>*>(points.data);
}

/// View of n GLM vectors.
template <class S>
View<Vec3<S>> as_view(GlmVec3<S>* points, std::size_t n) noexcept {
  return {reinterpret_cast<Vec3<S>*>(points), n};
}
template <class S>
View<const Vec3<S>> as_view(const GlmVec3<S>* points, std::size_t n) noexcept {
  return {reinterpret_cast<const Vec3<S>*>(points), n};
}

// ---- copies

/// Copies it to a GLM type.
template <class S>
GlmVec3<S> to_glm(const Vec3<S>& v) noexcept {
  return {v.x, v.y, v.z};
}
/// Copies it from a GLM type.
template <class S>
Vec3<S> from_glm(const GlmVec3<S>& v) noexcept {
  return {v.x, v.y, v.z};
}

/// Copies it to a GLM type, whose columns come first.
template <class S>
GlmMat3<S> to_glm(const Mat3<S>& m) noexcept {
  return {to_glm(m.column(0)), to_glm(m.column(1)), to_glm(m.column(2))};
}
/// Copies it from a GLM type.
template <class S>
Mat3<S> from_glm(const GlmMat3<S>& m) noexcept {
  return transpose(Mat3<S>{{from_glm(m[0]), from_glm(m[1]), from_glm(m[2])}});
}

/// Copies it to a GLM type.
template <class S>
GlmQuat<S> to_glm(const Quat<S>& q) noexcept {
  GlmQuat<S> r;  // by name: the order of the constructor's arguments depends on the version
  r.w = q.w, r.x = q.x, r.y = q.y, r.z = q.z;
  return r;
}
/// Copies it from a GLM type.
template <class S>
Quat<S> from_glm(const GlmQuat<S>& q) noexcept {
  return {q.w, q.x, q.y, q.z};
}

/// Copies it to a GLM matrix with a last row of 0, 0, 0, 1.
template <class S>
GlmMat4<S> to_glm(const Affine3<S>& a) noexcept {
  GlmMat4<S> m(to_glm(a.linear));
  m[3] = {to_glm(a.translation), S(1)};
  return m;
}
/// The affine map of a 4x4 matrix whose last row is 0 0 0 1 (which is not looked at).
template <class S>
Affine3<S> from_glm(const GlmMat4<S>& m) noexcept {
  return {from_glm(GlmMat3<S>(m)), from_glm(GlmVec3<S>(m[3]))};
}

/// Copies it to a GLM matrix with a last row of 0, 0, 0, 1.
inline glm::dmat4 to_glm(const Similarity& s) noexcept { return to_glm(affine_from(s)); }
/// Where an asset stands, from a model matrix that rotates, scales evenly and translates; an error where
/// it does anything else.
template <class S>
Result<Similarity> similarity_from(const GlmMat4<S>& model) {
  return similarity_from(affine_cast<double>(from_glm(model)));
}

// ---- cameras

/// A camera's viewmat from a view matrix; glm::lookAt makes OpenGL's axes.
template <class S>
Affine3<double> viewmat_from(const GlmMat4<S>& view, CameraAxes axes = CameraAxes::opengl) noexcept {
  return view_with_axes(affine_cast<double>(from_glm(view)), axes);
}
/// The view matrix of a camera, to draw something else from the same place.
inline glm::dmat4 view_to_glm(const Camera& camera, CameraAxes axes = CameraAxes::opengl) noexcept {
  return to_glm(view_with_axes(camera.viewmat, axes));
}

/// The camera of an OpenGL view and perspective projection (glm::lookAt and glm::perspective or
/// glm::frustum), for a viewport of w x h pixels whose row 0 is the top. The near plane stays gsnav's
/// default. Errors (invalid_argument): the projection is no perspective, or is skewed.
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
