// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/io/episode_file.hpp"

#include <algorithm>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "file.hpp"
#include "gsnav/core/replace_file.hpp"
#include "gzip.hpp"
#include "json.hpp"

namespace gsnav::io {
namespace {

namespace fs = std::filesystem;
using detail::Json;
using detail::member;
using detail::must_be;

constexpr std::size_t kLeastText = std::size_t{1} << 16;
constexpr std::size_t kMostText = std::size_t{1} << 30;  // a million episodes take half of it

/// The text of a file, decompressed if it is gzip.
Result<std::vector<std::byte>> load_text(const fs::path& path, const ReadLimits& limits) {
  const auto file = detail::read_file(path);
  if (!file) return file.status();
  const std::span<const std::byte> bytes = file->span();
  if (bytes.size() < 2 || bytes[0] != std::byte{0x1f} || bytes[1] != std::byte{0x8b}) {
    return std::vector<std::byte>(bytes.begin(), bytes.end());
  }
  if (Status s = detail::check_limits(limits, path.string()); !s) return s;
  const std::size_t most =
      std::max(kLeastText, static_cast<std::size_t>(limits.inflation) * bytes.size());
  detail::GzipReader gzip(bytes);
  std::vector<std::byte> text;
  while (!gzip.at_end()) {
    const std::size_t before = text.size();
    const std::size_t room = std::min(std::max(2 * before, kLeastText), most + 1);
    text.reserve(room);  // resize() alone may allocate twice this size
    text.resize(room);
    const std::size_t got = gzip.read(std::span(text).subspan(before));
    text.resize(before + got);
    if (text.size() > most) {
      return {Errc::unsupported, path.string() + ": its " + std::to_string(bytes.size()) +
                                     " bytes of gzip grow more than " +
                                     std::to_string(limits.inflation) +
                                     " times; raise ReadLimits::inflation for a file that you trust"};
    }
    if (text.size() > kMostText) return {Errc::unsupported, path.string() + ": more than 1 GiB of text"};
    if (got == 0) break;
  }
  if (!gzip.at_end()) return detail::invalid_file(path, "its gzip stream is cut or damaged");
  return text;
}

class EpisodeReader {
 public:
  explicit EpisodeReader(const ReadLimits& limits) : limits_(limits) {}

  Status read(const fs::path& path, bool follow) {
    const auto text = load_text(path, limits_);
    if (!text) return text.status();
    const auto json = detail::parse_json(*text, path.string(), limits_);
    if (!json) return json.status();
    source_ = path.string();
    if (!json->is_object()) return must_be(source_ + ":", *json, "an object");
    const Json* list = member(*json, "episodes");
    if (list == nullptr) return {Errc::invalid_file, source_ + ": 'episodes' is missing"};
    if (!list->is_array()) return must_be(source_ + ": 'episodes'", *list, "an array");
    if (list->empty() && follow) return read_content(path.parent_path() / "content");
    for (std::size_t i = 0; i < list->size(); ++i) {
      if (Status s = episode((*list)[i], source_ + ": episodes[" + std::to_string(i) + "]"); !s)
        return s;
    }
    return {};
  }

  EpisodeFile take() {
    for (const std::string& key : unknown_)
      out_.warnings.push_back("episodes: '" + key + "' is left out");
    if (more_goals_) out_.warnings.push_back("episodes: of several goals the first is taken");
    return std::move(out_);
  }

 private:
  Status read_content(const fs::path& folder) {
    if (!fs::is_directory(folder)) return {};
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(folder)) {
      const std::string name = entry.path().filename().string();
      if (name.ends_with(".json.gz") || name.ends_with(".json")) files.push_back(entry.path());
    }
    std::sort(files.begin(), files.end());
    for (const fs::path& f : files) {
      if (Status s = read(f, false); !s) return s;
    }
    return {};
  }

  static Status text(const Json& object, const char* key, const std::string& at, std::string& out) {
    const Json* v = member(object, key);
    if (v == nullptr) return {};
    if (v->is_number_integer()) {
      out = v->dump();
    } else if (v->is_string()) {
      out = v->get<std::string>();
    } else {
      return must_be(at + ": '" + key + "'", *v, "a text");
    }
    return {};
  }

  Status goal(const Json& e, const std::string& at, PointNavEpisode& out) {
    const Json* goals = member(e, "goals");
    if (goals == nullptr || !goals->is_array() || goals->empty()) {
      return {Errc::invalid_file, at + ": 'goals' has no goal"};
    }
    more_goals_ = more_goals_ || goals->size() > 1;
    const Json& first = (*goals)[0];
    if (Status s = detail::get_vector(first, "position", at + ": goals[0]", out.goal_position); !s)
      return s;
    const Json* radius = member(first, "radius");
    if (radius == nullptr || radius->is_null()) return {};
    const auto r = detail::get_number(first, "radius", at + ": goals[0]");
    if (!r) return r.status();
    out.goal_radius = *r;
    return {};
  }

  Status info(const Json& e, const std::string& at, PointNavEpisode& out) {
    const Json* info = member(e, "info");
    if (info == nullptr || info->is_null()) return {};
    for (const auto& [key, value] : {std::pair{"geodesic_distance", &out.geodesic_distance},
                                     std::pair{"start_time", &out.start_time}}) {
      if (member(*info, key) == nullptr) continue;
      const auto v = detail::get_number(*info, key, at + ": info");
      if (!v) return v.status();
      *value = *v;
    }
    return {};
  }

  Status episode(const Json& e, const std::string& at) {
    if (!e.is_object()) return must_be(at, e, "an object");
    PointNavEpisode out;
    out.id = std::to_string(out_.episodes.size());
    if (Status s = text(e, "episode_id", at, out.id); !s) return s;
    if (Status s = text(e, "scene_id", at, out.scene_id); !s) return s;
    if (Status s = detail::get_vector(e, "start_position", at, out.start_position); !s) return s;
    const auto q = detail::get_numbers(e, "start_rotation", 4, at);
    if (!q) return q.status();
    out.start_rotation = {(*q)[3], (*q)[0], (*q)[1], (*q)[2]};
    if (Status s = goal(e, at, out); !s) return s;
    if (Status s = info(e, at, out); !s) return s;
    static const std::set<std::string_view> kKnown{
        "episode_id",     "scene_id",  "start_position",       "start_rotation",
        "goals",          "info",      "scene_dataset_config", "additional_obj_config_paths",
        "shortest_paths", "start_room"};
    for (const auto& [key, value] : e.items()) {
      if (!kKnown.contains(key) && !value.is_null()) unknown_.insert(key);
    }
    out_.episodes.push_back(std::move(out));
    return {};
  }

  ReadLimits limits_;
  std::string source_;
  EpisodeFile out_;
  std::set<std::string> unknown_;
  bool more_goals_ = false;
};

}  // namespace

Result<EpisodeFile> load_episodes(const fs::path& path, const ReadLimits& limits) {
  return detail::guarded(path.string(), [&]() -> Result<EpisodeFile> {
    EpisodeReader reader(limits);
    if (Status s = reader.read(path, true); !s) return s;
    return reader.take();
  });
}

Status save_episodes(const fs::path& path, std::span<const PointNavEpisode> episodes) {
  return detail::guarded(path.string(), [&]() -> Status {
    Json list = Json::array();
    for (const PointNavEpisode& e : episodes) {
      const Vec3d &s = e.start_position, &g = e.goal_position;
      const Quatd& q = e.start_rotation;
      const std::pair<const char*, bool> finite[] = {
          {"start_position", is_finite(s)},
          {"start_rotation", is_finite(q.w) && is_finite(q.x) && is_finite(q.y) && is_finite(q.z)},
          {"goal_position", is_finite(g)},
          {"goal_radius", is_finite(e.goal_radius)},
          {"geodesic_distance", is_finite(e.geodesic_distance)},
          {"start_time", is_finite(e.start_time)}};
      for (const auto& [field, ok] : finite) {  // JSON cannot express such numbers
        if (!ok) {
          return {Errc::invalid_argument,
                  path.string() + ": episode \"" + e.id + "\": " + field + " is not finite"};
        }
      }
      Json info{{"geodesic_distance", e.geodesic_distance}};
      if (e.start_time != 0) info["start_time"] = e.start_time;  // a key that Habitat-Lab ignores
      list.push_back(
          {{"episode_id", e.id},
           {"scene_id", e.scene_id},
           {"start_position", {s.x, s.y, s.z}},
           {"start_rotation", {q.x, q.y, q.z, q.w}},
           {"goals", Json::array({{{"position", {g.x, g.y, g.z}}, {"radius", e.goal_radius}}})},
           {"info", std::move(info)}});
    }
    const std::string text =
        Json{{"episodes", std::move(list)}}.dump(-1, ' ', false, Json::error_handler_t::replace);
    if (path.extension() != ".gz") return replace_file(path, text);
    const std::vector<std::byte> packed =
        detail::gzip(std::as_bytes(std::span(text.data(), text.size())));
    return replace_file(path, [&](OutputFile& file) { file.write(packed.data(), packed.size()); });
  });
}

}  // namespace gsnav::io
