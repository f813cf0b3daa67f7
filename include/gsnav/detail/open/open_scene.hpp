// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "gsnav/core/status.hpp"
#include "gsnav/detail/nav/navmesh_settings.hpp"
#include "gsnav/detail/scene/load_report.hpp"
#include "gsnav/device/device.hpp"
#include "gsnav/image/camera.hpp"
#include "gsnav/math/aabb.hpp"
#include "gsnav/sim/scene.hpp"

namespace gsnav {

struct NavMeshTriangles;  // gsnav/nav/navmesh.hpp

/// How a scene's Gaussians are kept in memory.
enum class CloudStorage : std::uint8_t {
  full,     ///< Float32.
  compact,  ///< SH bands 1 to 3 as binary16: about half of the memory.
  packed,   ///< Everything in fewer bits: a third of the memory, but no levels of detail and no visible
            ///< sets.
};

/// Levels of detail of a scene's Gaussians.
enum class SceneLevels : std::uint8_t {
  none,     ///< The Gaussians of the finest level alone.
  shipped,  ///< Those that a streamed set ships, or else built ones.
  built,    ///< Built from the finest level.
};

/// What open_scene reads and builds. By default it reads what exists and builds nothing.
struct OpenOptions {
  Device device{};  ///< Device that builds levels of detail and visible sets.

  // ---- Gaussians
  /// Axis of the file that points up:
  /// - "x", "y" or "z", with an optional sign.
  /// - "auto": guessed from the ground (guess_up), or else the usual axis of the file's format.
  /// - "keep": the world is the file's frame.
  std::string up = "auto";
  double time = 0;  ///< Seconds: the moment of a scene that moves (4D Gaussians).
  int level = 0;    ///< Level of a streamed set that is opened without `levels`; 0 is the finest.
  CloudStorage storage = CloudStorage::full;  ///< How Gaussians are kept in memory.
  /// Largest change of a colour for which SH bands are dropped. 0 drops only bands of zeros, which
  /// changes no image. kUnseenColor drops bands too weak to be seen, for Quality::fast and levels of
  /// detail.
  double unseen_color = 0;
  bool keep_zero_bands = false;            ///< Keep all SH bands of the file, also those of zeros.
  SceneLevels levels = SceneLevels::none;  ///< Levels of detail. Built ones are stored next to the
                                           ///< scene's file. People get levels too.
  /// Paths of triangle meshes to draw among the Gaussians, in the frame of the scene's file: .gltf and
  /// .glb with colours and textures, .obj and .ply grey.
  std::vector<std::string> meshes{};

  // ---- NavMesh
  /// The NavMesh:
  /// - "": the one that a Habitat dataset names or that is next to the file (`flat.navmesh` for
  ///   `flat.ply`), else none.
  /// - "none": none.
  /// - "auto": as "", or else as "build".
  /// - "build": built from the triangles of a scene that has no Gaussians or a mesh for collisions, else
  ///   as "gaussians".
  /// - "mesh": built from triangles.
  /// - "gaussians": built from the Gaussians, and from triangles if there are any.
  /// - otherwise a file (.navmesh, .bin).
  std::string navmesh{};
  /// Settings of a built NavMesh, instead of `cell_size`, `agent_radius` and `agent_height`. Those of
  /// Gaussians have voxels of at most 0.05 m height, or of the cell size if that is larger. Empty:
  /// the defaults of NavMeshSettings with the fields below.
  std::optional<NavMeshSettings> navmesh_settings{};
  double cell_size = 0.05;                        ///< Edge of the voxels from which a NavMesh is built,
                                                  ///< metres.
  std::optional<Aabb<double>> crop{};             ///< Builds the NavMesh in this box only; world frame,
                                                  ///< metres.
  double agent_radius = 0.1, agent_height = 1.5;  ///< Size of the agent for which the NavMesh is built,
                                                  ///< metres.
  bool keep_triangles = false;                    ///< Fill OpenedScene::triangles.

  // ---- Visible sets
  /// Visible sets:
  /// - "": none.
  /// - "auto": read from next to the scene's file, or else computed for the places on the NavMesh and
  ///   stored there.
  /// - otherwise a file (gsnav-navmesh --visible-sets).
  std::string visible_sets{};
  /// A camera like those that will render, of an agent at the world's origin. "auto" computes visible
  /// sets for its height above the NavMesh and up to its focal length (VisibleSettings::serve).
  Camera eye = Camera::look_at({0, 1.5, 0}, {0, 1.5, -1}, {0, 1, 0}, 256, 256, 90);

  // ---- People
  /// Number of procedural people who walk on the NavMesh. 0: those of a Habitat dataset, if any.
  std::size_t people = 0;
  std::uint64_t seed = 1;  ///< Seed of the people's paths and looks.
  double density = 1.0;    ///< Factor on the number of Gaussians of "default" and of people, in
                           ///< [0.05, 20].

  /// Called from time to time with the current task ("NavMesh: floors") and the share of it that is
  /// done, in [0, 1]. Calls come from any thread, one at a time. An exception of it leaves open_scene
  /// when all threads have ended their part of the task.
  std::function<void(const std::string& task, double share)> progress{};
};

/// A scene with everything that was found or asked for. World frame: metres, Y up (with OpenOptions::up
/// "keep", the file's own frame).
struct OpenedScene {
  std::string name;  ///< The name that was opened; "embedded flat" for "default".
  std::shared_ptr<const SimulatorScene> scene;  ///< assets[0] of it are the Gaussians, if there are any.
  LoadReport report;                            ///< Report of reading the Gaussians.
  std::string up = "y";                         ///< The file's up axis, in the form of OpenOptions::up.
  bool up_guessed = false;     ///< Whether `up` was guessed from the ground; report.up_confidence
                               ///< then applies.
  std::string navmesh_source;  ///< Origin of the NavMesh, such as "from the mesh" or "from FILE";
                               ///< empty without one.
  /// World frame: the triangles that a NavMesh may be built from. Null without
  /// OpenOptions::keep_triangles.
  std::shared_ptr<const NavMeshTriangles> triangles;
  std::vector<std::string> notes;                ///< A line for each thing that was found or built.
  std::vector<std::string> warnings;             ///< A line for each thing that was left out, or done
                                                 ///< differently than asked for.
  double load_seconds = 0, navmesh_seconds = 0;  ///< Seconds taken.
};

/// Opens a scene by its name:
///
///     "default"                             the flat that gsnav makes without any data
///     flat.ply, flat.spz, flat.sog, ...     any file that io::load_scene reads
///     DIR, DIR/2_0,2_1                      a folder; tiles
///     room.glb, room.obj                    triangles alone
///     set.scene_dataset_config.json#NAME    a scene of a Habitat dataset; #NAME is
///                                           optional if the dataset has one scene
///     flat.stage_config.json                a Habitat stage
///
/// Errors name the file or the option: invalid_argument; file_not_found; unsupported; invalid_file;
/// nothing_navigable (a NavMesh that was asked for); out_of_memory; backend_failure.
Result<OpenedScene> open_scene(const std::string& name, const OpenOptions& options = {});

/// `count` cameras on a circle around a scene, slightly above it, looking at its middle. World frame.
/// `hfov` is the horizontal field of view, degrees. Errors: those of framing_camera; invalid_argument
/// for a count that is not in [1, 100000].
Result<std::vector<Camera>> views_around(const OpenedScene& scene, int count, int width, int height,
                                         double hfov = 60);

/// A camera that shows a scene. With a NavMesh: at eye height on its largest island, looking in the
/// direction with the longest view. Without: from outside, slightly above, at the middle of the scene.
/// `hfov` is the horizontal field of view, degrees. Errors: invalid_argument (a size or an angle out of
/// range; a scene with nothing to look at).
Result<Camera> framing_camera(const OpenedScene& scene, int width, int height, double hfov = 75);

}  // namespace gsnav
