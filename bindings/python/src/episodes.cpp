// SPDX-License-Identifier: Apache-2.0
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/shared_ptr.h>

#include "bind.hpp"
#include "fields.hpp"
#include "gsnav/demo.hpp"
#include "gsnav/detail/sim/episode.hpp"
#include "gsnav/io.hpp"
#include "gsnav/sim.hpp"
#include "progress.hpp"

namespace gsnav::python {
namespace {

using Release = nb::call_guard<ReleaseGil>;

void bind_metrics(nb::module_& m) {
  using E = EpisodeMetrics;
  Struct<E>(m, "EpisodeMetrics", "Metrics of one episode.")
      .field("success", &E::success, "`stop` was called within the success distance of the goal.")
      .field("spl", &E::spl, "Success weighted by path length, 0 to 1.")
      .field("soft_spl", &E::soft_spl, "SPL with progress in place of success, 0 to 1.")
      .field("stl", &E::stl, "Success weighted by time, 0 to 1.")
      .field("distance_to_goal", &E::distance_to_goal, "Remaining distance along the surface, metres.")
      .field("euclidean_distance_to_goal", &E::euclidean_distance_to_goal,
             "Remaining straight distance, metres.")
      .field("collision_rate", &E::collision_rate,
             "CR: fraction of steps with an avatar contact or block.")
      .field("psi", &E::psi, "Mean intrusion over all steps and the avatars active in them.")
      .field("psc", &E::psc, "Fraction of steps that respected the personal space of everyone.")
      .field("human_collision", &E::human_collision, "H-Coll: a person was touched in some step.")
      .field("human_blocked", &E::human_blocked, "A person stopped or deflected a move in some step.")
      .field("collisions", &E::collisions, "Number of steps that ran into a wall.")
      .field("collision_steps", &E::collision_steps, "Number of steps that CR counts.")
      .field("steps", &E::steps, "Number of actions, without `stop`.")
      .field("start_distance", &E::start_distance, "Length of the shortest path from the start, metres.")
      .field("path_length", &E::path_length, "Length of the path taken, metres.")
      .field("min_clearance", &E::min_clearance, "Smallest distance to any avatar, metres.")
      .field("stop_called", &E::stop_called, "The agent called `stop`.")
      .done();
  using S = MetricsSummary;
  Struct<S>(m, "MetricsSummary", "Mean metrics over episodes. Every episode has the same weight.")
      .field("episodes", &S::episodes, "Number of episodes.")
      .field("success_rate", &S::success_rate, "SR: fraction of episodes that succeeded.")
      .field("spl", &S::spl, "Mean SPL.")
      .field("soft_spl", &S::soft_spl, "Mean SoftSPL.")
      .field("stl", &S::stl, "Mean STL.")
      .field("distance_to_goal", &S::distance_to_goal, "DTG: mean remaining distance, metres.")
      .field("euclidean_distance_to_goal", &S::euclidean_distance_to_goal,
             "Mean remaining straight distance, metres.")
      .field("collision_rate", &S::collision_rate, "Mean CR.")
      .field("psi", &S::psi, "Mean PSI.")
      .field("psc", &S::psc, "Mean PSC.")
      .field("collisions", &S::collisions, "Mean number of steps that ran into a wall.")
      .field("human_collision_episode_rate", &S::human_collision_episode_rate,
             "Fraction of episodes in which a person was touched.")
      .field("human_blocked_episode_rate", &S::human_blocked_episode_rate,
             "Fraction of episodes in which a person stopped a move.")
      .field("disturbed_episode_rate", &S::disturbed_episode_rate,
             "Fraction of episodes with at least one step that CR counts.")
      .field("steps", &S::steps, "Mean number of actions.")
      .field("path_length", &S::path_length, "Mean length of the path taken, metres.")
      .field("min_clearance", &S::min_clearance, "Smallest distance to any avatar, metres.")
      .done();
  m.def(
      "summarize", [](const std::vector<EpisodeMetrics>& e) { return summarize(e); },
      nb::arg("episodes"), Release(), "Means over episodes. All values are 0 if there are none.");
}

void bind_generation(nb::module_& m) {
  using R = EpisodeRules;
  Struct<R>(m, "EpisodeRules",
            "Rules for sampling episodes. The defaults are those of Habitat's generator.")
      .field("min_distance", &R::min_distance, "Smallest geodesic distance, metres.")
      .field("max_distance", &R::max_distance, "Largest geodesic distance, metres. May be infinite.")
      .field("min_island_radius", &R::min_island_radius, "Smallest radius of an island, metres.")
      .field("max_height_difference", &R::max_height_difference,
             "Largest height difference of start and goal, metres. May be infinite.")
      .field("straight_ratio", &R::straight_ratio,
             "Paths with a smaller ratio of length to straight distance are mostly refused.")
      .field("retries_per_goal", &R::retries_per_goal, "Number of starts to try per goal.")
      .field(
          "max_goals", &R::max_goals,
          "Number of goals to try before an episode fails. With retries_per_goal, at most 10^6 starts.")
      .done();
  m.def(
      "generate_episode",
      [](const NavMesh& mesh, Rng& rng, EpisodeRules rules) {
        Rng own = rng;  // Other threads may use `rng` while the GIL is released.
        PointNavEpisode episode;
        {
          const ReleaseGil release;
          episode = generate_episode(mesh, own, rules).value();
        }
        rng = own;
        return episode;
      },
      nb::arg("navmesh"), nb::arg("rng"), nb::arg("rules") = EpisodeRules{},
      "Samples one episode. Raises NothingNavigable if no pair of points satisfied the rules.");
  m.def(
      "generate_episodes",
      [](const NavMesh& mesh, std::size_t count, std::uint64_t seed, EpisodeRules rules) {
        return generate_episodes(mesh, count, seed, rules, stop_after_signal).value();
      },
      nb::arg("navmesh"), nb::arg("count"), nb::arg("seed"), nb::arg("rules") = EpisodeRules{},
      Release(),
      "Samples `count` episodes, at most 10^7, with the ids \"0\", \"1\", ... Ctrl-C ends the call "
      "after an episode.");
  m.def(
      "draw_start_times",
      [](std::vector<PointNavEpisode> episodes, const SimulatorScene& scene, const TaskConfig& task,
         std::uint64_t seed) {
        draw_start_times(episodes, scene, task, seed, stop_after_signal).throw_if_error();
        return episodes;
      },
      nb::arg("episodes"), nb::arg("scene"), nb::arg("task"), nb::arg("seed"), Release(),
      "The episodes with random start times in [0, 600) seconds, multiples of the control period at "
      "which no avatar is within 0.6 m of the surface of an agent at the start. After a hundred "
      "attempts, the last time is used. Ctrl-C ends the call after an episode. Raises InvalidArgument "
      "naming the field of `task`, or the episode of which start_position is not finite.");
}

void bind_files(nb::module_& m) {
  // The module gsnav.io has these two.
  m.def(
      "load_episodes",
      [](const std::filesystem::path& path) {
        io::EpisodeFile file = io::load_episodes(path).value();
        return std::pair(std::move(file.episodes), std::move(file.warnings));
      },
      nb::arg("path"), Release(),
      "Reads PointNav and ImageNav episodes of Habitat-Lab, .json or .json.gz. Returns the episodes and "
      "a "
      "list of warnings. Raises FileNotFound or InvalidFile.");
  m.def(
      "save_episodes",
      [](const std::filesystem::path& path, const std::vector<PointNavEpisode>& episodes) {
        io::save_episodes(path, episodes).throw_if_error();
      },
      nb::arg("path"), nb::arg("episodes"), Release(),
      "Writes episodes for Habitat-Lab, compressed if the name ends in .gz.");
}

}  // namespace

void bind_episodes(nb::module_& m) {
  using E = PointNavEpisode;
  Struct<E>(
      m, "PointNavEpisode",
      "The task to go from a start to a goal. World frame, metres, Y up. The agent's forward direction "
      "is -Z turned by start_rotation.")
      .field("id", &E::id, "Name of the episode.")
      .field("start_position", &E::start_position, "Where the agent starts, shape [3].")
      .field("start_rotation", &E::start_rotation, "Turn about +Y, quaternion w, x, y, z, shape [4].")
      .field("goal_position", &E::goal_position, "Where the agent should go, shape [3].")
      .field("geodesic_distance", &E::geodesic_distance, "Distance along the surface, metres.")
      .field("start_time", &E::start_time, "Time on the avatars' clock, seconds.")
      .field("goal_radius", &E::goal_radius, "Radius of the goal as stored in files, metres.")
      .field("scene_id", &E::scene_id, "Name of the scene as stored in files.")
      .done();
  using B = BatchEpisode;
  Struct<B>(m, "BatchEpisode", "An episode and the scene in which it takes place.")
      .field("scene", &B::scene, "Index of the scene.")
      .field("episode", &B::episode, "The episode.")
      .done();
  bind_metrics(m);
  bind_generation(m);
  bind_files(m);
  m.def(
      "default_simulator_scene",
      [](std::size_t people, std::uint64_t seed, double density, TaskConfig task) {
        return std::make_shared<SimulatorScene>(
            default_simulator_scene(people, seed, density, task, stop_after_signal).value());
      },
      nb::arg("people") = 3, nb::arg("seed") = 1, nb::arg("density") = 1.0,
      nb::arg("task") = TaskConfig{}, Release(),
      "The embedded flat with its NavMesh for the body of `task`, and people who walk in it, at most "
      "1000. `density` is the factor on the number of Gaussians of the flat, in [0.05, 20]. Ctrl-C ends "
      "the call at the next person.");
  bind_planned_scene(m);
}

}  // namespace gsnav::python
