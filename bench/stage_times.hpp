// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <tuple>
#include <type_traits>

#include "gsnav/render/render.hpp"

namespace gsnav_bench {

/// Stages of a frame. `other`: the calling thread's work between kernels (validation, uploads, sums).
enum class Stage { project, sort, bin, blend, other };
inline constexpr std::size_t kStages = 5;
inline constexpr const char* kStageNames[kStages] = {"project", "sort", "bin", "blend", "other"};

/// Milliseconds by stage.
using StageTimes = std::array<double, kStages>;

inline double sum_of(const StageTimes& t) noexcept { return t[0] + t[1] + t[2] + t[3] + t[4]; }

/// A host backend whose calls are timed. It measures `render_camera` as it is, call by call, so that the
/// stages and `other` together make up the whole frame. A new stage counts as `other` until it has a
/// line in stage_of_run.
template <gsnav::Backend Base>
class TimedBackend : public Base {
 public:
  using Base::Base;

  /// Begins a frame.
  void begin() noexcept {
    times_ = {};
    mark_ = Clock::now();
  }
  /// Ends the frame. @return Milliseconds by stage since begin().
  StageTimes end() noexcept {
    add(Stage::other);
    return times_;
  }

  template <class F>
  void parallel_for(std::size_t n, const F& f) {
    timed(stage_of<F>(), [&] { Base::parallel_for(n, f); });
  }
  template <class S, class... Args>
  void run(S stage, const Args&... args) requires gsnav::RunsStage<Base, S, Args...> {
    timed(stage_of_run<S, Args...>(), [&] { Base::run(stage, args...); });
  }
  template <class P>
  bool sort_pairs(P* keys, P* values, P* keys_alt, P* values_alt, std::size_t n, int bits) requires
      requires(Base& b) {
    b.sort_pairs(keys, values, keys_alt, values_alt, n, bits);
  }
  {
    bool in_alt = false;
    timed(Stage::sort, [&] { in_alt = Base::sort_pairs(keys, values, keys_alt, values_alt, n, bits); });
    return in_alt;
  }

 private:
  using Clock = std::chrono::steady_clock;

  /// The stage that a functor of a generic fallback belongs to.
  template <class F>
  static constexpr Stage stage_of() noexcept {
    using S = float;
    if constexpr (std::is_same_v<F, gsnav::ProjectChunk<S>>) {
      return Stage::project;
    } else if constexpr (std::is_same_v<F, gsnav::CountTileIntersections<S>> ||
                         std::is_same_v<F, gsnav::ScanTileIntersections<S>> ||
                         std::is_same_v<F, gsnav::ScatterTileIntersections<S>>) {
      return Stage::bin;
    } else if constexpr (
        requires(const F& f) { f.digit; } ||  // passes of the radix sort
        requires(const F& f) { f.first_record; } || std::is_same_v<F, gsnav::detail::CountInRange> ||
        std::is_same_v<F, gsnav::detail::SortTiesOfRange<gsnav::detail::EntryTies>>) {
      return Stage::sort;
    } else {
      return Stage::other;
    }
  }

  /// The stage of a kernel that the backend implements itself.
  template <class S, class... Args>
  static constexpr Stage stage_of_run() noexcept {
    namespace stage = gsnav::stage;
    if constexpr (std::is_same_v<S, stage::Project>) {
      return Stage::project;
    } else if constexpr (std::is_same_v<S, stage::CountTiles> ||
                         std::is_same_v<S, stage::ScatterTiles>) {
      return Stage::bin;
    } else if constexpr (std::is_same_v<S, stage::Blend> || std::is_same_v<S, stage::BlendWithMeshes>) {
      return Stage::blend;
    } else if constexpr (std::is_same_v<S, stage::Each>) {
      return stage_of<std::tuple_element_t<1, std::tuple<Args...>>>();
    } else {
      return Stage::other;
    }
  }

  void add(Stage stage) noexcept {
    const Clock::time_point now = Clock::now();
    times_[static_cast<std::size_t>(stage)] +=
        std::chrono::duration<double, std::milli>(now - mark_).count();
    mark_ = now;
  }
  template <class F>
  void timed(Stage stage, const F& f) {
    add(Stage::other);
    f();
    add(stage);
  }

  StageTimes times_{};
  Clock::time_point mark_{};
};

}  // namespace gsnav_bench
