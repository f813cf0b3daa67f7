// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/sim/batch_world.hpp"

#include <algorithm>
#include <functional>
#include <utility>

#include "gsnav/detail/core/field_check.hpp"

namespace gsnav {
namespace {

constexpr double kMaxEnvironments = 1 << 16;  // far above what the memory of their images allows

Status bad(std::string what) { return {Errc::invalid_argument, std::move(what)}; }

}  // namespace

Result<BatchWorld> BatchWorld::create(std::vector<BatchScene> scenes, const TaskConfig& config,
                                      AutoReset auto_reset, std::size_t environments,
                                      EpisodeSource next_episode) {
  for (std::size_t i = 0; i < scenes.size(); ++i) {
    if (scenes[i].navmesh == nullptr)
      return bad("BatchWorld: scene " + std::to_string(i) + " has no NavMesh");
  }
  BatchPlaces places;
  places.count = scenes.size();
  places.get = [held = std::move(scenes)](std::size_t scene) -> Result<BatchScene> {
    return held[scene];
  };
  return create(std::move(places), config, auto_reset, environments, std::move(next_episode));
}

Result<BatchWorld> BatchWorld::create(BatchPlaces places, const TaskConfig& config, AutoReset auto_reset,
                                      std::size_t environments, EpisodeSource next_episode) {
  if (Status s = validate(config); !s) return s;
  if (places.count == 0 || !places.get) return bad("BatchWorld: no scene");
  detail::FieldCheck check("BatchWorld: ");
  if (Status s = check.in("environments", environments, 1, kMaxEnvironments).status(); !s) return s;
  if (!next_episode) return bad("BatchWorld: no source of episodes");
  BatchWorld b;
  b.places_ = std::move(places);
  b.config_ = config;
  b.auto_reset_ = auto_reset;
  b.next_episode_ = std::move(next_episode);
  b.environments_.resize(environments);
  for (Environment& e : b.environments_) e.bodies.resize(static_cast<std::size_t>(config.substeps));
  b.rewards_.resize(environments);
  b.times_.resize(environments);
  b.terminated_.resize(environments);
  b.truncated_.resize(environments);
  b.infos_.resize(environments);
  b.point_goals_.resize(environments);
  return b;
}

Status BatchWorld::first_error(std::span<const std::size_t> which) const {
  for (const std::size_t e : which) {
    const Status& s = environments_[e].status;
    if (!s) return {s.code(), "environment " + std::to_string(e) + ": " + s.message()};
  }
  return {};
}

void BatchWorld::note_observation(std::size_t e) {
  const World& w = *environments_[e].world;
  point_goals_[e] = w.point_goal();
  times_[e] = w.time();
}

void BatchWorld::publish() {
  info_ = {rewards_,  terminated_,    truncated_,        infos_, point_goals_, times_,
           finished_, final_metrics_, final_point_goals_};
}

Status BatchWorld::begin(const ParallelFor& run, std::span<const std::size_t> which) {
  prepared_ = false;
  episodes_.resize(environments_.size());
  for (const std::size_t i : which) {
    Environment& e = environments_[i];
    const std::string at = "environment " + std::to_string(i) + ": ";
    Result<BatchEpisode> next = e.next ? std::move(*e.next) : next_episode_(i, e.episodes);
    e.next.reset();
    if (!next) return {next.code(), at + next.message()};
    if (next->scene >= places_.count) {
      return bad(at + "episode \"" + next->episode.id + "\" is in scene " + std::to_string(next->scene) +
                 " of " + std::to_string(places_.count));
    }
    if (places_.prefetch) places_.prefetch(next->scene);
    ++e.episodes;
    episodes_[i] = std::move(*next);
  }
  for (const std::size_t i : which) {
    Environment& e = environments_[i];
    if (e.world && e.scene == episodes_[i].scene) continue;
    const auto place = places_.get(episodes_[i].scene);
    if (!place) return {place.code(), "environment " + std::to_string(i) + ": " + place.message()};
    Result<World> w = World::create(place->navmesh, config_, place->bodies);
    if (!w) return w.status();
    e.world.emplace(std::move(*w));
    e.source = place->bodies;
    e.source_after = place->bodies_after;
    e.scene = episodes_[i].scene;
  }
  for (const std::size_t i : which) {
    if (!places_.prefetch) break;
    Environment& e = environments_[i];
    e.next.emplace(next_episode_(i, e.episodes));
    if (*e.next && (*e.next)->scene < places_.count) places_.prefetch((*e.next)->scene);
  }
  run(which.size(), [&](std::size_t k) {
    Environment& e = environments_[which[k]];
    e.status = detail::guarded([&] { return e.world->reset(episodes_[which[k]].episode); });
    e.moved = true;
    if (e.status.ok()) note_observation(which[k]);
  });
  return first_error(which);
}

Status BatchWorld::reset(const ParallelFor& run, std::span<const std::uint8_t> mask) {
  if (!mask.empty() && mask.size() != size()) {
    return bad("reset: a mask of " + std::to_string(mask.size()) + " for " + std::to_string(size()) +
               " environments");
  }
  if (!mask.empty() && !begun_) return bad("reset: the first one is of all environments");
  begun_ = false;  // Set to true again only when everything has succeeded.
  finished_.clear();
  final_metrics_.clear();
  final_point_goals_.clear();
  resetting_.clear();
  for (std::size_t e = 0; e < size(); ++e) {
    environments_[e].moved = false;
    if (mask.empty() || mask[e] != 0) resetting_.push_back(e);
  }
  if (Status s = begin(run, resetting_); !s) return s;
  for (const std::size_t e : resetting_) {
    rewards_[e] = 0.0;
    terminated_[e] = truncated_[e] = 0;
    infos_[e] = environments_[e].world->last_step();
  }
  begun_ = true;
  publish();
  return {};
}

Status BatchWorld::make_bodies(const ParallelFor& run, std::span<const std::size_t> which) {
  try {
    return list_and_make_bodies(run, which);
  } catch (...) {
    bodies_ = {};  // Listed bodies that were not made would count as none.
    throw;
  }
}

Status BatchWorld::list_and_make_bodies(const ParallelFor& run, std::span<const std::size_t> which) {
  static const CapsuleSet nobody;
  removed_.clear();
  bodies_.trim(most_bodies_, removed_);
  missing_.clear();
  for (const std::size_t i : which) {
    Environment& e = environments_[i];
    for (std::size_t k = 0; k < e.bodies.size(); ++k) {
      e.bodies[k] = &nobody;
      const int at = static_cast<int>(k);
      if (!e.source) continue;
      const BodyCache::Key key{e.scene, e.world->tick(at), e.world->tick(at + 1)};
      const auto [entry, fresh] = bodies_.find(key);
      e.bodies[k] = &entry->bodies;
      if (fresh) {
        const bool goes_on = e.last.scene == key.scene && e.last.t1 == key.t0;
        missing_.push_back({key, entry, &e, goes_on ? bodies_.peek(e.last) : nullptr});
      }
      e.last = key;
    }
  }
  made_.assign(missing_.size(), {});
  run(std::max(missing_.size(), removed_.size()), [&](std::size_t m) {
    if (m < removed_.size()) removed_[m] = {};
    if (m >= missing_.size()) return;
    const BodyCache::Key& key = missing_[m].key;
    made_[m] = detail::guarded([&] {
      std::vector<DynamicCapsule> capsules;
      const Environment& e = *missing_[m].environment;
      if (e.source_after) {
        e.source_after(key.t0, key.t1, missing_[m].before, capsules);
      } else {
        e.source(key.t0, key.t1, capsules);
      }
      auto set = CapsuleSet::create(std::move(capsules), key.t0, key.t1);
      if (set) missing_[m].entry->bodies = std::move(*set);
      missing_[m].entry->made = set.ok();
      return set.status();
    });
  });
  Status first;
  for (std::size_t m = 0; m < missing_.size(); ++m) {
    if (made_[m].ok()) continue;
    const BodyCache::Key& key = missing_[m].key;
    if (first.ok())
      first = {made_[m].code(), "scene " + std::to_string(key.scene) + ": " + made_[m].message()};
    bodies_.erase(key);
  }
  return first;
}

Status BatchWorld::step(const ParallelFor& run, std::span<const Action> actions,
                        const std::function<Status()>& before_reset) {
  return act(run, actions, before_reset);
}
Status BatchWorld::step(const ParallelFor& run, std::span<const VelocityCommand> commands,
                        const std::function<Status()>& before_reset) {
  return act(run, commands, before_reset);
}

void BatchWorld::prepare_step(const ParallelFor& run) {
  if (!begun_) return;
  stepping_.clear();
  for (std::size_t e = 0; e < size(); ++e) {
    if (!environments_[e].world->done()) stepping_.push_back(e);
  }
  prepared_ = detail::guarded([&] { return make_bodies(run, stepping_); }).ok();
}

template <class A>
Status BatchWorld::act(const ParallelFor& run, std::span<const A> actions,
                       const std::function<Status()>& before_reset) {
  if (!begun_) return bad("step before reset: no episodes are running");
  if (actions.size() != size()) {
    return bad("step: " + std::to_string(actions.size()) + " actions for " + std::to_string(size()) +
               " environments");
  }
  stepping_.clear();
  resetting_.clear();
  for (std::size_t e = 0; e < size(); ++e) {
    const bool done = environments_[e].world->done();
    if (done && auto_reset_ == AutoReset::disabled) {
      return bad("environment " + std::to_string(e) + " is done: reset it first");
    }
    (done ? resetting_ : stepping_).push_back(e);
  }
  begun_ = false;  // Set to true again only when everything has succeeded.
  if (!std::exchange(prepared_, false)) {
    if (Status s = make_bodies(run, stepping_); !s) return s;
  }
  run(stepping_.size(), [&](std::size_t k) {
    const std::size_t i = stepping_[k];
    Environment& e = environments_[i];
    e.status = detail::guarded([&] { return e.world->step(actions[i], e.bodies).status(); });
    e.moved = true;
    infos_[i] = e.world->last_step();
    rewards_[i] = infos_[i].reward;
    terminated_[i] = e.world->stop_called() ? 1 : 0;
    truncated_[i] = e.world->done() && !e.world->stop_called() ? 1 : 0;
    note_observation(i);
  });
  if (Status s = first_error(stepping_); !s) return s;
  finished_.clear();
  final_metrics_.clear();
  final_point_goals_.clear();
  for (const std::size_t e : stepping_) {
    if (!environments_[e].world->done()) continue;
    finished_.push_back(e);
    final_metrics_.push_back(environments_[e].world->metrics());
    final_point_goals_.push_back(environments_[e].world->point_goal());
  }
  publish();
  if (Status s = begin(run, resetting_); !s) return s;
  for (const std::size_t e : resetting_) {
    rewards_[e] = 0.0;
    terminated_[e] = truncated_[e] = 0;
    infos_[e] = environments_[e].world->last_step();
  }
  if (auto_reset_ == AutoReset::same_step && !finished_.empty()) {
    if (before_reset) {
      if (Status s = before_reset(); !s) return s;
    }
    if (Status s = begin(run, finished_); !s) return s;
  }
  begun_ = true;
  return {};
}

}  // namespace gsnav
