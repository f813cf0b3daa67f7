// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include "csv.hpp"
#include "kernels.hpp"
#include "support/files.hpp"

using namespace gsnav_report;
using namespace gsnav_test;

TEST_CASE("csv: fields of any text come back") {
  for (const char* text :
       {"plain", "a,b", "say \"no\"", "two\nlines", "\"", ",", "", "trailing,", "caf\xc3\xa9"}) {
    CAPTURE(text);
    Row row;
    row.set("scene", text)
        .set("note", text)
        .set("rgb_max", 0.1)
        .set("pairs", std::uint64_t{18446744073709551615ull});
    std::string file;
    for (const std::string_view c : kColumns) file.append(file.empty() ? "" : ",").append(c);
    const auto rows = parse_csv(file + "\n" + row.line() + "\n" + row.line() + "\n", "text").value();
    REQUIRE(rows.size() == 2);
    CHECK(rows[1].get("scene") == text);
    CHECK(rows[1].get("note") == text);
    CHECK(rows[1].number("rgb_max") == 0.1);
    CHECK(rows[1].get("pairs") == "18446744073709551615");
    CHECK_FALSE(rows[1].number("ssim"));
  }
}

TEST_CASE("csv: what is wrong is named") {
  CHECK(parse_csv("", "f").message().find("header") != std::string::npos);
  CHECK(parse_csv("kind,colour\n", "f").message().find("colour") != std::string::npos);
  CHECK(parse_csv("kind,scene\nrender\n", "f").message().find("record 2") != std::string::npos);
  Row row;
  CHECK_THROWS_AS(row.set("colour", 1.0), gsnav::Error);
  CHECK_THROWS_AS(row.get("colour"), gsnav::Error);
}

TEST_CASE("csv: every added row is on disk, and a cut-off line is left out") {
  const TempFolder folder("report_csv");
  const auto path = folder / "report.csv";
  {
    CsvFile file = CsvFile::open(path, false).value();
    Row row;
    CHECK(file.add(row.set("key", "a")).ok());
    CHECK(file.add(row.set("key", "b").set("note", "x,\ny")).ok());
    CHECK(parse_csv(read_file(path), "f").value().size() == 2);  // while it is still open
  }
  const std::string whole = read_file(path);
  for (const std::size_t cut : {whole.size() - 1, whole.size() - 5}) {
    write_file(path, whole.substr(0, cut));
    CsvFile file = CsvFile::open(path, true).value();
    CHECK(file.has("a"));
    CHECK_FALSE(file.has("b"));
    CHECK(file.add(Row().set("key", "c")).ok());
    CHECK(parse_csv(read_file(path), "f").value().size() == 2);
  }
  CHECK(CsvFile::open(path, false).value().rows().empty());
  write_file(path, "not,ours\n1,2\n");
  CHECK(CsvFile::open(path, true).code() == gsnav::Errc::invalid_file);
  CHECK(CsvFile::open(folder / "none/report.csv", false).code() == gsnav::Errc::file_not_found);
}

TEST_CASE("csv: rows completed later are saved") {
  const TempFolder folder("report_csv_save");
  const auto path = folder / "report.csv";
  CsvFile file = CsvFile::open(path, false).value();
  CHECK(file.add(Row().set("key", "a")).ok());
  file.rows()[0].set("image", "images/a.png");
  CHECK(file.save().ok());
  CHECK(file.add(Row().set("key", "b")).ok());
  const auto rows = parse_csv(read_file(path), "f").value();
  REQUIRE(rows.size() == 2);
  CHECK(rows[0].get("image") == "images/a.png");
}

TEST_CASE("kernels: benchmarks with their counters") {
  const std::string json = R"({"context": {}, "benchmarks": [
    {"name": "project<float, OpenMPBackend>/degree:3/threads:12/real_time", "run_type": "iteration",
     "iterations": 9, "real_time": 2500.0,
     "cpu_time": 1, "time_unit": "us", "items_per_second": 4e7, "rgb_max": 1.5e-7, "mean_px_max": 0.25},
    {"name": "skin", "run_type": "iteration", "real_time": 7.0, "time_unit": "ms"}]})";
  const auto rows = parse_benchmarks(json, "f").value();
  REQUIRE(rows.size() == 3);
  CHECK(rows[0].get("backend") == "openmp");
  CHECK(rows[0].get("threads") == "12");
  CHECK(rows[2].get("threads").empty());
  CHECK(rows[0].number("time_p50_ms") == 2.5);
  CHECK(rows[0].number("items_per_second") == 4e7);
  CHECK(rows[0].get("error_unit") == "mean_px_max");
  CHECK(rows[0].number("error_max") == 0.25);
  CHECK(rows[1].get("error_unit") == "rgb_max");
  CHECK(rows[2].get("name") == "skin");
  CHECK(rows[2].get("error_unit").empty());
  CHECK(parse_benchmarks("[]", "f").code() == gsnav::Errc::invalid_file);
  CHECK(parse_benchmarks("{\"benchmarks\": [3]}", "f").code() == gsnav::Errc::invalid_file);
  CHECK(parse_benchmarks("{\"benchmarks\": [{\"name\": \"x\"}]}", "f").message().find("\"x\"") !=
        std::string::npos);
  CHECK(kernel_rows("/nowhere.json").code() == gsnav::Errc::file_not_found);
}
