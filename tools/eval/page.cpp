// SPDX-License-Identifier: Apache-2.0
#include "page.hpp"

#include <cstdint>
#include <fstream>
#include <iterator>
#include <utility>

#include "../common/html_text.hpp"
#include "gsnav/io/image_file.hpp"

namespace gsnav_eval {
namespace {

using gsnav_tools::base64;
using gsnav_tools::escape;
using gsnav_tools::format;

const char* const kStyle =
    "body{font:15px/1.45 system-ui,sans-serif;margin:2em auto;max-width:70em;padding:0 1em;color:#222}"
    "table{border-collapse:collapse}td,th{padding:.2em .8em;text-align:right;border-bottom:1px solid "
    "#ddd}"
    "th:first-child,td:first-child{text-align:left}img{max-width:100%;height:auto}"
    "details{border-bottom:1px solid #ddd;padding:.4em 0}summary{cursor:pointer}"
    "@media(prefers-color-scheme:dark){body{background:#181818;color:#ddd}td,th,details{border-color:#"
    "444}}";

void row(std::string& out, const char* name, const char* unit, double value) {
  out +=
      "<tr><td>" + std::string(name) + "</td><td>" + format(value) + "</td><td>" + unit + "</td></tr>\n";
}

std::string picture(const Picture& p, const std::string& what) {
  if (p.bytes.empty()) return {};
  return "<p><img alt=\"" + escape(what) + "\" loading=\"lazy\" src=\"data:image/" + p.type +
         ";base64," + base64(p.bytes) + "\"/></p>\n";
}

}  // namespace

gsnav::Result<Picture> page_picture(const std::string& png_file) {
  const auto png = gsnav::io::load_png(png_file);
  if (!png) return png.status();
  const std::vector<std::uint8_t> rgb(png->samples.begin(), png->samples.end());
  const auto jpeg = gsnav::io::encode_jpeg(rgb, png->width, png->height, 80);
  if (jpeg) return Picture{"jpeg", {reinterpret_cast<const char*>(jpeg->data()), jpeg->size()}};
  std::ifstream in(png_file, std::ios::binary);
  return Picture{"png", {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()}};
}

std::string page(const Options& o, const gsnav::MetricsSummary& s, const std::vector<Entry>& entries) {
  std::string out =
      "<!doctype html>\n<html lang=\"en\"><head><meta "
      "charset=\"utf-8\"/><title>Evaluation</title><style>";
  out += kStyle;
  out += "</style></head><body>\n<h1>Evaluation</h1>\n<p>" +
         escape(o.scene == "default" ? "embedded flat" : o.scene) + ", " + std::to_string(o.avatars) +
         " people, policy " + escape(o.policy) + ", preset " + escape(o.preset) + ", seed " +
         std::to_string(o.seed) + "</p>\n<table>\n";
  row(out, "episodes", "", static_cast<double>(s.episodes));
  row(out, "success rate (SR)", "", s.success_rate);
  row(out, "SPL", "", s.spl);
  row(out, "SoftSPL", "", s.soft_spl);
  row(out, "STL", "", s.stl);
  row(out, "distance to goal (DTG)", "m", s.distance_to_goal);
  row(out, "collision rate with people (CR)", "", s.collision_rate);
  row(out, "personal space intrusion (PSI)", "", s.psi);
  row(out, "personal space compliance (PSC)", "", s.psc);
  row(out, "episodes with somebody touched (H-Coll)", "", s.human_collision_episode_rate);
  row(out, "episodes with a move stopped by somebody", "", s.human_blocked_episode_rate);
  row(out, "wall collisions an episode", "", s.collisions);
  row(out, "actions an episode", "", s.steps);
  row(out, "path", "m", s.path_length);
  row(out, "nearest to anybody", "m", s.min_clearance);
  out += "</table>\n<h2>Episodes</h2>\n";
  for (const Entry& e : entries) {
    const gsnav::EpisodeMetrics& m = e.record->metrics;
    out += "<details><summary>" + escape(e.record->id) + ": " +
           (m.success       ? "reached"
            : m.stop_called ? "missed"
                            : "cut off") +
           ", SPL " + format(m.spl) + ", " + std::to_string(m.steps) + " actions, CR " +
           format(m.collision_rate) + ", PSI " + format(m.psi) + ", reward " + format(e.record->reward) +
           "</summary>\n";
    out += picture(e.strip, "what the agent saw in episode " + e.record->id);
    out += picture(e.map, "map of episode " + e.record->id);
    out += "</details>\n";
  }
  return out + "</body></html>\n";
}

}  // namespace gsnav_eval
