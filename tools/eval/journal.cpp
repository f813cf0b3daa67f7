// SPDX-License-Identifier: Apache-2.0
#include "journal.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <limits>
#include <nlohmann/json.hpp>
#include <string_view>
#include <type_traits>
#include <utility>

#include "gsnav/core/replace_file.hpp"
#include "gsnav/render.hpp"
#include "gsnav/scene/prepare.hpp"
#include "run.hpp"

namespace gsnav_eval {
namespace {

namespace fs = std::filesystem;
using gsnav::Errc;
using gsnav::Result;
using gsnav::Status;
using Json = nlohmann::ordered_json;

constexpr int kFormat = 2;
constexpr const char* kAnew = "begin anew with gsnav-eval --restart, or use another --out folder";

Json to_json(const Record& r) {
  Json metrics = Json::object();
  for_each_metric(r.metrics, [&](const char* name, const auto& v) { metrics[name] = v; });
  std::string actions;
  for (const gsnav::Action a : r.actions) actions += static_cast<char>('0' + static_cast<int>(a));
  return {{"episode", r.episode},
          {"id", r.id},
          {"reward", r.reward},
          {"metrics", metrics},
          {"actions", actions}};
}

/// The JSON of a line. Nesting is bounded, since copies and dump() take stack for each level.
Json parse_line(const std::string& line) {
  constexpr int kDepth = 4;  // a journal's own lines have two levels
  return Json::parse(line, [](int depth, Json::parse_event_t, const Json&) {
    if (depth > kDepth)
      throw gsnav::Error(Errc::invalid_file,
                         "is JSON nested more than " + std::to_string(kDepth) + " deep");
    return true;
  });
}

/// Thrown with "FIELD = VALUE: RULE".
[[noreturn]] void refuse(const std::string& field, const Json& value, const std::string& rule) {
  constexpr std::size_t kShown = 60;
  std::string shown = value.dump(-1, ' ', true, Json::error_handler_t::replace);
  if (shown.size() > kShown) shown = shown.substr(0, kShown) + "...";
  throw gsnav::Error(Errc::invalid_file, field + " = " + shown + ": " + rule);
}

const Json& member(const Json& j, const std::string& inside, const char* name) {
  const auto at = j.find(name);
  if (at == j.end()) throw gsnav::Error(Errc::invalid_file, inside + name + " is missing");
  return *at;
}

double number(const Json& j, const std::string& field, double low, double high) {
  if (!j.is_number()) refuse(field, j, "must be a number");
  const double v = j.get<double>();
  if (!(v >= low && v <= high)) {
    refuse(field, j, "must be in [" + Json(low).dump() + ", " + Json(high).dump() + "]");
  }
  return v;
}

std::size_t count(const Json& j, const std::string& field) {
  if (!j.is_number_unsigned()) refuse(field, j, "must be a whole number, 0 or more");
  return j.get<std::size_t>();
}

/// Largest distance that a record may have, metres.
constexpr double kFarthest = 1e9;

/// Least and largest value of a metric that is a number; whether it may be infinite (null).
struct Range {
  double low = 0, high = 1;
  bool infinite = false;
};
Range range_of(std::string_view name) {
  if (name == "min_clearance") return {-100, kFarthest, true};
  if (name == "distance_to_goal" || name == "start_distance") return {0, kFarthest, true};
  if (name == "euclidean_distance_to_goal" || name == "path_length") return {0, kFarthest};
  return {};  // a rate
}

Record from_json(const Json& j, const Stage& stage) {
  if (!j.is_object()) throw gsnav::Error(Errc::invalid_file, "is not an object");
  Record r;
  r.episode = count(member(j, "", "episode"), "episode");
  if (r.episode >= stage.episodes.size()) {
    refuse("episode", j["episode"],
           "there are " + std::to_string(stage.episodes.size()) + " episodes, from 0");
  }
  const std::string& expected = stage.episodes[r.episode].id;
  if (member(j, "", "id") != expected) {
    refuse("id", j["id"], "episode " + std::to_string(r.episode) + " has the id \"" + expected + "\"");
  }
  r.id = expected;
  r.reward = number(member(j, "", "reward"), "reward", -kFarthest, kFarthest);
  const Json& metrics = member(j, "", "metrics");
  if (!metrics.is_object()) refuse("metrics", metrics, "must be an object");
  std::size_t known = 0;
  for_each_metric(r.metrics, [&](const char* name, auto& v) {
    using T = std::remove_reference_t<decltype(v)>;
    const Json& value = member(metrics, "metrics.", name);
    const std::string field = std::string("metrics.") + name;
    ++known;
    if constexpr (std::is_same_v<T, bool>) {
      if (!value.is_boolean()) refuse(field, value, "must be true or false");
      v = value.get<bool>();
    } else if constexpr (std::is_same_v<T, double>) {
      const Range range = range_of(name);
      v = range.infinite && value.is_null() ? std::numeric_limits<double>::infinity()
                                            : number(value, field, range.low, range.high);
    } else {
      v = count(value, field);
    }
  });
  if (metrics.size() != known) refuse("metrics", metrics, "has names that no metric has");
  const Json& actions = member(j, "", "actions");
  if (!actions.is_string()) refuse("actions", actions, "must be a text of digits");
  for (const char c : actions.get_ref<const std::string&>()) {
    if (c < '0' || c > '5') refuse("actions", actions, "must be digits from 0 to 5");
    r.actions.push_back(static_cast<gsnav::Action>(c - '0'));
  }

  // What fits nothing that can happen.
  const gsnav::EpisodeMetrics& m = r.metrics;
  const auto stops =
      static_cast<std::size_t>(std::count(r.actions.begin(), r.actions.end(), gsnav::Action::stop));
  const auto check = [&](bool ok, const char* name, const char* rule) {
    if (!ok) refuse(std::string("metrics.") + name, metrics[name], rule);
  };
  constexpr double kRounding = 1e-9;
  const auto equal = [](double a, double b) { return std::abs(a - b) <= kRounding; };
  const double steps = static_cast<double>(m.steps);
  const gsnav::TaskConfig& task = stage.config.task;
  check(m.steps <= static_cast<std::size_t>(std::max(task.max_steps, 0)), "steps",
        "more than --max-steps");
  check(m.steps + stops == r.actions.size() && stops <= 1, "steps", "is not the number of actions");
  check(m.stop_called == (stops == 1), "stop_called", "does not fit the actions");
  check(m.success == gsnav::episode_success(m.stop_called, m.distance_to_goal, task.success_distance),
        "success", "does not follow from stop_called and distance_to_goal");
  check(m.collisions <= m.steps, "collisions", "more than steps");
  check(m.collision_steps <= m.steps, "collision_steps", "more than steps");
  check(equal(m.collision_rate * steps, static_cast<double>(m.collision_steps)), "collision_rate",
        "is not collision_steps / steps");
  check((m.human_collision || m.human_blocked) == (m.collision_steps > 0), "collision_steps",
        "does not fit human_collision and human_blocked");
  check(equal(m.spl, gsnav::success_weighted_by_path_length(m.success, m.start_distance, m.path_length)),
        "spl", "does not follow from success, start_distance and path_length");
  check(equal(m.stl,
              gsnav::success_weighted_by_time(m.success, m.start_distance, task.forward_step, m.steps)),
        "stl", "does not follow from success, start_distance and steps");
  check(equal(m.soft_spl, gsnav::soft_success_weighted_by_path_length(m.distance_to_goal,
                                                                      m.start_distance, m.path_length)),
        "soft_spl", "does not follow from distance_to_goal, start_distance and path_length");
  return r;
}

std::string file_text(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// Appends a line that is on the disk when this returns. A failure leaves the file as it was.
Status append(const fs::path& path, std::string line) {
  line += '\n';
  const int fd = ::open(path.c_str(), O_WRONLY | O_APPEND | O_CLOEXEC);
  if (fd < 0) return gsnav::detail::unwritable(path, errno);
  const ::off_t before = ::lseek(fd, 0, SEEK_END);
  int error = before < 0 ? errno : 0;
  for (std::size_t done = 0; error == 0 && done < line.size();) {
    const ::ssize_t n = ::write(fd, line.data() + done, line.size() - done);
    if (n > 0)
      done += static_cast<std::size_t>(n);
    else if (n < 0 && errno != EINTR)
      error = errno;
  }
  if (error == 0 && ::fdatasync(fd) != 0 && errno != EINVAL) error = errno;
  if (error != 0 && before >= 0 && ::ftruncate(fd, before) != 0) error = errno;
  ::close(fd);
  return error == 0 ? Status() : gsnav::detail::unwritable(path, error);
}

std::string header_of(const Options& o, const Contents& made_of) {
  Json options = Json::object(), contents = Json::object();
  for (const OptionValue& v : option_values(o)) options[v.flag.substr(2)] = v.value;
  for (const auto& [name, hash] : made_of) contents[name] = hash;
  const Json header{
      {"journal", "gsnav-eval"}, {"format", kFormat}, {"options", options}, {"contents", contents}};
  return header.dump(-1, ' ', false, Json::error_handler_t::replace);
}

/// A header read back.
struct Header {
  std::vector<OptionValue> options;
  Contents contents;
};

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

std::string shown(const OptionValue& v) {
  return v.value.empty() ? "no " + v.flag : v.flag + " " + v.value;
}

Status compare_options(const fs::path& path, const Header& header, const Options& o, bool views) {
  const std::vector<OptionValue> now = option_values(o);
  for (std::size_t i = 0; i < now.size(); ++i) {
    const OptionValue& was = header.options[i];
    if (now[i].value == was.value || (!views && now[i].role == OptionRole::view)) continue;
    // Files may lie elsewhere: their contents are compared.
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
    const std::string file = name == "scene"                       ? o.scene
                             : name == "episodes"                  ? o.episode_file
                             : name == "navmesh" && o.ready_made() ? o.navmesh
                                                                   : std::string();
    return {Errc::invalid_argument, path.string() + " is of other contents: the " + name +
                                        (file.empty() ? " that gsnav made" : " in " + file) +
                                        (name == "scene" || name == "navmesh" ? " has" : " have") +
                                        " changed (content hash " + hash + ", recorded " +
                                        (was == header.contents.end() ? "none" : was->second) +
                                        "). Put back what was, " + kAnew};
  }
  return {};
}

/// Whether a file of this name in the folder of an evaluation is a journal.
bool is_journal(const std::string& name) {
  if (name == "journal.jsonl") return true;
  constexpr std::string_view kFront = "journal.", kEnd = ".jsonl";
  if (!name.starts_with(kFront) || !name.ends_with(kEnd) || name.size() <= kFront.size() + kEnd.size())
    return false;
  const std::string rank = name.substr(kFront.size(), name.size() - kFront.size() - kEnd.size());
  return rank.find_first_not_of("0123456789") == std::string::npos;
}

/// Whether a file of this name in its folder `episodes` is a picture of one.
bool is_picture(const std::string& name) {
  const std::size_t digits = name.find_first_not_of("0123456789");
  return digits != 0 && digits != std::string::npos &&
         (name.substr(digits) == "_strip.png" || name.substr(digits) == "_map.png");
}

/// The files of a folder whose names `wanted` takes, in order; none where there is no folder.
std::vector<fs::path> files_in(const fs::path& folder, bool (*wanted)(const std::string&)) {
  std::vector<fs::path> out;
  std::error_code error;
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    if (wanted(at->path().filename().string())) out.push_back(at->path());
  }
  std::sort(out.begin(), out.end());
  return out;
}

Status remove_file(const fs::path& path) {
  std::error_code error;
  fs::remove(path, error);
  return error ? Status(Errc::file_not_found, path.string() + ": cannot be removed: " + error.message())
               : Status();
}

Status remove_pictures(const fs::path& folder) {
  for (const fs::path& p : files_in(folder / "episodes", is_picture)) {
    if (Status s = remove_file(p); !s) return s;
  }
  return {};
}

/// A file's first line where it has a whole one.
std::string first_line(const std::string& text) {
  return text.substr(0, std::min(text.find('\n'), text.size()));
}

}  // namespace

std::string line_of(const Record& record) { return to_json(record).dump(); }

Result<Record> record_of(const std::string& line, const std::string& where, const Stage& stage) {
  try {
    return from_json(parse_line(line), stage);
  } catch (const gsnav::Error& e) {
    return {Errc::invalid_file, where + ": " + e.what() + ". Remove the line, " + kAnew};
  } catch (const std::exception&) {
    return {Errc::invalid_file, where + ": is not JSON. Remove the line, " + kAnew};
  }
}

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
  // Bodies as they are met, at times that no walk repeats.
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

Result<std::vector<OptionValue>> Journal::recorded_options(const fs::path& folder) {
  const fs::path path = folder / "journal.jsonl";
  if (!fs::exists(path))
    return Status(Errc::file_not_found, path.string() + ": there is no evaluation here");
  auto header = read_header(path, first_line(file_text(path)));
  if (!header) return header.status();
  return std::move(header->options);
}

Status Journal::check_options(const fs::path& folder, const Options& options, bool views) {
  for (const fs::path& path : files_in(folder, is_journal)) {
    const std::string text = file_text(path);
    if (text.find('\n') == std::string::npos) continue;  // begun again
    const auto header = read_header(path, first_line(text));
    if (!header) return header.status();
    if (Status s = compare_options(path, *header, options, views); !s) return s;
  }
  return {};
}

Status Journal::read(const fs::path& path, const Options& options, const Stage& stage,
                     const Contents& made_of, bool own, bool views) {
  const std::string text = file_text(path);
  std::size_t whole = 0,
              line = 0;  // what follows the last end of a line was cut off while being written
  for (std::size_t at = 0, end; (end = text.find('\n', at)) != std::string::npos; at = whole = end + 1) {
    const std::string one = text.substr(at, end - at);
    if (++line == 1) {
      const auto header = read_header(path, one);
      if (!header) return header.status();
      if (Status s = compare_options(path, *header, options, views); !s) return s;
      if (Status s = compare_contents(path, *header, options, made_of); !s) return s;
      continue;
    }
    const std::string where = path.string() + ": line " + std::to_string(line);
    auto r = record_of(one, where, stage);
    if (!r) return r.status();
    const auto found = records_.find(r->episode);
    if (found != records_.end() && line_of(found->second) != line_of(*r)) {
      return {Errc::invalid_file, where + ": episode = " + std::to_string(r->episode) +
                                      ": differs from " + places_[r->episode] +
                                      ", of the same episode. Remove one of them, " + kAnew};
    }
    places_.emplace(r->episode, where);
    records_.insert_or_assign(r->episode, std::move(*r));
  }
  if (whole < text.size()) {
    notes_.push_back(path.string() + ": line " + std::to_string(line + 1) +
                     " has no end, as after a kill: " + std::to_string(text.size() - whole) +
                     " bytes are dropped");
    if (own && ::truncate(path.c_str(), static_cast<::off_t>(whole)) != 0) {
      return gsnav::detail::unwritable(path, errno);
    }
  }
  return {};
}

Result<Journal> Journal::load(const fs::path& folder, const Options& options, const Stage& stage) {
  Journal j;
  j.path_ = folder / "journal.jsonl";
  if (!fs::exists(j.path_))
    return Status(Errc::file_not_found, j.path_.string() + ": there is no evaluation here");
  const Contents made_of = contents_of(stage);
  for (const fs::path& path : files_in(folder, is_journal)) {
    if (Status s = j.read(path, options, stage, made_of, false, false); !s) return s;
  }
  return j;
}

Result<Journal> Journal::open(const fs::path& folder, const Options& options, const Stage& stage,
                              int rank) {
  if (Status s = gsnav::make_output_folder(folder); !s) return s;
  Journal j;
  j.path_ = folder / (rank == 0 ? "journal.jsonl" : "journal." + std::to_string(rank) + ".jsonl");
  const Contents made_of = contents_of(stage);
  if (file_text(j.path_).find('\n') == std::string::npos) {  // none, or a header that was cut off
    if (Status s =
            rank == 0 && files_in(folder, is_journal).empty() ? remove_pictures(folder) : Status();
        !s)
      return s;
    if (Status s = gsnav::replace_file(j.path_, header_of(options, made_of) + "\n"); !s) return s;
  }
  if (Status s = j.read(j.path_, options, stage, made_of, true, true); !s) return s;
  if (rank != 0) return j;
  for (const fs::path& path : files_in(folder, is_journal)) {
    if (path == j.path_) continue;
    if (Status s = j.read(path, options, stage, made_of, false, true); !s) return s;
  }
  return j;
}

Status Journal::restart(const fs::path& folder) {
  if (Status s = remove_pictures(folder); !s) return s;
  for (const char* name : {"index.html", "metrics.json", "timings.json", "episodes.json.gz"}) {
    if (Status s = remove_file(folder / name); !s) return s;
  }
  for (const fs::path& path : files_in(folder, is_journal)) {
    if (Status s = remove_file(path); !s) return s;
  }
  return {};
}

Status Journal::add(Record record) {
  if (Status s = append(path_, line_of(record)); !s) return s;
  records_.insert_or_assign(record.episode, std::move(record));
  return {};
}

}  // namespace gsnav_eval
