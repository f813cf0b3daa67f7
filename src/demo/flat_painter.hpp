// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <vector>

#include "gsnav/detail/core/thread_pool.hpp"
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
  Painter();

  /// Depth of trims and picture frames against the embedded flat's. Deeper ones hide the wall behind
  /// them from more directions: Gaussians are drawn in the order of their centres.
  double relief = 1.0;

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

  /// Bakes the light and makes the scene. Errors: invalid_argument (sampling), out_of_memory.
  Result<DefaultScene> finish(const SceneSampling& sampling) const;

 private:
  struct Patch {
    Field position, color;
    Spacing spacing;
    int cells_s, cells_t;
    bool glows, flat;
    std::size_t room;
  };
  /// Gaussians of a patch, and rows of it that nothing covers.
  struct Counted {
    std::size_t gaussians = 0, open_rows = 0;
  };
  /// How patches are cut into Gaussians.
  struct Cut {
    double stretch = 1;         ///< of all spacings
    std::size_t gaussians = 0;  ///< altogether
    std::size_t rows = 0;       ///< open rows, numbered through all patches
    std::size_t missing = 0;    ///< Gaussians that open rows get beyond what `stretch` gives
    std::vector<Counted> patches;

    /// Of `missing` that of one open row: shared out evenly.
    int extra(std::size_t row) const noexcept {
      return static_cast<int>((row + 1) * missing / rows - row * missing / rows);
    }
  };
  class PatchLight;
  /// Gaussians of a patch.
  struct Made {
    std::vector<RawGaussian> rows;
    std::vector<float> shN;  ///< theirs, one after the other; empty for degree 0
  };

  Box world_box(const Vec3d& low, const Vec3d& high) const noexcept;
  Vec3d light_at(const Room& room, const Vec3d& p, const Vec3d& n) const;
  bool sun_at(const Room& room, const Vec3d& p, const Vec3d& n) const;
  std::vector<Box> covers_of(const Patch& patch) const;
  Counted count(const Patch& patch, double stretch) const;
  Result<Cut> cut_at(double stretch, ThreadPool& pool) const;
  /// The cut that gives exactly so many.
  Result<Cut> cut_into(std::size_t gaussians, ThreadPool& pool) const;
  void emit_gaussians(const Patch& patch, const Cut& cut, std::size_t first_row, int sh_degree,
                      Made& out) const;
  Status emit(const Cut& cut, const SceneSampling& sampling, ThreadPool& pool,
              GaussianCloudBuilder& builder) const;
  /// Writes the bands from 1 on of a Gaussian, as RawGaussian::shN has them.
  void write_sheen(const Room& room, const Vec3d& p, const Vec3d& normal, int sh_degree,
                   float* shN) const noexcept;
  static void emit_triangles(const Patch& patch, DefaultScene& scene);

  std::vector<Room> rooms_;
  std::vector<Patch> patches_;
  std::vector<Vec3d> hemisphere_;
  Vec3d origin_{};
  Quatd turn_{};
};

}  // namespace gsnav::flat
