// SPDX-License-Identifier: Apache-2.0
#include "page.hpp"

#include <cstdint>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <utility>

#include "../common/html_text.hpp"
#include "../common/map.hpp"
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
    "figure{margin:1em "
    "0}figcaption{color:#777;font-size:.9em}td:last-child,th:last-child{text-align:left}"
    ".legend span{display:inline-block;width:.8em;height:.8em;border-radius:50%;margin:0 .4em 0 "
    "1em;vertical-align:baseline}"
    "@media(prefers-color-scheme:dark){body{background:#181818;color:#ddd}td,th,details{border-color:#"
    "444}}";

void row(std::string& out, const char* name, const std::string& value, const char* unit,
         const char* meaning) {
  out += "<tr><td>" + std::string(name) + "</td><td>" + value + "</td><td>" + unit + "</td><td>" +
         meaning + "</td></tr>\n";
}
void row(std::string& out, const char* name, double value, const char* unit, const char* meaning) {
  row(out, name, format(value), unit, meaning);
}

std::string metrics_table(const gsnav::MetricsSummary& s) {
  std::string out = "<table>\n<tr><th>metric</th><th>mean</th><th>unit</th><th>what it is</th></tr>\n";
  row(out, "episodes", std::to_string(s.episodes), "", "that were played");
  row(out, "success rate (SR)", s.success_rate, "",
      "share of episodes that ended by stop near the goal");
  row(out, "SPL", s.spl, "", "success times shortest path over path walked (at most 1)");
  row(out, "SoftSPL", s.soft_spl, "", "the same with the share of the way done in place of success");
  row(out, "STL", s.stl, "", "success times least time over time taken");
  row(out, "distance to goal (DTG)", s.distance_to_goal, "m", "along the floor, at the end");
  row(out, "collision rate (CR)", s.collision_rate, "",
      "share of steps in which a person was touched or stopped the move");
  row(out, "personal space intrusion (PSI)", s.psi, "", "0: never near a person, 1: always in contact");
  row(out, "personal space compliance (PSC)", s.psc, "", "share of steps outside of personal space");
  row(out, "H-Coll", s.human_collision_episode_rate, "",
      "share of episodes in which a person was touched");
  row(out, "stopped by a person", s.human_blocked_episode_rate, "",
      "share of episodes with a move stopped by a person");
  row(out, "wall collisions", s.collisions, "", "per episode");
  row(out, "actions", s.steps, "", "per episode");
  row(out, "path", s.path_length, "m", "per episode");
  row(out, "nearest to anybody", s.min_clearance, "m", "between surfaces; below 0: in touch");
  return out + "</table>\n";
}

std::string figure(const Picture& p, const std::string& what) {
  if (p.bytes.empty()) return {};
  return "<figure><img alt=\"" + escape(what) + "\" loading=\"lazy\" src=\"data:image/" + p.type +
         ";base64," + base64(p.bytes) + "\"/><figcaption>" + escape(what) + "</figcaption></figure>\n";
}

/// Legend of the lines and discs on maps, in their colours.
std::string map_legend() {
  const std::pair<gsnav_tools::Rgb, const char*> marks[] = {
      {gsnav_tools::kMapStart, "start"},
      {gsnav_tools::kMapGoal, "goal"},
      {gsnav_tools::kMapAgent, "the agent's way, and its body at the end"},
      {gsnav_tools::kMapShortest, "shortest way without people (dashed)"},
      {gsnav_tools::avatar_color(0), "people's ways and bodies, a colour each"},
      {gsnav_tools::kMapNavMesh, "where the agent can stand"}};
  std::string out = "<p class=\"legend\">On maps: ";
  for (const auto& [color, what] : marks) {
    char swatch[96];
    std::snprintf(swatch, sizeof swatch, "<span style=\"background:rgb(%d,%d,%d)\"></span>",
                  gsnav::to_byte(color.r), gsnav::to_byte(color.g), gsnav::to_byte(color.b));
    out += std::string(swatch) + what + " ";
  }
  return out + "</p>\n";
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
         std::to_string(o.seed) + "</p>\n";
  out += metrics_table(s) + "<h2>Episodes</h2>\n" + map_legend();
  std::size_t shown = 0;
  for (const Entry& e : entries) {
    const gsnav::EpisodeMetrics& m = e.record->metrics;
    constexpr std::size_t kOpen = 3;  // Number of entries that are open at first.
    out += std::string(shown++ < kOpen ? "<details open>" : "<details>") + "<summary>episode " +
           escape(e.record->id) + ": " +
           (m.success       ? "reached"
            : m.stop_called ? "missed"
                            : "cut off") +
           ", SPL " + format(m.spl) + ", " + std::to_string(m.steps) + " actions, CR " +
           format(m.collision_rate) + ", PSI " + format(m.psi) + ", reward " + format(e.record->reward) +
           "</summary>\n";
    out += figure(e.strip, "Camera images in episode " + e.record->id +
                               ", from its begin to its end: colour, and below it depth.");
    out += figure(e.map, "Episode " + e.record->id + " from above.");
    out += "</details>\n";
  }
  return out + "</body></html>\n";
}

}  // namespace gsnav_eval
