// SPDX-License-Identifier: Apache-2.0
#include "csv.hpp"

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <system_error>
#include <unordered_map>
#include <utility>

#include "gsnav/core/replace_file.hpp"

namespace gsnav_report {

using gsnav::Errc;
using gsnav::Result;
using gsnav::Status;

namespace {

std::string header_line() {
  std::string line;
  for (const std::string_view c : kColumns) line.append(line.empty() ? "" : ",").append(c);
  return line + "\n";
}

void append_quoted(std::string& out, const std::string& field) {
  if (field.find_first_of(",\"\r\n") == field.npos) {
    out += field;
    return;
  }
  out += '"';
  for (const char c : field) {
    if (c == '"') out += '"';
    out += c;
  }
  out += '"';
}

/// Reads the record that starts at `at` and moves `at` behind its line feed. @return False if the record
/// has no end.
bool next_record(const std::string& text, std::size_t& at, std::vector<std::string>& fields) {
  fields.assign(1, {});
  bool quoted = false;
  for (std::size_t i = at; i < text.size(); ++i) {
    const char c = text[i];
    if (quoted) {
      if (c != '"') {
        fields.back() += c;
      } else if (i + 1 < text.size() && text[i + 1] == '"') {
        fields.back() += text[++i];
      } else {
        quoted = false;
      }
    } else if (c == '"') {
      quoted = true;
    } else if (c == ',') {
      fields.emplace_back();
    } else if (c == '\n') {
      at = i + 1;
      return true;
    } else if (c != '\r') {
      fields.back() += c;
    }
  }
  return false;
}

}  // namespace

std::size_t Row::index(std::string_view column) {
  static const auto places = [] {
    std::unordered_map<std::string_view, std::size_t> map;
    for (const std::string_view c : kColumns) map.emplace(c, map.size());
    return map;
  }();
  const auto it = places.find(column);
  if (it == places.end()) {
    throw gsnav::Error(Errc::invalid_argument,
                       "no column \"" + std::string(column) + "\" in the report");
  }
  return it->second;
}

std::optional<double> Row::number(std::string_view column) const {
  const std::string& text = get(column);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

Row& Row::set(std::string_view column, std::string value) {
  fields_[index(column)] = std::move(value);
  return *this;
}

Row& Row::set(std::string_view column, double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.7g", value);
  return set(column, std::string(text));
}

Row& Row::set(std::string_view column, std::uint64_t value) {
  return set(column, std::to_string(value));
}

Row& Row::fill(const Row& other) {
  for (std::size_t k = 0; k < fields_.size(); ++k) {
    if (!other.fields_[k].empty()) fields_[k] = other.fields_[k];
  }
  return *this;
}

std::string Row::line() const {
  std::string out;
  for (std::size_t k = 0; k < fields_.size(); ++k) {
    if (k != 0) out += ',';
    append_quoted(out, fields_[k]);
  }
  return out;
}

Result<std::vector<Row>> parse_csv(const std::string& text, const std::string& source) {
  std::size_t at = 0, line = 1;
  std::vector<std::string> fields;
  if (!next_record(text, at, fields)) return {Errc::invalid_file, source + ": no header line"};
  std::vector<std::size_t> columns;
  for (const std::string& name : fields) {
    const auto it = std::find(kColumns.begin(), kColumns.end(), name);
    if (it == kColumns.end()) return {Errc::invalid_file, source + ": unknown column \"" + name + "\""};
    columns.push_back(static_cast<std::size_t>(it - kColumns.begin()));
  }
  std::vector<Row> rows;
  while (next_record(text, at, fields)) {
    ++line;
    if (fields.size() != columns.size()) {
      return {Errc::invalid_file, source + ": record " + std::to_string(line) + " has " +
                                      std::to_string(fields.size()) + " fields where the header has " +
                                      std::to_string(columns.size())};
    }
    Row& row = rows.emplace_back();
    for (std::size_t k = 0; k < fields.size(); ++k) row.fields_[columns[k]] = std::move(fields[k]);
  }
  return rows;
}

Result<CsvFile> CsvFile::open(const std::filesystem::path& path, bool resume) {
  CsvFile file;
  file.path_ = path;
  std::error_code error;
  if (resume && std::filesystem::exists(path, error)) {
    std::ifstream in(path, std::ios::binary);
    const std::string text((std::istreambuf_iterator<char>(in)), {});
    if (!in) return {Errc::file_not_found, path.string() + ": cannot be read"};
    Result<std::vector<Row>> rows = parse_csv(text, path.string());
    if (!rows) return rows.status();
    file.rows_ = std::move(*rows);
    for (const Row& r : file.rows_) file.keys_.insert(r.get("key"));
  }
  if (Status s = file.save(); !s) return s;
  return file;
}

Status CsvFile::add(Row row) {
  if (Status s = gsnav::append_line(path_, row.line()); !s) return s;
  keys_.insert(row.get("key"));
  rows_.push_back(std::move(row));
  return {};
}

Status CsvFile::save() {
  return gsnav::replace_file(path_, [this](gsnav::OutputFile& out) {
    out.write(header_line());
    for (const Row& r : rows_) out.write(r.line() + "\n");
  });
}

}  // namespace gsnav_report
