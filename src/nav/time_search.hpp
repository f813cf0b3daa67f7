// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <utility>
#include <vector>

#include "gsnav/detail/nav/position_at.hpp"
#include "gsnav/detail/nav/time_planner.hpp"
#include "timed_bodies.hpp"

namespace gsnav::detail {

/// Safe-interval search for plan_in_time. Places lie on the shortest path and on a lattice around it. A
/// state is a place with one of the intervals in which it is safe to stand there, and the earliest
/// arrival.
class TimeSearch {
 public:
  TimeSearch(const NavMesh& mesh, const TimedBodies& bodies, const GeodesicField& field,
             const TimePlannerOptions& options)
      : mesh_(mesh), bodies_(bodies), field_(field), o_(options) {}

  TimedPlan run(const NavPoint& start, const NavPoint& goal, const NavPath& path) {
    TimedPlan plan;
    follow(start, goal, path);
    const double reach = places_[0].left;
    push({0, 0, 0, 0, kNone});
    std::uint32_t best = kNone, latest = kNone;
    while (!open_.empty() && states_.size() < o_.max_states) {
      std::pop_heap(open_.begin(), open_.end(), std::greater<>());
      const std::uint32_t s = open_.back().second;
      open_.pop_back();
      const State at = states_[s];
      if (at.tick > arrival(at.place, at.interval)) continue;
      if (latest == kNone || last_tick(at) > last_tick(states_[latest])) latest = s;
      if (at.place == goal_ || at.rests) {
        best = s;
        break;
      }
      expand(s);
    }
    plan.states = states_.size();
    if (best == kNone) {
      plan.status = open_.empty() ? TimedPlanStatus::caught : TimedPlanStatus::gave_up;
      if (latest == kNone) latest = 0;  // Not even the start was expanded.
      trace(latest, plan);
      stay(states_[latest], plan);
      return plan;
    }
    trace(best, plan);
    const double left = places_[states_[best].place].left;
    plan.status = states_[best].place == goal_ ? TimedPlanStatus::reached
                  : left < reach - kSame       ? TimedPlanStatus::on_way
                                               : TimedPlanStatus::blocked;
    if (plan.status != TimedPlanStatus::reached) stay(states_[best], plan);
    if (plan.status == TimedPlanStatus::blocked) plan.blocked_until = bodies_.begin(bodies_.ticks());
    return plan;
  }

 private:
  static constexpr double kSame = 1e-6;   // Lengths that differ by less are equal, metres.
  static constexpr double kStorey = 0.5;  // Metres. Lattice points with a smaller height difference
                                          // coincide.
  static constexpr std::uint32_t kNone = 0xffffffffu;

  /// Path from one place to the next along the surface. Empty if a wall is in between.
  using Leg = WalkPoints;
  /// Ticks [first, last) during which an agent that stands there meets no body.
  struct Interval {
    std::size_t first = 0, last = 0;
    std::size_t arrival = std::numeric_limits<std::size_t>::max();
  };
  struct Place {
    NavPoint point;
    double left = 0;  ///< Distance to the goal along the surface, metres.
    std::int64_t column = 0, row = 0;
    bool in_lattice = false;
    std::uint32_t next = kNone;  ///< Next place on the shortest path.
    std::vector<Interval> safe;
  };
  struct State {
    std::uint32_t place = 0;
    std::uint32_t interval = 0;
    std::size_t tick = 0;
    std::size_t left = 0;  ///< Tick at which the parent's place was left.
    std::uint32_t parent = kNone;
    bool rests = false;  ///< Stays until the end of the known motion.
  };

  std::size_t arrival(std::uint32_t place, std::uint32_t interval) const {
    return places_[place].safe[interval].arrival;
  }
  std::size_t last_tick(const State& s) const { return places_[s.place].safe[s.interval].last; }

  std::uint32_t add(const NavPoint& p) {
    Place place;
    place.point = p;
    place.left = field_.distance(p);
    for (std::size_t k = 0; k < bodies_.ticks(); ++k) {
      if (!bodies_.clear(k, p.position, p.position)) continue;
      if (place.safe.empty() || place.safe.back().last != k) place.safe.push_back({k, k});
      place.safe.back().last = k + 1;
    }
    places_.push_back(std::move(place));
    return static_cast<std::uint32_t>(places_.size() - 1);
  }

  /// Creates the places of the shortest path, at most a cell apart, as far as the known motion allows.
  void follow(const NavPoint& start, const NavPoint& goal, const NavPath& path) {
    const double time = bodies_.begin(bodies_.ticks()) - bodies_.begin(0),
                 reach = o_.speed * time + o_.cell;
    const double tick = o_.speed * bodies_.seconds(0);
    // Use whole ticks, so that no time is lost between places.
    const double spacing = max(std::floor(o_.cell / max(tick, 1e-9)), 1.0) * tick;
    std::uint32_t last = add(start);
    places_[last].in_lattice = true;
    in_cell_[{0, 0}].push_back(last);
    double walked = 0;
    bool whole = true;
    NavPoint at = start;
    for (std::size_t i = 1; i < path.points.size() && whole; ++i) {
      Vec3d to = path.points[i] - at.position;
      to.y = 0;
      const double length = norm(to);
      for (double done = 0; done < length - kSame;) {
        const double next = min(done + spacing, length);
        const SurfaceWalk walk = mesh_.walk(at, to * ((next - done) / length), true);
        if (walk.points.empty()) return;
        at = {walk.points.back().position, walk.points.back().poly};
        const std::uint32_t place = add(at);
        places_[last].next = place;
        last = place;
        path_.push_back(place);
        walked += next - done;
        done = next;
        if (walked > reach) {
          whole = false;
          break;
        }
      }
    }
    if (!whole) return;
    goal_ = norm(at.position - goal.position) < 1e-3 ? last : add(goal);
    if (goal_ != last) path_.push_back(places_[last].next = goal_);
  }

  void push(const State& s) {
    Place& place = places_[s.place];
    std::uint32_t interval = kNone;
    for (std::uint32_t i = 0; i < place.safe.size(); ++i) {
      if (place.safe[i].first <= s.tick && s.tick <= place.safe[i].last) interval = i;
    }
    if (s.place == goal_ || s.tick == bodies_.ticks()) {
      // The agent need not stand there afterwards.
      if (interval == kNone) {
        place.safe.push_back({s.tick, s.tick});
        interval = static_cast<std::uint32_t>(place.safe.size() - 1);
      }
    } else if (interval == kNone) {
      if (s.parent != kNone) return;
      place.safe.push_back({s.tick, s.tick});  // The start, which the first leg may leave at once.
      interval = static_cast<std::uint32_t>(place.safe.size() - 1);
    }
    std::size_t& known = place.safe[interval].arrival;
    if (s.tick >= known) return;
    known = s.tick;
    State state = s;
    state.interval = interval;
    state.rests = s.tick == bodies_.ticks();
    enter(state);
    if (!state.rests && state.place != goal_ && place.safe[interval].last == bodies_.ticks()) {
      state.rests = true;
      enter(state);
    }
  }
  void enter(const State& s) {
    const double time = bodies_.begin(s.rests ? bodies_.ticks() : s.tick);
    open_.emplace_back(time + places_[s.place].left / o_.speed,
                       static_cast<std::uint32_t>(states_.size()));
    std::push_heap(open_.begin(), open_.end(), std::greater<>());
    states_.push_back(s);
  }

  void expand(std::uint32_t s) {
    const std::uint32_t from = states_[s].place;
    const Vec3d here = places_[from].point.position;
    std::vector<std::uint32_t> tried;
    const auto go = [&](std::uint32_t to) {
      if (to == from || to == kNone || std::find(tried.begin(), tried.end(), to) != tried.end()) return;
      tried.push_back(to);
      const Leg leg = leg_between(from, to);
      if (!leg.empty()) depart(s, to, leg);
    };
    go(places_[from].next);
    for (const std::uint32_t p : path_) {
      const Vec3d d = places_[p].point.position - here;
      if (d.x * d.x + d.z * d.z <= 2.25 * o_.cell * o_.cell && std::abs(d.y) < 2 * kStorey) go(p);
    }
    if (places_[from].in_lattice) {
      const Place& p = places_[from];
      const std::int64_t column = p.column, row = p.row;
      for (std::int64_t r = row - 1; r <= row + 1; ++r) {
        for (std::int64_t c = column - 1; c <= column + 1; ++c) {
          if (c != column || r != row) go(lattice_place(from, c, r));
        }
      }
    } else {
      // Off the lattice: try the corners of its cell.
      const Vec3d origin = places_[0].point.position;
      const auto c0 = static_cast<std::int64_t>(std::floor((here.x - origin.x) / o_.cell));
      const auto r0 = static_cast<std::int64_t>(std::floor((here.z - origin.z) / o_.cell));
      for (std::int64_t r = r0; r <= r0 + 1; ++r) {
        for (std::int64_t c = c0; c <= c0 + 1; ++c) go(lattice_place(from, c, r));
      }
    }
  }

  /// Lattice place at a cell, reached straight from `from`. kNone if a wall is in between.
  std::uint32_t lattice_place(std::uint32_t from, std::int64_t column, std::int64_t row) {
    const Vec3d origin = places_[0].point.position, here = places_[from].point.position;
    auto& known = in_cell_[{column, row}];
    for (const std::uint32_t k : known) {
      if (std::abs(places_[k].point.position.y - here.y) < kStorey) return k;
    }
    const Vec3d to{origin.x + o_.cell * static_cast<double>(column) - here.x, 0,
                   origin.z + o_.cell * static_cast<double>(row) - here.z};
    const SurfaceWalk walk = mesh_.walk(places_[from].point, to, false);
    if (walk.points.empty() || walk.hit_wall || walk.points.back().fraction < 1) return kNone;
    const std::uint32_t place = add({walk.points.back().position, walk.points.back().poly});
    places_[place].column = column;
    places_[place].row = row;
    places_[place].in_lattice = true;
    known.push_back(place);
    return place;
  }

  Leg leg_between(std::uint32_t from, std::uint32_t to) const {
    const NavPoint &a = places_[from].point, &b = places_[to].point;
    const SurfaceWalk walk = mesh_.walk(a, b.position - a.position, true);
    if (walk.points.empty() || norm(walk.points.back().position - b.position) > 1e-4) return {};
    return walk.points;
  }

  /// Departs as soon as the leg is clear, while waiting is safe, once for each safe interval in which it
  /// may arrive.
  void depart(std::uint32_t s, std::uint32_t to, const Leg& leg) {
    const State at = states_[s];
    const std::size_t until = places_[at.place].safe[at.interval].last;
    double length = 0;
    for (std::size_t i = 1; i < leg.size(); ++i) length += norm(leg[i].position - leg[i - 1].position);
    const auto ticks_from = [&](std::size_t k) {  // Returns 0 if the known motion ends before.
      double seconds = 0;
      for (std::size_t n = k; n < bodies_.ticks(); ++n) {
        seconds += bodies_.seconds(n);
        if (seconds * o_.speed >= length - kSame) return n + 1 - k;
      }
      return std::size_t{0};
    };
    std::size_t reached_interval = std::numeric_limits<std::size_t>::max();
    for (std::size_t k = at.tick; k <= until && k < bodies_.ticks(); ++k) {
      const std::size_t count = ticks_from(k);
      if (count == 0) return;
      // Only the first arrival in each safe interval matters.
      const auto& safe = places_[to].safe;
      std::size_t interval = safe.size();
      for (std::size_t i = 0; i < safe.size(); ++i) {
        if (safe[i].first <= k + count && k + count <= safe[i].last) interval = i;
      }
      if (interval == safe.size() && to != goal_ && k + count != bodies_.ticks()) continue;
      if (interval < safe.size() &&
          (interval == reached_interval || safe[interval].arrival <= k + count))
        continue;
      if (!leg_is_clear(k, count, leg)) continue;
      reached_interval = interval;
      push({to, 0, k + count, k, s});
    }
  }

  bool leg_is_clear(std::size_t first, std::size_t count, const Leg& leg) const {
    const double begin = bodies_.begin(first), whole = bodies_.begin(first + count) - begin;
    double u0 = 0;
    Vec3d from = leg.front().position;
    for (std::size_t k = first; k < first + count; ++k) {
      const double u1 = k + 1 == first + count ? 1.0 : (bodies_.begin(k + 1) - begin) / whole;
      WalkPoints between;
      for (const WalkPoint& p : leg) {
        if (p.fraction > u0 && p.fraction < u1)
          between.push_back({p.position, p.poly, (p.fraction - u0) / (u1 - u0)});
      }
      const Vec3d to = position_at(leg, u1);
      if (!bodies_.clear(k, from, to, between)) return false;
      from = to;
      u0 = u1;
    }
    return true;
  }

  /// Writes the points up to a state, with a wait where a place was left later than reached.
  void trace(std::uint32_t state, TimedPlan& plan) const {
    std::vector<std::uint32_t> chain;
    for (std::uint32_t s = state; s != kNone; s = states_[s].parent) chain.push_back(s);
    std::reverse(chain.begin(), chain.end());
    for (const std::uint32_t s : chain) {
      const State& at = states_[s];
      const NavPoint& p = places_[at.place].point;
      if (!plan.points.empty()) {
        const TimedPoint last = plan.points.back();
        const double left = bodies_.begin(at.left);
        if (left > last.time) plan.points.push_back({last.position, last.poly, left});
      }
      plan.points.push_back({p.position, p.poly, bodies_.begin(at.tick)});
    }
  }
  /// Waits as long as it is safe.
  void stay(const State& at, TimedPlan& plan) const {
    const double until = bodies_.begin(last_tick(at));
    if (until > plan.points.back().time) {
      plan.points.push_back({plan.points.back().position, plan.points.back().poly, until});
    }
  }

  const NavMesh& mesh_;
  const TimedBodies& bodies_;
  const GeodesicField& field_;
  const TimePlannerOptions& o_;
  std::vector<Place> places_;
  std::vector<std::uint32_t> path_;
  std::map<std::pair<std::int64_t, std::int64_t>, std::vector<std::uint32_t>> in_cell_;
  std::uint32_t goal_ = kNone;
  std::vector<State> states_;
  std::vector<std::pair<double, std::uint32_t>> open_;
};

}  // namespace gsnav::detail
