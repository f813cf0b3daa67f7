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
/// Smooth value noise in [0, 1), with one feature per unit.
double noise(double x, double y, int seed = 0) noexcept;

/// A function over a patch, with parameters in [0, 1] x [0, 1].
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
  std::vector<Box> covered{};  ///< Boxes of rugs and pictures, which hide the surface right behind them.
  std::vector<Window> windows{};
  std::vector<Lamp> lamps{};
  Vec3d bounce{};  ///< Colour of light reflected by the floor.
};

/// Distances between neighbouring Gaussians on a surface, metres, along u and v.
struct Spacing {
  double u, v;
  Spacing(double d) : u(d), v(d) {}
  Spacing(double du, double dv) : u(du), v(dv) {}
};

/// Collects surfaces, then bakes the light and turns each surface into Gaussians and triangles. Lengths
/// are in metres. Primitives are given in a local frame (`place`) of the current room (`room`).
class Painter {
 public:
  Painter();

  /// Depth of trims and picture frames, relative to that in the embedded flat. Deeper ones cover the
  /// wall behind them from more directions, because Gaussians are drawn in the order of their centres.
  double relief = 1.0;

  Room& add_room(const Box& inside, const Vec3d& bounce);
  Room& room() { return rooms_.back(); }
  /// Sets the local frame of the following primitives: rotated by `yaw` (radians about +Y), then moved
  /// to `origin`.
  void place(const Vec3d& origin = {}, double yaw = 0.0);
  Vec3d world(const Vec3d& p) const noexcept { return rotate(turn_, p) + origin_; }

  /// Adds a surface. Its front is on the side of dP/ds x dP/dt; `cells_s` x `cells_t` cells are
  /// triangulated.
  void patch(Field position, Field color, Spacing spacing, int cells_s, int cells_t, bool glows = false);
  void rect(const Vec3d& o, const Vec3d& a, const Vec3d& b, Field color, Spacing spacing,
            bool glows = false);

  /// Faces of a box, as a bitmask.
  enum BoxFace : unsigned { kXn = 1, kXp = 2, kYn = 4, kYp = 8, kZn = 16, kZp = 32, kAll = 63 };
  void box(const Vec3d& low, const Vec3d& high, const Field& color, Spacing spacing,
           unsigned faces = kAll & ~unsigned{kYn}, bool blocks = true);
  void rounded_box(const Vec3d& low, const Vec3d& high, double radius, const Field& color,
                   Spacing spacing, bool blocks = true);
  /// Adds an upright truncated cone; its top is closed if `cap`.
  void cone(const Vec3d& base, double radius0, double radius1, double height, const Field& color,
            Spacing spacing, bool cap = true, bool glows = false);
  void ellipsoid(const Vec3d& center, const Vec3d& radii, const Field& color, Spacing spacing,
                 bool glows = false);
  void disc(const Vec3d& center, double radius, const Field& color, Spacing spacing);
  void blocker(const Vec3d& low, const Vec3d& high);
  /// Keeps the box free of this room's Gaussians. As they are sorted by their centres, they would shine
  /// through things a few millimetres in front of them.
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
  /// Number of Gaussians of a patch, and of its rows without covered points.
  struct Counted {
    std::size_t gaussians = 0, open_rows = 0;
  };
  /// How patches are cut into Gaussians.
  struct PatchSplit {
    double stretch = 1;         ///< Factor on all spacings.
    std::size_t gaussians = 0;  ///< Total number.
    std::size_t rows = 0;       ///< Open rows, counted through all patches.
    std::size_t missing = 0;    ///< Gaussians that open rows get in addition to those from `stretch`.
    std::vector<Counted> patches;

    /// The part of `missing` for one open row; it is shared out evenly.
    int extra(std::size_t row) const noexcept {
      return static_cast<int>((row + 1) * missing / rows - row * missing / rows);
    }
  };
  class PatchLight;
  /// Gaussians of a patch.
  struct Made {
    std::vector<RawGaussian> rows;
    std::vector<float> shN;  ///< SH of the rows, one after the other; empty for degree 0
  };

  Box world_box(const Vec3d& low, const Vec3d& high) const noexcept;
  Vec3d light_at(const Room& room, const Vec3d& p, const Vec3d& n) const;
  bool sun_at(const Room& room, const Vec3d& p, const Vec3d& n) const;
  std::vector<Box> covers_of(const Patch& patch) const;
  Counted count(const Patch& patch, double stretch) const;
  Result<PatchSplit> cut_at(double stretch, ThreadPool& pool) const;
  /// The cut that gives exactly `gaussians`.
  Result<PatchSplit> cut_into(std::size_t gaussians, ThreadPool& pool) const;
  void emit_gaussians(const Patch& patch, const PatchSplit& cut, std::size_t first_row, int sh_degree,
                      Made& out) const;
  Status emit(const PatchSplit& cut, const SceneSampling& sampling, ThreadPool& pool,
              GaussianCloudBuilder& builder) const;
  /// Writes the bands from 1 on of a Gaussian, as RawGaussian::shN has them.
  void write_sheen(const Room& room, const Vec3d& p, const Vec3d& normal, int sh_degree,
                   float* shN) const noexcept;
  static void emit_triangles(const Patch& patch, DefaultScene& scene);
  /// Display-referred colour of a point of the patch. `light` is null if it glows.
  Vec3d shown(const Patch& patch, const PatchLight* light, double s, double t,
              const Vec3d& normal) const;
  /// Appends the patch as a grid of triangles, whose vertices are as far apart as Gaussians.
  void emit_painted(const Patch& patch, double stretch, TexturedPart& out) const;
  Status emit_painted(const PatchSplit& cut, const SceneSampling& sampling, ThreadPool& pool,
                      DefaultScene& scene) const;

  std::vector<Room> rooms_;
  std::vector<Patch> patches_;
  std::vector<Vec3d> hemisphere_;
  Vec3d origin_{};
  Quatd turn_{};
};

}  // namespace gsnav::flat
