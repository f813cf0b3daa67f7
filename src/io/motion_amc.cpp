// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "file.hpp"
#include "gsnav/io/motion_file.hpp"
#include "text_lines.hpp"

namespace gsnav::io {
namespace {

using detail::in_quotes;
using detail::TextLines;

constexpr double kRadians = 3.14159265358979323846 / 180.0;
constexpr std::size_t kMostBones = 1024;

struct Bone {
  std::string name;
  Vec3d direction{};
  double length = 0.0;     // in the file's units
  Quatd axis{};            // C
  std::vector<int> turns;  // axes of its rotations as they are listed: 0 x, 1 y, 2 z
  std::vector<std::size_t> children;
};

Quatd about(int axis, double angle) {
  Vec3d v{};
  v[axis] = 1.0;
  return axis_angle(v, angle);
}

/// 0 to 2 for x to z in either case, else -1.
int axis_of(char c) {
  const int k = std::tolower(static_cast<unsigned char>(c)) - 'x';
  return k >= 0 && k <= 2 ? k : -1;
}

/// The skeleton as the file has it; bone 0 is the root.
struct Acclaim {
  std::vector<Bone> bones{{"root", {}, 0.0, {}, {}, {}}};
  std::vector<std::pair<bool, int>> root_order;  // (is a rotation, axis)
  Vec3d root_position{}, root_angles{};
  double length_unit = 1.0, angle_unit = kRadians;

  std::size_t find(std::string_view name) const {
    std::size_t b = 0;
    while (b < bones.size() && bones[b].name != name) ++b;
    return b;
  }
};

class AsfReader {
 public:
  AsfReader(std::string_view text, const std::string& source) : lines_(text, source) {}

  Result<Acclaim> run() {
    std::string section;
    bool more = lines_.next();
    while (more) {
      section = std::string(lines_.word(0));
      if (section.front() != ':') return lines_.bad(in_quotes(section) + " where a section should begin");
      // A section's own line has nothing that is needed; its content follows.
      more = lines_.next();
      while (more && lines_.word(0).front() != ':') {
        Status s;
        if (section == ":units") s = unit();
        if (section == ":root") s = root();
        if (section == ":bonedata") s = bone();
        if (section == ":hierarchy") s = children();
        if (!s) return s;
        more = lines_.next();
      }
    }
    if (out_.root_order.empty()) return lines_.bad("there is no ':root' with an order");
    // The axes are known once the units are.
    out_.bones[0].axis = euler(root_axis_, out_.root_angles);
    for (std::size_t b = 1; b < out_.bones.size(); ++b) out_.bones[b].axis = euler(axes_[b].first, axes_[b].second);
    return std::move(out_);
  }

 private:
  using Order = std::vector<int>;

  Quatd euler(const Order& order, const Vec3d& angles) const {
    Quatd q;
    for (std::size_t k = 0; k < order.size(); ++k) {
      q = about(order[k], angles[static_cast<int>(k)] * out_.angle_unit) * q;
    }
    return q;
  }

  Status unit() {
    if (lines_.word(0) == "length") {
      if (Status s = lines_.number(1, out_.length_unit); !s) return s;
      if (!(out_.length_unit > 0)) return lines_.bad("length is not positive");
    }
    if (lines_.word(0) == "angle") {
      if (lines_.word(1) != "deg" && lines_.word(1) != "rad")
        return lines_.bad(in_quotes(lines_.word(1)) + " is no unit of angles");
      out_.angle_unit = lines_.word(1) == "deg" ? kRadians : 1.0;
    }
    return {};
  }

  Status vector(Vec3d& out) const {
    for (int k = 0; k < 3; ++k) {
      if (Status s = lines_.number(static_cast<std::size_t>(k) + 1, out[k]); !s) return s;
    }
    return {};
  }

  Status order(std::string_view word, Order& out) const {
    out.clear();
    for (const char c : word) out.push_back(axis_of(c));
    std::vector<int> sorted = out;
    std::sort(sorted.begin(), sorted.end());
    return sorted == std::vector<int>{0, 1, 2} ? Status() : lines_.bad(in_quotes(word) + " is no order of axes");
  }

  Status root() {
    const std::string_view key = lines_.word(0);
    if (key == "axis") return order(lines_.word(1), root_axis_);
    if (key == "position") return vector(out_.root_position);
    if (key == "orientation") return vector(out_.root_angles);
    if (key == "order") {
      out_.root_order.clear();
      for (std::size_t k = 1; k < lines_.words().size(); ++k) {
        const std::string_view w = lines_.word(k);
        const char kind = static_cast<char>(std::toupper(static_cast<unsigned char>(w.front())));
        if (w.size() != 2 || (kind != 'T' && kind != 'R') || axis_of(w[1]) < 0)
          return lines_.bad(in_quotes(w) + " is no channel");
        out_.root_order.emplace_back(kind == 'R', axis_of(w[1]));
      }
    }
    return {};
  }

  Status bone() {
    const std::string_view key = lines_.word(0);
    if (key == "begin") {
      if (out_.bones.size() > kMostBones) return lines_.bad("more than " + std::to_string(kMostBones) + " bones");
      out_.bones.emplace_back();
      axes_.resize(out_.bones.size());
      return {};
    }
    if (out_.bones.size() < 2) return lines_.bad(in_quotes(key) + " where a bone should begin");
    Bone& b = out_.bones.back();
    if (key == "name") {
      b.name = std::string(lines_.word(1));
      if (b.name.empty()) return lines_.bad("a bone without a name");
      if (out_.find(b.name) + 1 != out_.bones.size()) return lines_.bad("bone " + in_quotes(b.name) + " twice");
    } else if (key == "direction") {
      return vector(b.direction);
    } else if (key == "length") {
      return lines_.number(1, b.length);
    } else if (key == "axis") {
      if (Status s = vector(axes_.back().second); !s) return s;
      return order(lines_.word(4), axes_.back().first);
    } else if (key == "dof") {
      for (std::size_t k = 1; k < lines_.words().size(); ++k) {
        const std::string_view w = lines_.word(k);
        if (w.size() != 2 || std::tolower(static_cast<unsigned char>(w.front())) != 'r' || axis_of(w[1]) < 0) {
          return {Errc::unsupported, lines_.bad("dof " + in_quotes(w) + " is no rotation").message()};
        }
        b.turns.push_back(axis_of(w[1]));
      }
    }
    return {};
  }

  Status children() {
    if (lines_.word(0) == "begin" || lines_.word(0) == "end") return {};
    const std::size_t parent = out_.find(lines_.word(0));
    if (parent == out_.bones.size()) return lines_.bad("there is no bone " + in_quotes(lines_.word(0)));
    for (std::size_t k = 1; k < lines_.words().size(); ++k) {
      const std::size_t child = out_.find(lines_.word(k));
      if (child == out_.bones.size() || child == 0) return lines_.bad("there is no bone " + in_quotes(lines_.word(k)));
      if (placed_.size() <= child) placed_.resize(out_.bones.size(), false);
      if (placed_[child]) return lines_.bad("bone " + in_quotes(lines_.word(k)) + " hangs on two bones");
      placed_[child] = true;
      out_.bones[parent].children.push_back(child);
    }
    return {};
  }

  TextLines lines_;
  Acclaim out_;
  Order root_axis_;
  std::vector<std::pair<Order, Vec3d>> axes_;  // of each bone
  std::vector<bool> placed_;
};

/// A skeleton from the bones below the root, parents first; `joints[b]` is the joint of bone b.
Status build_skeleton(const Acclaim& file, double scale, const std::string& source, Skeleton& out,
                      std::vector<std::size_t>& joints) {
  joints.assign(file.bones.size(), file.bones.size() * 2);
  const auto add = [&](const std::string& name, std::int32_t parent, const Vec3d& place) {
    out.names.push_back(name);
    out.parents.push_back(parent);
    out.rest_local.push_back({Mat3d::identity(), place});
    return out.size() - 1;
  };
  std::vector<std::size_t> open{0};
  joints[0] = add("root", -1, file.root_position * scale);
  while (!open.empty()) {
    const std::size_t b = open.back();
    open.pop_back();
    const Bone& bone = file.bones[b];
    const Vec3d tip = bone.direction * (bone.length * scale);
    const auto parent = static_cast<std::int32_t>(joints[b]);
    if (bone.children.empty()) add(bone.name + "_end", parent, tip);
    for (const std::size_t c : bone.children) {
      joints[c] = add(file.bones[c].name, parent, tip);
      open.push_back(c);
    }
  }
  for (std::size_t b = 0; b < joints.size(); ++b) {
    if (joints[b] >= file.bones.size() * 2) {
      return {Errc::invalid_file, source + ": bone " + in_quotes(file.bones[b].name) + " is in no hierarchy"};
    }
  }
  return out.validate();
}

class AmcReader {
 public:
  AmcReader(std::string_view text, const std::string& source, const Acclaim& file, double scale, bool z_up)
      : lines_(text, source), file_(file), scale_(scale), angle_unit_(file.angle_unit), bytes_(text.size()) {
    if (z_up) up_ = axis_angle(Vec3d{1, 0, 0}, -90 * kRadians);
  }

  Status run(const std::vector<std::size_t>& joints, Skeleton& skeleton, MotionClip& clip) {
    clip.joints = skeleton.size();
    const Affine3<double> turn{rotation_matrix(up_), {}};
    skeleton.rest_local[0] = turn * skeleton.rest_local[0];
    rest_ = skeleton.rest_local[0].translation;
    std::size_t given = 0, wanted = 1;
    for (const Bone& b : file_.bones) wanted += b.turns.empty() ? 0 : 1;
    const auto whole = [&] {
      return given == wanted
                 ? Status()
                 : lines_.bad("a frame of " + std::to_string(given) + " bones, must be " + std::to_string(wanted));
    };
    std::vector<bool> seen(file_.bones.size());
    while (lines_.next()) {
      const std::string_view word = lines_.word(0);
      if (word == ":DEGREES" || word == ":RADIANS") {
        angle_unit_ = word == ":DEGREES" ? kRadians : 1.0;
      } else if (word.front() == ':') {
        continue;
      } else if (lines_.words().size() == 1 && std::isdigit(static_cast<unsigned char>(word.front()))) {
        if (clip.frames() > 0) {
          if (Status s = whole(); !s) return s;
        }
        // Joints without values must not fill the memory.
        if (clip.frames() * clip.joints > bytes_) return lines_.bad("more joints than bytes");
        given = 0;
        seen.assign(seen.size(), false);
        clip.rotations.resize(clip.rotations.size() + clip.joints, Quatd{});
        clip.rotations[clip.rotations.size() - clip.joints] = up_;
        clip.root_translation.emplace_back();
      } else {
        const std::size_t b = file_.find(word);
        if (clip.frames() == 0) return lines_.bad(in_quotes(word) + " before the first frame");
        if (b == file_.bones.size()) return lines_.bad("there is no bone " + in_quotes(word));
        if (seen[b]) return lines_.bad("bone " + in_quotes(word) + " twice in a frame");
        seen[b] = true;
        given += b == 0 || !file_.bones[b].turns.empty() ? 1 : 0;
        if (Status s = pose(b, clip.rotations[(clip.frames() - 1) * clip.joints + joints[b]], clip); !s) return s;
      }
    }
    if (clip.frames() == 0) return lines_.bad("there are no frames");
    if (Status s = whole(); !s) return s;
    for (const auto& m : skeleton.rest_local) clip.translations.push_back(m.translation);
    return clip.validate();
  }

 private:
  Status pose(std::size_t b, Quatd& out, MotionClip& clip) {
    const Bone& bone = file_.bones[b];
    const std::size_t values = b == 0 ? file_.root_order.size() : bone.turns.size();
    if (lines_.words().size() != values + 1) {
      return lines_.bad("bone " + in_quotes(bone.name) + " has " + std::to_string(lines_.words().size() - 1) +
                        " values, must be " + std::to_string(values));
    }
    Quatd m;
    Vec3d place = file_.root_position;
    for (std::size_t k = 0; k < values; ++k) {
      double v = 0.0;
      if (Status s = lines_.number(k + 1, v); !s) return s;
      const bool turns = b != 0 || file_.root_order[k].first;
      const int axis = b == 0 ? file_.root_order[k].second : bone.turns[k];
      if (turns) {
        m = about(axis, v * angle_unit_) * m;
      } else {
        place[axis] += v;
      }
    }
    out = bone.axis * m * conjugate(bone.axis);
    if (b == 0) {
      out = up_ * out;
      clip.root_translation.back() = rotate(up_, place * scale_) - rest_;
    }
    normalize(out);
    return {};
  }

  TextLines lines_;
  const Acclaim& file_;
  double scale_, angle_unit_;
  std::size_t bytes_;
  Quatd up_{};
  Vec3d rest_{};
};

}  // namespace

Result<LoadedMotion> load_amc(const std::filesystem::path& skeleton, const std::filesystem::path& motion,
                              const AmcOptions& options) {
  return detail::guarded(motion.string(), [&]() -> Result<LoadedMotion> {
    const std::string name = skeleton.string(), clip_name = motion.string();
    const auto positive = [](double v) { return v > 0 && std::isfinite(v); };
    if (!positive(options.frame_rate))
      return {Errc::invalid_argument, clip_name + ": AmcOptions.frame_rate must be positive"};
    if (options.scale != 0 && !positive(options.scale))
      return {Errc::invalid_argument, clip_name + ": AmcOptions.scale must be positive"};
    const auto asf = detail::read_file(skeleton), amc = detail::read_file(motion);
    if (!asf) return asf.status();
    if (!amc) return amc.status();
    const auto text = [](const detail::FileBytes& f) {
      return std::string_view(reinterpret_cast<const char*>(f.data.get()), f.size);
    };
    const auto file = AsfReader(text(*asf), name).run();
    if (!file) return file.status();
    const double scale = options.scale > 0 ? options.scale : 0.0254 / file->length_unit;
    LoadedMotion out;
    std::vector<std::size_t> joints;
    if (Status s = build_skeleton(*file, scale, name, out.skeleton, joints); !s)
      return {Errc::invalid_file, s.message()};
    out.clip.frame_rate = options.frame_rate;
    if (Status s = AmcReader(text(*amc), clip_name, *file, scale, options.z_up).run(joints, out.skeleton, out.clip);
        !s) {
      return {Errc::invalid_file, s.message()};
    }
    return out;
  });
}

}  // namespace gsnav::io
