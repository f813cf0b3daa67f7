// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/sim/scene_library.hpp"

#include <utility>

#include "gsnav/detail/core/guarded.hpp"
#include "gsnav/scene/packed_cloud.hpp"
#include "gsnav/scene/visible_sets.hpp"

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

Result<std::shared_ptr<SceneLibrary>> SceneLibrary::create(std::vector<SceneEntry> scenes,
                                                           std::size_t budget) {
  if (scenes.empty()) return {Errc::invalid_argument, "SceneLibrary: no scene"};
  for (const SceneEntry& e : scenes) {
    if (!e.load)
      return {Errc::invalid_argument, "SceneLibrary: scene \"" + e.name + "\" has no load function"};
  }
  std::shared_ptr<SceneLibrary> library(new SceneLibrary(std::move(scenes), budget));
  library->thread_ = std::thread([p = library.get()] { p->work(); });
  return library;
}

SceneLibrary::SceneLibrary(std::vector<SceneEntry> scenes, std::size_t budget)
    : budget_(budget), slots_(scenes.size()) {
  for (std::size_t i = 0; i < scenes.size(); ++i) slots_[i].entry = std::move(scenes[i]);
}

SceneLibrary::~SceneLibrary() {
  {
    std::lock_guard lock(mutex_);
    stopping_ = true;
    news_.notify_all();
  }
  if (thread_.joinable()) thread_.join();
}

void SceneLibrary::work() {
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

void SceneLibrary::make_room() {
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

void SceneLibrary::want(std::size_t index) {
  Slot& slot = slots_[index];
  slot.used = ++now_;
  if (slot.state != State::absent) return;
  slot.state = State::wanted;
  queue_.push_back(index);
  news_.notify_all();
}

void SceneLibrary::prefetch(std::size_t index) {
  std::lock_guard lock(mutex_);
  if (index < slots_.size()) want(index);
}

Result<std::shared_ptr<const SimulatorScene>> SceneLibrary::get(std::size_t index) {
  std::unique_lock lock(mutex_);
  if (index >= slots_.size()) {
    return {Errc::invalid_argument,
            "scene " + std::to_string(index) + " of " + std::to_string(slots_.size())};
  }
  Slot& slot = slots_[index];
  want(index);
  ++slot.waiting;
  news_.wait(lock, [&] {
    if (slot.state == State::absent)
      want(index);  // Another waiting thread may have taken the error of
                    // the failed load.
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

std::size_t SceneLibrary::bytes() const {
  std::lock_guard lock(mutex_);
  return bytes_;
}

std::size_t SceneLibrary::loads() const {
  std::lock_guard lock(mutex_);
  return loads_;
}

bool SceneLibrary::holds(std::size_t index) const {
  std::lock_guard lock(mutex_);
  return slots_[index].state == State::there;
}

}  // namespace gsnav
