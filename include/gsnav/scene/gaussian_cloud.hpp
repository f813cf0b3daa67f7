// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "gsnav/core/status.hpp"
#include "gsnav/detail/core/huge_pages.hpp"
#include "gsnav/detail/math/curves.hpp"
#include "gsnav/detail/math/half.hpp"
#include "gsnav/detail/scene/load_report.hpp"
#include "gsnav/detail/scene/origin_lattice.hpp"
#include "gsnav/frame/gaussians.hpp"
#include "gsnav/frame/rules.hpp"
#include "gsnav/math/functions.hpp"
#include "gsnav/math/quat.hpp"

namespace gsnav {

/// One Gaussian as files store it, before any activation.
struct RawGaussian {
  Vec3d mean{};                ///< Metres, asset frame.
  Quatd quat{};                ///< w, x, y, z, of any length.
  Vec3d log_scales{};          ///< Natural logarithms of the standard deviations.
  double opacity_logit = 0;    ///< opacity = 1 / (1 + exp(-logit)); infinities are allowed.
  std::array<float, 3> sh0{};  ///< SH coefficients of degree 0, RGB.
  const float* shN = nullptr;  ///< [(degree+1)^2 - 1][3], colour inner; null for degree 0.
};

/// N Gaussians in host memory, ready for kernels: linear scales, opacities after the sigmoid, unit
/// quaternions. Positions are float32 offsets from origins on a 64 m lattice.
struct GaussianCloud {
  std::array<std::vector<float>, 3> means;   ///< [N] each: x, y, z offsets from the origin, metres.
  std::array<std::vector<float>, 4> quats;   ///< [N] each: w, x, y, z of unit quaternions.
  std::array<std::vector<float>, 3> scales;  ///< [N] each: standard deviations, metres.
  std::vector<float> opacities;              ///< [N] in [0, 1].
  std::vector<float> sh0;                    ///< [N][3] SH coefficients of degree 0.
  std::vector<float> shN;                 ///< [N][(degree+1)^2 - 1][3] higher SH coefficients; empty if
                                          ///< shN_half has them.
  std::vector<std::uint16_t> shN_half;    ///< The same as binary16 (compact_sh), or empty.
  int sh_degree = 0;                      ///< 0 to 3.
  std::vector<std::uint32_t> origin_ids;  ///< [N] index of each origin. Empty while every origin is
                                          ///< zero.
  std::vector<Vec3d> origins;             ///< Lattice points in use. Empty if origin_ids is empty.
  // Filled by sort_spatially (detail/scene/spatial_order.hpp). Clear chunk_bounds and part_bounds after
  // moving, adding or scaling rows.
  std::vector<std::uint32_t> row_ids;     ///< [N] place of each row in the order of reading, or empty.
  std::vector<ChunkBounds> chunk_bounds;  ///< [ceil(N / kProjectChunk)], or empty.
  std::vector<ChunkBounds> part_bounds;   ///< [ceil(N / kChunkPart)], or empty. bound_chunks computes
                                          ///< both.

  // How the asset was trained. Copied into each GaussianSet that is made of the cloud.
  Filter filter = Filter::classic;               ///< Filter on the image.
  float eps2d = 0.3f;                            ///< Term on the diagonal of the 2D covariance, px^2.
  SortOrder sort_order = SortOrder::z_depth;     ///< Order in which Gaussians are blended.
  ColorSpace color_space = ColorSpace::display;  ///< Space in which colours are blended.

  std::size_t size() const noexcept { return opacities.size(); }  ///< Number of Gaussians, N.
  /// True if the coefficients above degree 0 are halves (compact_sh).
  bool compact() const noexcept { return !shN_half.empty(); }

  /// Mean of Gaussian i in the asset's frame, metres.
  Vec3d mean(std::size_t i) const noexcept {
    return origin_of(view_of(origin_ids), view_of(origins), i) +
           Vec3d{means[0][i], means[1][i], means[2][i]};
  }
  /// Rotation of Gaussian i as it is stored, in double.
  Quatd quat(std::size_t i) const noexcept {
    return {quats[0][i], quats[1][i], quats[2][i], quats[3][i]};
  }
  /// Sets the rotation of Gaussian i, rounded to float32. `q` must be a unit quaternion.
  void set_quat(std::size_t i, const Quatd& q) noexcept {
    const double parts[] = {q.w, q.x, q.y, q.z};
    for (std::size_t k = 0; k < 4; ++k) quats[k][i] = static_cast<float>(parts[k]);
  }

  /// Bytes of the arrays.
  std::size_t bytes() const noexcept {
    return sizeof(float) * (11 * size() + sh0.size() + shN.size()) +
           sizeof(std::uint16_t) * shN_half.size() +
           sizeof(std::uint32_t) * (origin_ids.size() + row_ids.size()) +
           sizeof(Vec3d) * origins.size() +
           sizeof(ChunkBounds) * (chunk_bounds.size() + part_bounds.size());
  }

  /// Views of the arrays for kernels. Valid while the cloud lives and does not grow.
  GaussianRows view() const& noexcept {
    GaussianRows v;
    v.shape.size = size();
    v.shape.means = planes_of(means);
    v.shape.quats = planes_of(quats);
    v.shape.scales = planes_of(scales);
    v.shape.opacities = view_of(opacities);
    v.shape.origin_ids = view_of(origin_ids);
    v.color.degree = sh_degree;
    v.color.sh0 = view_of(sh0);
    v.color.shN = view_of(shN);
    v.color.shN_half = view_of(shN_half);
    v.origins = view_of(origins);
    v.row_ids = view_of(row_ids);
    v.chunk_bounds = view_of(chunk_bounds);
    v.part_bounds = view_of(part_bounds);
    return v;
  }

  /// Deleted: the view would point into a temporary.
  GaussianRows view() const&& = delete;

  /// The cloud placed in the world, with views of its arrays. Valid while the cloud lives and does not
  /// grow.
  GaussianSet set(const Similarity& world_from_asset = {}) const& noexcept {
    return {view(), world_from_asset, filter, eps2d, color_space};
  }
  /// Deleted: the set would point into a temporary.
  GaussianSet set(const Similarity& world_from_asset = {}) const&& = delete;
};

/// A Gaussian after the activations.
struct ActiveGaussian {
  Vec3d mean{};                   ///< Metres, asset frame.
  std::array<float, 4> quat{};    ///< w, x, y, z, unit.
  std::array<float, 3> scales{};  ///< Standard deviations, metres.
  float opacity = 0;              ///< In [0, 1].
  bool clamped = false;           ///< Whether a log-scale was outside [-20, 20].
};

/// Activates a raw Gaussian with `rest` numbers in shN, by the rules of the contract. The result says
/// whether the row is kept, or why it is dropped:
///
/// - A row with NaN anywhere, or an infinite position or SH coefficient, is dropped.
/// - Quaternions are normalised (largest component first); a zero or non-finite one drops the row.
/// - Opacities go through the sigmoid; a row below 1/255, which is never drawn, is dropped.
/// - Log-scales are clamped to [-20, 20], except minus infinity, which stands for a flat axis.
inline RowFate activate(const RawGaussian& raw, std::size_t rest, ActiveGaussian& out) noexcept {
  bool finite = is_finite(raw.mean) && !std::isnan(raw.opacity_logit);
  for (int k = 0; k < 3; ++k) {
    finite = finite && !std::isnan(raw.log_scales[k]) && is_finite(raw.sh0[static_cast<std::size_t>(k)]);
  }
  for (std::size_t k = 0; k < rest; ++k) finite = finite && is_finite(raw.shN[k]);
  if (!finite) return RowFate::non_finite;
  Quatd quat = raw.quat;
  if (!normalize(quat)) return RowFate::zero_quat;
  out.opacity = static_cast<float>(sigmoid(raw.opacity_logit));
  if (out.opacity < static_cast<float>(kAlphaMin)) return RowFate::transparent;
  out.clamped = false;
  for (int k = 0; k < 3; ++k) {
    const double s = raw.log_scales[k];
    const double limited = std::isinf(s) && s < 0 ? s : clamp(s, -20.0, 20.0);
    out.clamped = out.clamped || limited != s;
    out.scales[static_cast<std::size_t>(k)] = static_cast<float>(std::exp(limited));
  }
  out.mean = raw.mean;
  out.quat = {static_cast<float>(quat.w), static_cast<float>(quat.x), static_cast<float>(quat.y),
              static_cast<float>(quat.z)};
  return RowFate::kept;
}

/// Appends means to the planes of a cloud, splitting them into origins and offsets.
class MeanWriter {
 public:
  /// Appends `mean` (metres, asset frame) to means, origin_ids and origins of the cloud.
  void push(GaussianCloud& cloud, const Vec3d& mean) {
    const std::uint32_t id = lattice_.id_of(mean);
    if (id != 0 && cloud.origins.empty()) {  // the first Gaussian away from zero
      cloud.origin_ids.assign(cloud.means[0].size(), 0);
      cloud.origins.push_back({});
    }
    if (!cloud.origins.empty()) {
      if (id >= cloud.origins.size()) cloud.origins.push_back(lattice_.origins()[id]);
      cloud.origin_ids.push_back(id);
    }
    const Vec3d offset = mean - lattice_.origins()[id];
    for (std::size_t k = 0; k < 3; ++k) {
      cloud.means[k].push_back(static_cast<float>(offset[static_cast<int>(k)]));
    }
  }

 private:
  OriginLattice lattice_;
};

/// Builds a GaussianCloud from raw Gaussians by the rules of activate(), and counts every repaired and
/// dropped row.
class GaussianCloudBuilder {
 public:
  /// @param sh_degree degree of every added Gaussian, in [0, 3].
  /// @param source for the report and messages.
  explicit GaussianCloudBuilder(int sh_degree, std::string source = {}) {
    cloud_.sh_degree = report_.sh_degree = sh_degree;
    report_.source = std::move(source);
    rest_ = 3 * static_cast<std::size_t>(sh_coefficient_count(sh_degree) - 1);
  }

  /// Reserves memory for n Gaussians.
  void reserve(std::size_t n) {
    for (auto& p : cloud_.means) p.reserve(n);
    for (auto& p : cloud_.quats) p.reserve(n);
    for (auto& p : cloud_.scales) p.reserve(n);
    cloud_.opacities.reserve(n);
    cloud_.sh0.reserve(3 * n);
    cloud_.shN.reserve(rest_ * n);
  }

  /// Adds one Gaussian, or counts why it was dropped. Returns whether it was kept.
  bool add(const RawGaussian& raw) {
    ActiveGaussian g;
    const RowFate fate = activate(raw, rest_, g);
    report_.count(fate, g.clamped);
    if (fate != RowFate::kept) return false;
    means_.push(cloud_, g.mean);
    for (std::size_t k = 0; k < 4; ++k) cloud_.quats[k].push_back(g.quat[k]);
    for (std::size_t k = 0; k < 3; ++k) cloud_.scales[k].push_back(g.scales[k]);
    cloud_.opacities.push_back(g.opacity);
    for (const float value : raw.sh0) cloud_.sh0.push_back(value);
    for (std::size_t k = 0; k < rest_; ++k) cloud_.shN.push_back(raw.shN[k]);
    report_.bounds.add(raw.mean);
    return true;
  }

  LoadReport& report() noexcept { return report_; }   ///< The report of all rows so far.
  GaussianCloud& cloud() noexcept { return cloud_; }  ///< The cloud so far.

 private:
  GaussianCloud cloud_;
  LoadReport report_;
  std::size_t rest_ = 0;
  MeanWriter means_;
};

/// The largest change of a coefficient by storing shN as binary16.
inline double half_sh_error(const GaussianCloud& cloud) noexcept {
  float error = 0;
  for (const float v : cloud.shN) error = max(error, abs(half_to_float(half_of_float(v)) - v));
  return static_cast<double>(error);
}

/// Stores shN as binary16, which halves its memory; such a cloud can be rendered. Returns half_sh_error.
inline double compact_sh(GaussianCloud& cloud) {
  const double error = half_sh_error(cloud);
  if (cloud.shN.empty()) return error;
  cloud.shN_half = moved_through<std::uint16_t>(cloud.shN, cloud.shN.size(),
                                                [](float v) { return half_of_float(v); });
  return error;
}

/// Undoes compact_sh, except for the rounding.
inline void expand_sh(GaussianCloud& cloud) {
  if (!cloud.compact()) return;
  cloud.shN = moved_through<float>(cloud.shN_half, cloud.shN_half.size(),
                                   [](std::uint16_t v) { return half_to_float(v); });
}

/// A cloud and the report of how it was read.
struct LoadedCloud {
  GaussianCloud cloud;  ///< The cloud.
  LoadReport report;    ///< What reading found, changed and left out.
};

/// Appends `b` to `a`, for example to merge the tiles of a scene. The SH degree becomes the larger of
/// the two, with zeros for missing bands. Chunk bounds are dropped, so sort again. If `a` is empty it
/// becomes `b`. On an error `a` is unchanged: invalid_argument if filters, sort orders or colour spaces
/// differ, or if one cloud is compact (expand_sh).
inline Status append(GaussianCloud& a, const GaussianCloud& b) {
  if (a.compact() || b.compact()) {
    return {Errc::invalid_argument, "compact clouds cannot be merged: expand_sh first"};
  }
  if (a.size() == 0) {
    a = GaussianCloud(b);
    return {};
  }
  if (a.filter != b.filter || a.eps2d != b.eps2d || a.sort_order != b.sort_order ||
      a.color_space != b.color_space) {
    return {Errc::invalid_argument,
            "clouds with different filters, sort orders or colour spaces cannot be merged"};
  }
  // A range insertion takes longer to compile, in each file that includes this.
  const auto join = [](auto& to, const auto& from) {
    std::size_t at = to.size();
    to.resize(at + from.size());
    for (const auto& value : from) to[at++] = value;
  };
  const int degree = max(a.sh_degree, b.sh_degree);
  const auto widen = [degree](const GaussianCloud& c) {
    const std::size_t from = 3 * static_cast<std::size_t>(sh_coefficient_count(c.sh_degree) - 1);
    const std::size_t to = 3 * static_cast<std::size_t>(sh_coefficient_count(degree) - 1);
    if (from == to) return c.shN;
    std::vector<float> out(c.size() * to, 0.0f);
    for (std::size_t i = 0; i < c.size(); ++i) {
      for (std::size_t k = 0; k < from; ++k) out[i * to + k] = c.shN[i * from + k];
    }
    return out;
  };
  std::vector<float> rest = widen(b);
  if (a.sh_degree != degree) a.shN = widen(a);
  a.sh_degree = degree;
  join(a.shN, rest);
  if (!a.origins.empty() || !b.origins.empty()) {
    if (a.origins.empty()) {
      a.origins.push_back({});
      a.origin_ids.assign(a.size(), 0);
    }
    const std::uint32_t shift = static_cast<std::uint32_t>(a.origins.size());
    if (b.origins.empty()) {
      a.origins.push_back({});
      a.origin_ids.resize(a.origin_ids.size() + b.size(), shift);
    } else {
      join(a.origins, b.origins);
      for (const std::uint32_t id : b.origin_ids) a.origin_ids.push_back(shift + id);
    }
  }
  a.chunk_bounds.clear();
  a.part_bounds.clear();
  if (!a.row_ids.empty() || !b.row_ids.empty()) {
    const auto ids = [](const GaussianCloud& c) {
      std::vector<std::uint32_t> out = c.row_ids;
      for (std::size_t i = out.size(); i < c.size(); ++i) out.push_back(static_cast<std::uint32_t>(i));
      return out;
    };
    const std::uint32_t shift = static_cast<std::uint32_t>(a.size());
    a.row_ids = ids(a);
    for (const std::uint32_t id : ids(b)) a.row_ids.push_back(shift + id);
  }
  for (std::size_t k = 0; k < 3; ++k) join(a.means[k], b.means[k]);
  for (std::size_t k = 0; k < 4; ++k) join(a.quats[k], b.quats[k]);
  for (std::size_t k = 0; k < 3; ++k) join(a.scales[k], b.scales[k]);
  join(a.opacities, b.opacities);
  join(a.sh0, b.sh0);
  return {};
}

}  // namespace gsnav
