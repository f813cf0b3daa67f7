// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <list>
#include <unordered_map>
#include <utility>
#include <vector>

#include "gsnav/detail/nav/obstacles.hpp"

namespace gsnav {

/// Least-recently-used cache of the bodies of scenes during intervals of time. Episodes that begin at
/// multiples of the control period meet the same intervals again and again.
class BodyCache {
 public:
  /// A scene and an interval.
  struct Key {
    std::size_t scene = 0;      ///< Index of the scene.
    double t0 = 0.0, t1 = 0.0;  ///< Interval, seconds.
    bool operator==(const Key&) const = default;
  };
  /// Bodies of one key.
  struct Entry {
    CapsuleSet bodies;                 ///< The bodies during the interval.
    bool made = false;                 ///< Set by the caller once `bodies` is filled in.
    std::list<Key>::iterator place{};  ///< Position in the list of use.
  };

  /// Returns the entry of `key`, and true if it is new. The pointer stays valid until trim() or erase().
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
  /// The bodies of `key`, or null if they are not cached or not filled in yet.
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
  /// Removes the least recently used entries until at most `most` remain, and appends their bodies to
  /// `removed`, so that the caller can free them on several threads.
  void trim(std::size_t most, std::vector<CapsuleSet>& removed) {
    while (entries_.size() > most) {
      const auto at = entries_.find(order_.front());
      removed.push_back(std::move(at->second.bodies));
      order_.pop_front();
      entries_.erase(at);
    }
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
  std::list<Key> order_;  // Most recently used last.
};

}  // namespace gsnav
