// SPDX-License-Identifier: Apache-2.0
#include "jobs.hpp"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <utility>

#include "gsnav/scene/lod_cut.hpp"
#include "storage.hpp"

namespace gsnav_report {

using namespace gsnav;

namespace {

constexpr std::array<std::pair<Oracle, std::string_view>, 6> kOracles{
    {{Oracle::contract, "contract"},
     {Oracle::contract_f64, "contract_f64"},
     {Oracle::photo4, "photo4"},
     {Oracle::ray, "ray"},
     {Oracle::ray_key, "ray_key"},
     {Oracle::untruncated, "untruncated"}}};

struct Knob {
  std::string name;
  std::vector<std::string> values;
  std::vector<Oracle> oracles;
};

std::vector<Knob> knobs() {
  std::vector<Knob> all{
      {"alpha_min",
       {"0.015625", "0.0078125", "0.00392156862745098", "0.001953125"},
       {Oracle::contract, Oracle::untruncated}},
      {"transmittance_min",
       {"1e-2", "5e-3", "2e-3", "1e-3", "5e-4", "1e-4", "1e-5"},
       {Oracle::contract, Oracle::untruncated}},
      {"max_sh_degree", {"0", "1", "2", "3"}, {Oracle::contract}},
      {"key_bits", {"16", "18", "20", "22", "24", "32"}, {Oracle::contract}},
      {"storage", {}, {Oracle::contract}},
      {"response", {"ewa", "tangent_plane", "ray"}, {Oracle::contract, Oracle::ray_key, Oracle::ray}},
      {"compat", {"inria", "gsplat", "habitat_gs"}, {Oracle::contract}},
      {"exponential", {"exact", "fast"}, {Oracle::contract}}};
  for (const StorageCodec& c : storage_codecs()) all[4].values.emplace_back(c.name);
  for (const std::string_view drawn : {kCompactStorage, kPackedStorage})
    all[4].values.emplace_back(drawn);
  return all;
}

template <class T>
bool contains(const std::vector<T>& list, const T& value) {
  return std::find(list.begin(), list.end(), value) != list.end();
}

void add_profiles(const PlanOptions& o, std::size_t view, const ImageSize& size,
                  std::vector<Setting>& out) {
  for (const std::string& backend : o.backends) {
    for (const std::string& sensor : o.sensors) {
      const bool first = backend == o.backends.front();
      if (!first && sensor != o.sensors.front()) continue;
      for (const std::string& profile : o.profiles) {
        if (profile == "none") continue;
        Setting s{view, size, sensor, backend, profile, "none", {}, {}};
        // The other oracles judge only the first profile of the first sensor and backend.
        const bool first_sensor = first && sensor == o.sensors.front();
        const bool others = first_sensor && profile == o.profiles.front();
        const bool lod = profile == "lod";
        // The report has levels of detail and visible sets in host memory only.
        if ((lod || profile == "visible") && backend == "cuda") continue;
        for (const Oracle q : o.oracles) {
          if (q == Oracle::photo4 &&
              (lod || (first_sensor && profile == "fast" && contains<std::string>(o.profiles, "lod")))) {
            s.oracles.push_back(q);  // oracles of levels of detail, and of the `fast` rows beside them
          } else if (lod) {
            continue;
          } else if (q == Oracle::contract ||
                     (others && (q == Oracle::contract_f64 || q == Oracle::photo4))) {
            s.oracles.push_back(q);
          }
        }
        if (!s.oracles.empty()) out.push_back(std::move(s));
      }
    }
  }
}

void add_knobs(const PlanOptions& o, std::size_t view, std::vector<Setting>& out) {
  for (const Knob& knob : knobs()) {
    if (!contains(o.knobs, knob.name)) continue;
    for (const std::string& value : knob.values) {
      if (knob.name == "max_sh_degree" && std::atoi(value.c_str()) > o.sh_degree) continue;
      if (value.starts_with("shN_") && o.sh_degree == 0) continue;
      if (!o.knob_values.empty() && !contains(o.knob_values, value)) continue;
      Setting s{view, o.knob_size, o.sensors.front(), o.backends.front(), "exact", knob.name, value, {}};
      for (const Oracle q : knob.oracles) {
        if (contains(o.oracles, q)) s.oracles.push_back(q);
      }
      if (!s.oracles.empty()) out.push_back(std::move(s));
    }
  }
}

}  // namespace

std::string to_string(const ImageSize& size) {
  return std::to_string(size.width) + "x" + std::to_string(size.height);
}

std::string_view to_string(Oracle oracle) noexcept {
  return kOracles[static_cast<std::size_t>(oracle)].second;
}

Result<Oracle> parse_oracle(const std::string& name) {
  std::string known;
  for (const auto& [oracle, text] : kOracles) {
    if (name == text) return oracle;
    known.append(known.empty() ? "" : ", ").append(text);
  }
  return {Errc::invalid_argument, "oracle " + name + ": known are " + known};
}

std::vector<std::string> knob_names() {
  std::vector<std::string> out;
  for (const Knob& k : knobs()) out.push_back(k.name);
  return out;
}

std::vector<std::string> knob_values() {
  std::vector<std::string> out;
  for (const Knob& knob : knobs()) {
    for (const std::string& value : knob.values) {
      if (!contains(out, value)) out.push_back(value);
    }
  }
  return out;
}

std::vector<Setting> plan(const PlanOptions& o) {
  std::vector<Setting> out;
  bool knobs_done = false;
  for (const ImageSize& size : o.sizes) {
    for (std::size_t view = 0; view < o.views; ++view) {
      add_profiles(o, view, size, out);
      if (size == o.knob_size) add_knobs(o, view, out);
    }
    knobs_done = knobs_done || size == o.knob_size;
  }
  for (std::size_t view = 0; view < o.views && !knobs_done; ++view) add_knobs(o, view, out);
  return out;
}

RenderConfig render_config(const Setting& s, SortOrder order) {
  RenderConfig c;
  c.outputs = s.sensor == "depth" ? kAlpha | kMedianDepth
              : s.sensor == "rgb" ? kRgb | kAlpha
                                  : kRgb | kAlpha | kMedianDepth;
  c.quality = s.profile == "exact" ? Quality::exact() : Quality::fast();
  if (s.profile == "lod") c = lod_config(c);
  c.sort_order = order;
  const double number = std::strtod(s.knob_value.c_str(), nullptr);
  if (s.knob == "alpha_min") c.quality.alpha_min = number;
  if (s.knob == "transmittance_min") c.quality.transmittance_min = number;
  if (s.knob == "max_sh_degree") c.quality.max_sh_degree = static_cast<int>(number);
  if (s.knob == "key_bits") c.quality.key_bits = static_cast<int>(number);
  if (s.knob == "exponential") {
    c.quality.exponential = s.knob_value == "fast" ? Exponential::fast : Exponential::exact;
  }
  if (s.knob == "response") {
    c.response = s.knob_value == "ray"             ? Response::ray
                 : s.knob_value == "tangent_plane" ? Response::tangent_plane
                                                   : Response::ewa;
  }
  if (s.knob == "compat") {
    c.compat = s.knob_value == "inria"    ? Compat::inria
               : s.knob_value == "gsplat" ? Compat::gsplat
                                          : Compat::habitat_gs;
  }
  return c;
}

}  // namespace gsnav_report
