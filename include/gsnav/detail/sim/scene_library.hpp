// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "gsnav/sim/scene.hpp"

namespace gsnav {

/// Bytes of host memory that the Gaussians, avatars and capsules of a scene take. The NavMesh is not
/// counted; it is small in comparison.
std::size_t scene_bytes(const SimulatorScene& scene) noexcept;

/// A scene that is loaded on demand.
struct SceneEntry {
  std::string name;                              ///< Name in messages, for example the path of a file.
  std::function<Result<SimulatorScene>()> load;  ///< Loads the scene, on another thread. It must return
                                                 ///< the same scene each time.
};

/// Cache of scenes, by index. One background thread loads scenes. When the memory budget is exceeded,
/// the least recently used scene that is not in use is freed. Thread-safe.
class SceneLibrary {
 public:
  /// Creates a library.
  /// @param scenes Names of the scenes, with the functions that load them.
  /// @param budget Memory budget in bytes, as counted by scene_bytes(). Scenes in use may exceed it.
  /// @return invalid_argument if there are no scenes or one has no load function.
  static Result<std::shared_ptr<SceneLibrary>> create(std::vector<SceneEntry> scenes,
                                                      std::size_t budget);
  /// Waits for the scene that is being loaded.
  ~SceneLibrary();
  SceneLibrary(const SceneLibrary&) = delete;
  SceneLibrary& operator=(const SceneLibrary&) = delete;

  /// Number of scenes.
  std::size_t size() const noexcept;
  /// Starts loading scene `index` unless it is in memory.
  void prefetch(std::size_t index);
  /// Returns scene `index`, after waiting for it to load. A load that failed is repeated at the next
  /// call.
  /// @return invalid_argument if there is no such scene; an error of loading, with the scene's name.
  Result<std::shared_ptr<const SimulatorScene>> get(std::size_t index);

  /// Memory of the scenes held, in bytes.
  std::size_t bytes() const;
  /// Number of loads so far.
  std::size_t loads() const;
  /// True if scene `index` is in memory.
  bool holds(std::size_t index) const;

 private:
  class Loader;  // keeps <thread> and <mutex> out of this header

  explicit SceneLibrary(std::unique_ptr<Loader> loader);

  std::unique_ptr<Loader> loader_;
};

}  // namespace gsnav
