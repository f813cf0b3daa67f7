// SPDX-License-Identifier: Apache-2.0
#include "motion_asf.hpp"

#include <algorithm>
#include <cctype>

#include "file.hpp"
#include "text_lines.hpp"

namespace gsnav::io::detail {
namespace {

constexpr std::size_t kMostBones = 1024;

/// 0 to 2 for x to z, in upper or lower case; otherwise -1.
int axis_of(char c) {
  const int k = std::tolower(static_cast<unsigned char>(c)) - 'x';
  return k >= 0 && k <= 2 ? k : -1;
}

class AsfReader {
 public:
  AsfReader(std::string_view text, const std::string& source) : lines_(text, source) {}

  Result<AsfSkeleton> run() {
    std::string section;
    bool more = lines_.next();
    while (more) {
      section = std::string(lines_.word(0));
      if (section.front() != ':')
        return lines_.bad(in_quotes(section) + " where a section should begin");
      // The line that begins a section has no needed content; the next lines have.
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
    // Angles can be converted only after all units were read.
    out_.bones[0].axis = euler(root_axis_, out_.root_angles);
    for (std::size_t b = 1; b < out_.bones.size(); ++b)
      out_.bones[b].axis = euler(axes_[b].first, axes_[b].second);
    return std::move(out_);
  }

 private:
  using Order = std::vector<int>;

  Quatd euler(const Order& order, const Vec3d& angles) const {
    Quatd q;
    for (std::size_t k = 0; k < order.size(); ++k) {
      q = about_axis(order[k], angles[static_cast<int>(k)] * out_.angle_unit) * q;
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
      out_.angle_unit = lines_.word(1) == "deg" ? kRadiansPerDegree : 1.0;
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
    return sorted == std::vector<int>{0, 1, 2} ? Status()
                                               : lines_.bad(in_quotes(word) + " is no order of axes");
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
          return lines_.bad(in_quotes(w) + " is not a channel");
        out_.root_order.emplace_back(kind == 'R', axis_of(w[1]));
      }
    }
    return {};
  }

  Status bone() {
    const std::string_view key = lines_.word(0);
    if (key == "begin") {
      if (out_.bones.size() > kMostBones)
        return lines_.bad("more than " + std::to_string(kMostBones) + " bones");
      out_.bones.emplace_back();
      axes_.resize(out_.bones.size());
      return {};
    }
    if (out_.bones.size() < 2) return lines_.bad(in_quotes(key) + " where a bone should begin");
    AsfBone& b = out_.bones.back();
    if (key == "name") {
      b.name = std::string(lines_.word(1));
      if (b.name.empty()) return lines_.bad("a bone without a name");
      if (out_.find(b.name) + 1 != out_.bones.size())
        return lines_.bad("bone " + in_quotes(b.name) + " twice");
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
        if (w.size() != 2 || std::tolower(static_cast<unsigned char>(w.front())) != 'r' ||
            axis_of(w[1]) < 0) {
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
      if (child == out_.bones.size() || child == 0)
        return lines_.bad("there is no bone " + in_quotes(lines_.word(k)));
      if (placed_.size() <= child) placed_.resize(out_.bones.size(), false);
      if (placed_[child]) return lines_.bad("bone " + in_quotes(lines_.word(k)) + " hangs on two bones");
      placed_[child] = true;
      out_.bones[parent].children.push_back(child);
    }
    return {};
  }

  TextLines lines_;
  AsfSkeleton out_;
  Order root_axis_;
  std::vector<std::pair<Order, Vec3d>> axes_;  // of each bone
  std::vector<bool> placed_;
};

}  // namespace

std::size_t AsfSkeleton::find(std::string_view name) const {
  std::size_t b = 0;
  while (b < bones.size() && bones[b].name != name) ++b;
  return b;
}

Quatd about_axis(int axis, double angle) {
  Vec3d v{};
  v[axis] = 1.0;
  return axis_angle(v, angle);
}

Result<AsfSkeleton> read_asf(std::string_view text, const std::string& source) {
  return AsfReader(text, source).run();
}

Status asf_joints(const AsfSkeleton& file, double scale, const std::string& source, Skeleton& out,
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
    const AsfBone& bone = file.bones[b];
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
      return {Errc::invalid_file,
              source + ": bone " + in_quotes(file.bones[b].name) + " is in no hierarchy"};
    }
  }
  return out.validate();
}

}  // namespace gsnav::io::detail
