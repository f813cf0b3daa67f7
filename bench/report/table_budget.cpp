// SPDX-License-Identifier: Apache-2.0
#include "table_budget.hpp"

#include <string_view>

namespace gsnav_report {
namespace {

/// A budget: `column` of a profile's rows times `unit` against `limit`.
struct Budget {
  std::string_view profile, measure, column;
  double limit, unit;
  bool at_least;
};

constexpr Budget kProfiles[] = {
    {"exact", "colour, largest error, LSB of 8 bit", "rgb_max", 0.5, 255, false},
    {"exact", "colour, 99.9th percentile", "rgb_p999", 1e-4, 1, false},
    {"exact", "PSNR, dB", "rgb_psnr", 85, 1, true},
    {"exact", "pixels left out, %", "excluded", 0.1, 100, false},
    {"exact", "depth, 99th percentile, mm", "depth_p99", 0.1, 1e3, false},
    {"exact", "depth, largest error, mm", "depth_max", 1, 1e3, false},
    {"fast", "colour, largest error, LSB of 8 bit", "rgb_max", 6, 255, false},
    {"fast", "PSNR, dB", "rgb_psnr", 65, 1, true},
    {"fast", "pixels over 2 LSB, %", "rgb_over_2lsb", 0.1, 100, false},
    {"fast", "depth, median error, mm", "depth_p50", 1, 1e3, false},
    {"fast", "depth, 99th percentile, mm", "depth_p99", 5, 1e3, false},
    {"lod", "depth, 90th percentile, % of range", "depth_absrel_p90", 1, 100, false},
};

/// A budget for the largest error among rows of a kind whose name starts with `name`.
struct NamedBudget {
  std::string_view kind, name, measure, unit;
  double limit, scale;
};

constexpr NamedBudget kNamed[] = {
    {"skinning", "position", "skinned position, mm", "m", 0.02, 1e3},
    {"skinning", "rotation", "skinned rotation, degrees", "deg", 0.01, 1},
    {"sweep", "distance", "capsule distance, relative", "relative", 1e-5, 1},
    {"sweep", "penetration", "penetration after a step, m", "m", 1e-5, 1},
};

std::string place(const Row& row) {
  std::string out;
  for (const std::string& part :
       {row.get("scene"), row.get("view"), row.get("width").empty() ? std::string() : resolution(row),
        row.get("name"), row.get("knob_value")}) {
    if (!part.empty()) out += (out.empty() ? "" : ", ") + part;
  }
  return out;
}

void add_check(std::vector<BudgetCheck>& checks, BudgetCheck check, const RowRefs& rows,
               std::string_view column, double unit) {
  const Spread s = spread(rows, column);
  if (s.count == 0) return;
  const Row& worst = check.at_least ? *s.lowest : *s.highest;
  check.worst = (check.at_least ? s.min : s.max) * unit;
  check.oracle = worst.get("oracle");
  check.where = place(worst);
  check.rows = s.count;
  checks.push_back(std::move(check));
}

}  // namespace

std::vector<BudgetCheck> check_budgets(const Table& table) {
  std::vector<BudgetCheck> checks;
  const auto backend = [](const Row& r) { return r.get("backend"); };
  for (const Budget& b : kProfiles) {
    // LOD is judged by the photographic oracle, all others by the contract in its own order.
    const std::string_view oracle = b.profile == "lod" ? "photo4" : "contract";
    const RowRefs rows = select(table.of_kind("render"), [&](const Row& r) {
      return is_plain(r) && r.get("profile") == b.profile && r.get("oracle") == oracle;
    });
    for (const Group& g : group_by(rows, backend)) {
      add_check(
          checks,
          {std::string(b.profile), g.name, std::string(b.measure), {}, b.limit, 0, b.at_least, {}, 0},
          g.rows, b.column, b.unit);
    }
  }
  for (const NamedBudget& b : kNamed) {
    const RowRefs rows = select(table.of_kind(b.kind), [&](const Row& r) {
      return !r.get("backend").empty() && r.get("name").starts_with(b.name) &&
             r.get("error_unit") == b.unit;
    });
    for (const Group& g : group_by(rows, backend)) {
      add_check(checks,
                {std::string(b.kind), g.name, std::string(b.measure), {}, b.limit, 0, false, {}, 0},
                g.rows, "error_max", b.scale);
    }
  }
  return checks;
}

}  // namespace gsnav_report
