// SPDX-License-Identifier: Apache-2.0
#include "gsnav/io/ply.hpp"

#include <algorithm>
#include <array>
#include <vector>

#include "file.hpp"
#include "ply_body.hpp"
#include "ply_compressed.hpp"
#include "ply_header.hpp"

namespace gsnav::io {
namespace {

using detail::kPlyBlock;
using detail::ply_rows_missing;
using detail::PlyBody;
using detail::PlyElement;
using detail::PlyHeader;
using detail::PlyProperty;

constexpr std::size_t kFixed = 14;  // x y z, f_dc 3, opacity, scale 3, rot 4

/// The vertex properties that are read, in the order of a block's columns.
struct Columns {
  std::vector<const PlyProperty*> properties;
  int degree = 0;
  std::size_t rest = 0;          ///< f_rest columns read: 3 ((degree + 1)^2 - 1)
  std::size_t rest_in_file = 0;  ///< f_rest properties in the file
};

Result<Columns> choose_columns(const PlyElement& vertex, const std::string& source) {
  static constexpr std::array<const char*, kFixed> kNames = {
      "x",       "y",       "z",       "f_dc_0", "f_dc_1", "f_dc_2", "opacity",
      "scale_0", "scale_1", "scale_2", "rot_0",  "rot_1",  "rot_2",  "rot_3"};
  Columns c;
  for (const char* name : kNames) {
    const PlyProperty* p = vertex.find(name);
    if (p == nullptr) {
      return {Errc::invalid_file, source + ": element 'vertex' has no property '" + name + "'"};
    }
    c.properties.push_back(p);
  }
  for (const PlyProperty& p : vertex.properties) {
    c.rest_in_file += p.name.starts_with("f_rest_") ? 1 : 0;
  }
  static constexpr std::array<std::size_t, 5> kCounts = {0, 9, 24, 45, 72};
  const auto found = std::find(kCounts.begin(), kCounts.end(), c.rest_in_file);
  if (found == kCounts.end()) {
    return {Errc::invalid_file, source + ": " + std::to_string(c.rest_in_file) +
                                    " properties f_rest_*, must be 0, 9, 24, 45 or 72"};
  }
  c.degree = std::min(kMaxShDegree, static_cast<int>(found - kCounts.begin()));
  c.rest = kCounts[static_cast<std::size_t>(c.degree)];
  // Channel-major in the file; colour inner in the cloud.
  for (std::size_t k = 0; k < c.rest / 3; ++k) {
    for (std::size_t channel = 0; channel < 3; ++channel) {
      const std::string name = "f_rest_" + std::to_string(channel * (c.rest_in_file / 3) + k);
      const PlyProperty* p = vertex.find(name);
      if (p == nullptr) {
        return {Errc::invalid_file, source + ": element 'vertex' has no property '" + name +
                                        "' among its " + std::to_string(c.rest_in_file) + " f_rest_*"};
      }
      c.properties.push_back(p);
    }
  }
  return c;
}

void add_block(GaussianCloudBuilder& builder, const Columns& columns, const double* block,
               std::size_t n) {
  std::array<float, 45> rest;
  RawGaussian raw;
  raw.shN = columns.rest != 0 ? rest.data() : nullptr;
  for (std::size_t i = 0; i < n; ++i) {
    const auto at = [&](std::size_t column) { return block[column * kPlyBlock + i]; };
    raw.mean = {at(0), at(1), at(2)};
    for (std::size_t k = 0; k < 3; ++k) raw.sh0[k] = static_cast<float>(at(3 + k));
    raw.opacity_logit = at(6);
    raw.log_scales = {at(7), at(8), at(9)};
    raw.quat = {at(10), at(11), at(12), at(13)};
    for (std::size_t k = 0; k < columns.rest; ++k) rest[k] = static_cast<float>(at(kFixed + k));
    builder.add(raw);
  }
}

Result<LoadedCloud> parse(std::span<const std::byte> bytes, const std::string& source) {
  auto parsed = detail::parse_ply_header(bytes, source);
  if (!parsed) return parsed.status();
  const PlyHeader& header = *parsed;
  const auto vertex = std::find_if(header.elements.begin(), header.elements.end(),
                                   [](const PlyElement& e) { return e.name == "vertex"; });
  if (vertex == header.elements.end()) return {Errc::invalid_file, source + ": no element 'vertex'"};
  if (detail::is_compressed_ply(header)) return detail::parse_compressed_ply(bytes, header, source);
  if (vertex->has_list) {
    return {Errc::unsupported, source + ": element 'vertex' has a list property"};
  }
  auto chosen = choose_columns(*vertex, source);
  if (!chosen) return chosen.status();
  const Columns& columns = *chosen;

  PlyBody body(bytes, header);
  for (auto e = header.elements.begin(); e != vertex; ++e) {
    if (const std::uint64_t rows = body.skip(*e); rows != e->count)
      return ply_rows_missing(source, *e, rows);
  }
  if (const std::uint64_t rows = body.available(*vertex); rows < vertex->count) {
    return ply_rows_missing(source, *vertex, rows);
  }
  const std::size_t count = static_cast<std::size_t>(vertex->count);

  GaussianCloudBuilder builder(columns.degree, source);
  builder.cloud().filter = header.mip ? Filter::mip : Filter::classic;
  builder.reserve(count);
  std::vector<double> block(columns.properties.size() * kPlyBlock);
  for (std::size_t row = 0; row < count; row += kPlyBlock) {
    const std::size_t n = std::min(kPlyBlock, count - row);
    const std::size_t there = body.read(*vertex, columns.properties, n, block.data());
    if (there != n) return ply_rows_missing(source, *vertex, row + there);
    add_block(builder, columns, block.data(), n);
  }

  LoadReport& report = builder.report();
  if (columns.rest_in_file == 72) {
    report.warnings.push_back("SH degree 4 in the file: bands up to degree 3 are read");
  }
  for (auto e = vertex + 1; e != header.elements.end(); ++e) {
    if (const std::uint64_t rows = body.skip(*e); rows != e->count) {
      report.warnings.push_back(ply_rows_missing(source, *e, rows).message());
      return LoadedCloud{std::move(builder.cloud()), std::move(report)};
    }
  }
  body.skip_blanks();
  if (body.left() != 0) {
    report.warnings.push_back(std::to_string(body.left()) + " stray bytes follow the " +
                              std::to_string(count) + " rows that the header promises");
  }
  return LoadedCloud{std::move(builder.cloud()), std::move(report)};
}

}  // namespace

Result<LoadedCloud> parse_ply(std::span<const std::byte> bytes, std::string source) {
  return detail::guarded(source, [&] { return parse(bytes, source); });
}

Result<LoadedCloud> load_ply(const std::filesystem::path& path) {
  return detail::guarded(path.string(), [&]() -> Result<LoadedCloud> {
    auto file = detail::read_file(path);
    if (!file) return file.status();
    return parse(file->span(), path.string());
  });
}

}  // namespace gsnav::io
