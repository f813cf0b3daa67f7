// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "gsnav/sim/basic_simulator.hpp"

namespace gsnav {

/// Positions of agents that share a scene. Each agent is a body for the others.
class TeamBodies {
 public:
  /// Body of one agent.
  struct Body {
    Vec3d base{};                       ///< World position of its base, metres.
    double radius = 0.1, height = 1.5;  ///< Radius and height, metres.
    bool present = false;               ///< False until the agent takes part.
  };
  /// Creates bodies for a number of agents, none of them present.
  explicit TeamBodies(std::size_t agents) : bodies_(agents) {}
  /// Body of an agent.
  Body& operator[](std::size_t agent) noexcept { return bodies_[agent]; }

  /// Appends the bodies of all agents except `self`. They are numbered from `first`.
  void append(std::size_t self, std::uint32_t first, std::vector<DynamicCapsule>& out) const {
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
      const Body& b = bodies_[i];
      if (i == self || !b.present) continue;
      const Capsule<double> c = agent_capsule(b.base, b.radius, b.height);
      out.push_back({{c, c}, first + static_cast<std::uint32_t>(i), 0});
    }
  }

 private:
  std::vector<Body> bodies_;
};

/// Several agents in one scene at one time, each with its own body, sensors and episode.
///
/// Within a tick the agents act one after the other, while the others stand still: earlier agents at
/// their new position, later ones at their old one. Therefore no agent ever enters another. If all moved
/// at once, an agent that stops next to another could be hit by a motion that was tested against its old
/// position.
///
/// To an agent, the others are avatars: they count in CR and PSI and are numbered after the avatars of
/// the scene. An agent whose episode has ended stays in place. Cameras do not show agents, only the
/// scene and its avatars.
template <Backend B>
class Team {
 public:
  /// Creates a team.
  /// @param agents One configuration per agent. All must have the same control period.
  /// @return the errors of BasicSimulator::create, with the index of the agent; invalid_argument if
  /// there are no agents or their control periods differ.
  static Result<Team> create(B& backend, SimulatorScene scene, std::vector<SimulatorConfig> agents) {
    if (agents.empty()) return {Errc::invalid_argument, "Team: no agent"};
    Team team;
    team.bodies_ = std::make_shared<TeamBodies>(agents.size());
    const auto shared = std::make_shared<const SimulatorScene>(std::move(scene));
    for (std::size_t i = 0; i < agents.size(); ++i) {
      if (agents[i].task.control_period != agents[0].task.control_period) {
        return {Errc::invalid_argument,
                "Team: agent " + std::to_string(i) + " has another control_period than agent 0"};
      }
      const auto others = [bodies = team.bodies_, i, n = shared->avatars.size()](double, double,
                                                                                 auto& out) {
        bodies->append(i, static_cast<std::uint32_t>(n), out);
      };
      auto sim = BasicSimulator<B>::create(backend, shared, std::move(agents[i]), others);
      if (!sim) return {sim.code(), "Team: agent " + std::to_string(i) + ": " + sim.message()};
      team.agents_.push_back(std::move(*sim));
    }
    return team;
  }

  /// Number of agents.
  std::size_t size() const noexcept { return agents_.size(); }
  /// Simulator of an agent.
  BasicSimulator<B>& operator[](std::size_t agent) noexcept { return agents_[agent]; }
  /// True if the episodes of all agents have ended.
  bool done() const noexcept {
    for (const BasicSimulator<B>& a : agents_) {
      if (!a.done()) return false;
    }
    return true;
  }

  /// Starts an episode for each agent, all with the same start time.
  /// @return invalid_argument for a wrong number of episodes or different start times; the errors of
  /// BasicSimulator::reset.
  Result<std::vector<Observations>> reset(std::span<const PointNavEpisode> episodes) & {
    if (episodes.size() != size()) return wrong_number("episodes", episodes.size());
    for (std::size_t i = 0; i < size(); ++i) {
      if (episodes[i].start_time != episodes[0].start_time) {
        return {Errc::invalid_argument,
                "Team: agent " + std::to_string(i) + " starts at another time than agent 0"};
      }
      (*bodies_)[i].present = false;
    }
    // Place all agents first, so that each is measured against the others.
    for (std::size_t i = 0; i < size(); ++i) {
      if (Result<Observations> r = quietly(i, [&] { return agents_[i].reset(episodes[i]); }); !r)
        return r.status();
      stand(i);
    }
    for (std::size_t i = 0; i < size(); ++i) {
      if (Result<Observations> r = quietly(i, [&] { return agents_[i].reset(episodes[i]); }); !r)
        return r.status();
    }
    return observe();
  }

  /// Performs one action per agent. Agents whose episode has ended are skipped.
  /// @return invalid_argument for a wrong number of actions; the errors of BasicSimulator::step.
  Result<std::vector<Observations>> step(std::span<const Action> actions) & {
    if (actions.size() != size()) return wrong_number("actions", actions.size());
    for (std::size_t i = 0; i < size(); ++i) {
      if (agents_[i].done()) continue;
      if (Result<Observations> r = quietly(i, [&] { return agents_[i].step(actions[i]); }); !r)
        return r.status();
      stand(i);
    }
    return observe();
  }

 private:
  Team() = default;

  Status wrong_number(const char* what, std::size_t n) const {
    return {Errc::invalid_argument,
            "Team: " + std::to_string(n) + " " + what + " for " + std::to_string(size()) + " agents"};
  }

  /// Calls f with rendering of agent i turned off. Images are rendered after all agents have moved.
  template <class F>
  Result<Observations> quietly(std::size_t i, const F& f) {
    const bool rendering = agents_[i].config().rendering;
    agents_[i].set_rendering(false);
    Result<Observations> r = f();
    agents_[i].set_rendering(rendering);
    return r;
  }

  void stand(std::size_t i) {
    const BasicSimulator<B>& a = agents_[i];
    (*bodies_)[i] = {a.agent().position, a.config().task.agent_radius, a.config().task.agent_height,
                     true};
  }

  Result<std::vector<Observations>> observe() {
    std::vector<Observations> out;
    for (BasicSimulator<B>& a : agents_) {
      Result<Observations> r = a.observe();
      if (!r) return r.status();
      out.push_back(std::move(*r));
    }
    return out;
  }

  std::shared_ptr<TeamBodies> bodies_;
  std::vector<BasicSimulator<B>> agents_;
};

}  // namespace gsnav
