// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <unordered_map>
#include <utility>
#include <vector>

#include "gsnav/nav/obstacles.hpp"

namespace gsnav {

/// Bodies of scenes over intervals of time, kept for whoever comes by there later: episodes that begin at multiples of
/// the control period meet the same intervals over and over. What was not used for longest leaves first.
class BodyCache {
 public:
  struct Key {
    std::size_t scene = 0;
    double t0 = 0.0, t1 = 0.0;  ///< seconds
    bool operator==(const Key&) const = default;
  };
  struct Entry {
    CapsuleSet bodies;
    std::uint64_t used = 0;
    bool made = false;  // set by whoever makes the bodies
  };

  /// The entry of `key`, which stays where it is until trim(), and whether its bodies have yet to be made.
  std::pair<Entry*, bool> find(const Key& key) {
    const auto [at, fresh] = entries_.try_emplace(key);
    at->second.used = now_;
    return {&at->second, fresh};
  }
  /// The bodies of `key` where they are there and made, else null.
  const CapsuleSet* peek(const Key& key) const {
    const auto at = entries_.find(key);
    return at != entries_.end() && at->second.made ? &at->second.bodies : nullptr;
  }
  void erase(const Key& key) { entries_.erase(key); }
  /// Forgets the oldest entries where there are more than `most`, some at once so that it is seldom done.
  void trim(std::size_t most) {
    ++now_;
    if (entries_.size() <= most) return;
    ages_.clear();
    for (const auto& e : entries_) ages_.push_back(e.second.used);
    const auto keep = static_cast<std::ptrdiff_t>(most - most / 8);
    std::nth_element(ages_.begin(), ages_.begin() + keep, ages_.end(), std::greater<>());
    std::erase_if(entries_, [last = ages_[static_cast<std::size_t>(keep)]](const auto& e) { return e.second.used <= last; });
  }
  std::size_t size() const noexcept { return entries_.size(); }

 private:
  struct Hash {
    std::size_t operator()(const Key& k) const noexcept {
      const std::hash<double> of;
      return of(k.t0) * 3 + of(k.t1) + k.scene * 0x9e3779b97f4a7c15ull;
    }
  };
  std::unordered_map<Key, Entry, Hash> entries_;
  std::vector<std::uint64_t> ages_;
  std::uint64_t now_ = 1;
};

}  // namespace gsnav
