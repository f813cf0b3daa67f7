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

/// Where agents that share a scene stand, so that each can be a body to the others.
class TeamBodies {
 public:
  struct Body {
    Vec3d base{};  ///< world, metres
    double radius = 0.1, height = 1.5;
    bool present = false;
  };
  explicit TeamBodies(std::size_t agents) : bodies_(agents) {}
  Body& operator[](std::size_t agent) noexcept { return bodies_[agent]; }

  /// Appends all but `self`, numbered from `first` on.
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

/// Several agents, each with its own body, sensors and episode, in one scene at one time.
///
/// They act one after the other within a tick, each while the others stand: the earlier ones where they
/// have gone, the later ones where they were. So no agent ever enters another. (Were they to move at
/// once, one that stops at another's flank could be run over by a motion that was checked against its
/// old place.) To an agent the others are avatars: they count in CR and PSI and are numbered behind the
/// scene's. An agent whose episode is over stays where it is. Other agents are bodies, not pictures:
/// cameras see the scene and its avatars.
template <Backend B>
class Team {
 public:
  /// One config for each agent; their control periods must be one. Errors: what BasicSimulator::create
  /// reports, with the agent's number; invalid_argument (no agent, other control periods).
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

  std::size_t size() const noexcept { return agents_.size(); }
  BasicSimulator<B>& operator[](std::size_t agent) noexcept { return agents_[agent]; }
  bool done() const noexcept {
    for (const BasicSimulator<B>& a : agents_) {
      if (!a.done()) return false;
    }
    return true;
  }

  /// Begins an episode for each agent, at one start time. Errors: invalid_argument (another number of
  /// episodes, other start times); what BasicSimulator::reset reports.
  Result<std::vector<Observations>> reset(std::span<const PointNavEpisode> episodes) {
    if (episodes.size() != size()) return wrong_number("episodes", episodes.size());
    for (std::size_t i = 0; i < size(); ++i) {
      if (episodes[i].start_time != episodes[0].start_time) {
        return {Errc::invalid_argument,
                "Team: agent " + std::to_string(i) + " starts at another time than agent 0"};
      }
      (*bodies_)[i].present = false;
    }
    // All take their places before anybody looks or is measured against.
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

  /// One action for each agent; of those whose episode is over none is taken. Errors: invalid_argument
  /// (another number of actions); what BasicSimulator::step reports.
  Result<std::vector<Observations>> step(std::span<const Action> actions) {
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

  /// Runs f without pictures of agent i: they are made once all have moved.
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
