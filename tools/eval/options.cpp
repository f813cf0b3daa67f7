// SPDX-License-Identifier: Apache-2.0
#include "options.hpp"

namespace gsnav_eval {

void add_scene_options(CLI::App& app, Options& o) {
  app.add_option("--scene", o.scene, "scene to load; without: the embedded flat");
  app.add_option("--density", o.density, "of the embedded flat's Gaussians and of people's")
      ->capture_default_str()
      ->check(CLI::Range(0.05, 20.0));
  app.add_option("--up", o.up, "axis of the scene that points up")->capture_default_str();
  nav_loop::add_navmesh_options(app, o);
  app.add_option("--avatars", o.avatars, "people walking about")->capture_default_str()->check(CLI::Range(0, 64));
  app.add_option("--episodes", o.episodes, "episodes to generate")->capture_default_str()->check(CLI::Range(1, 100000));
  app.add_option("--episode-file", o.episode_file, "Habitat-Lab's .json or .json.gz, instead of generated ones");
  app.add_option("--preset", o.preset, "body and rules: v1, v2 (PointNav challenges), avatar (v1 with people charged)")
      ->capture_default_str()
      ->check(CLI::IsMember({"v1", "v2", "avatar"}));
  app.add_option("--seed", o.seed, "decides episodes, people and the random policy")->capture_default_str();
  app.add_option("--width", o.width, "image width, pixels")->capture_default_str()->check(CLI::Range(16, 4096));
  app.add_option("--height", o.height, "image height, pixels")->capture_default_str()->check(CLI::Range(16, 4096));
  app.add_option("--hfov", o.hfov, "horizontal field of view, degrees")->capture_default_str()->check(CLI::Range(10.0, 170.0));
  app.add_option("--eye-height", o.eye_height, "camera above the floor, metres")
      ->capture_default_str()
      ->check(CLI::Range(0.05, 3.0));
  app.add_option("--threads", o.threads, "threads, 0: all")->capture_default_str()->check(CLI::Range(0, 1024));
}

void add_world_options(CLI::App& app, Options& o) {
  o.out = "eval";
  add_scene_options(app, o);
  app.add_option("--policy", o.policy, "follower (gives way), greedy (sees walls only), random")
      ->capture_default_str()
      ->check(CLI::IsMember({"follower", "greedy", "random"}));
  app.add_option("--max-steps", o.max_steps, "actions after which an episode is cut off")
      ->capture_default_str()
      ->check(CLI::Range(1, 1000000));
  app.add_option("--out", o.out, "folder of the evaluation")->capture_default_str();
}

}  // namespace gsnav_eval
