// SPDX-License-Identifier: Apache-2.0
#include "session.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <exception>
#include <new>
#include <nlohmann/json.hpp>
#include <numbers>
#include <utility>

#include "../common/overlay.hpp"
#include "gsnav/io/image_file.hpp"

namespace gsnav_viewer {
namespace {

using gsnav::Errc;
using gsnav::Result;
using gsnav::Status;
using gsnav::Vec3d;
using std::chrono::duration;
using std::chrono::milliseconds;

constexpr double kTurnedUp = 1.55;          // Radians. Limit of looking up and down.
constexpr auto kHeld = milliseconds(1000);  // A key whose release was lost is released after this time.
constexpr auto kStill = milliseconds(250);  // Interval between frames while nothing moves.
constexpr auto kLinger =
    milliseconds(100);  // After this time the next frame is started even if it has not been requested.
constexpr auto kAnswer = milliseconds(500);  // Longest wait of a request for a frame.
constexpr int kMostActions = 5;              // Largest number of actions that one frame catches up with
                                             // if rendering is slow.
constexpr double kLeastIsland = 1.5;         // Metres, as on maps.

/// Depth colours, evenly spaced from near to far, in CSS notation.
std::vector<std::string> depth_colors(const SessionOptions& how) {
  constexpr int kColors = 9;
  std::vector<float> depth;
  for (int i = 0; i < kColors; ++i) {
    depth.push_back(
        static_cast<float>(how.depth_near + i * (how.depth_far - how.depth_near) / (kColors - 1)));
  }
  const std::vector<std::uint8_t> rgb = gsnav::io::colorize_depth(
      depth, static_cast<float>(how.depth_near), static_cast<float>(how.depth_far));
  std::vector<std::string> out;
  for (std::size_t i = 0; i < depth.size(); ++i) {
    char text[8];
    std::snprintf(text, sizeof text, "#%02x%02x%02x", rgb[3 * i], rgb[3 * i + 1], rgb[3 * i + 2]);
    out.emplace_back(text);
  }
  return out;
}

std::vector<std::array<Vec3d, 3>> walkable(const gsnav::NavMesh& mesh) {
  std::vector<std::array<Vec3d, 3>> out = mesh.triangles();
  std::erase_if(out, [&](const std::array<Vec3d, 3>& t) {
    const auto on = mesh.snap_point((t[0] + t[1] + t[2]) * (1.0 / 3.0), {{0.1, 0.5, 0.1}});
    return !on || mesh.island_radius(mesh.island_of(on->poly)) < kLeastIsland;
  });
  return out;
}

}  // namespace

Result<std::unique_ptr<Session>> Session::create(const gsnav_eval::Options& options,
                                                 gsnav_eval::Stage stage, const SessionOptions& how) {
  if (stage.episodes.empty()) return {Errc::invalid_argument, "no episode to begin with"};
  stage.config.task.control_period = 1.0 / how.rate;
  stage.config.task.max_steps = 1000000000;  // A person who walks by hand has no step limit.
  auto world = gsnav::World::create(stage.scene->navmesh, stage.config.task,
                                    [scene = stage.scene](double t0, double t1, auto& out) {
                                      gsnav::append_bodies(*scene, t0, t1, out);
                                    });
  if (!world) return world.status();
  gsnav::RenderOptions draws{stage.config.render, gsnav::detail_choice(stage.config)};
  draws.render.outputs = gsnav::kRgb | gsnav::kMedianDepth;
  auto renderer = gsnav::Renderer::create(options.device, stage.scene, draws);
  if (!renderer) return renderer.status();
  auto empty = std::make_shared<gsnav::SimulatorScene>(*stage.scene);
  empty->avatars.clear();
  auto without_people = gsnav::Renderer::create(options.device, std::move(empty), draws);
  if (!without_people) return without_people.status();
  std::unique_ptr<Session> s(new Session(options, std::move(stage), how, std::move(*world),
                                         std::move(*renderer), std::move(*without_people)));
  if (Status status = s->begin_episode(0); !status) return status;
  return s;
}

Session::Session(const gsnav_eval::Options& options, gsnav_eval::Stage stage, const SessionOptions& how,
                 gsnav::World world, gsnav::Renderer renderer, gsnav::Renderer without_people)
    : stage_(std::move(stage)),
      how_(how),
      depth_colors_(depth_colors(how)),
      scene_name_(options.scene == "default" ? "embedded flat" : options.scene),
      world_(std::move(world)),
      renderer_(std::move(renderer)),
      without_people_(std::move(without_people)),
      walkable_(walkable(*stage_.scene->navmesh)),
      map_frame_(gsnav_tools::fit_map(*stage_.scene->navmesh, options.width, options.height)),
      ground_(options.width, options.height, {0.96f, 0.96f, 0.96f}) {
  controls_.paused = how.paused;
  gsnav_tools::MapContent map;
  map.navmesh = stage_.scene->navmesh.get();
  map.start = stage_.episodes.front().start_position;
  if (!stage_.scene->assets.empty()) {
    map.cloud = stage_.scene->assets.front().cloud.get();
    map.world_from_asset = stage_.scene->assets.front().world_from_asset;
  }
  gsnav_tools::draw_ground(ground_, map_frame_, map);
}

Status Session::begin_episode(std::size_t number) {
  episode_ = number;
  const gsnav::PointNavEpisode& e = stage_.episodes[episode_];
  if (Status s = world_.reset(e); !s) return s;
  way_ = {world_.agent().position};
  shortest_.clear();
  if (const auto path = world_.navmesh().find_path(way_[0], e.goal_position)) shortest_ = path->points;
  return {};
}

Status Session::put_time(double t) {
  gsnav::WorldState s = world_.state();
  s.time = t;
  s.start_time = t - s.steps * world_.config().control_period;
  return world_.set_state(s);
}

Status Session::run() {
  const auto failed = [](Errc code, const char* what) {
    return Status(code, std::string("drawing a frame: ") + what);
  };
  try {
    return draw_frames();
  } catch (const std::bad_alloc&) {
    return failed(Errc::out_of_memory,
                  "out of memory; a smaller --width and --height or fewer --avatars take less");
  } catch (const std::exception& e) {
    return failed(Errc::backend_failure, e.what());
  }
}

Status Session::draw_frames() {
  const auto period = std::chrono::duration_cast<Clock::duration>(duration<double>(1.0 / how_.rate));
  Clock::time_point before = Clock::now() - period;
  while (true) {
    Controls c;
    {
      std::unique_lock lock(mutex_);
      news_.wait(lock, [&] { return stopped_ || waiting_ > 0 || Clock::now() - last_wait_ < kLinger; });
      news_.wait_until(lock, before + period, [&] { return stopped_; });
      const auto still = [&] {
        return controls_.paused && controls_.forward == 0 && controls_.left == 0 && !changed_;
      };
      if (still()) news_.wait_until(lock, before + kStill, [&] { return stopped_ || !still(); });
      if (stopped_) return {};
      if (Clock::now() - last_message_ > kHeld) controls_.forward = controls_.left = 0;
      c = controls_;
      controls_.forget_commands();
      changed_ = false;
      ++begun_;
    }
    const Clock::time_point now = Clock::now();
    const double passed = duration<double>(now - before).count();
    before = now;
    if (passed > 1.0) rate_ = 0.0;  // No frame was requested for a while.
    rate_ += (rate_ == 0.0 ? 1.0 : 0.1) * (1.0 / passed - rate_);
    if (Status s =
            advance(c, std::clamp(static_cast<int>(std::lround(passed * how_.rate)), 1, kMostActions));
        !s)
      return s;
    if (Status s = draw(c); !s) return s;
    frame_seconds_ = duration<double>(Clock::now() - now).count();
    std::string made = describe(c, begun_) + '\n';
    for (const std::string& image : drawn_) made += image;
    std::lock_guard lock(mutex_);
    newest_ = std::move(made);
    published_ = begun_;
    news_.notify_all();
  }
}

void Session::stop() {
  std::lock_guard lock(mutex_);
  stopped_ = true;
  news_.notify_all();
}

Status Session::advance(const Controls& c, int actions) {
  if (c.next) {
    const double now = world_.time();
    if (Status s = begin_episode((episode_ + 1) % stage_.episodes.size()); !s) return s;
    if (Status put = put_time(now); !put) return put;  // People continue to walk.
  }
  if (c.time) {
    if (Status put = put_time(*c.time); !put) return put;
  }
  gsnav::WorldState s = world_.state();
  s.agent.yaw = std::remainder(s.agent.yaw + c.turn, 2 * std::numbers::pi);
  s.agent.pitch = std::clamp(s.agent.pitch + c.tilt, -kTurnedUp, kTurnedUp);
  if (Status put = world_.set_state(s); !put) return put;
  if (world_.done()) return {};
  gsnav::VelocityCommand command;
  if (c.stop) {
    command.stop = true;
    return world_.step(command).status();
  }
  command.linear = how_.speed * c.forward;
  command.lateral = how_.speed * c.left;
  const bool moving = command.linear != 0 || command.lateral != 0;
  if (c.paused && !moving) return {};
  for (int i = 0; i < actions; ++i) {
    const double t = world_.time();
    if (const auto r = world_.step(command); !r) return r.status();
    if (c.paused) {
      if (Status put = put_time(t); !put) return put;
    }
    if (moving) way_.push_back(world_.agent().position);
  }
  return {};
}

Status Session::draw(const Controls& c) {
  const auto bodies = world_.bodies(world_.time(), world_.time());
  if (!bodies) return bodies.status();
  if (Status s = draw_view(c, *bodies); !s) return s;
  return draw_map(c, *bodies);
}

Status Session::draw_view(const Controls& c, const gsnav::CapsuleSet& bodies) {
  const gsnav::AgentPose& agent = world_.agent();
  const gsnav::Camera camera =
      gsnav::sensor_camera(stage_.config.sensors.front(), agent.position, agent.rotation(), agent.pitch);
  gsnav::Renderer& renderer = c.people ? renderer_ : without_people_;
  if (Status s = renderer.render(std::span(&camera, 1), frames_, world_.time()); !s) return s;
  std::vector<std::uint8_t> rgb(frames_.rgb.size());
  gsnav::to_bytes(frames_.rgb, rgb);
  if (c.navmesh || c.capsules) {
    gsnav_tools::Canvas canvas(camera.width, camera.height, {});
    canvas.paste(rgb.data(), camera.width, camera.height, 0, 0);
    const gsnav_tools::DrawnView view{canvas, camera, frames_.median_depth};
    if (c.navmesh) gsnav_tools::draw_navmesh(view, walkable_);
    if (c.capsules) gsnav_tools::draw_capsules(view, bodies.capsules());
    rgb = canvas.bytes();
  }
  if (Status s = publish(Panel::color, rgb); !s) return s;
  return publish(Panel::depth,
                 gsnav::io::colorize_depth(frames_.median_depth, static_cast<float>(how_.depth_near),
                                           static_cast<float>(how_.depth_far)));
}

Status Session::draw_map(const Controls& c, const gsnav::CapsuleSet& bodies) {
  constexpr gsnav_tools::Rgb kAgent{0.05f, 0.30f, 0.85f}, kGoal{0.86f, 0.10f, 0.16f},
      kShortest{0.15f, 0.15f, 0.17f};
  gsnav_tools::Canvas canvas = ground_;
  const gsnav_tools::MapFrame& f = map_frame_;
  gsnav_tools::draw_polyline(canvas, f, shortest_, 0.8, kShortest, 0.6f);
  gsnav_tools::draw_polyline(canvas, f, way_, 1.4, kAgent, 0.9f);
  if (c.people) gsnav_tools::draw_bodies(canvas, f, bodies.capsules(), 0.6f);
  const Vec3d goal = world_.episode().goal_position;
  canvas.disc(f.x(goal), f.y(goal), 2.5, kGoal, 1.0f);
  canvas.ring(f.x(goal), f.y(goal), 6, 2, kGoal, 1.0f);
  const gsnav::AgentPose& agent = world_.agent();
  // Field of view: the edges of the picture up to a distance of 2 m.
  const double half = 0.5 * stage_.config.sensors.front().hfov * std::numbers::pi / 180.0;
  const double x = f.x(agent.position), y = f.y(agent.position);
  gsnav::Vec2<double> view[3] = {{x, y}, {}, {}};
  for (int i = 0; i < 2; ++i) {
    const double yaw = agent.yaw + (i == 0 ? half : -half), far = 2.0 * f.scale;
    view[i + 1] = {x - far * std::sin(yaw), y - far * std::cos(yaw)};
  }
  canvas.triangle(view, kAgent, 0.4f);
  const double radius = std::max(world_.config().agent_radius * f.scale, 4.0);
  canvas.disc(x, y, radius + 1.5, {1, 1, 1}, 1.0f);
  canvas.disc(x, y, radius, kAgent, 1.0f);
  return publish(Panel::map, canvas.bytes());
}

Status Session::publish(Panel panel, std::span<const std::uint8_t> rgb) {
  const gsnav::SensorSpec& s = stage_.config.sensors.front();
  const auto jpeg = gsnav::io::encode_jpeg(rgb, s.resolution[1], s.resolution[0], how_.quality);
  if (!jpeg) return jpeg.status();
  drawn_[static_cast<std::size_t>(panel)].assign(reinterpret_cast<const char*>(jpeg->data()),
                                                 jpeg->size());
  return {};
}

std::string Session::describe(const Controls& c, std::uint64_t number) const {
  const gsnav::EpisodeMetrics m = world_.metrics();
  const gsnav::AgentPose& a = world_.agent();
  return nlohmann::json{
      {"frame", number},
      {"sizes", {drawn_[0].size(), drawn_[1].size(), drawn_[2].size()}},
      {"depth", {{"near", how_.depth_near}, {"far", how_.depth_far}, {"colors", depth_colors_}}},
      {"scene", scene_name_},
      {"time", world_.time()},
      {"paused", c.paused},
      {"people", c.people},
      {"capsules", c.capsules},
      {"navmesh", c.navmesh},
      {"position", {a.position.x, a.position.y, a.position.z}},
      {"yaw", a.yaw},
      {"pitch", a.pitch},
      {"episode", world_.episode().id},
      {"episodes", stage_.episodes.size()},
      {"done", world_.done()},
      {"success", m.success},
      {"visible", frames_.stats.empty() ? 0 : frames_.stats[0].visible},
      {"rate", rate_},
      {"frame_ms", 1e3 * frame_seconds_},
      {"metrics",
       {{"distance_to_goal", m.distance_to_goal},
        {"path_length", m.path_length},
        {"shortest_path", m.start_distance},
        {"spl", m.spl},
        {"soft_spl", m.soft_spl},
        {"steps", m.steps},
        {"collisions", m.collisions},
        {"collision_rate", m.collision_rate},
        {"psi", m.psi},
        {"psc", m.psc},
        {"clearance", world_.last_step().avatar_clearance}}}}
      // File names are bytes. Invalid UTF-8 becomes U+FFFD.
      .dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

Result<std::string> Session::frame(std::string_view message) {
  std::unique_lock lock(mutex_);
  if (Status s = apply(message, controls_); !s) return s;
  // A frame number from another process is ignored.
  const bool knows = controls_.seen && *controls_.seen <= begun_;
  const std::uint64_t seen = knows ? *controls_.seen : begun_;
  if (controls_.walks) last_message_ = Clock::now();
  changed_ = changed_ || controls_.steers || !knows;
  ++waiting_;
  news_.notify_all();
  news_.wait_for(lock, kAnswer, [&] { return stopped_ || published_ > seen; });
  --waiting_;
  last_wait_ = Clock::now();
  return newest_;
}

}  // namespace gsnav_viewer
