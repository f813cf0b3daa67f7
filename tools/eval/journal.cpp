// SPDX-License-Identifier: Apache-2.0
#include "journal.hpp"

#include <fstream>
#include <iterator>
#include <limits>
#include <nlohmann/json.hpp>
#include <utility>

namespace gsnav_eval {
namespace {

using gsnav::Errc;
using gsnav::Status;
using Json = nlohmann::json;

std::string header_of(const Options& o) {
  Json header{{"scene", o.scene},       {"up", o.up},           {"navmesh", o.navmesh}, {"avatars", o.avatars},
              {"episodes", o.episodes}, {"episode_file", o.episode_file}, {"preset", o.preset}, {"policy", o.policy},
              {"max_steps", o.max_steps}, {"seed", o.seed}};
  if (o.density < 1 || o.density > 1) header["density"] = o.density;  // journals from before there was a choice go on
  return header.dump();
}

/// Metrics by name; what is infinite has no number in JSON and is left out.
template <class M, class F>
void for_each_metric(M& m, const F& f) {
  f("spl", m.spl), f("soft_spl", m.soft_spl), f("stl", m.stl), f("distance_to_goal", m.distance_to_goal);
  f("euclidean_distance_to_goal", m.euclidean_distance_to_goal), f("collision_rate", m.collision_rate), f("psi", m.psi);
  f("collisions", m.collisions), f("collision_steps", m.collision_steps), f("steps", m.steps);
  f("start_distance", m.start_distance), f("path_length", m.path_length), f("min_clearance", m.min_clearance);
  f("success", m.success), f("human_collision", m.human_collision), f("stop_called", m.stop_called);
}

Json to_json(const Record& r) {
  Json metrics = Json::object();
  for_each_metric(r.metrics, [&](const char* name, const auto& v) {
    if (gsnav::is_finite(static_cast<double>(v))) metrics[name] = v;
  });
  std::string actions;
  for (const gsnav::Action a : r.actions) actions += static_cast<char>('0' + static_cast<int>(a));
  return {{"episode", r.episode}, {"id", r.id}, {"reward", r.reward}, {"metrics", metrics}, {"actions", actions}};
}

Record from_json(const Json& j) {
  Record r;
  r.episode = j.at("episode").get<std::size_t>();
  r.id = j.at("id").get<std::string>();
  r.reward = j.at("reward").get<double>();
  const Json& metrics = j.at("metrics");
  for_each_metric(r.metrics, [&](const char* name, auto& v) {
    using T = std::remove_reference_t<decltype(v)>;
    if (metrics.contains(name)) {
      v = metrics.at(name).get<T>();
    } else if constexpr (std::is_same_v<T, double>) {
      v = std::numeric_limits<double>::infinity();
    }
  });
  for (const char c : j.at("actions").get<std::string>()) {
    if (c < '0' || c > '5') throw gsnav::Error(Errc::invalid_file, "actions");
    r.actions.push_back(static_cast<gsnav::Action>(c - '0'));
  }
  return r;
}

Status append(const std::filesystem::path& path, const std::string& line) {
  std::ofstream out(path, std::ios::binary | std::ios::app);
  out << line << '\n' << std::flush;
  if (!out) return {Errc::file_not_found, path.string() + ": cannot be written"};
  return {};
}

}  // namespace

std::string line_of(const Record& record) { return to_json(record).dump(); }

gsnav::Result<Record> record_of(const std::string& line) {
  try {
    return from_json(Json::parse(line));
  } catch (const std::exception& e) {
    return {Errc::invalid_file, std::string("no line of a journal: ") + e.what()};
  }
}

Status Journal::read(const std::filesystem::path& path, const std::string& header, bool own) {
  std::ifstream in(path, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  const auto bad = [&](std::size_t line) {
    return Status(Errc::invalid_file, path.string() + ": line " + std::to_string(line) + " is none of a journal");
  };
  std::size_t whole = 0, line = 0;  // what follows the last end of a line was cut off while being written
  for (std::size_t at = 0, end; (end = text.find('\n', at)) != std::string::npos; at = whole = end + 1) {
    const std::string one = text.substr(at, end - at);
    if (++line == 1) {
      if (one != header) {
        return {Errc::invalid_argument,
                path.string() + " is of an evaluation with other options; give those, or another --out"};
      }
      continue;
    }
    auto r = record_of(one);
    if (!r) return bad(line);
    records_.insert_or_assign(r->episode, std::move(*r));
  }
  if (own && line == 0) return bad(1);
  if (own && whole < text.size()) std::filesystem::resize_file(path, whole);
  return {};
}

gsnav::Result<Journal> Journal::load(const std::filesystem::path& folder, const Options& options) {
  Journal j;
  j.path_ = folder / "journal.jsonl";
  if (!std::filesystem::exists(j.path_)) return {Errc::file_not_found, j.path_.string() + ": there is no evaluation here"};
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with("journal.") || !name.ends_with(".jsonl")) continue;
    if (Status s = j.read(entry.path(), header_of(options), false); !s) return s;
  }
  return j;
}

gsnav::Result<Journal> Journal::open(const std::filesystem::path& folder, const Options& options, int rank) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) return {Errc::file_not_found, "--out " + folder.string() + ": " + error.message()};
  const std::filesystem::path path = folder / (rank == 0 ? "journal.jsonl" : "journal." + std::to_string(rank) + ".jsonl");
  // An end of line makes a header; one that was cut off while being written is begun again.
  std::ifstream in(path, std::ios::binary);
  std::string first;
  if (!std::getline(in, first) || in.eof()) {
    in.close();
    std::filesystem::remove(path, error);
    if (Status s = append(path, header_of(options)); !s) return s;
  }
  Journal own;
  if (Status s = own.read(path, header_of(options), true); !s) return s;
  if (rank != 0) {
    own.path_ = path;
    return own;
  }
  return load(folder, options);
}

Status Journal::add(Record record) {
  if (Status s = append(path_, line_of(record)); !s) return s;
  records_.insert_or_assign(record.episode, std::move(record));
  return {};
}

}  // namespace gsnav_eval
