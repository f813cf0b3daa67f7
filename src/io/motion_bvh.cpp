// SPDX-License-Identifier: Apache-2.0
#include <charconv>
#include <cmath>
#include <numbers>
#include <string_view>

#include "file.hpp"
#include "gsnav/detail/core/field_check.hpp"
#include "gsnav/detail/io/motion_file.hpp"

namespace gsnav::io {
namespace {

constexpr double kRadians = std::numbers::pi / 180.0;

struct Channel {
  bool rotation = false;
  int axis = 0;  // 0 x, 1 y, 2 z
};

class BvhReader {
 public:
  BvhReader(std::string_view text, std::string name, const BvhOptions& options)
      : text_(text), name_(std::move(name)), options_(options) {}

  Result<LoadedMotion> run() {
    gsnav::detail::FieldCheck check(name_ + ": BvhOptions.");
    if (!check.positive("scale", options_.scale).status()) return check.status();
    if (Status s = read_hierarchy(); !s) return s;
    if (Status s = out_.skeleton.validate(); !s) return {Errc::invalid_file, name_ + ": " + s.message()};
    if (Status s = read_frames(); !s) return s;
    if (Status s = make_clip(); !s) return s;
    return std::move(out_);
  }

 private:
  Status bad(const std::string& what) const {
    return {Errc::invalid_file, name_ + ": line " + std::to_string(line_) + ": " + what};
  }

  /// The next word; empty at the end of the text.
  std::string_view next() {
    while (!text_.empty() && static_cast<unsigned char>(text_.front()) <= ' ') {
      line_ += text_.front() == '\n' ? 1u : 0u;
      text_.remove_prefix(1);
    }
    std::size_t n = 0;
    while (n < text_.size() && static_cast<unsigned char>(text_[n]) > ' ') ++n;
    const std::string_view word = text_.substr(0, n);
    text_.remove_prefix(n);
    return word;
  }
  Status expect(std::string_view word) {
    const std::string_view have = next();
    return have == word ? Status()
                        : bad(detail::in_quotes(have) + " where '" + std::string(word) + "' should be");
  }
  Status number(double& out) {
    const std::string_view word = next();
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), out);
    if (error != std::errc{} || end != word.data() + word.size() || !std::isfinite(out)) {
      return bad(detail::in_quotes(word) + " is not a number");
    }
    return {};
  }
  Status offset(Vec3d& out) {
    if (Status s = expect("OFFSET"); !s) return s;
    for (int k = 0; k < 3; ++k) {
      if (Status s = number(out[k]); !s) return s;
    }
    return {};
  }

  Status read_hierarchy() {
    if (Status s = expect("HIERARCHY"); !s) return s;
    if (Status s = expect("ROOT"); !s) return s;
    if (Status s = open_joint(-1); !s) return s;
    std::int32_t current = 0;
    while (current >= 0) {
      const std::string_view word = next();
      if (word == "JOINT") {
        if (Status s = open_joint(current); !s) return s;
        current = static_cast<std::int32_t>(out_.skeleton.size()) - 1;
      } else if (word == "End") {
        Vec3d ignored;
        if (Status s = expect("Site"); !s) return s;
        if (Status s = expect("{"); !s) return s;
        if (Status s = offset(ignored); !s) return s;
        if (Status s = expect("}"); !s) return s;
      } else if (word == "}") {
        current = out_.skeleton.parents[static_cast<std::size_t>(current)];
      } else {
        return bad(detail::in_quotes(word) + " where a joint should begin or end");
      }
    }
    return {};
  }

  Status open_joint(std::int32_t parent) {
    constexpr std::size_t kMostBvhJoints = 4096;
    Skeleton& skeleton = out_.skeleton;
    const std::string name(next());
    if (skeleton.size() >= kMostBvhJoints)
      return bad("more than " + std::to_string(kMostBvhJoints) + " joints");
    if (Status s = expect("{"); !s) return s;
    Vec3d place;
    if (Status s = offset(place); !s) return s;
    if (Status s = expect("CHANNELS"); !s) return s;
    double count = 0;
    if (Status s = number(count); !s) return s;
    if (!(count >= 0 && count <= 6) || count != std::floor(count)) {
      return bad(std::to_string(count) + " channels, must be 0 to 6");
    }
    std::vector<Channel> channels;
    for (int k = 0; k < static_cast<int>(count); ++k) {
      const std::string_view word = next();
      const std::string_view kind = word.empty() ? word : word.substr(1);
      if ((kind != "rotation" && kind != "position") || word[0] < 'X' || word[0] > 'Z') {
        return bad(detail::in_quotes(word) + " is not a channel");
      }
      channels.push_back({kind == "rotation", word[0] - 'X'});
    }
    values_ += channels.size();
    channels_.push_back(std::move(channels));
    skeleton.names.push_back(name);
    skeleton.parents.push_back(parent);
    skeleton.rest_local.push_back({Mat3d::identity(), place * options_.scale});
    return {};
  }

  Status read_frames() {
    double frames = 0;
    for (const char* word : {"MOTION", "Frames:"}) {
      if (Status s = expect(word); !s) return s;
    }
    if (Status s = number(frames); !s) return s;
    for (const char* word : {"Frame", "Time:"}) {
      if (Status s = expect(word); !s) return s;
    }
    if (Status s = number(frame_time_); !s) return s;
    if (!(frame_time_ > 0) || !std::isfinite(1.0 / frame_time_))
      return bad("the frame time is not positive");
    // A value takes at least a digit and a blank. Joints without channels must not fill the memory
    // either.
    const double bytes = static_cast<double>(text_.size()),
                 joints = static_cast<double>(channels_.size());
    if (!(frames >= 1) || frames != std::floor(frames) ||
        2 * frames * static_cast<double>(values_) > bytes + 2 || (frames - 1) * joints > bytes) {
      return bad(std::to_string(frames) + " frames of " + std::to_string(values_) + " channels in " +
                 std::to_string(text_.size()) + " bytes");
    }
    frames_ = static_cast<std::size_t>(frames);
    motion_.resize(frames_ * values_);
    for (double& v : motion_) {
      if (Status s = number(v); !s) return s;
    }
    const std::string_view rest = next();
    return rest.empty() ? Status() : bad(detail::in_quotes(rest) + " behind the last frame");
  }

  /// Whether the positions of joint j, whose first value is at `at`, replace its OFFSET.
  bool replaces(std::size_t j, std::size_t at) const {
    Vec3d first = out_.skeleton.rest_local[j].translation, from_zero{};
    bool any = false;
    for (const Channel& c : channels_[j]) {
      const double v = motion_[at++] * options_.scale;
      if (c.rotation) continue;
      first[c.axis] -= v;
      from_zero[c.axis] = v;
      any = true;
    }
    return any && norm(first) < norm(from_zero);
  }

  Status make_clip() {
    Skeleton& skeleton = out_.skeleton;
    MotionClip& clip = out_.clip;
    const std::size_t joints = skeleton.size();
    clip.frame_rate = 1.0 / frame_time_;
    clip.joints = joints;
    bool moving = false;
    std::vector<bool> replace(joints);
    for (std::size_t j = 0, at = 0; j < joints; at += channels_[j++].size()) {
      replace[j] = replaces(j, at);
      for (const Channel& c : channels_[j]) moving = moving || (j != 0 && !c.rotation);
    }
    // If Z is up, turn each frame as a whole, the rest position and rotation of the root included.
    const Quatd up = options_.z_up ? axis_angle(Vec3d{1, 0, 0}, -90 * kRadians) : Quatd{};
    const Affine3<double> turn{rotation_matrix(up), {}};
    const Vec3d root_rest = turn * skeleton.rest_local[0].translation;
    std::size_t at = 0;
    for (std::size_t t = 0; t < frames_; ++t) {
      for (std::size_t j = 0; j < joints; ++j) {
        Quatd rotation;
        Vec3d place = skeleton.rest_local[j].translation;
        for (const Channel& c : channels_[j]) {
          const double v = motion_[at++];
          Vec3d axis{};
          axis[c.axis] = 1.0;
          if (c.rotation) {
            rotation = rotation * axis_angle(axis, v * kRadians);
          } else {
            place[c.axis] = v * options_.scale + (replace[j] ? 0.0 : place[c.axis]);
          }
        }
        if (j == 0) {
          rotation = up * rotation;
          clip.root_translation.push_back(turn * place - root_rest);
          place = root_rest;
        }
        normalize(rotation);
        clip.rotations.push_back(rotation);
        if (moving || t == 0) clip.translations.push_back(place);
      }
    }
    skeleton.rest_local[0] = turn * skeleton.rest_local[0];
    if (Status s = clip.validate(); !s) return {Errc::invalid_file, name_ + ": " + s.message()};
    clip.wrap_time = smooth_wrap_time(skeleton, clip);
    return {};
  }

  std::string_view text_;
  std::string name_;
  BvhOptions options_;
  std::size_t line_ = 1, values_ = 0, frames_ = 0;
  double frame_time_ = 0;
  std::vector<std::vector<Channel>> channels_;
  std::vector<double> motion_;  // [frames][values]
  LoadedMotion out_;
};

}  // namespace

Result<LoadedMotion> load_bvh(const std::filesystem::path& path, const BvhOptions& options) {
  return detail::with_file(
      path, [&](const auto& file) { return BvhReader(file.text(), path.string(), options).run(); });
}

}  // namespace gsnav::io
