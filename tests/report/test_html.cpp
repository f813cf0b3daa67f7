// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <regex>

#include "html.hpp"
#include "support/files.hpp"
#include "synthetic.hpp"

using namespace gsnav_report;

namespace {

/// What is wrong with the nesting of elements, or nothing: the page is written as XML.
std::string nesting_error(const std::string& page) {
  std::vector<std::string> open;
  for (std::size_t at = page.find('<'); at != page.npos; at = page.find('<', at + 1)) {
    const std::size_t end = page.find('>', at);
    if (end == page.npos) return "no end of " + page.substr(at, 30);
    const std::string tag = page.substr(at + 1, end - at - 1);
    if (tag.empty() || tag[0] == '!' || tag.back() == '/') continue;
    if (tag[0] != '/') {
      open.push_back(tag.substr(0, tag.find(' ')));
    } else if (open.empty() || open.back() != tag.substr(1)) {
      return tag + " closes " + (open.empty() ? "nothing" : open.back());
    } else {
      open.pop_back();
    }
  }
  return open.empty() ? "" : open.back() + " stays open";
}

std::size_t count(const std::string& text, const std::string& what) {
  std::size_t n = 0;
  for (std::size_t at = text.find(what); at != text.npos; at = text.find(what, at + 1)) ++n;
  return n;
}

}  // namespace

TEST_CASE("html: a full report is one well-formed page with every section") {
  const std::string page = html_page(Table(gsnav_test::synthetic_rows(), {}));
  CHECK(nesting_error(page) == "");
  CHECK(page.find("Nothing was measured") == std::string::npos);
  CHECK(count(page, "<section") == 11);
  CHECK(page.find("<script") == std::string::npos);
  CHECK(page.find("src=\"http") == std::string::npos);
  CHECK(page.find("href=\"http") == std::string::npos);
  for (const char* text :
       {"2026-01-31", "0123abcd", "2 cores of a &lt;virtual&gt; machine", "ruin &amp; garden",
        "project&lt;float&gt;", "256x256", "640x480", "alpha_min = 0.008", "exp2 by a cubic"}) {
    CAPTURE(text);
    CHECK(page.find(text) != std::string::npos);
  }
  CHECK(page.find("<virtual>") == std::string::npos);
  // Numbers that are none would show in attributes.
  CHECK(!std::regex_search(page, std::regex("(points|d|cx|cy|x|y)=\"[^\"]*(nan|inf)")));
}

TEST_CASE("html: budgets are said in words, met and missed") {
  std::vector<Row> rows = gsnav_test::synthetic_rows();
  CHECK(html_page(Table(rows, {})).find(">missed<") == std::string::npos);
  for (Row& r : rows) {
    if (r.get("profile") == "fast") r.set("rgb_psnr", 64.0);
  }
  const std::string page = html_page(Table(rows, {}));
  CHECK(count(page, ">missed<") == 2);  // on both backends
  CHECK(page.find("2 of ") != std::string::npos);
}

TEST_CASE("html: what was not measured is said, section by section, and nothing fails") {
  CHECK(count(html_page(Table({}, {})), "Nothing was measured") == 10);
  // Every column absent in turn, each row of the report having lost it.
  for (const std::string_view column : kColumns) {
    CAPTURE(column);
    std::vector<Row> rows = gsnav_test::synthetic_rows();
    for (Row& r : rows) r.set(column, "");
    CHECK(nesting_error(html_page(Table(std::move(rows), {}))) == "");
  }
}

TEST_CASE("html: fields that are no numbers are no numbers, wherever they stand") {
  std::vector<Row> rows = gsnav_test::synthetic_rows();
  for (std::size_t i = 0; i < rows.size(); ++i) {
    for (const char* column :
         {"rgb_psnr", "time_p50_ms", "depth_p99", "error_max", "flip_mean", "width"}) {
      const char* values[] = {"inf", "-inf", "nan", "\"><script>", "1e400", "-3"};
      rows[i].set(column, values[(i + rows[i].get("view").size()) % 6]);
    }
  }
  const std::string page = html_page(Table(rows, {}));
  CHECK(nesting_error(page) == "");
  CHECK(page.find("<script") == std::string::npos);
  CHECK(!std::regex_search(page, std::regex("(points|d|cx|cy)=\"[^\"]*(nan|inf)")));
}

TEST_CASE("html: images are embedded; one that is none is named") {
  const gsnav_test::TempFolder folder("report_html");
  gsnav_test::write_file(folder / "a.png", "\x89PNG\r\n\x1a\nrest");
  gsnav_test::write_file(folder / "b.png", "text");
  std::vector<Row> rows;
  for (const char* image : {"a.png", "b.png", "absent.png", "a.png"}) {
    Row r;
    rows.push_back(
        r.set("kind", "render").set("profile", "exact").set("scene", "s").set("image", image));
  }
  const Table table(rows, folder.path());
  REQUIRE(write_html(table, folder / "page.html").ok());
  const std::string page = gsnav_test::read_file(folder / "page.html");
  CHECK(page == html_page(table));
  CHECK(count(page, "data:image/png;base64,iVBORw0KGgpyZXN0") == 1);
  CHECK(page.find("b.png is no PNG") != std::string::npos);
  CHECK(page.find("absent.png is no PNG") != std::string::npos);
  CHECK(write_html(table, folder / "no/such/page.html").code() == gsnav::Errc::file_not_found);
}

TEST_CASE("html: a user's scene is judged by no target of the project's") {
  std::vector<Row> rows;
  Row r;
  rows.push_back(
      r.set("kind", "render").set("profile", "exact").set("scene", "s").set("rgb_psnr", "20"));
  const Table table(rows, {});
  CHECK(html_page(table, true).find("Budgets") != std::string::npos);
  const std::string page = html_page(table, false);
  CHECK(page.find("Budgets") == std::string::npos);
  CHECK(page.find("Targets") == std::string::npos);
  CHECK(page.find("How to read this") != std::string::npos);
}
