// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>

#include "support/files.hpp"
#include "synthetic.hpp"
#include "table.hpp"
#include "table_budget.hpp"
#include "table_targets.hpp"

using namespace gsnav_report;

namespace {

Row render(const char* profile, const char* knob, const char* value, int view, double psnr, double ms) {
  Row r;
  r.set("kind", "render").set("profile", profile).set("knob", knob).set("knob_value", value);
  r.set("view", view)
      .set("width", 64)
      .set("height", 48)
      .set("backend", "serial")
      .set("oracle", "contract");
  return r.set("scene", "box").set("rgb_psnr", psnr).set("time_p50_ms", ms);
}

const BudgetCheck* find(const std::vector<BudgetCheck>& checks, const std::string& profile,
                        const std::string& measure) {
  for (const BudgetCheck& c : checks) {
    if (c.profile == profile && c.measure == measure) return &c;
  }
  return nullptr;
}

}  // namespace

TEST_CASE("table: reads quoted fields, and says which file and record is wrong") {
  const gsnav_test::TempFolder folder("report_table");
  const auto write = [&](const char* text) {
    gsnav_test::write_file(folder / "r.csv", text);
    return Table::read(folder / "r.csv");
  };
  const auto table = write("kind,name,note\nkernel,\"a, \"\"b\"\"\",\"two\nlines\"\nsweep,c,\n");
  REQUIRE(table.ok());
  REQUIRE(table->of_kind("kernel").size() == 1);
  CHECK(table->of_kind("kernel")[0]->get("name") == "a, \"b\"");
  CHECK(table->of_kind("kernel")[0]->get("note") == "two\nlines");
  CHECK(table->distinct("name") == "a, \"b\", c");
  CHECK(table->folder() == folder.path());

  const auto wrong = write("kind,name\nkernel,a\nkernel\n");
  CHECK(wrong.code() == gsnav::Errc::invalid_file);
  CHECK(wrong.message().find("r.csv") != std::string::npos);
  CHECK(wrong.message().find('3') != std::string::npos);
  CHECK(Table::read(folder / "absent.csv").code() == gsnav::Errc::file_not_found);
}

TEST_CASE("table: means, extremes and the rows they come from; an identical view counts as 140 dB") {
  std::vector<Row> rows{render("exact", "none", "", 0, 90, 2), render("exact", "none", "", 1, 100, 4)};
  rows.push_back(render("exact", "none", "", 2, 0, 6));
  rows.back().set("rgb_psnr", "");
  const Table table(rows, {});
  Spread s = spread(table.of_kind("render"), "rgb_psnr");
  CHECK(s.count == 2);
  CHECK(s.mean == 95);
  CHECK(s.lowest->get("view") == "0");
  CHECK(s.highest->get("view") == "1");
  CHECK(spread(table.of_kind("render"), "ssim").count == 0);
  rows.back().set("rgb_psnr", "inf");
  const Table second(rows, {});
  CHECK(spread(second.of_kind("render"), "rgb_psnr").mean == doctest::Approx(110));
}

TEST_CASE("table: the ratio to exact is of the same view, geometric") {
  std::vector<Row> rows{render("exact", "none", "", 0, 90, 2), render("exact", "none", "", 1, 90, 20),
                        render("fast", "none", "", 0, 70, 1), render("fast", "none", "", 1, 70, 40),
                        render("fast", "none", "", 7, 70, 1000)};  // no exact row of that view
  const Table table(rows, {});
  const RowRefs all = table.of_kind("render");
  const RowRefs fast = select(all, [](const Row& r) { return r.get("profile") == "fast"; });
  CHECK(ratio_to_exact(fast, all, "time_p50_ms").value() == doctest::Approx(1.0));
  CHECK(!ratio_to_exact(fast, all, "pairs").has_value());
  CHECK(exact_rows(fast, all).size() == 2);
}

TEST_CASE("table: a knob at the value of exact is known by its errors, oracle by oracle") {
  std::vector<Row> rows{render("exact", "none", "", 0, 110, 2),
                        render("exact", "key_bits", "32", 0, 110, 3),
                        render("exact", "key_bits", "16", 0, 60, 3)};
  rows.push_back(render("exact", "key_bits", "32", 0, 30, 3));
  rows.back().set("oracle", "ray");  // exact was not measured against it
  const Table table(rows, {});
  const RowRefs all = table.of_kind("render");
  CHECK(same_as_exact({all[1], all[3]}, all));
  CHECK(!same_as_exact({all[2]}, all));
  CHECK(!same_as_exact({all[3]}, all));
  CHECK(setting_label(*all[1]) == "key_bits = 32");
  rows[1].set("knob_value", "0.00392156862745098");
  CHECK(shown_value(rows[1]) == "0.003922");
}

TEST_CASE("table: values of a knob are in the order of numbers, names behind") {
  std::vector<Group> groups{{"32", {}}, {"name", {}}, {"4", {}}, {"0.5", {}}, {"another", {}}};
  sort_numerically(groups);
  std::string order;
  for (const Group& g : groups) order += g.name + " ";
  CHECK(order == "0.5 4 32 name another ");
}

TEST_CASE("budgets: the worst row decides, in the unit of the budget; knobs and other oracles do not") {
  std::vector<Row> rows{render("exact", "none", "", 0, 110, 2), render("exact", "none", "", 1, 84, 2),
                        render("exact", "alpha_min", "0.1", 0, 20, 2),
                        render("fast", "none", "", 0, 66, 2)};
  rows[0].set("rgb_max", 0.4 / 255).set("depth_p99", 0.00005);
  rows[1].set("rgb_max", 0.3 / 255).set("depth_p99", 0.0002);
  rows.push_back(render("exact", "none", "", 0, 30, 2));
  rows.back().set("oracle", "ray");
  const std::vector<BudgetCheck> checks = check_budgets(Table(rows, {}));
  const BudgetCheck* psnr = find(checks, "exact", "PSNR, dB");
  REQUIRE(psnr != nullptr);
  CHECK(psnr->worst == 84);
  CHECK(!psnr->met());
  CHECK(psnr->rows == 2);
  CHECK(psnr->where.find("box, 1") == 0);
  const BudgetCheck* largest = find(checks, "exact", "colour, largest error, LSB of 8 bit");
  REQUIRE(largest != nullptr);
  CHECK(largest->worst == doctest::Approx(0.4));
  CHECK(largest->met());
  const BudgetCheck* depth = find(checks, "exact", "depth, 99th percentile, mm");
  REQUIRE(depth != nullptr);
  CHECK(depth->worst == doctest::Approx(0.2));
  CHECK(!depth->met());
  REQUIRE(find(checks, "fast", "PSNR, dB") != nullptr);
  CHECK(find(checks, "fast", "PSNR, dB")->met());
  CHECK(find(checks, "fast", "depth, median error, mm") == nullptr);
}

TEST_CASE("budgets: an infinite or negative-infinite error is missed, not met") {
  Row bad = render("exact", "none", "", 0, 0, 2);
  bad.set("rgb_psnr", "-inf").set("rgb_max", "inf");
  const std::vector<BudgetCheck> checks = check_budgets(Table({bad}, {}));
  REQUIRE(checks.size() == 2);
  CHECK(!checks[0].met());
  CHECK(!checks[1].met());
}

TEST_CASE("targets: one setting beside another, over the views that have both") {
  std::vector<Row> rows;
  const auto add = [&rows](const char* profile, const char* oracle, const char* sensor, int view,
                           double psnr, double ms) -> Row& {
    Row r = render(profile, "none", "", view, psnr, ms);
    r.set("oracle", oracle)
        .set("sensor", sensor)
        .set("width", 256)
        .set("height", 256)
        .set("gaussians", 1000);
    rows.push_back(r);
    return rows.back();
  };
  add("fast", "photo4", "rgbd", 0, 30, 10);
  add("fast", "photo4", "rgbd", 1, 40, 30);
  add("fast", "photo4", "rgbd", 2, 40, 1000);  // no lod row of that view
  add("lod", "photo4", "rgbd", 0, 37, 4);
  add("lod", "photo4", "rgbd", 1, 39, 6);
  add("fast", "contract", "rgbd", 0, 100, 12)
      .set("touched", 300)
      .set("emitting", 200)
      .set("row_bytes", 236);
  add("fast", "contract", "rgbd", 1, 100, 20)
      .set("touched", 500)
      .set("emitting", 400)
      .set("row_bytes", 236);
  add("fast", "contract", "depth", 0, 100, 6)
      .set("touched", 999)
      .set("emitting", 1)
      .set("row_bytes", 59);
  add("fast", "contract", "depth", 1, 100, 10)
      .set("touched", 999)
      .set("emitting", 1)
      .set("row_bytes", 59);
  add("exact", "contract", "rgbd", 0, 78, 12)
      .set("knob", "storage")
      .set("knob_value", "packed")
      .set("gaussians", 1000000)
      .set("cloud_bytes", 83000000)
      .set("band_bytes", 45000000)
      .set("read_peak", 124500000);
  const std::vector<TargetCheck> checks = check_targets(Table(rows, {}));
  const auto value = [&checks](const std::string& measure) -> const TargetCheck& {
    const auto it = std::find_if(checks.begin(), checks.end(),
                                 [&](const TargetCheck& c) { return c.measure.starts_with(measure); });
    REQUIRE(it != checks.end());
    return *it;
  };
  CHECK(checks.size() == 8);
  CHECK(value("lod: times").value == doctest::Approx(40.0 / 10));
  CHECK(value("lod: times").met());
  CHECK(value("lod: nearer to the photo than fast, mean").value == doctest::Approx(3));
  CHECK(value("lod: nearer to the photo than fast, least").value == doctest::Approx(-1));
  CHECK(!value("lod: nearer to the photo than fast, least").met());
  CHECK(value("lod: times").views == 2);
  CHECK(value("culling").value == doctest::Approx(800.0 / 600));
  CHECK(!value("culling").met());
  CHECK(value("culling").note == "removed 60.0 % of all, 85.7 % of the removable");
  CHECK(value("depth alone: times").value == doctest::Approx(2));
  CHECK(value("depth alone: fewer").value == doctest::Approx(75));
  CHECK(value("packed: bytes").value == doctest::Approx(38));
  CHECK(value("packed: most memory").value == doctest::Approx(1.5));
  const std::string text = targets_text(checks);
  CHECK(std::count(text.begin(), text.end(), '\n') == 8);
  CHECK(text.find("box, 256x256, serial: packed: bytes per Gaussian beside its SH bands: 38") !=
        std::string::npos);
  CHECK(check_targets(Table({}, {})).empty());
}
