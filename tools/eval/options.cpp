// SPDX-License-Identifier: Apache-2.0
#include "options.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <charconv>
#include <sstream>
#include <string_view>
#include <type_traits>

#include "../common/check_values.hpp"

namespace gsnav_eval {
namespace {

template <class T>
std::string text_of(const T& value) {
  if constexpr (std::is_same_v<T, std::string>) {
    return value;
  } else if constexpr (std::is_arithmetic_v<T>) {
    std::array<char, 32> text{};
    return {text.data(), std::to_chars(text.data(), text.data() + text.size(), value)
                             .ptr};  // Shortest text that reads back as the same value.
  } else {
    std::string all;
    for (const auto& v : value) all += (all.empty() ? "" : "\n") + text_of(v);
    return all;
  }
}

/// Calls f(flag, value, role, names_file) for each option that affects an evaluation. `names_file` is
/// true if the value is the name of a file.
template <class O, class F>
void for_each_option(O& o, const F& f) {
  using enum OptionRole;
  f("--scene", o.scene, file, o.scene != "default");
  f("--up", o.up, result, false);
  f("--time", o.time, result, false);
  f("--storage", o.storage, result, false);
  f("--profile", o.profile, view, false);
  f("--lod-error", o.lod_error, view, false);
  f("--lod-levels", o.lod_levels, view, false);
  f("--visible-sets", o.visible_sets, view, false);
  f("--mesh", o.meshes, result, false);
  f("--navmesh", o.navmesh, file, names_navmesh(o));
  f("--cell-size", o.cell_size, result, false);
  f("--crop", o.crop, result, false);
  f("--density", o.density, result, false);
  f("--avatars", o.avatars, result, false);
  f("--episodes", o.episodes, result, false);
  f("--episode-file", o.episode_file, file, !o.episode_file.empty());
  f("--preset", o.preset, result, false);
  f("--policy", o.policy, result, false);
  f("--seed", o.seed, result, false);
  f("--max-steps", o.max_steps, result, false);
  f("--width", o.width, view, false);
  f("--height", o.height, view, false);
  f("--hfov", o.hfov, view, false);
  f("--eye-height", o.eye_height, view, false);
}

}  // namespace

std::vector<OptionValue> option_values(const Options& o) {
  std::vector<OptionValue> out;
  for_each_option(o, [&](const char* flag, const auto& value, OptionRole role, bool names_file) {
    out.push_back({flag, text_of(value), role, names_file});
  });
  return out;
}

gsnav::Status take_options(const CLI::App& app, const std::vector<OptionValue>& values,
                           Options& options) {
  std::vector<std::string> words;
  for (const OptionValue& v : values) {
    if (v.value.empty() || app.get_option(v.flag)->count() > 0) continue;
    if (v.flag == "--crop" || v.flag == "--mesh") {
      words.push_back(v.flag);
      std::istringstream lines(v.value);
      for (std::string one; std::getline(lines, one);) words.push_back(one);
    } else {
      words.push_back(v.flag + "=" + v.value);
    }
  }
  std::reverse(words.begin(), words.end());  // CLI11 expects the words in reverse order.
  CLI::App again;
  Options read;
  add_world_options(again, read);
  try {
    again.parse(words);
  } catch (const CLI::ParseError& e) {
    return {gsnav::Errc::invalid_argument, e.what()};
  }
  // Options given on the command line are kept. They are compared with the journal later.
  for_each_option(options, [&](const char* flag, auto& to, OptionRole, bool) {
    if (app.get_option(flag)->count() > 0) return;
    for_each_option(read, [&](const char* other, auto& from, OptionRole, bool) {
      if constexpr (std::is_same_v<decltype(to), decltype(from)>) {
        if (std::string_view(flag) == other) to = from;
      }
    });
  });
  return {};
}

bool names_navmesh(const Options& o) {
  return o.navmesh != "auto" && o.navmesh != "mesh" && o.navmesh != "gaussians" && o.navmesh != "none";
}

void add_scene_options(CLI::App& app, Options& o) {
  app.add_option("--episodes", o.episodes, "number of episodes to generate")
      ->capture_default_str()
      ->check(CLI::Range(1, 100000));
  app.add_option("--episode-file", o.episode_file,
                 "episodes of Habitat-Lab (.json, .json.gz) instead of generated ones");
  app.add_option("--preset", o.preset,
                 "body and rules: v1 or v2 (PointNav challenges), or avatar (v1, with a reward that "
                 "charges contact with people)")
      ->capture_default_str()
      ->check(CLI::IsMember({"v1", "v2", "avatar"}));
  gsnav_tools::add_view_options(app, o);
  gsnav_tools::add_scene_options(app, o);
  gsnav_tools::refuse_value(app, "--navmesh", "none", "agents need one; use auto");
  gsnav_tools::refuse_value(app, "--storage", "packed",
                            "journals and maps read the floats; use full or compact");
}

void add_world_options(CLI::App& app, Options& o) {
  o.out = "eval";
  add_scene_options(app, o);
  app.add_option("--policy", o.policy,
                 "follower (shortest path, waits for people), greedy (ignores people) or random")
      ->capture_default_str()
      ->check(CLI::IsMember({"follower", "greedy", "random"}));
  app.add_option("--max-steps", o.max_steps, "number of actions after which an episode ends")
      ->capture_default_str()
      ->check(CLI::Range(1, 1000000));
  app.add_option("--out", o.out, "folder of the evaluation")->capture_default_str();
}

}  // namespace gsnav_eval
