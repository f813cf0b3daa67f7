// SPDX-License-Identifier: Apache-2.0
#include "kernels.hpp"

#include <algorithm>
#include <array>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string_view>
#include <utility>

namespace gsnav_report {

using gsnav::Errc;
using gsnav::Result;

namespace {

using Json = nlohmann::json;

/// Numbers that Google Benchmark itself writes; all others are counters.
constexpr std::array<std::string_view, 10> kOwn{"family_index",     "per_family_instance_index",
                                                "repetitions",      "repetition_index",
                                                "threads",          "iterations",
                                                "real_time",        "cpu_time",
                                                "items_per_second", "bytes_per_second"};

/// Names of backends in benchmarks (their types), and in the report.
constexpr std::array<std::pair<std::string_view, const char*>, 3> kBackends{
    {{"OpenMPBackend", "openmp"}, {"SerialBackend", "serial"}, {"CudaBackend", "cuda"}}};

/// The digits after `/threads:` in a benchmark's name; empty if it has none.
std::string threads_of(const std::string& name) {
  constexpr std::string_view kKey = "/threads:";
  const std::size_t at = name.find(kKey);
  if (at == name.npos) return {};
  const std::size_t begin = at + kKey.size();
  return name.substr(begin, name.find_first_not_of("0123456789", begin) - begin);
}

double milliseconds(const std::string& unit) {
  return unit == "ns" ? 1e-6 : unit == "us" ? 1e-3 : unit == "ms" ? 1.0 : unit == "s" ? 1e3 : 0.0;
}

}  // namespace

Result<std::vector<Row>> parse_benchmarks(const std::string& text, const std::string& source) {
  const Json root = Json::parse(text, nullptr, false);
  if (!root.is_object() || !root.contains("benchmarks") || !root["benchmarks"].is_array()) {
    return {Errc::invalid_file, source + ": no Google Benchmark JSON (no array `benchmarks`)"};
  }
  const Json& all = root["benchmarks"];
  const auto text_of = [](const Json& b, const char* key) {
    return b.contains(key) && b[key].is_string() ? b[key].get<std::string>() : std::string();
  };
  const bool medians = std::any_of(all.begin(), all.end(), [&](const Json& b) {
    return b.is_object() && text_of(b, "aggregate_name") == "median";
  });
  std::vector<Row> rows;
  for (const Json& b : all) {
    if (!b.is_object()) return {Errc::invalid_file, source + ": a benchmark that is no object"};
    const std::string aggregate = text_of(b, "aggregate_name");
    if (medians ? aggregate != "median" : !aggregate.empty()) continue;
    const std::string name = medians ? text_of(b, "run_name") : text_of(b, "name");
    const double scale = milliseconds(text_of(b, "time_unit"));
    if (name.empty() || !b.contains("real_time") || !b["real_time"].is_number() || scale <= 0) {
      return {Errc::invalid_file, source + ": benchmark \"" + name + "\" has no time"};
    }
    Row row;
    row.set("kind", "kernel").set("name", name).set("time_p50_ms", b["real_time"].get<double>() * scale);
    for (const auto& [type, backend] : kBackends) {
      if (name.find(type) != name.npos) row.set("backend", backend);
    }
    row.set("threads", threads_of(name));
    if (b.contains("items_per_second") && b["items_per_second"].is_number()) {
      row.set("items_per_second", b["items_per_second"].get<double>());
    }
    const std::size_t before = rows.size();
    for (const auto& [key, value] : b.items()) {
      if (!value.is_number() || std::find(kOwn.begin(), kOwn.end(), key) != kOwn.end()) continue;
      Row counted = row;
      counted.set("error_max", value.get<double>()).set("error_unit", key);
      rows.push_back(std::move(counted));
    }
    if (rows.size() == before) rows.push_back(std::move(row));
  }
  return rows;
}

Result<std::vector<Row>> kernel_rows(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) return {Errc::file_not_found, path.string() + ": cannot be read"};
  const std::string text((std::istreambuf_iterator<char>(in)), {});
  return parse_benchmarks(text, path.string());
}

}  // namespace gsnav_report
