// SPDX-License-Identifier: Apache-2.0
#include "docs.hpp"

#include <algorithm>
#include <vector>

#include "../../tools/common/html_text.hpp"
#include "gsnav/core/replace_file.hpp"
#include "plot_pareto.hpp"
#include "table_budget.hpp"
#include "table_targets.hpp"

namespace gsnav_report {

using gsnav_tools::format;
using gsnav_tools::format_round;
namespace {

/// Text for a cell of a Markdown table, without markup and column breaks.
std::string plain(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '\n' || c == '\r') {
      out += ' ';
      continue;
    }
    if (std::string("|\\`*_<>[]").find(c) != std::string::npos) out += '\\';
    out += c;
  }
  return out;
}

std::string line(const std::vector<std::string>& cells) {
  std::string out = "|";
  for (const std::string& c : cells) out += " " + c + " |";
  return out + "\n";
}

std::string header(const std::vector<std::string>& names) {
  std::string out = line(names) + "|";
  for (std::size_t i = 0; i < names.size(); ++i) out += "---|";
  return out + "\n";
}

std::string mean_worst(const RowRefs& rows, const char* column, double scale, bool lowest) {
  const Spread s = spread(rows, column);
  if (s.count == 0) return format(std::nullopt);
  return format(s.mean * scale) + " / " + format((lowest ? s.min : s.max) * scale);
}

const std::vector<std::string> kErrorColumns{
    "against", "PSNR, dB", "colour max, LSB", "FLIP", "depth p99, mm", "time", "pairs", "evaluations"};

/// Lines of errors and speedups of some rows, by backend and oracle. `names`: the first cells of each
/// line.
std::string error_lines(const std::vector<std::string>& names, const RowRefs& rows, const RowRefs& all) {
  std::string out;
  for (const Group& g :
       group_by(rows, [](const Row& r) { return r.get("backend") + '\n' + r.get("oracle"); })) {
    const Row& first = *g.rows.front();
    std::vector<std::string> cells = names;
    cells.push_back(plain(first.get("backend")));
    cells.push_back(plain(first.get("oracle")));
    cells.push_back(mean_worst(g.rows, "rgb_psnr", 1, true));
    cells.push_back(mean_worst(g.rows, "rgb_max", 255, false));
    cells.push_back(mean_worst(g.rows, "flip_mean", 1, false));
    cells.push_back(mean_worst(g.rows, "depth_p99", 1e3, false));
    cells.push_back(format(time_ratio(g.rows, all)));
    for (const char* column : {"pairs", "evaluations"}) {
      cells.push_back(format(ratio_to_exact(g.rows, all, column)));
    }
    out += line(cells);
  }
  return out;
}

std::vector<std::string> with(std::vector<std::string> first, const std::vector<std::string>& rest) {
  first.insert(first.end(), rest.begin(), rest.end());
  return first;
}

std::string absent(const char* what) { return std::string("No ") + what + " in this report.\n"; }

std::string profile_part(const Table& table) {
  const RowRefs renders = table.of_kind("render");
  const RowRefs rows = select(renders, is_plain);
  if (rows.empty()) return absent("profile was rendered");
  std::string out = header(with({"profile", "backend"}, kErrorColumns));
  for (const Group& g : group_by(rows, [](const Row& r) { return r.get("profile"); })) {
    out += error_lines({plain(g.name)}, g.rows, renders);
  }
  return out;
}

std::string budget_part(const Table& table) {
  const std::vector<BudgetCheck> checks = check_budgets(table);
  if (checks.empty()) return absent("row has a budget");
  std::string out = header({"profile", "backend", "measure", "budget", "worst", "", "worst row"});
  for (const BudgetCheck& c : checks) {
    out += line({plain(c.profile), plain(c.backend), plain(c.measure),
                 (c.at_least ? ">= " : "<= ") + format_round(c.limit), format(c.worst, 4),
                 c.met() ? "met" : "**missed**", plain(c.where)});
  }
  return out;
}

std::string target_part(const Table& table) {
  const std::vector<TargetCheck> checks = check_targets(table);
  if (checks.empty()) return absent("row has a target");
  std::string out =
      header({"scene", "size", "backend", "measure", "target", "found", "", "views", "beside it"});
  for (const TargetCheck& c : checks) {
    out += line({plain(c.scene), c.size, plain(c.backend), plain(c.measure),
                 (c.at_least ? ">= " : "<= ") + format_round(c.limit), format(c.value, 4),
                 c.met() ? "met" : "**missed**", std::to_string(c.views), plain(c.note)});
  }
  return out;
}

std::string knob_part(const Table& table) {
  const RowRefs renders = table.of_kind("render");
  const RowRefs turned = select(renders, [](const Row& r) { return !is_plain(r); });
  if (turned.empty()) return absent("knob was turned");
  std::string out;
  for (const Group& knob : group_by(turned, [](const Row& r) { return r.get("knob"); })) {
    std::vector<Group> values = group_by(knob.rows, [](const Row& r) { return r.get("knob_value"); });
    sort_numerically(values);
    out += "\n### `" + knob.name + "`\n\n" + header(with({"value", "backend"}, kErrorColumns));
    for (const Group& v : values) {
      const std::string mark = same_as_exact(v.rows, renders) ? " (exact)" : "";
      out += error_lines({plain(shown_value(*v.rows.front())) + mark}, v.rows, renders);
    }
  }
  return out;
}

/// The settings that no other beats in both time and PSNR, per size and backend, with those that are
/// beaten.
std::string front_part(const Table& table) {
  std::string out;
  for (const Group& size : group_by(table.of_kind("render"), resolution)) {
    const RowRefs rows = against_front_oracle(size.rows);
    std::vector<ParetoPoint> points = pareto_points(rows, "rgb_psnr", true);
    if (points.size() < 2) continue;
    std::stable_sort(points.begin(), points.end(),
                     [](const ParetoPoint& a, const ParetoPoint& b) { return a.error > b.error; });
    out += "\n### " + size.name + "\n\n" +
           header({"setting", "backend", "PSNR, dB", "time of exact", "views", "on the front"});
    for (const ParetoPoint& p : points) {
      out += line({plain(p.label), plain(p.backend), format(p.error, 3) + " / " + format(p.worst, 3),
                   format(p.ratio), std::to_string(p.views),
                   p.partial     ? "fewer views"
                   : p.dominated ? ""
                                 : "yes"});
    }
  }
  return out.empty() ? absent("two settings of a size") : out;
}

std::string ledger_part(const Table& table) {
  const RowRefs rows = table.of_kind("ledger");
  if (rows.empty()) return absent("ledger");
  std::string out = header({"profile", "approximation", "knob", "at most", "of", "what it does"});
  for (const Row* r : rows) {
    out += line({plain(r->get("profile")), plain(r->get("name")), plain(r->get("knob")),
                 format(r->number("error_max")), plain(r->get("error_unit")), plain(r->get("note"))});
  }
  return out;
}

std::string named_part(const Table& table, const char* kind, const char* missing) {
  const RowRefs rows = table.of_kind(kind);
  if (rows.empty()) return absent(missing);
  std::string out = header({"quantity", "of", "backend", "K", "error max", "error p99", "unit", "ms p50",
                            "items / s", "note"});
  for (const Row* r : rows) {
    const std::string of =
        r->get("knob").empty() ? std::string() : r->get("knob") + " " + r->get("knob_value");
    out += line({plain(r->get("name")), plain(of), plain(r->get("backend")), r->get("influences"),
                 format(r->number("error_max")), format(r->number("error_p99")),
                 plain(r->get("error_unit")), format(r->number("time_p50_ms")),
                 format(r->number("items_per_second")), plain(r->get("note"))});
  }
  return out;
}

}  // namespace

std::string approximations_page(const Table& table, const std::string& command) {
  std::string out = "<!-- Generated by `" + command + "`; do not edit. -->\n\n# Approximations\n\n";
  out +=
      "Generated by `" + command + "` from the rows of one run. Date: " + plain(table.distinct("date")) +
      ". Machine: " + plain(table.distinct("machine")) + ". Commit: " + plain(table.distinct("commit")) +
      ". Scenes: " + plain(table.distinct("scene")) + ".\n\n";
  out +=
      "Each error is `mean / worst` over scenes, views and resolutions, against the oracle named "
      "(docs/reference/image_contract.md). Time, pairs and evaluations are geometric means of the ratio "
      "to the `exact` "
      "profile on "
      "the same view and backend: below 1 is what the approximation buys. 1 LSB is 1/255.\n\n";
  out += "## Profiles\n\n" + profile_part(table);
  out += "\n## Budgets\n\n" + budget_part(table);
  out += "\n## Targets\n\n";
  out +=
      "Targets on large scenes (docs/notes/lod.md), for each scene, size and backend, over "
      "the "
      "views that have "
      "both of the rows that are compared.\n\n"
      "- *lod*: rows of the profile lod compared with fast on the same view, both judged by photo4, the "
      "image "
      "of four times the "
      "resolution averaged. Times are sums of medians over the views; the gain of a view is the "
      "difference of the two "
      "PSNR, its mean and its least.\n"
      "- *culling*: Gaussians touched are those of the chunks, or parts of chunks, that projecting "
      "reads; those that reach "
      "a tile have a pair. Removed of all: 1 - touched / Gaussians; removed of the removable: that "
      "divided by "
      "1 - in a tile / Gaussians. Nothing that is removed changes a bit.\n"
      "- *depth alone*: frames of the sensor depth compared with rgbd, and the bytes of a Gaussian that "
      "each "
      "reads.\n"
      "- *packed*: bytes of the packed cloud, bounds and ids included, without its SH bands, and its "
      "PSNR against "
      "contract; the growth of the resident memory while the file is read, at most, compared with the "
      "size of "
      "the "
      "packed cloud (files whose cloud takes 16 MB and more).\n\n";
  out += target_part(table);
  out += "\n## What each profile approximates\n\n" + ledger_part(table);
  out += "\n## One knob at a time\n\n" + knob_part(table);
  out +=
      "\n## Fronts\n\nSorted by PSNR. A setting is on the front if no other of its backend and "
      "number of threads is at least as fast and as accurate, and better in one of the two.\n" +
      front_part(table);
  out += "\n## Skinning\n\n" + named_part(table, "skinning", "skinning");
  out += "\n## Capsule distances and sweeps\n\n" + named_part(table, "sweep", "sweep");
  out += "\n## Kernels\n\n" + named_part(table, "kernel", "kernel");
  return out;
}

gsnav::Status write_docs(const Table& table, const std::filesystem::path& path,
                         const std::string& command) {
  return gsnav::replace_file(path, approximations_page(table, command));
}

}  // namespace gsnav_report
