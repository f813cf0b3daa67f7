// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "gsnav/core/backend.hpp"
#include "gsnav/core/buffer.hpp"
#include "gsnav/detail/nav/step.hpp"
#include "gsnav/detail/sweep/first_impacts.hpp"

namespace gsnav {

/// Agents that step at the same time.
struct StepBatch {
  std::span<const AgentState> agents;  ///< [N]
  std::span<const Vec3d> desired;      ///< [N], metres
  std::span<StepResult> results;       ///< [N], written

  /// invalid_argument if the sizes differ.
  Status check() const {
    for (const auto& [size, name] :
         {std::pair{desired.size(), "desired"}, std::pair{results.size(), "results"}}) {
      if (size == agents.size()) continue;
      return {Errc::invalid_argument, std::string("StepBatch.") + name + " has " + std::to_string(size) +
                                          " values for " + std::to_string(agents.size()) + " agents"};
    }
    return {};
  }
};

/// step() of many agents among the same bodies, none of whom meets another agent, on the threads of a
/// host's backend. The results are those of step(), bit for bit, with any number of threads. Errors:
/// invalid_argument naming the span of another size than the agents.
template <Backend B>
requires is_host_backend<B> Status step_all(B& backend, const NavMesh& mesh, const StepBatch& batch,
                                            const CapsuleSet& bodies, const StepOptions& options = {}) {
  if (Status s = batch.check(); !s) return s;
  backend.parallel_for(batch.agents.size(), [&](std::size_t i) {
    batch.results[i] = step(mesh, batch.agents[i], batch.desired[i], bodies, options);
  });
  return backend.synchronize();
}

/// The same with a device for the bodies: `host` walks the agents, `device` sweeps all legs of their
/// ways against all bodies by the same kernel, and who meets nobody is done; `host` steps the others.
/// The same bits.
template <Backend H, Backend D>
requires is_host_backend<H> Status step_all(H& host, D& device, const NavMesh& mesh,
                                            const StepBatch& batch, const CapsuleSet& bodies,
                                            const StepOptions& options = {}) {
  if (options.compat != StepCompat::none || bodies.empty())
    return step_all(host, mesh, batch, bodies, options);
  static const CapsuleSet nobody;
  if (Status s = step_all(host, mesh, batch, nobody, options); !s) return s;

  // The legs of each way, and standing for what is left of the tick, as step() sweeps them.
  std::vector<SweptLeg> legs;
  std::vector<std::size_t> first{0};
  for (std::size_t i = 0; i < batch.agents.size(); ++i) {
    const AgentState& a = batch.agents[i];
    const WalkPoints& path = batch.results[i].path;
    for (std::size_t k = 1; k <= path.size(); ++k) {
      const WalkPoint &from = path[k - 1], &to = path[k < path.size() ? k : k - 1];
      legs.push_back({{agent_capsule(from.position, a.radius, a.height),
                       agent_capsule(to.position, a.radius, a.height)},
                      from.fraction,
                      k < path.size() ? to.fraction : 1.0});
    }
    first.push_back(legs.size());
  }
  Buffer<SweptLeg, D> legs_there(device);
  Buffer<DynamicCapsule, D> bodies_there(device);
  Buffer<FirstImpact<double>, D> impacts_there(device);
  legs_there.upload(legs.data(), legs.size());
  bodies_there.upload(bodies.capsules().data(), bodies.size());
  impacts_there.resize_discard(legs.size());
  FirstImpactArgs<double> args;
  args.legs = {legs_there.data(), legs.size()};
  args.bodies = {bodies_there.data(), bodies.size()};
  args.rules.skin = options.skin;
  args.impacts = impacts_there.view();
  if (Status s = first_impacts<double>(device, args); !s) return s;
  std::vector<FirstImpact<double>> impacts(legs.size());
  impacts_there.download(impacts.data(), impacts.size());
  if (Status s = device.synchronize(); !s) return s;

  host.parallel_for(batch.agents.size(), [&](std::size_t i) {
    bool meets = false;
    for (std::size_t k = first[i]; k < first[i + 1]; ++k) {
      meets = meets || impacts[k].hit || impacts[k].pushed || impacts[k].started_overlapping;
    }
    if (meets) batch.results[i] = step(mesh, batch.agents[i], batch.desired[i], bodies, options);
  });
  return host.synchronize();
}

}  // namespace gsnav
