// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/rigging/body_levels.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>

#include "gsnav/detail/scene/lod_greedy.hpp"
#include "gsnav/detail/scene/lod_settings.hpp"

namespace gsnav {
namespace {

constexpr std::size_t kLeast = 100;  // Gaussians of the coarsest level
constexpr std::size_t kBlock = 256;  // Gaussians that are merged at once

/// The Gaussians of one level.
class LevelOfBody {
 public:
  /// All Gaussians of the body.
  explicit LevelOfBody(const AvatarAsset& body)
      : joints_(body.skeleton.size()),
        rest_(3 * static_cast<std::size_t>(sh_coefficient_count(body.cloud.sh_degree) - 1)),
        parts_(joints_) {
    const GaussianCloud& cloud = body.cloud;
    const auto row = static_cast<std::size_t>(body.influences);
    detail::LodGrain grain;
    for (std::size_t i = 0; i < body.size(); ++i) {
      shapes_.push_back(detail::lod_gaussian(cloud, i, 0.0));
      grain.add(shapes_.back());
      const std::size_t first = values_.size();
      values_.resize(first + width());
      for (std::size_t k = 0; k < 3; ++k) values_[first + k] = static_cast<double>(cloud.sh0[3 * i + k]);
      for (std::size_t k = 0; k < rest_; ++k)
        values_[first + 3 + k] = static_cast<double>(cloud.shN[rest_ * i + k]);
      for (std::size_t k = i * row; k < (i + 1) * row; ++k)
        values_[first + 3 + rest_ + body.joint_indices[k]] += body.skinning_weights[k];
      parts_[body.joint_indices[i * row]].push_back(static_cast<std::uint32_t>(i));
    }
    grain_ = grain.size();
  }

  /// Merges Gaussians of this level until half are left.
  LevelOfBody halved() const {
    LevelOfBody out(*this, 0);
    for (std::size_t j = 0; j < joints_; ++j) {
      std::vector<std::uint32_t> part = parts_[j];
      merge(part.begin(), part.end(), out, out.parts_[j]);
    }
    LodDistance moved;
    for (const LodGaussian& g : out.shapes_) moved.add(g.mass, g.spread);
    out.error_ = std::max(error_, static_cast<float>(moved.size()));
    return out;
  }

  std::size_t size() const noexcept { return shapes_.size(); }

  Result<AvatarLevel> level(const AvatarAsset& body) const {
    auto made = std::make_shared<AvatarAsset>();
    made->name = body.name;
    made->skeleton = body.skeleton;
    made->skinning = body.skinning;
    GaussianCloud& c = made->cloud;
    const std::size_t n = size();
    for (auto& p : c.means) p.resize(n);
    for (auto& p : c.quats) p.resize(n);
    for (auto& p : c.scales) p.resize(n);
    c.opacities.resize(n);
    c.sh_degree = body.cloud.sh_degree;
    c.filter = body.cloud.filter;
    c.eps2d = body.cloud.eps2d;
    c.sort_order = body.cloud.sort_order;
    c.color_space = body.cloud.color_space;
    std::vector<std::uint16_t> indices;
    std::vector<float> weights;
    for (std::size_t i = 0; i < n; ++i) {
      detail::set_lod_gaussian(c, i, shapes_[i], {});
      const double* const v = values_.data() + i * width();
      for (std::size_t k = 0; k < 3; ++k) c.sh0.push_back(static_cast<float>(v[k]));
      for (std::size_t k = 0; k < rest_; ++k) c.shN.push_back(static_cast<float>(v[3 + k]));
      for (std::size_t j = 0; j < joints_; ++j) {
        indices.push_back(static_cast<std::uint16_t>(j));
        weights.push_back(static_cast<float>(v[3 + rest_ + j]));
      }
    }
    if (auto dropped = made->set_weights(joints_, indices, weights, body.influences); !dropped)
      return dropped.status();
    return AvatarLevel{std::move(made), error_, grain_};
  }

 private:
  using Rows = std::vector<std::uint32_t>::iterator;

  /// An empty level of the same body.
  LevelOfBody(const LevelOfBody& o, int)
      : joints_(o.joints_), rest_(o.rest_), grain_(o.grain_), parts_(o.joints_) {}

  /// Numbers of a Gaussian that are averaged: SH, and a weight for each joint.
  std::size_t width() const noexcept { return 3 + rest_ + joints_; }

  /// Merges rows [first, end), in blocks of neighbours. The order of the rows changes.
  void merge(Rows first, Rows end, LevelOfBody& out, std::vector<std::uint32_t>& part) const {
    const auto n = static_cast<std::size_t>(end - first);
    if (n == 0) return;
    if (n <= kBlock) return merge_block({first, end}, out, part);
    Aabb<double> box;
    for (Rows r = first; r != end; ++r) box.add(shapes_[*r].mean);
    const Vec3d size = box.high - box.low;
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    std::sort(first, end, [&](std::uint32_t a, std::uint32_t b) {
      const double x = shapes_[a].mean[axis], y = shapes_[b].mean[axis];
      return x != y ? x < y : a < b;
    });
    const Rows middle = first + static_cast<std::ptrdiff_t>(n / 2);
    merge(first, middle, out, part);
    merge(middle, end, out, part);
  }

  void merge_block(const std::vector<std::uint32_t>& rows, LevelOfBody& out,
                   std::vector<std::uint32_t>& part) const {
    std::vector<LodGaussian> shapes;
    for (const std::uint32_t r : rows) shapes.push_back(shapes_[r]);
    detail::GreedyMerge merge(LodSettings{}.neighbours);
    merge.run(shapes, (rows.size() + 1) / 2);
    const std::size_t first = out.size();
    std::vector<double> masses(merge.size());
    out.values_.resize((first + merge.size()) * width());
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const std::size_t to = merge.owner()[i];
      const double mass = std::max(shapes_[rows[i]].mass, 1e-30);
      masses[to] += mass;
      for (std::size_t k = 0; k < width(); ++k)
        out.values_[(first + to) * width() + k] += mass * values_[rows[i] * width() + k];
    }
    for (std::size_t g = 0; g < merge.size(); ++g) {
      for (std::size_t k = 0; k < width(); ++k) out.values_[(first + g) * width() + k] /= masses[g];
      part.push_back(static_cast<std::uint32_t>(first + g));
      out.shapes_.push_back(merge.left(g));
      // No Gaussian takes more than all light, so its area grows instead.
      LodGaussian& shape = out.shapes_.back();
      const double opacity = lod_opacity(shape);
      if (opacity > 1) shape.covariance.add(Sym3(shape.covariance), opacity - 1);
    }
  }

  std::size_t joints_, rest_;
  float error_ = 0, grain_ = 0;
  std::vector<LodGaussian> shapes_;
  std::vector<double> values_;                     // [N][width()]
  std::vector<std::vector<std::uint32_t>> parts_;  // Rows that each joint moves most.
};

}  // namespace

Result<std::vector<AvatarLevel>> body_levels(const AvatarAsset& body) {
  if (Status s = body.validate(); !s) return s;
  if (body.skinning == Skinning::linear_stretched) {
    return {Errc::unsupported, "body_levels: \"" + body.name + "\" has stretched skinning"};
  }
  std::vector<AvatarLevel> levels;
  LevelOfBody now(body);
  while (now.size() > 2 * kLeast && levels.size() < AvatarAsset::kMostLevels) {
    LevelOfBody next = now.halved();
    if (4 * next.size() > 3 * now.size()) break;  // Most parts have one Gaussian left.
    now = std::move(next);
    auto level = now.level(body);
    if (!level) return level.status();
    levels.push_back(std::move(*level));
  }
  return levels;
}

}  // namespace gsnav
