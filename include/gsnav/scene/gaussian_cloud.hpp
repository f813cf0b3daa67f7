// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "gsnav/core/status.hpp"
#include "gsnav/detail/core/huge_pages.hpp"
#include "gsnav/detail/frame/projection_camera.hpp"
#include "gsnav/detail/math/half.hpp"
#include "gsnav/detail/scene/load_report.hpp"
#include "gsnav/frame/gaussians.hpp"

namespace gsnav {

/// One Gaussian as files store it: raw, before any activation.
struct RawGaussian {
  Vec3d mean{};                ///< metres, asset frame
  Quatd quat{};                ///< w, x, y, z, any length
  Vec3d log_scales{};          ///< natural logarithm of the standard deviations
  double opacity_logit = 0;    ///< opacity = 1 / (1 + exp(-logit)); infinities are legal
  std::array<float, 3> sh0{};  ///< Coefficients of degree 0, RGB.
  const float* shN = nullptr;  ///< [(degree+1)^2 - 1][3], colour inner; null for degree 0
};

/// N Gaussians in host memory, ready for kernels: linear scales, opacities after the sigmoid, unit
/// quaternions. Positions are float32 offsets from origins on a 64 m lattice.
struct GaussianCloud {
  std::array<std::vector<float>, 3> means;   ///< x, y, z offsets from the origin, metres, [N] each
  std::array<std::vector<float>, 4> quats;   ///< w, x, y, z, [N] each
  std::array<std::vector<float>, 3> scales;  ///< standard deviations, metres, [N] each
  std::vector<float> opacities;              ///< in [0, 1], [N]
  std::vector<float> sh0;                    ///< [N][3]
  std::vector<float> shN;                 ///< [N][(degree+1)^2 - 1][3], or empty where shN_half has them
  std::vector<std::uint16_t> shN_half;    ///< the same as binary16 (compact_sh), or empty
  int sh_degree = 0;                      ///< 0 to 3
  std::vector<std::uint32_t> origin_ids;  ///< [N], or empty while every origin is zero
  std::vector<Vec3d> origins;             ///< lattice points in use; empty with origin_ids
  // Filled by sort_spatially (detail/scene/spatial_order.hpp); whoever moves, adds or scales rows clears
  // them.
  std::vector<std::uint32_t> row_ids;     ///< place of each row as it was read, [N], or empty
  std::vector<ChunkBounds> chunk_bounds;  ///< [ceil(N / kProjectChunk)], or empty
  std::vector<ChunkBounds> part_bounds;   ///< [ceil(N / kChunkPart)], or empty; bound_chunks makes both

  // How the asset was trained; copied into each GaussianSet made of the cloud.
  Filter filter = Filter::classic;  ///< Screen-space filter that the Gaussians were trained with.
  float eps2d = 0.3f;               ///< Blur of the filter, square pixels.
  SortOrder sort_order = SortOrder::z_depth;     ///< Quantity that Gaussians are sorted by.
  ColorSpace color_space = ColorSpace::display;  ///< Space of the colours.

  /// Number of Gaussians.
  std::size_t size() const noexcept { return opacities.size(); }

  /// Mean of Gaussian i in the asset's frame, metres.
  Vec3d mean(std::size_t i) const noexcept {
    const Vec3d o = origin_ids.empty() ? Vec3d{} : origins[origin_ids[i]];
    return o + Vec3d{means[0][i], means[1][i], means[2][i]};
  }

  /// Bytes held by the arrays.
  std::size_t bytes() const noexcept {
    return sizeof(float) * (11 * size() + sh0.size() + shN.size()) +
           sizeof(std::uint16_t) * shN_half.size() +
           sizeof(std::uint32_t) * (origin_ids.size() + row_ids.size()) +
           sizeof(Vec3d) * origins.size() +
           sizeof(ChunkBounds) * (chunk_bounds.size() + part_bounds.size());
  }

  /// What kernels read; valid while the cloud lives and does not grow. A temporary has no view.
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

  GaussianRows view() const&& = delete;

  /// The cloud placed in the world. It views the cloud's arrays, as view().
  GaussianSet set(const Similarity& world_from_asset = {}) const& noexcept {
    return {view(), world_from_asset, filter, eps2d, color_space};
  }
  GaussianSet set(const Similarity& world_from_asset = {}) const&& = delete;
};

/// Spacing of the lattice that positions are stored relative to, metres.
inline constexpr double kOriginLattice = 64.0;

/// A raw Gaussian after the activations.
struct ActiveGaussian {
  Vec3d mean{};                   ///< Centre, metres.
  std::array<float, 4> quat{};    ///< w, x, y, z, unit
  std::array<float, 3> scales{};  ///< linear
  float opacity = 0;              ///< Opacity, in [0, 1].
  bool clamped = false;           ///< a log-scale was outside of [-20, 20]
};

/// Activates a raw Gaussian with `rest` numbers in shN by the contract's rules: quaternions are
/// normalised (largest component first; zero or non-finite: dropped), log-scales are clamped to
/// [-20, 20] (minus infinity is a legal flat axis), opacities go through the sigmoid, rows with NaN
/// anywhere are dropped whole, and Gaussians that can never reach 1/255 are left out.
inline RowFate activate(const RawGaussian& raw, std::size_t rest, ActiveGaussian& out) noexcept {
  bool finite = is_finite(raw.mean) && !std::isnan(raw.opacity_logit);
  for (int k = 0; k < 3; ++k) {
    finite = finite && !std::isnan(raw.log_scales[k]) && is_finite(raw.sh0[static_cast<std::size_t>(k)]);
  }
  for (std::size_t k = 0; k < rest; ++k) finite = finite && is_finite(raw.shN[k]);
  if (!finite) return RowFate::non_finite;
  Quatd quat = raw.quat;
  if (!normalize(quat)) return RowFate::zero_quat;
  out.opacity = static_cast<float>(1.0 / (1.0 + std::exp(-raw.opacity_logit)));
  if (out.opacity < 1.0f / 255.0f) return RowFate::transparent;
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

/// Numbers the lattice points that means lie nearest to, in the order in which they come; 0 is the
/// origin itself.
class OriginLattice {
 public:
  /// Number of the origin that a centre is stored from.
  std::uint32_t id_of(const Vec3d& mean) {
    Vec3d origin;
    for (int k = 0; k < 3; ++k) origin[k] = kOriginLattice * std::nearbyint(mean[k] / kOriginLattice);
    if (origin == origins_[last_]) return last_;
    return last_ = id_of_point(origin);
  }
  /// Number of an origin on the lattice.
  std::uint32_t id_of_point(const Vec3d& origin) {
    const auto [it, added] = index_.emplace(std::make_tuple(origin.x, origin.y, origin.z),
                                            static_cast<std::uint32_t>(origins_.size()));
    if (added) origins_.push_back(origin);
    return it->second;
  }
  /// [ids in use].
  const std::vector<Vec3d>& origins() const noexcept { return origins_; }

 private:
  std::vector<Vec3d> origins_{Vec3d{}};
  std::map<std::tuple<double, double, double>, std::uint32_t> index_{{{0.0, 0.0, 0.0}, 0u}};
  std::uint32_t last_ = 0;
};

/// Puts means into a cloud, from the first row to the last.
class MeanWriter {
 public:
  /// Appends a centre to the cloud.
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

/// Fills a GaussianCloud from raw Gaussians by activate()'s rules, counting every repair and drop.
class GaussianCloudBuilder {
 public:
  /// `sh_degree` in [0, 3] is what every added Gaussian carries.
  explicit GaussianCloudBuilder(int sh_degree, std::string source = {}) {
    cloud_.sh_degree = report_.sh_degree = sh_degree;
    report_.source = std::move(source);
    rest_ = 3 * static_cast<std::size_t>(sh_coefficient_count(sh_degree) - 1);
  }

  /// Makes room for n Gaussians.
  void reserve(std::size_t n) {
    for (auto& p : cloud_.means) p.reserve(n);
    for (auto& p : cloud_.quats) p.reserve(n);
    for (auto& p : cloud_.scales) p.reserve(n);
    cloud_.opacities.reserve(n);
    cloud_.sh0.reserve(3 * n);
    cloud_.shN.reserve(rest_ * n);
  }

  /// Adds one Gaussian or counts why not. Returns whether it was kept.
  bool add(const RawGaussian& raw) {
    ActiveGaussian g;
    const RowFate fate = activate(raw, rest_, g);
    report_.count(fate, g.clamped);
    if (fate != RowFate::kept) return false;
    means_.push(cloud_, g.mean);
    for (std::size_t k = 0; k < 4; ++k) cloud_.quats[k].push_back(g.quat[k]);
    for (std::size_t k = 0; k < 3; ++k) cloud_.scales[k].push_back(g.scales[k]);
    cloud_.opacities.push_back(g.opacity);
    cloud_.sh0.insert(cloud_.sh0.end(), raw.sh0.begin(), raw.sh0.end());
    if (rest_ != 0) cloud_.shN.insert(cloud_.shN.end(), raw.shN, raw.shN + rest_);
    report_.bounds.add(raw.mean);
    return true;
  }

  /// Counts so far.
  LoadReport& report() noexcept { return report_; }
  /// The cloud so far.
  GaussianCloud& cloud() noexcept { return cloud_; }

 private:
  GaussianCloud cloud_;
  LoadReport report_;
  std::size_t rest_ = 0;
  MeanWriter means_;
};

/// The largest difference of a coefficient between shN and the same as binary16.
inline double half_sh_error(const GaussianCloud& cloud) noexcept {
  float error = 0;
  for (const float v : cloud.shN) error = max(error, abs(half_to_float(half_of_float(v)) - v));
  return static_cast<double>(error);
}

/// Keeps shN as binary16, which renders in half of the memory. Returns half_sh_error.
inline double compact_sh(GaussianCloud& cloud) {
  const double error = half_sh_error(cloud);
  if (cloud.shN.empty()) return error;
  cloud.shN_half = moved_through<std::uint16_t>(cloud.shN, cloud.shN.size(),
                                                [](float v) { return half_of_float(v); });
  return error;
}

/// Undoes compact_sh but for the rounding.
inline void expand_sh(GaussianCloud& cloud) {
  if (cloud.shN_half.empty()) return;
  cloud.shN = moved_through<float>(cloud.shN_half, cloud.shN_half.size(),
                                   [](std::uint16_t v) { return half_to_float(v); });
}

/// A cloud with the report of how it was read.
struct LoadedCloud {
  GaussianCloud cloud;  ///< The Gaussians.
  LoadReport report;    ///< What the reader found, changed and left out.
};

/// Appends `b` to `a`; the SH degree becomes the larger (missing bands are zero). Used to merge the
/// tiles of one scene. Chunks lose their bounds: sort again. An empty `a` becomes `b`.
/// Errors, with `a` as it was: invalid_argument where filters, sort orders or colour spaces differ, or
/// one is compact (expand_sh).
inline Status append(GaussianCloud& a, const GaussianCloud& b) {
  if (!a.shN_half.empty() || !b.shN_half.empty()) {
    return {Errc::invalid_argument, "compact clouds cannot be merged: expand_sh first"};
  }
  if (a.size() == 0) {
    a = b;
    return {};
  }
  if (a.filter != b.filter || a.eps2d != b.eps2d || a.sort_order != b.sort_order ||
      a.color_space != b.color_space) {
    return {Errc::invalid_argument,
            "clouds with different filters, sort orders or colour spaces cannot be merged"};
  }
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
  a.shN.insert(a.shN.end(), rest.begin(), rest.end());
  if (!a.origins.empty() || !b.origins.empty()) {
    if (a.origins.empty()) {
      a.origins.push_back({});
      a.origin_ids.assign(a.size(), 0);
    }
    const std::uint32_t shift = static_cast<std::uint32_t>(a.origins.size());
    if (b.origins.empty()) {
      a.origins.push_back({});
      a.origin_ids.insert(a.origin_ids.end(), b.size(), shift);
    } else {
      a.origins.insert(a.origins.end(), b.origins.begin(), b.origins.end());
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
  const auto join = [](auto& to, const auto& from) { to.insert(to.end(), from.begin(), from.end()); };
  for (std::size_t k = 0; k < 3; ++k) join(a.means[k], b.means[k]);
  for (std::size_t k = 0; k < 4; ++k) join(a.quats[k], b.quats[k]);
  for (std::size_t k = 0; k < 3; ++k) join(a.scales[k], b.scales[k]);
  join(a.opacities, b.opacities);
  join(a.sh0, b.sh0);
  return {};
}

}  // namespace gsnav
