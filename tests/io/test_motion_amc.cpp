// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <random>
#include <string>

#include "allocations.hpp"
#include "gsnav/detail/io/motion_file.hpp"
#include "pose_at.hpp"
#include "support/data.hpp"
#include "support/files.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

const char* const kSkeleton =
    "# a comment\n:version 1.10\n:name test\n:units\n  mass 1.0\n  length 0.5\n  angle deg\n:root\n"
    "   order TX TY TZ RX RY RZ\n   axis XYZ\n   position 1 2 3\n   orientation 0 0 30\n:bonedata\n"
    "  begin\n   id 1\n   name arm\n   direction 0 1 0\n   length 4\n   axis 10 20 30 XYZ\n   dof rx ry "
    "rz\n"
    "   limits (-160.0 20.0)\n          (-70.0 70.0)\n  end\n"
    "  begin\n   id 2\n   name hand\n   direction 0.6 0 0.8\n   length 2\n   axis -90 5 7 ZXY\n   dof "
    "rz rx\n  end\n"
    "  begin\n   id 3\n   name fixed\n   direction -1 0 0\n   length 3\n   axis 0 0 0 XYZ\n  end\n"
    ":hierarchy\n  begin\n    root arm fixed\n    arm hand\n  end\n";
const char* const kMotion =
    "#!OML:ASF test\n:FULLY-SPECIFIED\n:DEGREES\n1\nroot 5 6 7 10 20 30\narm 40 50 60\nhand 70 -80\n"
    "2\nhand 1 2\nroot -1 0 1 -170 3 4e1\narm 0 +5 -5.5\n";

Result<io::LoadedMotion> load(const std::string& skeleton, const std::string& motion,
                              const io::AmcOptions& options = {}) {
  TempFolder folder("amc");
  write_file(folder / "some.asf", skeleton);
  write_file(folder / "some.amc", motion);
  return io::load_amc(folder / "some.asf", folder / "some.amc", options);
}

using Real = long double;
using Matrix = std::array<std::array<Real, 3>, 3>;

Matrix operator*(const Matrix& a, const Matrix& b) {
  Matrix c{};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      for (std::size_t k = 0; k < 3; ++k) c[i][j] += a[i][k] * b[k][j];
    }
  }
  return c;
}
Matrix transposed(const Matrix& a) {
  Matrix t{};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) t[i][j] = a[j][i];
  }
  return t;
}
Matrix about(char axis, Real degrees) {
  const Real a = degrees * std::acos(Real{-1}) / 180, c = std::cos(a), s = std::sin(a);
  if (axis == 'X') return {{{1, 0, 0}, {0, c, -s}, {0, s, c}}};
  if (axis == 'Y') return {{{c, 0, s}, {0, 1, 0}, {-s, 0, c}}};
  return {{{c, -s, 0}, {s, c, 0}, {0, 0, 1}}};
}
Vec3d at(const Matrix& m, const Vec3d& v) {
  Vec3d out;
  for (std::size_t i = 0; i < 3; ++i) {
    out[static_cast<int>(i)] =
        static_cast<double>(m[i][0] * static_cast<Real>(v.x) + m[i][1] * static_cast<Real>(v.y) +
                            m[i][2] * static_cast<Real>(v.z));
  }
  return out;
}

}  // namespace

TEST_CASE("amc: kinematics against matrices in long double") {
  const io::LoadedMotion m = load(kSkeleton, kMotion).value();
  CHECK(m.clip.frame_rate == 120.0);
  REQUIRE(m.clip.frames() == 2);
  REQUIRE(m.skeleton.size() == 6);
  const double unit = 0.0254 / 0.5;
  const Real f[2][11] = {{5, 6, 7, 10, 20, 30, 40, 50, 60, 70, -80},
                         {-1, 0, 1, -170, 3, 40, 0, 5, -5.5L, 1, 2}};
  for (std::size_t t = 0; t < 2; ++t) {
    // C M C^-1, with the first angle turned by first.
    const Matrix root_axis = about('Z', 30), arm_axis = about('Z', 30) * about('Y', 20) * about('X', 10);
    const Matrix hand_axis = about('Y', 7) * about('X', 5) * about('Z', -90);
    const Matrix root = root_axis * (about('Z', f[t][5]) * about('Y', f[t][4]) * about('X', f[t][3])) *
                        transposed(root_axis);
    const Matrix arm = root * arm_axis *
                       (about('Z', f[t][8]) * about('Y', f[t][7]) * about('X', f[t][6])) *
                       transposed(arm_axis);
    const Matrix hand =
        arm * hand_axis * (about('X', f[t][10]) * about('Z', f[t][9])) * transposed(hand_axis);
    const Vec3d place{static_cast<double>(1 + f[t][0]), static_cast<double>(2 + f[t][1]),
                      static_cast<double>(3 + f[t][2])};
    const Vec3d elbow = place + at(arm, {0, 4, 0}), tip = elbow + at(hand, Vec3d{0.6, 0, 0.8} * 2.0);
    const auto globals = pose_at(m, static_cast<double>(t) / 120);
    const auto joint = [&](const char* name) {
      return globals[static_cast<std::size_t>(m.skeleton.find(name))];
    };
    CHECK(norm(joint("root").translation - place * unit) < 1e-12);
    CHECK(norm(joint("arm").translation - place * unit) < 1e-12);
    CHECK(norm(joint("hand").translation - elbow * unit) < 1e-12);
    CHECK(norm(joint("hand_end").translation - tip * unit) < 1e-12);
    CHECK(norm(joint("fixed_end").translation - (place + at(root, {-3, 0, 0})) * unit) < 1e-12);
    for (int i = 0; i < 3; ++i) {
      for (int k = 0; k < 3; ++k) {
        const Real want = hand[static_cast<std::size_t>(i)][static_cast<std::size_t>(k)];
        CHECK(std::abs(joint("hand").linear(i, k) - static_cast<double>(want)) < 1e-12);
      }
    }
  }
  const io::LoadedMotion other = load(kSkeleton, kMotion, {60, 0.1, true}).value();
  const auto a = pose_at(m, 0.004), b = pose_at(other, 0.008);
  for (std::size_t j = 0; j < a.size(); ++j) {
    const Vec3d p = a[j].translation * (0.1 / unit);
    CHECK(norm(b[j].translation - Vec3d{p.x, p.z, -p.y}) < 1e-12);
  }
}

TEST_CASE("amc: what is wrong is named with its file and line") {
  const auto fails = [](const std::string& from, const std::string& to, const std::string& part,
                        Errc code = Errc::invalid_file) {
    std::string skeleton = kSkeleton, motion = kMotion;
    const bool first = skeleton.find(from) != skeleton.npos;
    std::string& text = first ? skeleton : motion;
    text.replace(text.find(from), from.size(), to);
    const Status s = load(skeleton, motion).status();
    CAPTURE(s.message());
    CHECK(s.code() == code);
    CHECK(contains(s.message(), first ? "some.asf" : "some.amc"));
    CHECK(contains(s.message(), part));
  };
  fails("length 4", "length four", "line 18: 'four' is not a number");
  fails("length 0.5", "length 0", "length is not positive");
  fails("angle deg", "angle grad", "'grad'");
  fails("name hand", "name arm", "bone 'arm' twice");
  fails("axis 10 20 30 XYZ", "axis 10 20 30 XXZ", "'XXZ' is no order of axes");
  fails("dof rz rx", "dof rz tx", "dof 'tx'", Errc::unsupported);
  fails("arm hand\n", "arm leg\n", "there is no bone 'leg'");
  fails("arm hand\n", "arm hand\n hand arm\n", "hangs on two bones");
  fails("root arm fixed", "root fixed\n hand arm", "is in no hierarchy");
  fails("order TX", "order QX", "'QX' is not a channel");
  fails("hand 1 2\n", "", "a frame of 2 bones, must be 3");
  fails("hand 1 2\n", "hand 1\n", "line 9: bone 'hand' has 1 values, must be 2");
  fails("hand 1 2\n", "tail 1 2\n", "there is no bone 'tail'");
  fails("hand 1 2\n", "hand 1 nan\n", "'nan' is not a number");
  fails("hand 1 2\n", "hand 1 2\nhand 1 2\n", "twice in a frame");
  fails("1\nroot 5", "root 5", "before the first frame");
  CHECK(contains(load(kSkeleton, ":DEGREES\n").status().message(), "no frames"));
  CHECK(load(kSkeleton, kMotion, {0.0}).code() == Errc::invalid_argument);
  CHECK(load(kSkeleton, kMotion, {120, -1}).code() == Errc::invalid_argument);
  CHECK(io::load_amc("/none/a.asf", "/none/a.amc").code() == Errc::file_not_found);
  std::mt19937 generator(4);
  int refused = 0;
  for (int i = 0; i < 2000; ++i) {
    std::string text[2] = {kSkeleton, kMotion};
    std::string& changed = text[generator() % 2];
    const std::size_t place = generator() % changed.size();
    if (i % 4 == 0) {
      changed.resize(place);
    } else {
      changed[place] =
          i % 4 == 1 ? "0123456789-.eE :\n"[generator() % 17] : static_cast<char>(generator());
    }
    reset_largest_allocation();
    const auto m = load(text[0], text[1]);
    REQUIRE(largest_allocation() < 1000000);
    REQUIRE((m.ok() || contains(m.status().message(), "some.")));
    refused += m.ok() ? 0 : 1;
  }
  std::printf("amc: of 2000 mutations %d were refused\n", refused);
  CHECK(refused > 700);
}

TEST_CASE("amc: somebody walks on two feet") {
  const std::string asf = data_file("avatars/cmu_mocap/11.asf"),
                    amc = data_file("avatars/cmu_mocap/11_01.amc");
  if (asf.empty() || amc.empty()) return;
  const auto m = io::load_amc(asf, amc);
  CAPTURE(m.status().message());
  REQUIRE(m.ok());
  const auto joint = [&](const auto& g, const char* name) {
    return g[static_cast<std::size_t>(m->skeleton.find(name))].translation;
  };
  double lowest = 9, highest = -9, head = 9;
  for (std::size_t t = 0; t < m->clip.frames(); ++t) {
    const auto g = pose_at(*m, static_cast<double>(t) / 120);
    const double foot = std::min(joint(g, "ltoes_end").y, joint(g, "rtoes_end").y);
    lowest = std::min(lowest, foot);
    highest = std::max(highest, foot);
    head = std::min(head, joint(g, "head_end").y);
  }
  const Vec3d way = m->clip.root_translation.back() - m->clip.root_translation.front();
  std::printf(
      "11_01: %zu frames, %.2f m, the lower tip of the toes is %.3f to %.3f m high, the head's top at "
      "least %.2f m\n",
      m->clip.frames(), norm(way), lowest, highest, head);
  // The floor of the recording is y = 0; one foot is always down.
  CHECK(lowest > -0.05);
  CHECK(highest < 0.14);  // between two steps one foot is on its heel, the other on its toes
  CHECK(head > 1.4);
  CHECK(norm(way) > 2.0);
}
