// SPDX-License-Identifier: Apache-2.0
#include "record.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string_view>
#include <type_traits>

#include "journal_json.hpp"
#include "run.hpp"

namespace gsnav_eval {
namespace {

using gsnav::Errc;
using gsnav::Result;
using gsnav::Status;

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

/// Throws an error "FIELD = VALUE: RULE".
[[noreturn]] void refuse(const std::string& field, const Json& value, const std::string& rule) {
  constexpr std::size_t kShown = 60;
  std::string shown = value.dump(-1, ' ', true, Json::error_handler_t::replace);
  if (shown.size() > kShown) shown = shown.substr(0, kShown) + "...";
  throw gsnav::Error(Errc::invalid_file, field + " = " + shown + ": " + rule);
}

const Json& member(const Json& j, std::string_view inside, const char* name) {
  const auto at = j.find(name);
  if (at == j.end()) throw gsnav::Error(Errc::invalid_file, std::string(inside) + name + " is missing");
  return *at;
}

std::size_t count(const Json& j, const std::string& field) {
  if (!j.is_number_unsigned()) refuse(field, j, "must be a whole number, 0 or more");
  return j.get<std::size_t>();
}

/// Reads a number. JSON null stands for infinity.
double number(const Json& j, const std::string& field) {
  if (j.is_null()) return std::numeric_limits<double>::infinity();
  if (!j.is_number()) refuse(field, j, "must be a number");
  return j.get<double>();
}

gsnav::EpisodeMetrics metrics_of(const Json& j) {
  if (!j.is_object()) refuse("metrics", j, "must be an object");
  gsnav::EpisodeMetrics out;
  std::size_t known = 0;
  for_each_metric(out, [&](const char* name, auto& v) {
    using T = std::remove_reference_t<decltype(v)>;
    const Json& value = member(j, "metrics.", name);
    const std::string field = std::string("metrics.") + name;
    ++known;
    if constexpr (std::is_same_v<T, bool>) {
      if (!value.is_boolean()) refuse(field, value, "must be true or false");
      v = value.template get<bool>();
    } else if constexpr (std::is_same_v<T, double>) {
      v = number(value, field);
    } else {
      v = count(value, field);
    }
  });
  if (j.size() != known) refuse("metrics", j, "has names that no metric has");
  return out;
}

Record from_json(const Json& j, const Stage& stage) {
  if (!j.is_object()) throw gsnav::Error(Errc::invalid_file, "is not an object");
  Record r;
  r.episode = count(member(j, "", "episode"), "episode");
  if (r.episode >= stage.episodes.size()) {
    refuse("episode", j["episode"],
           "there are " + std::to_string(stage.episodes.size()) + " episodes, from 0");
  }
  r.id = stage.episodes[r.episode].id;
  if (member(j, "", "id") != r.id) {
    refuse("id", j["id"], "episode " + std::to_string(r.episode) + " has the id \"" + r.id + "\"");
  }
  r.reward = number(member(j, "", "reward"), "reward");
  r.metrics = metrics_of(member(j, "", "metrics"));
  const Json& actions = member(j, "", "actions");
  if (!actions.is_string()) refuse("actions", actions, "must be a text of digits");
  for (const char c : actions.get_ref<const std::string&>()) {
    if (c < '0' || c > '5') refuse("actions", actions, "must be digits from 0 to 5");
    r.actions.push_back(static_cast<gsnav::Action>(c - '0'));
  }
  return r;
}

/// Returns true if two values of a field are equal within a tolerance. Mathematical libraries of other
/// machines round differently.
bool same(const Json& a, const Json& b) {
  constexpr double kTolerance = 1e-6;  // Metres, rates or rewards. Relative for values above 1.
  if (!a.is_number_float() || !b.is_number_float()) return a == b;
  const double x = a.get<double>(), y = b.get<double>();
  return x == y || (std::isfinite(y) && std::abs(x - y) <= kTolerance * std::max(1.0, std::abs(y)));
}

}  // namespace

std::string line_of(const Record& record) { return to_json(record).dump(); }

Result<Record> record_of(const std::string& line, const std::string& where, const Stage& stage) {
  try {
    return from_json(parse_line(line), stage);
  } catch (const gsnav::Error& e) {
    return {Errc::invalid_file, where + ": " + e.what()};
  } catch (const std::exception&) {
    return {Errc::invalid_file, where + ": is not JSON"};
  }
}

Status check_outcome(const Record& record, const gsnav::World& world, double reward) {
  const Json recorded = to_json(record);
  const Json played = to_json({record.episode, record.id, world.metrics(), reward, record.actions});
  const auto check = [](const std::string& field, const Json& was, const Json& is) {
    if (!same(was, is)) refuse(field, was, "the recorded actions lead to " + is.dump());
  };
  try {
    if (!world.done()) refuse("actions", recorded["actions"], "the episode goes on after the last one");
    check("reward", recorded["reward"], played["reward"]);
    for (const auto& metric : played["metrics"].items())
      check("metrics." + metric.key(), recorded["metrics"][metric.key()], metric.value());
  } catch (const gsnav::Error& e) {
    return {Errc::invalid_file, e.what()};
  }
  return {};
}

Status play_again(gsnav::World& world, const gsnav::PointNavEpisode& episode, const Record& record) {
  if (Status s = world.reset(episode); !s) return s;
  double reward = 0.0;
  for (const gsnav::Action action : record.actions) {
    const auto step = world.step(action);
    if (!step) return {Errc::invalid_file, "actions: " + step.status().message()};
    reward += step->reward;
  }
  return check_outcome(record, world, reward);
}

}  // namespace gsnav_eval
