// SPDX-License-Identifier: Apache-2.0
#include "table_targets.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

#include "../../tools/common/html_text.hpp"

namespace gsnav_report {

using gsnav_tools::format;
using gsnav_tools::format_round;
namespace {

/// Rows of one scene, size, backend and number of threads.
class Place {
 public:
  Place(const RowRefs& rows, std::vector<TargetCheck>& out) : rows_(rows), out_(out) {}

  void check() {
    const RowRefs fast = plain("fast", "contract"), exact = plain("exact", "contract");
    levels_of_detail();
    culling(fast.empty() ? exact : fast);
    depths_alone(fast.empty() ? exact : fast);
    memory();
  }

 private:
  RowRefs plain(std::string_view profile, std::string_view oracle) const {
    return select(rows_, [&](const Row& r) {
      return is_plain(r) && r.get("profile") == profile && r.get("oracle") == oracle;
    });
  }
  static RowRefs of_sensor(const RowRefs& rows, std::string_view sensor) {
    return select(rows, [&](const Row& r) { return r.get("sensor") == sensor; });
  }
  /// Pairs of rows of the same view, and of the same sensor if `same_sensor`.
  static std::vector<std::pair<const Row*, const Row*>> by_view(const RowRefs& a, const RowRefs& b,
                                                                bool same_sensor) {
    std::vector<std::pair<const Row*, const Row*>> out;
    for (const Row* x : a) {
      for (const Row* y : b) {
        if (x->get("view") != y->get("view") || (same_sensor && x->get("sensor") != y->get("sensor")))
          continue;
        out.emplace_back(x, y);
        break;
      }
    }
    return out;
  }
  void add(const char* measure, double limit, double value, bool at_least, std::size_t views,
           std::string note = {}) {
    if (!std::isfinite(value)) return;
    const Row& r = *rows_.front();
    out_.push_back({r.get("scene"), resolution(r), r.get("backend"), measure, limit, value, at_least,
                    std::move(note), views});
  }
  static std::string percent(double share) {
    char text[32];
    std::snprintf(text, sizeof text, "%.1f %%", 100 * share);
    return text;
  }

  void levels_of_detail() {
    double fast_ms = 0, lod_ms = 0, gain = 0, least = INFINITY;
    std::size_t n = 0;
    for (const auto& [fast, lod] : by_view(plain("fast", "photo4"), plain("lod", "photo4"), true)) {
      const auto a = fast->number("rgb_psnr"), b = lod->number("rgb_psnr");
      const auto s = fast->number("time_p50_ms"), t = lod->number("time_p50_ms");
      if (!a || !b || !s || !t) continue;
      const double more = std::min(*b, kIdenticalPsnr) - std::min(*a, kIdenticalPsnr);
      fast_ms += *s;
      lod_ms += *t;
      gain += more;
      least = std::min(least, more);
      ++n;
    }
    if (n == 0) return;
    add("lod: times faster than fast", 4, fast_ms / lod_ms, true, n);
    add("lod: nearer to the photo than fast, mean, dB", 3, gain / static_cast<double>(n), true, n);
    add("lod: nearer to the photo than fast, least, dB", 0, least, true, n);
  }

  void culling(const RowRefs& rows) {
    double all = 0, touched = 0, emitting = 0;
    std::size_t n = 0;
    for (const Row* r : rows) {
      const auto g = r->number("gaussians"), t = r->number("touched"), e = r->number("emitting");
      if (!g || !t || !e || r->get("sensor") != rows.front()->get("sensor")) continue;
      all += *g;
      touched += *t;
      emitting += *e;
      ++n;
    }
    if (n == 0 || !(emitting > 0)) return;
    add("culling: Gaussians touched for each that reaches a tile", 1.3, touched / emitting, false, n,
        "removed " + percent((all - touched) / all) + " of all, " +
            percent(all > emitting ? (all - touched) / (all - emitting) : 1) + " of the removable");
  }

  void depths_alone(const RowRefs& rows) {
    double both_ms = 0, depth_ms = 0, both_bytes = 0, depth_bytes = 0;
    std::size_t n = 0;
    for (const auto& [both, depth] : by_view(of_sensor(rows, "rgbd"), of_sensor(rows, "depth"), false)) {
      const auto s = both->number("time_p50_ms"), t = depth->number("time_p50_ms");
      const auto a = both->number("row_bytes"), b = depth->number("row_bytes");
      if (!s || !t || !a || !b) continue;
      both_ms += *s;
      depth_ms += *t;
      both_bytes += *a;
      depth_bytes += *b;
      ++n;
    }
    if (n == 0) return;
    add("depth alone: times faster than with colour", 1.5, both_ms / depth_ms, true, n);
    add("depth alone: fewer bytes of a Gaussian read, %", 70, 100 * (1 - depth_bytes / both_bytes), true,
        n);
  }

  void memory() {
    const RowRefs packed = select(rows_, [](const Row& r) {
      return r.get("knob") == "storage" && r.get("knob_value") == "packed" &&
             r.get("oracle") == "contract";
    });
    if (packed.empty()) return;
    const auto n = packed.front()->number("gaussians"), bytes = packed.front()->number("cloud_bytes"),
               bands = packed.front()->number("band_bytes");
    const Spread psnr = spread(packed, "rgb_psnr");
    if (!n || !bytes || !bands || !(*n > 0)) return;
    char note[80];
    std::snprintf(note, sizeof note, "and %.1f of SH bands; %.1f dB, least %.1f", *bands / *n, psnr.mean,
                  psnr.min);
    add("packed: bytes per Gaussian beside its SH bands", 40, (*bytes - *bands) / *n, false,
        packed.size(), note);
    constexpr double kLeast = 1.6e7;  // below this, threads and pages dominate the peak
    if (const auto peak = packed.front()->number("read_peak"); peak && *bytes >= kLeast)
      add("packed: most memory while it is read, relative to its size", 2, *peak / *bytes, false,
          packed.size());
  }

  const RowRefs& rows_;
  std::vector<TargetCheck>& out_;
};

}  // namespace

std::vector<TargetCheck> check_targets(const Table& table) {
  std::vector<TargetCheck> out;
  const auto place = [](const Row& r) {
    return r.get("scene") + '\n' + resolution(r) + '\n' + r.get("backend") + '\n' + r.get("threads");
  };
  for (const Group& g : group_by(table.of_kind("render"), place)) Place(g.rows, out).check();
  return out;
}

std::string targets_text(const std::vector<TargetCheck>& checks) {
  std::string out;
  for (const TargetCheck& c : checks) {
    out += c.scene + ", " + c.size + ", " + c.backend + ": " + c.measure + ": " + format(c.value, 4) +
           " (" + (c.at_least ? "at least " : "at most ") + format_round(c.limit) +
           (c.met() ? ", met)" : ", missed)") + (c.note.empty() ? "" : "; " + c.note) + ", " +
           std::to_string(c.views) + " views\n";
  }
  return out;
}

}  // namespace gsnav_report
