// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "gsnav/sim/scene.hpp"

namespace gsnav {

/// Bytes that a scene's Gaussians, its people and their capsules take on the host; a NavMesh is small
/// beside them.
std::size_t scene_bytes(const SimulatorScene& scene) noexcept;

/// A scene that is loaded when somebody needs it.
struct SceneEntry {
  std::string name;                              ///< for messages, a file's path say
  std::function<Result<SimulatorScene>()> load;  ///< by another thread; gives the same scene each time
};

/// Scenes by number, loaded in the background by one thread and kept while they fit a budget. Where they
/// do not, the one that was used least recently leaves first; one that somebody holds stays. Any thread
/// may use it.
class SceneLibrary {
 public:
  /// `budget` is in bytes, as scene_bytes counts; what is in use may exceed it. Errors: invalid_argument
  /// (no scene; one without a way to load it).
  static Result<std::shared_ptr<SceneLibrary>> create(std::vector<SceneEntry> scenes,
                                                      std::size_t budget);
  ~SceneLibrary();  ///< waits for the scene that is being loaded
  SceneLibrary(const SceneLibrary&) = delete;
  SceneLibrary& operator=(const SceneLibrary&) = delete;

  /// Number of scenes.
  std::size_t size() const noexcept { return slots_.size(); }
  /// Begins to load scene `index`, unless it is there.
  void prefetch(std::size_t index);
  /// Scene `index`, when it has been loaded. Errors: invalid_argument (there is none); what loading
  /// reports, with the scene's name. What failed is tried again the next time.
  Result<std::shared_ptr<const SimulatorScene>> get(std::size_t index);

  /// What is held now, and how many scenes were loaded so far.
  std::size_t bytes() const;
  std::size_t loads() const;            ///< How many scenes have been loaded so far.
  bool holds(std::size_t index) const;  ///< Whether scene `index` is in memory.

 private:
  enum class State : std::uint8_t { absent, wanted, there, failed };
  struct Slot {
    SceneEntry entry;
    State state = State::absent;
    std::shared_ptr<const SimulatorScene> scene;
    Status error;
    std::size_t bytes = 0;
    std::uint64_t used = 0;
    std::size_t waiting = 0;
  };

  SceneLibrary(std::vector<SceneEntry> scenes, std::size_t budget);
  void work();
  void want(std::size_t index);
  void make_room();

  const std::size_t budget_;
  mutable std::mutex mutex_;
  std::condition_variable news_;
  std::vector<Slot> slots_;
  std::deque<std::size_t> queue_;
  std::uint64_t now_ = 0;
  std::size_t bytes_ = 0, loads_ = 0;
  bool stopping_ = false;
  std::thread thread_;
};

}  // namespace gsnav
