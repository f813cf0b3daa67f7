// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <limits>
#include <span>
#include <type_traits>

#include "gsnav/math/functions.hpp"

namespace gsnav {

// Symbols used below, all in metres:
// l  length of the shortest path from start to goal along the surface
// p  length of the path that the agent took
// g  remaining distance to the goal along the surface at the end (DTG)

/// Success of an episode: true if `stop` was called and g < threshold (strictly).
inline bool episode_success(bool stop_called, double g, double threshold) noexcept {
  return stop_called && g < threshold;
}

namespace detail {
/// Ratio l / max(l, p). If l = 0: 1 for an agent that did not move, else 0. An unreachable goal gives 0.
inline double path_efficiency(double l, double p) noexcept {
  if (!is_finite(l) || !(l >= 0)) return 0.0;
  if (l == 0) return p == 0 ? 1.0 : 0.0;
  return l / max(l, p);
}
}  // namespace detail

/// SPL: S l / max(l, p), where S is 1 for success, else 0. If l = 0: S if p = 0, else 0.
inline double success_weighted_by_path_length(bool success, double l, double p) noexcept {
  return success ? detail::path_efficiency(l, p) : 0.0;
}

/// SoftSPL: max(0, 1 - g / l) l / max(l, p). If l = 0, the first factor is 1 if g = 0, else 0.
inline double soft_success_weighted_by_path_length(double g, double l, double p) noexcept {
  const double progress = l > 0 ? max(0.0, 1.0 - g / l) : (g == 0 ? 1.0 : 0.0);
  const double soft = progress * detail::path_efficiency(l, p);
  return is_finite(soft) ? soft : 0.0;
}

/// STL: S T0 / max(T0, T), with T = steps and T0 = l / forward_step in actions. T0 is the time of an
/// agent that follows the shortest path at full speed without turning. If l = 0: S if no step was taken,
/// else 0.
inline double success_weighted_by_time(bool success, double l, double forward_step,
                                       std::size_t steps) noexcept {
  return success ? detail::path_efficiency(l / forward_step, static_cast<double>(steps)) : 0.0;
}

/// Distance to a person below which the agent intrudes, metres.
inline constexpr double kPersonalSpace = 1.0;

/// Depth of the agent inside a person's space: clamp(1 - d / 1 m, 0, 1).
/// @param d Distance in metres from the agent's surface to the nearest capsule of the avatar. Negative
/// if they overlap, infinity if there are no avatars.
inline double intrusion(double d) noexcept {
  return d < kPersonalSpace ? clamp(1.0 - d / kPersonalSpace, 0.0, 1.0) : 0.0;
}

/// Smallest distance between the surfaces of agent and person that respects personal space, metres.
///
/// The Personal Space Compliance of the SocialNav benchmark (Gong et al. 2024, "From Cognition to
/// Precognition", Falcon) counts the steps in which no person is nearer than 1.0 m. It measures between
/// the centres of bodies with radii of 0.25 m (robot) and 0.3 m (person). gsnav measures between
/// surfaces, so that agents and people of any size can be compared: 1.0 - 0.25 - 0.3 = 0.45 m.
inline constexpr double kCompliantGap = 0.45;

/// Returns true if the distance d respects personal space (kCompliantGap). See intrusion() for d.
inline bool keeps_personal_space(double d) noexcept { return d >= kCompliantGap; }

/// Input of the metrics for one action. `stop` does not count as an action.
struct StepRecord {
  double moved = 0.0;            ///< Straight distance between the positions before and after the
                                 ///< action, metres.
  bool wall_collision = false;   ///< An edge of the NavMesh stopped or deflected the move.
  bool capsule_blocked = false;  ///< An avatar stopped or deflected the move.
  bool avatar_contact = false;   ///< Agent and avatar touched during the step, whichever of them moved.
                                 ///< If the move was stopped before they touched, only `capsule_blocked`
                                 ///< is set.
  /// Smallest distance to each active avatar during the step, metres. Empty if there are none.
  std::span<const double> avatar_distances{};
};

/// Metrics of one episode.
struct EpisodeMetrics {
  bool success = false;           ///< `stop` was called within the success distance of the goal.
  double spl = 0.0;               ///< Success weighted by path length, 0 to 1.
  double soft_spl = 0.0;          ///< SPL with progress in place of success, 0 to 1.
  double stl = 0.0;               ///< Success weighted by time, 0 to 1.
  double distance_to_goal = 0.0;  ///< Remaining distance along the surface, metres. Infinity
                                  ///< if the goal cannot be reached.
  double euclidean_distance_to_goal = 0.0;  ///< Remaining straight distance, metres.
  double collision_rate = 0.0;      ///< CR: fraction of steps with an avatar contact or a move blocked
                                    ///< by an avatar.
  double psi = 0.0;                 ///< Mean intrusion over all steps and the avatars active in them. 0
                                    ///< if there are none.
  double psc = 1.0;                 ///< Fraction of steps that respected the personal space of everyone.
                                    ///< 1 if there were no avatars or no steps.
  bool human_collision = false;     ///< H-Coll: a person was touched in some step, whichever side moved.
  bool human_blocked = false;       ///< A person stopped or deflected a move in some step.
  std::size_t collisions = 0;       ///< Number of steps that ran into a wall.
  std::size_t collision_steps = 0;  ///< Number of steps that CR counts.
  std::size_t steps = 0;            ///< Number of actions, without `stop`.
  double start_distance = 0.0;      ///< Length of the shortest path from the start (l), metres.
  double path_length = 0.0;         ///< Length of the path taken (p), metres.
  double min_clearance = std::numeric_limits<double>::infinity();  ///< Smallest distance to any avatar,
                                                                   ///< metres.
  bool stop_called = false;                                        ///< The agent called `stop`.
};

/// Accumulates the steps of one episode and computes its metrics.
class EpisodeTracker {
 public:
  /// Begins an episode.
  /// @param start_distance Distance to the goal along the surface (l), metres.
  /// @param forward_step Largest distance that one action moves, metres.
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

  /// Metrics as if the episode ended now.
  /// @param stop_called True if the agent has called stop.
  /// @param geodesic, euclidean Remaining distance to the goal, along the surface and straight, metres.
  /// @param success_distance The episode succeeds if `geodesic` is below it, metres.
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

/// Mean metrics over episodes. Every episode has the same weight.
struct MetricsSummary {
  std::size_t episodes = 0;                 ///< Number of episodes.
  double success_rate = 0.0;                ///< SR: fraction of episodes that succeeded.
  double spl = 0.0;                         ///< Mean SPL.
  double soft_spl = 0.0;                    ///< Mean SoftSPL.
  double stl = 0.0;                         ///< Mean STL.
  double distance_to_goal = 0.0;            ///< DTG: mean remaining distance along the surface, metres.
  double euclidean_distance_to_goal = 0.0;  ///< Mean remaining straight distance, metres.
  double collision_rate = 0.0;  ///< CR: mean fraction of steps with an avatar contact or block.
  double psi = 0.0;             ///< Mean PSI, see EpisodeMetrics::psi.
  double psc = 0.0;             ///< Mean PSC, see EpisodeMetrics::psc.
  double collisions = 0.0;      ///< Mean number of steps that ran into a wall, per episode.
  /// H-Coll of the SocialNav benchmark (Falcon): fraction of episodes in which a person was touched. In
  /// that benchmark nothing stops the robot before it touches a person. In gsnav the motion stops at
  /// contact; the next two fields count such stops.
  double human_collision_episode_rate = 0.0;
  double human_blocked_episode_rate = 0.0;  ///< Fraction of episodes in which a person stopped a move.
  double disturbed_episode_rate =
      0.0;  ///< Fraction of episodes with at least one step that CR counts: a contact or a stop.
  double steps = 0.0;        ///< Mean number of actions.
  double path_length = 0.0;  ///< Mean length of the path taken, metres.
  double min_clearance = std::numeric_limits<double>::infinity();  ///< Smallest distance to any avatar
                                                                   ///< over all episodes, metres.
};

/// Means over `episodes`. All values are 0 if there are none.
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

/// Calls f(name, value) for each metric of an episode. Files use the same names.
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
/// Calls f(name, value) for each metric of a summary. Files use the same names.
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
