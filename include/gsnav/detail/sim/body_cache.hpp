// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <list>
#include <unordered_map>
#include <utility>

#include "gsnav/detail/nav/obstacles.hpp"

namespace gsnav {

/// Bodies of scenes over intervals of time, kept for whoever comes by there later: episodes that begin
/// at multiples of the control period meet the same intervals over and over. What was not used for
/// longest leaves first.
class BodyCache {
 public:
  /// A scene and an interval of time.
  struct Key {
    std::size_t scene = 0;      ///< Number of the scene.
    double t0 = 0.0, t1 = 0.0;  ///< seconds
    bool operator==(const Key&) const = default;
  };
  /// The bodies of one interval.
  struct Entry {
    CapsuleSet bodies;                 ///< Bodies over the interval.
    bool made = false;                 ///< set by whoever makes the bodies
    std::list<Key>::iterator place{};  ///< the cache's own
  };

  /// The entry of `key`, which stays where it is until trim(), and whether its bodies have yet to be
  /// made.
  std::pair<Entry*, bool> find(const Key& key) {
    const auto [at, fresh] = entries_.try_emplace(key);
    Entry& entry = at->second;
    if (fresh) {
      entry.place = order_.insert(order_.end(), key);
    } else {
      order_.splice(order_.end(), order_, entry.place);
    }
    return {&entry, fresh};
  }
  /// The bodies of `key` where they are there and made, else null.
  const CapsuleSet* peek(const Key& key) const {
    const auto at = entries_.find(key);
    return at != entries_.end() && at->second.made ? &at->second.bodies : nullptr;
  }
  /// Removes an entry if it exists.
  void erase(const Key& key) {
    const auto at = entries_.find(key);
    if (at == entries_.end()) return;
    order_.erase(at->second.place);
    entries_.erase(at);
  }
  /// Forgets the oldest entries where there are more than `most`.
  void trim(std::size_t most) {
    while (entries_.size() > most) erase(Key(order_.front()));
  }
  /// Number of entries.
  std::size_t size() const noexcept { return entries_.size(); }

 private:
  struct Hash {
    std::size_t operator()(const Key& k) const noexcept {
      const std::hash<double> of;
      return of(k.t0) * 3 + of(k.t1) + k.scene * 0x9e3779b97f4a7c15ull;
    }
  };
  std::unordered_map<Key, Entry, Hash> entries_;
  std::list<Key> order_;  // the one used last at the end
};

}  // namespace gsnav
