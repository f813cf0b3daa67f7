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
#include "gsnav/detail/scene/load_report.hpp"
#include "gsnav/device/device.hpp"
#include "gsnav/image/camera.hpp"
#include "gsnav/math/aabb.hpp"
#include "gsnav/sim/scene.hpp"

namespace gsnav {

struct NavMeshTriangles;  // gsnav/nav/navmesh.hpp

/// How a scene's Gaussians are kept in memory.
enum class CloudStorage : std::uint8_t {
  full,     ///< float32
  compact,  ///< SH bands from 1 on as binary16: about half of the memory
  packed,   ///< all in fewer bits: a third of the memory; no levels of detail, no visible sets
};

/// Levels of detail of a scene's Gaussians.
enum class SceneLevels : std::uint8_t {
  none,
  shipped,  ///< those of a streamed set where it has any, else built
  built,    ///< built of the finest level
};

/// What open_scene reads and makes. By default it reads what is there and builds nothing.
struct OpenOptions {
  Device device{};  ///< builds levels of detail and visible sets

  // ---- Gaussians
  /// Axis of the file that points up: "x", "y", "z", with an optional sign; "auto": guessed from the
  /// ground (guess_up), or else what the file's kind usually has; "keep": the world is the file's frame.
  std::string up = "auto";
  double time = 0;  ///< seconds; the moment of a scene that moves (4D Gaussians)
  int level = 0;    ///< of a streamed set that is opened without `levels`; 0 is the finest
  CloudStorage storage = CloudStorage::full;
  /// SH bands that change no colour by more than this are let go. 0: those of zeros alone, which changes
  /// no image; kUnseenColor: those that nobody sees, for Quality::fast and levels of detail.
  double unseen_color = 0;
  bool keep_zero_bands = false;            ///< keep all SH bands of the file, those of zeros too
  SceneLevels levels = SceneLevels::none;  ///< kept beside the scene's file once they were built
  /// Triangle meshes among the Gaussians, in the frame of the scene's file: .gltf and .glb with colours
  /// and textures, .obj and .ply grey.
  std::vector<std::string> meshes{};

  // ---- NavMesh
  /// "": the one that a Habitat dataset names or that lies beside the file (`flat.navmesh` for
  /// `flat.ply`), else none; "none"; "auto": as "", else built; "mesh": built of triangles;
  /// "gaussians": built of the Gaussians, and triangles where there are any; else a file (.navmesh,
  /// .bin).
  std::string navmesh{};
  double cell_size = 0.05;                        ///< edge of its voxels, metres
  std::optional<Aabb<double>> crop{};             ///< build it in this box only; world, metres
  double agent_radius = 0.1, agent_height = 1.5;  ///< it is built for, metres
  bool keep_triangles = false;                    ///< fill OpenedScene::triangles

  // ---- what is seen from where
  /// "": none; "auto": of the places on the NavMesh, read from beside the scene's file or found and kept
  /// there; else a file (gsnav-navmesh --visible-sets).
  std::string visible_sets{};
  /// A camera like those that will look, of an agent at the world's origin: "auto" finds what such
  /// cameras see, at its height above the NavMesh and up to its focal length (VisibleSettings::serve).
  Camera eye = Camera::look_at({0, 1.5, 0}, {0, 1.5, -1}, {0, 1, 0}, 256, 256, 90);

  // ---- people
  /// Who walk about on the NavMesh, made by code alone; none: those that a Habitat dataset names.
  std::size_t people = 0;
  std::uint64_t seed = 1;  ///< of people's ways and looks
  double density = 1.0;    ///< of the Gaussians of "default" and of people, [0.05, 20]

  /// Called now and then with what is being made ("NavMesh: floors") and the share of it that is done, 0
  /// to 1. From any thread, one at a time.
  std::function<void(const std::string& task, double share)> progress{};
};

/// A scene with all that was found or asked for. World frame: metres, Y up (with OpenOptions::up "keep",
/// the file's own).
struct OpenedScene {
  std::string name;  ///< as it was asked for; "embedded flat" for "default"
  std::shared_ptr<const SimulatorScene>
      scene;                   ///< of it assets[0] are the Gaussians, where there are any
  LoadReport report;           ///< of reading the Gaussians
  std::string up = "y";        ///< axis of the file that was taken as up, as OpenOptions::up has it
  bool up_guessed = false;     ///< from the ground, report.up_confidence
  std::string navmesh_source;  ///< "from the mesh", "from FILE", ...; empty: there is none
  /// World; those that a NavMesh may be built of. Null without OpenOptions::keep_triangles.
  std::shared_ptr<const NavMeshTriangles> triangles;
  std::vector<std::string> notes;                ///< what was found and made, step by step
  std::vector<std::string> warnings;             ///< what was left out or taken otherwise than asked for
  double load_seconds = 0, navmesh_seconds = 0;  ///< time taken
};

/// Opens a scene by its name:
///
///     "default"                                   the flat that gsnav makes by code alone
///     flat.ply, flat.spz, flat.sog, flat.glb ...  what io::load_scene reads; a folder, tiles:
///     DIR/2_0,2_1 room.glb, room.obj                          triangles alone
///     set.scene_dataset_config.json#NAME          a scene of a Habitat dataset; #NAME may be left out
///     of a
///                                                 dataset of one
///     flat.stage_config.json                      a Habitat stage
///
/// Errors name the file or the option: invalid_argument; file_not_found; unsupported; invalid_file;
/// nothing_navigable (a NavMesh that was asked for); out_of_memory; backend_failure.
Result<OpenedScene> open_scene(const std::string& name, const OpenOptions& options = {});

/// `count` cameras on a circle around a scene, slightly above it, that look at its middle. World frame.
/// `hfov`: horizontal field of view, degrees. Errors: as of framing_camera.
Result<std::vector<Camera>> views_around(const OpenedScene& scene, int count, int width, int height,
                                         double hfov = 60);

/// A camera that shows a scene: at eye height on the largest place of its NavMesh, where it has one,
/// looking the longest way; else from outside, slightly above, at its middle. `hfov`: degrees. Errors:
/// invalid_argument (a size or an angle that cannot be; a scene with nothing to look at).
Result<Camera> framing_camera(const OpenedScene& scene, int width, int height, double hfov = 75);

}  // namespace gsnav
