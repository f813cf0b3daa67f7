// SPDX-License-Identifier: Apache-2.0
#include "gsnav/sim/follower.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <vector>

#include "action_motion.hpp"
#include "gsnav/detail/math/angles.hpp"

namespace gsnav {
namespace {

const SnapOptions kSnap{{0.5, 1.0, 0.5}};

// Penalties, in metres of path.
constexpr double kContact = 6.0;   // Step that touches an avatar.
constexpr double kNearness = 0.9;  // Step within the comfort distance, scaled by nearness: full at
                                   // distance 0.
constexpr double kStuck = 0.2;     // Move that a wall stops.

/// Numbers of actions: first wait, then turn, then walk straight, and from then on follow the path. All
/// zero: follow the path at once.
struct ActionCounts {
  int waits = 0, turns = 0, walks = 0;  // Positive turns are to the left.
};

struct Outlook {
  double cost = std::numeric_limits<double>::infinity();
  double charge = 0.0;  // Part of the cost that is not distance.
  Action first = Action::stop;
};

/// Continuation of the shortest path from a position: its remaining length, and the direction to its
/// next corner.
struct Guide {
  double left = std::numeric_limits<double>::infinity();
  double bearing = 0.0;
};

Guide guide(const NavMesh& mesh, const Vec3d& from, const Vec3d& goal, double bearing) {
  Guide g{std::numeric_limits<double>::infinity(), bearing};
  const Result<NavPath> path = mesh.find_path(from, goal, kSnap);
  if (!path) return g;
  g.left = path->length;
  for (const Vec3d& p : path->points) {
    const Vec3d d = p - from;
    if (std::hypot(d.x, d.z) < 0.05) continue;  // A corner that was just passed gives no direction.
    g.bearing = heading_of(d);
    break;
  }
  return g;
}

class Lookahead {
 public:
  Lookahead(const World& world, const std::vector<CapsuleSet>& bodies, int horizon, double comfort)
      : world_(world),
        bodies_(bodies),
        horizon_(horizon),
        comfort_(comfort),
        turn_(radians(world.config().turn_angle)),
        reach_(0.95 * world.config().success_distance) {}

  Outlook play(const ActionCounts& plan) const {
    static const CapsuleSet nobody;
    const TaskConfig& c = world_.config();
    const Vec3d goal = world_.episode().goal_position;
    AgentState agent = world_.agent_state();
    double yaw = world_.agent().yaw;
    Outlook out;
    Guide way = guide(world_.navmesh(), agent.position, goal, yaw);
    for (int i = 0; i < horizon_; ++i) {
      Action a = scripted(plan, i);
      if (a == Action::stop) a = steer(way, yaw);
      if (i == 0) out.first = a;
      const detail::ActionMotion motion = detail::action_motion(a, c);
      Vec3d displacement{};
      if (a == Action::move_forward) {
        displacement = along_heading(yaw) * motion.forward;
      } else {
        yaw += motion.turn;
      }
      const CapsuleSet& now = bodies_.empty() ? nobody : bodies_[static_cast<std::size_t>(i)];
      // Later actions count less, because a new plan is made before they happen.
      const double weight = 1.0 - 0.5 * i / horizon_;
      if (a == Action::move_forward || !now.empty()) {
        const StepResult r = gsnav::step(world_.navmesh(), agent, displacement, now,
                                         {c.allow_sliding, c.skin, StepOptions{}.max_slides});
        const double moved = norm(r.position - agent.position);
        if (r.hit_wall && moved < 0.5 * c.forward_step) out.charge += kStuck * weight;
        if (r.blocked_by == BlockedBy::capsule || r.pushed_into) out.charge += kContact * weight;
        agent.position = r.position;
        agent.poly = r.poly;
        if (a == Action::move_forward) way = guide(world_.navmesh(), agent.position, goal, way.bearing);
        if (!now.empty()) {
          const double d = clearance(agent, now, now.t1()).distance;
          if (d < comfort_) out.charge += kNearness * weight * (1.0 - max(d, 0.0) / comfort_);
        }
      }
      if (way.left < reach_) {
        // Reward for actions that are not needed.
        out.cost = out.charge - c.forward_step * (horizon_ - 1 - i);
        return out;
      }
    }
    const double turns_left = abs(wrapped(way.bearing - yaw)) / turn_;
    out.cost = out.charge + way.left + 0.6 * c.forward_step * turns_left;
    return out;
  }

 private:
  /// Action that the plan prescribes for step i. Action::stop means that the path decides.
  Action scripted(const ActionCounts& plan, int i) const noexcept {
    const Action to = plan.turns < 0 ? Action::turn_right : Action::turn_left;
    const Action fro = plan.turns < 0 ? Action::turn_left : Action::turn_right;
    if (i < plan.waits) return i % 2 == 0 ? to : fro;
    i -= plan.waits;
    if (i < std::abs(plan.turns)) return to;
    return i - std::abs(plan.turns) < plan.walks ? Action::move_forward : Action::stop;
  }

  Action steer(const Guide& way, double yaw) const noexcept {
    const double error = wrapped(way.bearing - yaw);
    if (abs(error) <= 0.5 * turn_ + 1e-9) return Action::move_forward;
    return error > 0 ? Action::turn_left : Action::turn_right;
  }

  const World& world_;
  const std::vector<CapsuleSet>& bodies_;
  int horizon_;
  double comfort_, turn_, reach_;
};

}  // namespace

Action GeodesicFollower::next(const World& world) const {
  const TaskConfig& c = world.config();
  const double left = world.distance_to_goal();
  if (left < 0.95 * c.success_distance || !is_finite(left)) return Action::stop;

  const int horizon = std::max(options_.horizon, 2);
  std::vector<CapsuleSet> bodies;
  bool near = false;
  for (int i = 0; i < horizon; ++i) {
    const double t = world.time() + i * c.control_period;
    Result<CapsuleSet> set = world.bodies(t, t + c.control_period);
    if (!set) break;
    near = near || clearance(world.agent_state(), *set, t).distance < options_.watch_distance;
    bodies.push_back(std::move(*set));
  }
  if (!near || bodies.size() != static_cast<std::size_t>(horizon)) bodies.clear();

  const Lookahead look(world, bodies, horizon, options_.comfort);
  Outlook best = look.play({});
  if (best.charge <= 0) return best.first;
  const auto consider = [&](const ActionCounts& plan) {
    const Outlook o = look.play(plan);
    if (o.cost < best.cost - 1e-9) best = o;
  };
  const int most = std::min(static_cast<int>(std::lround(180.0 / c.turn_angle)), horizon - 2);
  for (int k = 0; k <= most; ++k) {
    for (const int walks : {1, 3}) {
      consider({0, k, walks});
      if (k > 0) consider({0, -k, walks});
    }
  }
  if (!bodies.empty()) {
    for (int wait = 2; wait < horizon; wait += 2) {
      consider({wait, 0, 0});
      consider({wait, -1, 0});
    }
    for (const int k : {3, 6, 9}) {  // Turn away and stay there.
      consider({horizon - k, k, 0});
      consider({horizon - k, -k, 0});
    }
  }
  return best.first;
}

}  // namespace gsnav
