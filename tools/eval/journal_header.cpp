// SPDX-License-Identifier: Apache-2.0
#include "journal_header.hpp"

#include <algorithm>

#include "gsnav/render.hpp"
#include "gsnav/scene/prepare.hpp"
#include "journal_json.hpp"
#include "run.hpp"

namespace gsnav_eval {
namespace {

namespace fs = std::filesystem;
using gsnav::Errc;
using gsnav::Result;
using gsnav::Status;

constexpr int kFormat = 2;

std::string shown(const OptionValue& v) {
  std::string value = v.value;
  std::replace(value.begin(), value.end(), '\n', ' ');
  return value.empty() ? "no " + v.flag : v.flag + " " + value;
}

}  // namespace

Contents contents_of(const Stage& stage) {
  const auto vector = [](gsnav::Hasher& h, const gsnav::Vec3d& v) {
    for (int k = 0; k < 3; ++k) h.value(v[k]);
  };
  gsnav::Hasher scene, navmesh, people, episodes;
  for (const auto& asset : stage.scene->assets) {
    hash_cloud(scene, *asset.cloud);
    const gsnav::Similarity& at = asset.world_from_asset;
    for (const double x : {at.rotation.w, at.rotation.x, at.rotation.y, at.rotation.z, at.scale})
      scene.value(x);
    vector(scene, at.translation);
  }
  for (const auto& triangle : stage.scene->navmesh->triangles()) {
    for (const gsnav::Vec3d& v : triangle) vector(navmesh, v);
  }
  const auto hash_body = [&vector](gsnav::Hasher& h, const gsnav::DynamicCapsule& b) {
    h.value(b.avatar), h.value(b.bone);
    for (const auto& c : {b.motion.begin, b.motion.end})
      vector(h, c.p0), vector(h, c.p1), h.value(c.radius);
  };
  // Hash the bodies at times that no periodic walk repeats.
  constexpr int kTimes = 32;
  constexpr double kApart = 7.390625;
  std::vector<gsnav::DynamicCapsule> bodies;
  people.value(stage.scene->avatars.size());
  for (int i = 0; i < kTimes; ++i) {
    bodies.clear();
    const double t = kApart * i;
    gsnav::append_bodies(*stage.scene, t, t + stage.config.task.control_period, bodies);
    people.value(bodies.size());
    for (const gsnav::DynamicCapsule& b : bodies) hash_body(people, b);
  }
  for (const auto& avatar : stage.scene->avatars) hash_cloud(people, avatar.asset()->cloud);
  episodes.value(stage.episodes.size());
  for (const gsnav::PointNavEpisode& e : stage.episodes) {
    episodes.text(e.id);
    episodes.text(e.scene_id);
    vector(episodes, e.start_position), vector(episodes, e.goal_position);
    const gsnav::Quatd& q = e.start_rotation;
    for (const double x : {q.w, q.x, q.y, q.z, e.geodesic_distance, e.start_time, e.goal_radius})
      episodes.value(x);
  }
  return {{"scene", scene.hex()},
          {"navmesh", navmesh.hex()},
          {"people", people.hex()},
          {"episodes", episodes.hex()}};
}

std::string header_of(const Options& o, const Contents& made_of) {
  Json options = Json::object(), contents = Json::object();
  for (const OptionValue& v : option_values(o)) options[v.flag.substr(2)] = v.value;
  for (const auto& [name, hash] : made_of) contents[name] = hash;
  const Json header{
      {"journal", "gsnav-eval"}, {"format", kFormat}, {"options", options}, {"contents", contents}};
  return header.dump(-1, ' ', false, Json::error_handler_t::replace);
}

Result<Header> read_header(const fs::path& path, const std::string& line) {
  const std::string where = path.string() + ": line 1: ";
  Json j;
  try {
    j = parse_line(line);
  } catch (const std::exception&) {
    return {Errc::invalid_file, where + "is not the header of a journal; " + kAnew};
  }
  if (!j.is_object() || !j.contains("format") || !j["format"].is_number_integer()) {
    return {Errc::invalid_file, where +
                                    "is of an earlier gsnav, whose journals do not say what they are of "
                                    "(format 1; this one reads 2); " +
                                    kAnew};
  }
  if (j["format"] != kFormat) {
    return {Errc::invalid_file, where + "format = " + j["format"].dump() + ": this gsnav reads " +
                                    std::to_string(kFormat) + "; " + kAnew};
  }
  Header out;
  for (const OptionValue& v : option_values(Options{})) {
    const auto options = j.find("options");
    const std::string name = v.flag.substr(2);
    if (options == j.end() || !options->is_object() || !options->contains(name) ||
        !(*options)[name].is_string()) {
      return {Errc::invalid_file, where + "options." + name + " is missing or no text; " + kAnew};
    }
    out.options.push_back({v.flag, (*options)[name].get<std::string>(), v.role, false});
  }
  if (!j.contains("contents") || !j["contents"].is_object()) {
    return {Errc::invalid_file, where + "contents is missing; " + kAnew};
  }
  for (const auto& [name, hash] : j["contents"].items()) {
    out.contents.emplace_back(name, hash.is_string() ? hash.get<std::string>() : hash.dump());
  }
  return out;
}

Status compare_options(const fs::path& path, const Header& header, const Options& o, bool views) {
  const std::vector<OptionValue> now = option_values(o);
  for (std::size_t i = 0; i < now.size(); ++i) {
    const OptionValue& was = header.options[i];
    if (now[i].value == was.value || (!views && now[i].role == OptionRole::view)) continue;
    // Files may be elsewhere. Their contents are compared.
    if (now[i].names_file && !was.value.empty() && now[i].role == OptionRole::file) continue;
    return {Errc::invalid_argument, path.string() + " was recorded with " + shown(was) +
                                        ", but this run has " + shown(now[i]) +
                                        ". Give the recorded option, " + kAnew};
  }
  return {};
}

Status compare_contents(const fs::path& path, const Header& header, const Options& o,
                        const Contents& now) {
  for (const auto& [name, hash] : now) {
    const auto same_name = [&n = name](const auto& entry) { return entry.first == n; };
    const auto was = std::find_if(header.contents.begin(), header.contents.end(), same_name);
    if (was != header.contents.end() && was->second == hash) continue;
    const std::string file = name == "scene" && o.scene != "default" ? o.scene
                             : name == "episodes"                    ? o.episode_file
                             : name == "navmesh" && names_navmesh(o) ? o.navmesh
                                                                     : std::string();
    return {Errc::invalid_argument, path.string() + " was made from other contents: the " + name +
                                        (file.empty() ? " that gsnav made" : " in " + file) +
                                        (name == "scene" || name == "navmesh" ? " has" : " have") +
                                        " changed (content hash " + hash + ", recorded " +
                                        (was == header.contents.end() ? "none" : was->second) +
                                        "). Restore the recorded content, " + kAnew};
  }
  return {};
}

}  // namespace gsnav_eval
