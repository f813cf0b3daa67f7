// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/sim/scene_library.hpp"

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <mutex>
#include <thread>
#include <utility>

#include "gsnav/detail/core/guarded.hpp"
#include "gsnav/detail/scene/view_cells.hpp"
#include "gsnav/scene/packed_cloud.hpp"

namespace gsnav {
namespace {

template <class T>
std::size_t bytes_of(const std::vector<T>& v) noexcept {
  return v.size() * sizeof(T);
}

std::size_t cloud_bytes(const GaussianCloud& c) noexcept {
  std::size_t sum = bytes_of(c.opacities) + bytes_of(c.sh0) + bytes_of(c.shN) + bytes_of(c.origin_ids) +
                    bytes_of(c.row_ids) + bytes_of(c.chunk_bounds) + bytes_of(c.part_bounds);
  for (const auto& v : c.means) sum += bytes_of(v);
  for (const auto& v : c.quats) sum += bytes_of(v);
  for (const auto& v : c.scales) sum += bytes_of(v);
  return sum;
}

Result<SimulatorScene> load(const SceneEntry& entry) {
  Result<SimulatorScene> scene = detail::guarded([&] {
    Result<SimulatorScene> loaded = entry.load();
    if (!loaded) return loaded;
    if (Status s = validate(*loaded); !s) return Result<SimulatorScene>(s);
    return loaded;
  });
  if (!scene) return {scene.code(), entry.name + ": " + scene.message()};
  return scene;
}

}  // namespace

std::size_t scene_bytes(const SimulatorScene& scene) noexcept {
  std::size_t sum = 0;
  for (const SceneAsset& a : scene.assets) {
    sum += a.packed != nullptr ? a.packed->bytes() : cloud_bytes(*a.cloud);
    sum += a.visible != nullptr ? a.visible->bytes() : 0;
  }
  const AvatarAsset* last = nullptr;
  for (const AvatarActor& a : scene.avatars) {
    if (a.asset().get() == last) continue;  // Avatars with the same body share its memory.
    last = a.asset().get();
    sum += cloud_bytes(last->cloud) + bytes_of(last->skinning_weights) + bytes_of(last->joint_indices);
  }
  return sum;
}

/// The scenes of a library, and the thread that loads them.
class SceneLibrary::Loader {
 public:
  Loader(std::vector<SceneEntry> scenes, std::size_t budget) : budget_(budget), slots_(scenes.size()) {
    for (std::size_t i = 0; i < scenes.size(); ++i) slots_[i].entry = std::move(scenes[i]);
    thread_ = std::thread([this] { work(); });
  }

  ~Loader() {
    {
      std::lock_guard lock(mutex_);
      stopping_ = true;
      news_.notify_all();
    }
    thread_.join();
  }

  std::size_t size() const noexcept { return slots_.size(); }

  void prefetch(std::size_t index) {
    std::lock_guard lock(mutex_);
    if (index < slots_.size()) want(index);
  }

  Result<std::shared_ptr<const SimulatorScene>> get(std::size_t index) {
    std::unique_lock lock(mutex_);
    if (index >= slots_.size()) {
      return {Errc::invalid_argument,
              "scene " + std::to_string(index) + " of " + std::to_string(slots_.size())};
    }
    Slot& slot = slots_[index];
    want(index);
    ++slot.waiting;
    news_.wait(lock, [&] {
      // Another waiting thread may have taken the error of the failed load.
      if (slot.state == State::absent) want(index);
      return slot.state == State::there || slot.state == State::failed;
    });
    --slot.waiting;
    if (slot.state == State::there) {
      std::shared_ptr<const SimulatorScene> scene = slot.scene;
      make_room();
      return scene;
    }
    slot.state = State::absent;
    return slot.error;
  }

  std::size_t bytes() const {
    std::lock_guard lock(mutex_);
    return bytes_;
  }

  std::size_t loads() const {
    std::lock_guard lock(mutex_);
    return loads_;
  }

  bool holds(std::size_t index) const {
    std::lock_guard lock(mutex_);
    return slots_[index].state == State::there;
  }

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

  void work() {
    std::unique_lock lock(mutex_);
    while (true) {
      news_.wait(lock, [&] { return stopping_ || !queue_.empty(); });
      if (stopping_) return;
      const std::size_t index = queue_.front();
      queue_.pop_front();
      Slot& slot = slots_[index];
      lock.unlock();
      Result<SimulatorScene> scene = load(slot.entry);
      lock.lock();
      ++loads_;
      if (scene) {
        slot.scene = std::make_shared<const SimulatorScene>(std::move(*scene));
        slot.bytes = scene_bytes(*slot.scene);
        slot.state = State::there;
        bytes_ += slot.bytes;
        make_room();
      } else {
        slot.error = scene.status();
        slot.state = State::failed;
      }
      news_.notify_all();
    }
  }

  void make_room() {
    while (bytes_ > budget_) {
      Slot* oldest = nullptr;
      for (Slot& s : slots_) {
        // Only get() hands out pointers, so a count of one is exact.
        if (s.state != State::there || s.scene.use_count() > 1 || s.waiting > 0) continue;
        if (oldest == nullptr || s.used < oldest->used) oldest = &s;
      }
      if (oldest == nullptr) return;
      bytes_ -= oldest->bytes;
      oldest->scene.reset();
      oldest->state = State::absent;
    }
  }

  void want(std::size_t index) {
    Slot& slot = slots_[index];
    slot.used = ++now_;
    if (slot.state != State::absent) return;
    slot.state = State::wanted;
    queue_.push_back(index);
    news_.notify_all();
  }

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

Result<std::shared_ptr<SceneLibrary>> SceneLibrary::create(std::vector<SceneEntry> scenes,
                                                           std::size_t budget) {
  if (scenes.empty()) return {Errc::invalid_argument, "SceneLibrary: no scene"};
  for (const SceneEntry& e : scenes) {
    if (!e.load)
      return {Errc::invalid_argument, "SceneLibrary: scene \"" + e.name + "\" has no load function"};
  }
  return std::shared_ptr<SceneLibrary>(
      new SceneLibrary(std::make_unique<Loader>(std::move(scenes), budget)));
}

SceneLibrary::SceneLibrary(std::unique_ptr<Loader> loader) : loader_(std::move(loader)) {}

SceneLibrary::~SceneLibrary() = default;

std::size_t SceneLibrary::size() const noexcept { return loader_->size(); }

void SceneLibrary::prefetch(std::size_t index) { loader_->prefetch(index); }

Result<std::shared_ptr<const SimulatorScene>> SceneLibrary::get(std::size_t index) {
  return loader_->get(index);
}

std::size_t SceneLibrary::bytes() const { return loader_->bytes(); }

std::size_t SceneLibrary::loads() const { return loader_->loads(); }

bool SceneLibrary::holds(std::size_t index) const { return loader_->holds(index); }

}  // namespace gsnav
