// SPDX-License-Identifier: Apache-2.0
#include "temporal_npz.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "cloud_fill.hpp"
#include "described.hpp"
#include "file.hpp"
#include "gsnav/detail/io/npz_file.hpp"
#include "npz_arrays.hpp"
#include "temporal_rows.hpp"

namespace gsnav::io::detail {
namespace {

/// The Gaussians of one network. Arrays that are missing in the file are empty.
struct Network {
  std::string prefix;
  bool moves = true;
  std::size_t count = 0, rest_blocks = 0, motion_width = 0;
  NpyArray xyz, opacity, scaling, rotation, dc, rest, time, time_scale, motion;
};

class TemporalNpz {
 public:
  explicit TemporalNpz(const NpzFile& file) : file_(file) {}

  Result<LoadedTemporalCloud> run() {
    const bool hybrid = file_.contains("network.fg_fdgs._xyz") && file_.contains("network.bg_fdgs._xyz");
    if (Status s = number("network.scene_scale", scale_); !s) return s;
    if (Status s = number("network.time_dilation", dilation_); !s) return s;
    if (!(scale_ > 0)) {
      return fail("network.scene_scale is " + std::to_string(scale_) + ", must be positive");
    }
    parts_.resize(hybrid ? 2 : 1);
    parts_[0].prefix = hybrid ? "network.fg_fdgs." : "network.tfgs.fdgs.";
    if (hybrid) {
      parts_[1].prefix = "network.bg_fdgs.";
      parts_[1].moves = false;
    }
    std::size_t total = 0, blocks = 0, motion = 0;
    for (Network& part : parts_) {
      if (Status s = read(part); !s) return s;
      total += part.count;
      blocks = std::max(blocks, part.rest_blocks);
      motion = std::max(motion, part.motion_width);
    }
    int degree = 0;
    while (degree < kMaxShDegree &&
           static_cast<std::size_t>(sh_coefficient_count(degree + 1) - 1) <= blocks)
      ++degree;
    TemporalRows planes(total, motion);
    const auto decode = [&](std::size_t first, std::size_t last, CloudSink& sink) -> Status {
      for (std::size_t row = first; row < last; ++row) add(row, sink, planes);
      return {};
    };
    auto loaded = described(fill_cloud(total, degree, file_.source(), decode), usual_up(file_.source()));
    if (!loaded) return loaded.status();
    LoadedTemporalCloud out{{}, std::move(loaded->report)};
    out.scene.cloud = std::move(loaded->cloud);
    planes.give(out.scene, out.report);
    out.report.memory = out.scene.bytes();
    if (static_cast<std::size_t>(sh_coefficient_count(degree) - 1) < blocks) {
      out.report.warnings.push_back(std::to_string(blocks) +
                                    " SH coefficients in the file: those up to degree " +
                                    std::to_string(degree) + " are read");
    }
    if (file_.contains(parts_[0].prefix + "_rotation_r")) {
      out.report.warnings.push_back("right rotations are not used: shapes do not turn with time");
    }
    return out;
  }

 private:
  Status fail(const std::string& what) const {
    return {Errc::invalid_file, file_.source() + ": " + what};
  }

  /// Reads an optional number.
  Status number(const std::string& name, double& to) const {
    if (!file_.contains(name)) return {};
    const auto value = NpzArrays(file_).number(name);
    if (!value) return value.status();
    to = *value;
    return {};
  }

  /// Reads an array [N][width] (kAny: any), with or without a dimension of 1 in between. An optional
  /// array that is missing stays empty.
  Status array(const Network& part, const char* name, std::size_t width, bool needed,
               NpyArray& to) const {
    const std::string key = part.prefix + name;
    if (!needed && !file_.contains(key)) return {};
    auto values = file_.read(key);
    if (!values) return values.status();
    std::size_t row = 1;
    for (std::size_t k = 1; k < values->shape.size(); ++k) row *= values->shape[k];
    const std::size_t rows = values->shape.empty() ? 0 : values->shape[0];
    const bool first = std::string_view(name) == "_xyz";
    if ((!first && rows != part.count) || (width != NpzArrays::kAny && row != width)) {
      return fail(key + " has the shape " + shape_text(values->shape) + ", must be [" +
                  (first ? std::string("N") : std::to_string(part.count)) + ", " +
                  (width == NpzArrays::kAny ? std::string("any") : std::to_string(width)) + "]");
    }
    to = std::move(*values);
    return {};
  }

  Status read(Network& p) const {
    if (Status s = array(p, "_xyz", 3, true, p.xyz); !s) return s;
    p.count = p.xyz.shape[0];
    const std::size_t any = NpzArrays::kAny;
    for (const Status& s :
         {array(p, "_opacity", 1, true, p.opacity), array(p, "_scaling", 3, true, p.scaling),
          array(p, p.moves ? "_rotation_l" : "_rotation", 4, true, p.rotation),
          array(p, "_features_dc", 3, true, p.dc), array(p, "_features_rest", any, false, p.rest)}) {
      if (!s) return s;
    }
    const std::vector<std::size_t>& rest = p.rest.shape;
    if (!rest.empty()) {
      if (rest.size() != 3 || rest[2] != 3) {
        return fail(p.prefix + "_features_rest has the shape " + shape_text(rest) +
                    ", must be [N, M, 3]");
      }
      p.rest_blocks = rest[1];
    }
    if (!p.moves) return {};
    for (const Status& s :
         {array(p, "_t", 1, false, p.time), array(p, "_scaling_t", 1, false, p.time_scale),
          array(p, "_motion", any, false, p.motion)}) {
      if (!s) return s;
    }
    if (!p.motion.shape.empty()) {
      p.motion_width = p.motion.shape.size() == 2 ? p.motion.shape[1] : 0;
      if (p.motion_width == 0 || p.motion_width % 3 != 0 || p.motion_width > kMotionPlanes) {
        return fail(p.prefix + "_motion has the shape " + shape_text(p.motion.shape) +
                    ", must be [N, 3], [N, 6] or [N, 9]");
      }
    }
    return {};
  }

  void add(std::size_t row, CloudSink& sink, TemporalRows& planes) const {
    const Network& p = row < parts_[0].count ? parts_[0] : parts_[1];
    const std::size_t i = row < parts_[0].count ? row : row - parts_[0].count;
    std::array<float, 45> rest{};
    RawGaussian raw;
    raw.shN = rest.data();
    for (std::size_t k = 0; k < 3; ++k) {
      const int axis = static_cast<int>(k);
      raw.mean[axis] = scale_ * p.xyz.values[3 * i + k];
      raw.log_scales[axis] = p.scaling.values[3 * i + k] + std::log(scale_);
      raw.sh0[k] = static_cast<float>(p.dc.values[3 * i + k]);
    }
    raw.opacity_logit = p.opacity.values[i];
    const double* q = &p.rotation.values[4 * i];
    raw.quat = {q[0], q[1], q[2], q[3]};
    const std::size_t width = 3 * p.rest_blocks;
    for (std::size_t k = 0; k < std::min(width, rest.size()); ++k) {
      rest[k] = static_cast<float>(p.rest.values[width * i + k]);
    }
    RawTemporal t;
    if (!p.moves) t.log_sigma = std::numeric_limits<double>::infinity();
    if (!p.time.values.empty()) t.time = dilation_ * p.time.values[i];
    if (!p.time_scale.values.empty()) t.log_sigma = p.time_scale.values[i];
    for (std::size_t k = 0; k < p.motion_width; ++k)
      t.motion[k] = scale_ * p.motion.values[p.motion_width * i + k];
    planes.add(row, t, raw, sink);
  }

  const NpzFile& file_;
  double scale_ = 1, dilation_ = 1;
  std::vector<Network> parts_;
};

}  // namespace

Result<LoadedTemporalCloud> load_temporal_npz(const std::filesystem::path& path) {
  const auto file = NpzFile::open(path);
  if (!file) return file.status();
  return TemporalNpz(*file).run();
}

}  // namespace gsnav::io::detail
