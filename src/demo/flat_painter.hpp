// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <vector>

#include "gsnav/detail/demo/default_scene.hpp"
#include "gsnav/math/quat.hpp"

namespace gsnav::flat {

/// Linear-light colour of an sRGB value 0xRRGGBB.
Vec3d srgb(unsigned hex) noexcept;
/// Hash of three integers to [0, 1).
double hash01(int a, int b, int c = 0) noexcept;
/// Smooth value noise in [0, 1), one feature a unit.
double noise(double x, double y, int seed = 0) noexcept;

/// A value over a patch, parameters in [0, 1] x [0, 1].
using Field = std::function<Vec3d(double s, double t)>;

inline Field plain(const Vec3d& c) {
  return [c](double, double) { return c; };
}

/// An axis-aligned box that blocks light.
using Box = Aabb<double>;

/// A rectangle of sky that lights a room.
struct Window {
  Vec3d corner{}, u{}, v{};  ///< u x v points into the room
};

/// A small warm lamp.
struct Lamp {
  Vec3d position{};
  double power = 1.0;
};

/// A convex room with its own lights; light does not cross doorways.
struct Room {
  Box inside{};
  std::vector<Box> blockers{};
  std::vector<Box> covered{};  ///< where a rug or picture hides what lies right behind it
  std::vector<Window> windows{};
  std::vector<Lamp> lamps{};
  Vec3d bounce{};  ///< colour of light off the floor
};

/// How densely a surface is covered, metres between neighbours; v may differ from u.
struct Spacing {
  double u, v;
  Spacing(double d) : u(d), v(d) {}
  Spacing(double du, double dv) : u(du), v(dv) {}
};

/// Collects surfaces, then bakes the light and turns each into Gaussians and triangles. Lengths are
/// metres; primitives are given in a local frame (`place`) of the current room (`room`).
class Painter {
 public:
  explicit Painter(double density);

  Room& add_room(const Box& inside, const Vec3d& bounce);
  Room& room() { return rooms_.back(); }
  /// Local frame of what follows: turned by `yaw` (radians about +Y), then moved.
  void place(const Vec3d& origin = {}, double yaw = 0.0);
  Vec3d world(const Vec3d& p) const noexcept { return rotate(turn_, p) + origin_; }

  /// A surface; its front is on the side of dP/ds x dP/dt. `cells_s` x `cells_t` triangulates it.
  void patch(Field position, Field color, Spacing spacing, int cells_s, int cells_t, bool glows = false);
  void rect(const Vec3d& o, const Vec3d& a, const Vec3d& b, Field color, Spacing spacing,
            bool glows = false);

  /// Which faces of a box are made.
  enum Face : unsigned { kXn = 1, kXp = 2, kYn = 4, kYp = 8, kZn = 16, kZp = 32, kAll = 63 };
  void box(const Vec3d& low, const Vec3d& high, const Field& color, Spacing spacing,
           unsigned faces = kAll & ~unsigned{kYn}, bool blocks = true);
  void rounded_box(const Vec3d& low, const Vec3d& high, double radius, const Field& color,
                   Spacing spacing, bool blocks = true);
  /// Upright truncated cone; the top is closed where `cap`.
  void cone(const Vec3d& base, double radius0, double radius1, double height, const Field& color,
            Spacing spacing, bool cap = true, bool glows = false);
  void ellipsoid(const Vec3d& center, const Vec3d& radii, const Field& color, Spacing spacing,
                 bool glows = false);
  void disc(const Vec3d& center, double radius, const Field& color, Spacing spacing);
  void blocker(const Vec3d& low, const Vec3d& high);
  /// No Gaussians of this room within the box: sorted by their centres, they would shine through
  /// whatever lies a few millimetres in front of them.
  void cover(const Vec3d& low, const Vec3d& high);

  /// Bakes and writes everything.
  void finish(DefaultScene& scene);

 private:
  Box world_box(const Vec3d& low, const Vec3d& high) const noexcept;
  struct Patch {
    Field position, color;
    Spacing spacing;
    int cells_s, cells_t;
    bool glows, flat;
    std::size_t room;
  };
  Vec3d light_at(const Room& room, const Vec3d& p, const Vec3d& n) const;
  bool sun_at(const Room& room, const Vec3d& p, const Vec3d& n) const;
  void emit_gaussians(const Patch& patch, GaussianCloudBuilder& builder) const;
  static void emit_triangles(const Patch& patch, DefaultScene& scene);

  double stretch_;
  std::vector<Room> rooms_;
  std::vector<Patch> patches_;
  std::vector<Vec3d> hemisphere_;
  Vec3d origin_{};
  Quatd turn_{};
};

}  // namespace gsnav::flat
