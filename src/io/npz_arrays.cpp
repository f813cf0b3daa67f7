// SPDX-License-Identifier: Apache-2.0
#include "npz_arrays.hpp"

#include <cmath>

namespace gsnav::io::detail {
namespace {

/// A shape without dimensions of 1 at its beginning and end.
std::vector<std::size_t> core(std::vector<std::size_t> shape) {
  while (!shape.empty() && shape.back() == 1) shape.pop_back();
  while (!shape.empty() && shape.front() == 1) shape.erase(shape.begin());
  return shape;
}

bool fits(const std::vector<std::size_t>& have, const std::vector<std::size_t>& want) {
  if (have.size() != want.size()) return false;
  for (std::size_t k = 0; k < have.size(); ++k) {
    if (want[k] != NpzArrays::kAny && want[k] != have[k]) return false;
  }
  return true;
}

}  // namespace

std::string shape_text(const std::vector<std::size_t>& shape) {
  std::string out = "[";
  for (std::size_t k = 0; k < shape.size(); ++k) {
    if (k != 0) out += ", ";
    out += shape[k] == NpzArrays::kAny ? std::string("any") : std::to_string(shape[k]);
  }
  return out + "]";
}

Result<NpyArray> NpzArrays::read(const std::string& name, const std::vector<std::size_t>& shape) const {
  auto a = file_.read(name);
  if (!a) return a;
  const std::string what = file_.source() + ": " + name;
  if (!shape.empty() && !fits(a->shape, shape) && !fits(core(a->shape), core(shape))) {
    return {Errc::invalid_file,
            what + " has the shape " + shape_text(a->shape) + ", must be " + shape_text(shape)};
  }
  for (std::size_t i = 0; i < a->values.size(); ++i) {
    if (!std::isfinite(a->values[i])) {
      const std::size_t row = a->shape.empty() ? 1 : a->values.size() / a->shape[0];
      return {Errc::invalid_file,
              what + ": row " + std::to_string(i / row) + " has " + std::to_string(a->values[i])};
    }
  }
  return a;
}

Result<double> NpzArrays::number(const std::string& name) const {
  const auto a = read(name, {1});
  if (!a) return a.status();
  return a->values[0];
}

bool is_rigid(const Affine3<double>& m) {
  return determinant(m.linear) > 0 && is_finite(m.translation) &&
         distance_from_orthogonal(m.linear) < kRigidTolerance;
}

bool rigid_transform(const double* m, Affine3<double>& out) {
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) out.linear(i, k) = m[4 * i + k];
    out.translation[i] = m[4 * i + 3];
  }
  bool ok = is_rigid(out);
  for (int i = 0; i < 3; ++i) ok = ok && std::fabs(m[12 + i]) < kRigidTolerance;
  return ok && std::fabs(m[15] - 1.0) < kRigidTolerance;
}

Result<std::vector<Affine3<double>>> read_transforms(const NpzArrays& arrays, const std::string& name) {
  const auto a = arrays.read(name, {});
  if (!a) return a.status();
  const std::vector<std::size_t>& s = a->shape;
  std::size_t joints = 0;
  if (s.size() == 2 && s[1] == 16) joints = s[0];
  if (s.size() == 3 && s[1] == 4 && s[2] == 4) joints = s[0];
  if (s.size() == 4 && s[0] == 1 && s[2] == 4 && s[3] == 4) joints = s[1];
  const std::string what = arrays.file().source() + ": " + name;
  if (joints == 0) {
    return {Errc::invalid_file,
            what + " has the shape " + shape_text(s) + ", must be [J, 4, 4], [1, J, 4, 4] or [J, 16]"};
  }
  std::vector<Affine3<double>> out(joints);
  for (std::size_t j = 0; j < joints; ++j) {
    if (!rigid_transform(&a->values[16 * j], out[j])) {
      return {Errc::invalid_file, what + ": the matrix of joint " + std::to_string(j) + " is not rigid"};
    }
  }
  return out;
}

}  // namespace gsnav::io::detail
