// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <limits>
#include <span>
#include <type_traits>

#include "gsnav/math/functions.hpp"

namespace gsnav {

// Symbols: l  shortest path from start to goal along the surface, metres
//          p  length of the path that the agent took, metres
//          g  what is left to the goal at the end along the surface (DTG), metres

/// S = 1 where stop was called and g < threshold (strictly), else 0.
inline bool episode_success(bool stop_called, double g, double threshold) noexcept {
  return stop_called && g < threshold;
}

namespace detail {
/// l / max(l, p); with l = 0: 1 for an agent that stayed, else 0. An unreachable goal gives 0.
inline double path_efficiency(double l, double p) noexcept {
  if (!is_finite(l) || !(l >= 0)) return 0.0;
  if (l == 0) return p == 0 ? 1.0 : 0.0;
  return l / max(l, p);
}
}  // namespace detail

/// SPL = S l / max(l, p). With l = 0: S where p = 0, else 0.
inline double success_weighted_by_path_length(bool success, double l, double p) noexcept {
  return success ? detail::path_efficiency(l, p) : 0.0;
}

/// SoftSPL = max(0, 1 - g / l) l / max(l, p). With l = 0 the progress term is 1 where g = 0, else 0.
inline double soft_success_weighted_by_path_length(double g, double l, double p) noexcept {
  const double progress = l > 0 ? max(0.0, 1.0 - g / l) : (g == 0 ? 1.0 : 0.0);
  const double soft = progress * detail::path_efficiency(l, p);
  return is_finite(soft) ? soft : 0.0;
}

/// STL = S T0 / max(T0, T) with T = steps and T0 = l / forward_step, both in actions: the time of
/// whoever goes the shortest way at full speed without turning. With l = 0: S where no step was taken,
/// else 0.
inline double success_weighted_by_time(bool success, double l, double forward_step,
                                       std::size_t steps) noexcept {
  return success ? detail::path_efficiency(l / forward_step, static_cast<double>(steps)) : 0.0;
}

/// Within this distance of a person the agent intrudes, metres.
inline constexpr double kPersonalSpace = 1.0;

/// clamp(1 - d / 1 m, 0, 1): how far the agent is inside a person's space. d: metres from the agent's
/// surface to the avatar's nearest capsule surface; negative in overlap, infinity with nobody there.
inline double intrusion(double d) noexcept {
  return d < kPersonalSpace ? clamp(1.0 - d / kPersonalSpace, 0.0, 1.0) : 0.0;
}

/// A person's space is kept where the agent's surface is at least this far from the avatar's, metres.
///
/// Personal Space Compliance of the SocialNav benchmark (Gong et al. 2024, "From Cognition to
/// Precognition", Falcon) counts the steps in which no person is nearer than 1.0 m, between the centres
/// of bodies of 0.25 m (robot) and 0.3 m (person). Here distances are between surfaces, so that agents
/// and people of any size compare: 1.0 - 0.25 - 0.3 = 0.45 m.
inline constexpr double kCompliantGap = 0.45;

/// Whether the agent keeps out of a person's space (kCompliantGap). d as of `intrusion`.
inline bool keeps_personal_space(double d) noexcept { return d >= kCompliantGap; }

/// What one action did, for the metrics. `stop` is no step.
struct StepRecord {
  double moved = 0.0;            ///< metres from the position before to the one after, straight
  bool wall_collision = false;   ///< an edge of the NavMesh stopped or turned the move
  bool capsule_blocked = false;  ///< an avatar stopped or turned the move
  bool avatar_contact = false;   ///< bodies touched during the step, whoever's fault; a move that was
                                 ///< stopped before they did is `capsule_blocked` only
  /// Smallest distance during the step to each avatar that is active, metres; empty with none.
  std::span<const double> avatar_distances{};
};

/// The outcome of one episode.
struct EpisodeMetrics {
  bool success = false;                     ///< The agent stopped near enough to the goal.
  double spl = 0.0;                         ///< SPL: success weighted by path length, in [0, 1].
  double soft_spl = 0.0;                    ///< SoftSPL: progress weighted by path length, in [0, 1].
  double stl = 0.0;                         ///< success weighted by time
  double distance_to_goal = 0.0;            ///< geodesic, metres; infinity where cut off
  double euclidean_distance_to_goal = 0.0;  ///< straight, metres
  double collision_rate = 0.0;      ///< CR: steps with avatar contact or a capsule-blocked move / steps
  double psi = 0.0;                 ///< mean intrusion over steps and avatars active then; 0 with none
  double psc = 1.0;                 ///< steps in which the agent kept out of everybody's space / steps,
                                    ///< in [0, 1]; 1 with nobody there or no step
  bool human_collision = false;     ///< H-Coll: a person was touched in some step, whoever's fault
  bool human_blocked = false;       ///< a person stopped or turned a move in some step
  std::size_t collisions = 0;       ///< steps that ran into a wall
  std::size_t collision_steps = 0;  ///< steps counted by CR
  std::size_t steps = 0;            ///< actions, stop excluded
  double start_distance = 0.0;      ///< l, metres
  double path_length = 0.0;         ///< p, metres
  double min_clearance = std::numeric_limits<double>::infinity();  ///< to any avatar, metres
  bool stop_called = false;  ///< The agent ended the episode by stopping.
};

/// Collects the steps of one episode.
class EpisodeTracker {
 public:
  /// Begins an episode whose goal is `start_distance` metres away along the surface; an action moves by
  /// `forward_step` metres at most.
  void reset(double start_distance, double forward_step = 0.25) noexcept {
    *this = {};
    m_.start_distance = start_distance;
    forward_step_ = forward_step;
  }

  /// Adds one step.
  void add(const StepRecord& r) noexcept {
    ++m_.steps;
    m_.path_length += r.moved;
    m_.collisions += r.wall_collision ? 1 : 0;
    m_.collision_steps += r.avatar_contact || r.capsule_blocked ? 1 : 0;
    m_.human_collision = m_.human_collision || r.avatar_contact;
    m_.human_blocked = m_.human_blocked || r.capsule_blocked;
    bool compliant = true;
    for (const double d : r.avatar_distances) {
      compliant = compliant && keeps_personal_space(d);
      intrusion_ += intrusion(d);
      ++pairs_;
      m_.min_clearance = min(d, m_.min_clearance);
    }
    compliant_ += compliant ? 1 : 0;
  }

  /// The metrics if the episode ended here, `geodesic` and `euclidean` metres from the goal.
  EpisodeMetrics finish(bool stop_called, double geodesic, double euclidean,
                        double success_distance) const noexcept {
    EpisodeMetrics m = m_;
    m.stop_called = stop_called;
    m.distance_to_goal = geodesic;
    m.euclidean_distance_to_goal = euclidean;
    m.success = episode_success(stop_called, geodesic, success_distance);
    m.spl = success_weighted_by_path_length(m.success, m.start_distance, m.path_length);
    m.soft_spl = soft_success_weighted_by_path_length(geodesic, m.start_distance, m.path_length);
    m.stl = success_weighted_by_time(m.success, m.start_distance, forward_step_, m.steps);
    m.collision_rate =
        m.steps == 0 ? 0.0 : static_cast<double>(m.collision_steps) / static_cast<double>(m.steps);
    m.psi = pairs_ == 0 ? 0.0 : intrusion_ / static_cast<double>(pairs_);
    m.psc = m.steps == 0 ? 1.0 : static_cast<double>(compliant_) / static_cast<double>(m.steps);
    return m;
  }

 private:
  EpisodeMetrics m_{};
  double forward_step_ = 0.25;
  double intrusion_ = 0.0;
  std::size_t pairs_ = 0;
  std::size_t compliant_ = 0;
};

/// Means over episodes, each episode counting once.
struct MetricsSummary {
  std::size_t episodes = 0;                 ///< Number of episodes.
  double success_rate = 0.0;                ///< SR
  double spl = 0.0;                         ///< SPL: success weighted by path length, in [0, 1].
  double soft_spl = 0.0;                    ///< SoftSPL: progress weighted by path length, in [0, 1].
  double stl = 0.0;                         ///< STL: success weighted by time, in [0, 1].
  double distance_to_goal = 0.0;            ///< DTG, geodesic, metres
  double euclidean_distance_to_goal = 0.0;  ///< Straight distance to the goal, metres.
  double collision_rate = 0.0;              ///< CR
  double psi = 0.0;                         ///< PSI: mean intrusion into personal space.
  double psc = 0.0;                         ///< PSC: share of steps that keep out of personal space.
  double collisions = 0.0;                  ///< wall hits an episode
  /// H-Coll of the SocialNav benchmark (Falcon): episodes in which a person was touched / episodes, in
  /// [0, 1]. There nothing stops a robot short of a person; here the step filter does, and what it
  /// stopped is counted by the next two.
  double human_collision_episode_rate = 0.0;
  double human_blocked_episode_rate = 0.0;  ///< episodes in which a person stopped a move / episodes
  double disturbed_episode_rate =
      0.0;                   ///< episodes with any step counted by CR / episodes: either of both
  double steps = 0.0;        ///< Actions per episode.
  double path_length = 0.0;  ///< Metres walked per episode.
  double min_clearance = std::numeric_limits<double>::infinity();  ///< the least of all episodes
};

/// Means of `episodes`; zeros for none.
inline MetricsSummary summarize(std::span<const EpisodeMetrics> episodes) noexcept {
  MetricsSummary s;
  s.episodes = episodes.size();
  if (episodes.empty()) return s;
  for (const EpisodeMetrics& e : episodes) {
    s.success_rate += e.success ? 1.0 : 0.0;
    s.spl += e.spl;
    s.soft_spl += e.soft_spl;
    s.stl += e.stl;
    s.distance_to_goal += e.distance_to_goal;
    s.euclidean_distance_to_goal += e.euclidean_distance_to_goal;
    s.collision_rate += e.collision_rate;
    s.psi += e.psi;
    s.psc += e.psc;
    s.collisions += static_cast<double>(e.collisions);
    s.human_collision_episode_rate += e.human_collision ? 1.0 : 0.0;
    s.human_blocked_episode_rate += e.human_blocked ? 1.0 : 0.0;
    s.disturbed_episode_rate += e.collision_steps > 0 ? 1.0 : 0.0;
    s.steps += static_cast<double>(e.steps);
    s.path_length += e.path_length;
    s.min_clearance = min(e.min_clearance, s.min_clearance);
  }
  const double n = static_cast<double>(episodes.size());
  for (double* v :
       {&s.success_rate, &s.spl, &s.soft_spl, &s.stl, &s.distance_to_goal, &s.euclidean_distance_to_goal,
        &s.collision_rate, &s.psi, &s.psc, &s.collisions, &s.human_collision_episode_rate,
        &s.human_blocked_episode_rate, &s.disturbed_episode_rate, &s.steps, &s.path_length}) {
    *v /= n;
  }
  return s;
}

/// Calls f(name, value) for each metric of an episode, by the names that files have.
template <class M, class F>
requires std::is_same_v<std::remove_const_t<M>, EpisodeMetrics>
void for_each_metric(M& m, const F& f) {
  f("success", m.success), f("spl", m.spl), f("soft_spl", m.soft_spl), f("stl", m.stl);
  f("distance_to_goal", m.distance_to_goal);
  f("euclidean_distance_to_goal", m.euclidean_distance_to_goal);
  f("collision_rate", m.collision_rate), f("psi", m.psi), f("psc", m.psc);
  f("human_collision", m.human_collision), f("human_blocked", m.human_blocked);
  f("collisions", m.collisions), f("collision_steps", m.collision_steps), f("steps", m.steps);
  f("start_distance", m.start_distance), f("path_length", m.path_length);
  f("min_clearance", m.min_clearance), f("stop_called", m.stop_called);
}
/// The same for the means over episodes.
template <class M, class F>
requires std::is_same_v<std::remove_const_t<M>, MetricsSummary>
void for_each_metric(M& s, const F& f) {
  f("success_rate", s.success_rate), f("spl", s.spl), f("soft_spl", s.soft_spl), f("stl", s.stl);
  f("distance_to_goal", s.distance_to_goal);
  f("euclidean_distance_to_goal", s.euclidean_distance_to_goal);
  f("collision_rate", s.collision_rate), f("psi", s.psi), f("psc", s.psc);
  f("human_collision_episode_rate", s.human_collision_episode_rate);
  f("human_blocked_episode_rate", s.human_blocked_episode_rate);
  f("disturbed_episode_rate", s.disturbed_episode_rate);
  f("collisions", s.collisions), f("steps", s.steps), f("path_length", s.path_length);
  f("min_clearance", s.min_clearance);
}

}  // namespace gsnav
