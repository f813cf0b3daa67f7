// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "file.hpp"
#include "gltf_skin.hpp"
#include "gsnav/math/quat.hpp"

namespace gsnav::io::detail {
namespace {

enum class Interpolation : std::uint8_t { linear, step, cubic };

/// The keys of one property of one node.
struct Channel {
  std::size_t node = 0, width = 3;
  char target = 't';  // t, r or s
  Interpolation blend = Interpolation::linear;
  std::vector<double> times;
  std::vector<double> values;  // [times][width], or [times][3][width] for cubic splines
};

/// Value of the channel at `time`, by the formulas of glTF 2.0, appendix C.
std::array<double, 4> sample(const Channel& c, double time) {
  const std::size_t n = c.times.size(), w = c.width;
  const std::size_t stride = c.blend == Interpolation::cubic ? 3 * w : w,
                    middle = c.blend == Interpolation::cubic ? w : 0;
  std::array<double, 4> out{};
  const auto key = [&](std::size_t i) { return c.values.data() + i * stride + middle; };
  std::size_t b =
      static_cast<std::size_t>(std::upper_bound(c.times.begin(), c.times.end(), time) - c.times.begin());
  if (b == 0 || b == n) {
    std::copy_n(key(b == 0 ? 0 : n - 1), w, out.begin());
    return out;
  }
  const std::size_t a = b - 1;
  const double step = c.times[b] - c.times[a], u = (time - c.times[a]) / step;
  const double *p = key(a), *q = key(b);
  if (c.blend == Interpolation::step) {
    std::copy_n(p, w, out.begin());
  } else if (c.blend == Interpolation::cubic) {
    const double u2 = u * u, u3 = u2 * u;
    for (std::size_t k = 0; k < w; ++k) {
      out[k] = (2 * u3 - 3 * u2 + 1) * p[k] + step * (u3 - 2 * u2 + u) * p[w + k] +
               (3 * u2 - 2 * u3) * q[k] + step * (u3 - u2) * (q - w)[k];
    }
  } else if (c.target == 'r') {
    const Quatd r = slerp(Quatd{p[3], p[0], p[1], p[2]}, Quatd{q[3], q[0], q[1], q[2]}, u);
    out = {r.x, r.y, r.z, r.w};
  } else {
    for (std::size_t k = 0; k < w; ++k) out[k] = p[k] + u * (q[k] - p[k]);
  }
  return out;
}

Result<std::vector<Channel>> read_channels(const GltfFile& file, const Json& animation,
                                           const std::string& at) {
  const Json *channels = member(animation, "channels"), *samplers = member(animation, "samplers");
  if (channels == nullptr || samplers == nullptr || !channels->is_array() || !samplers->is_array()) {
    return {Errc::invalid_file, at + " has no channels or samplers"};
  }
  std::vector<Channel> out;
  for (std::size_t i = 0; i < channels->size(); ++i) {
    const std::string here = at + ".channels[" + std::to_string(i) + "]";
    const Json* target = member((*channels)[i], "target");
    if (target == nullptr) return {Errc::invalid_file, here + " has no target"};
    const Json* path = member(*target, "path");
    if (member(*target, "node") == nullptr || path == nullptr || *path == "weights") continue;
    Channel c;
    const auto node = file.index(*target, "node", "nodes", here);
    if (!node) return node.status();
    c.node = *node;
    if (*path != "translation" && *path != "rotation" && *path != "scale") {
      return {Errc::invalid_file, here + ": 'path' is " + shown(*path)};
    }
    c.target = path->get<std::string>()[0];
    c.width = c.target == 'r' ? 4 : 3;
    const auto which =
        get_integer((*channels)[i], "sampler", 0, static_cast<std::int64_t>(samplers->size()) - 1, here);
    if (!which) return which.status();
    const Json& sampler = (*samplers)[static_cast<std::size_t>(*which)];
    const Json* blend = member(sampler, "interpolation");
    if (blend != nullptr && *blend != "LINEAR" && *blend != "STEP" && *blend != "CUBICSPLINE") {
      return {Errc::invalid_file, here + ": 'interpolation' is " + shown(*blend)};
    }
    if (blend != nullptr && *blend == "STEP") c.blend = Interpolation::step;
    if (blend != nullptr && *blend == "CUBICSPLINE") c.blend = Interpolation::cubic;
    const auto input = file.index(sampler, "input", "accessors", here),
               output = file.index(sampler, "output", "accessors", here);
    if (!input) return input.status();
    if (!output) return output.status();
    auto times = file.numbers(*input, "SCALAR");
    if (!times) return times.status();
    auto values = file.numbers(*output, c.width == 4 ? "VEC4" : "VEC3");
    if (!values) return values.status();
    if (values->count != times->count * (c.blend == Interpolation::cubic ? 3 : 1)) {
      return {Errc::invalid_file, here + ": " + std::to_string(values->count) + " values for " +
                                      std::to_string(times->count) + " keys"};
    }
    for (std::size_t k = 0; k < times->count; ++k) {
      if (!(times->values[k] >= 0) || (k > 0 && !(times->values[k] > times->values[k - 1]))) {
        return {Errc::invalid_file, here + ": key " + std::to_string(k) + " is at " +
                                        std::to_string(times->values[k]) + " s"};
      }
    }
    c.times = std::move(times->values);
    c.values = std::move(values->values);
    out.push_back(std::move(c));
  }
  return out;
}

/// Rate and number of keys from time 0 on: those of the keys, if they are evenly spaced, else at `rate`.
struct TimeGrid {
  double first = 0.0, rate = 60.0;  // first: time of the first key
  std::size_t keys = 1;
};

TimeGrid grid_of(const std::vector<Channel>& channels, double rate) {
  std::set<double> times;
  bool uniform = true;
  for (const Channel& c : channels) {
    times.insert(c.times.begin(), c.times.end());
    uniform = uniform && c.blend == Interpolation::linear;
  }
  TimeGrid out;
  if (times.empty()) return out;
  out.first = *times.begin();
  times.insert(0.0);
  const double length = *times.rbegin();
  if (!(length > 0)) return out;
  // Find the least step. The set may contain times that differ only by rounding.
  double step = length;
  for (auto a = times.begin(), b = std::next(a); b != times.end(); ++a, ++b) {
    if (*b - *a > 1e-4) step = std::min(step, *b - *a);
  }
  const double count = std::round(length / step);
  step = length / count;
  uniform = uniform && rate <= 0 && step >= 1.0 / 480;
  for (const double t : times) uniform = uniform && std::fabs(std::remainder(t, step)) < 2e-4;
  out.rate = uniform ? 1.0 / step : rate > 0 ? rate : 60.0;
  out.keys = static_cast<std::size_t>(std::min(std::round(length * out.rate), 1e9)) + 1;
  return out;
}

}  // namespace

Status read_clips(const GltfFile& file, const GltfSkin& skin, const GltfNodes& nodes, double frame_rate,
                  PoseObserver& observer, std::vector<NamedClip>& out,
                  std::vector<std::string>& warnings) {
  for (std::size_t i = 0; i < file.count("animations"); ++i) {
    const auto animation = file.item("animations", i);
    if (!animation) return animation.status();
    const std::string at = file.where("animations", i);
    const auto channels = read_channels(file, **animation, at);
    if (!channels) return channels.status();
    GltfNodes posed = nodes;
    for (const Channel& c : *channels) {
      // An animated node must not have a matrix. If it has one, use its other members.
      posed.nodes[c.node].has_matrix = false;
    }
    const TimeGrid grid = grid_of(*channels, frame_rate);
    constexpr std::size_t kMostMatrices = std::size_t{1} << 22;
    if (grid.keys > kMostMatrices / skin.nodes.size()) {
      return {Errc::unsupported, at + ": " + std::to_string(grid.keys) + " keys at " +
                                     std::to_string(grid.rate) + " a second"};
    }
    std::vector<Affine3<double>> matrices;
    for (std::size_t k = 0; k < grid.keys; ++k) {
      const double time = static_cast<double>(k) / grid.rate;
      for (const Channel& c : *channels) {
        GltfNode& node = posed.nodes[c.node];
        const std::array<double, 4> v = sample(c, time);
        if (c.target == 't') node.translation = {v[0], v[1], v[2]};
        if (c.target == 's') node.scale = {v[0], v[1], v[2]};
        if (c.target == 'r') node.rotation = v;
      }
      const auto globals = posed.globals();
      if (k % std::max<std::size_t>(1, grid.keys / 10) == 0) observer.look(globals);
      const auto rigid = rigid_joints(skin, globals);
      matrices.insert(matrices.end(), rigid.begin(), rigid.end());
    }
    const Json* title = member(**animation, "name");
    const std::string name =
        title != nullptr && title->is_string() ? title->get<std::string>() : "clip" + std::to_string(i);
    if (grid.first > 1e-6) {
      warnings.push_back("clip \"" + name + "\": its first key is at " + std::to_string(grid.first) +
                         " s and holds from 0 s on");
    }
    auto clip = clip_from_matrices(skin.skeleton, grid.rate, matrices, false);
    if (!clip) return {Errc::invalid_file, at + ": " + clip.message()};
    clip->wrap_time = smooth_wrap_time(skin.skeleton, *clip);
    out.push_back({name, std::move(*clip)});
  }
  return {};
}

}  // namespace gsnav::io::detail
