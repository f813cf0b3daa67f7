// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/io/ply.hpp"

#include <algorithm>
#include <array>
#include <optional>
#include <vector>

#include "cloud_fill.hpp"
#include "described.hpp"
#include "file.hpp"
#include "ply_body.hpp"
#include "ply_columns.hpp"
#include "ply_compressed.hpp"
#include "ply_header.hpp"
#include "ply_points.hpp"
#include "ply_temporal.hpp"
#include "quantised.hpp"
#include "temporal_rows.hpp"

namespace gsnav::io {
namespace {

using detail::kPlyBlock;
using detail::ply_rows_missing;
using detail::PlyBody;
using detail::PlyColumns;
using detail::PlyElement;
using detail::PlyHeader;
using detail::PlyProperty;

/// Adds n rows, the first of which is `row`, to the sink, and their time planes to `moving` if it is not
/// null.
void add_block(detail::CloudSink& sink, detail::TemporalRows* moving, const PlyColumns& columns,
               const double* block, std::size_t row, std::size_t n) {
  std::array<float, 45> rest;
  RawGaussian raw;
  raw.shN = columns.rest != 0 ? rest.data() : nullptr;
  for (std::size_t i = 0; i < n; ++i) {
    const auto at = [&](std::size_t column) { return block[column * kPlyBlock + i]; };
    raw.mean = {at(0), at(1), at(2)};
    for (std::size_t k = 0; k < 3; ++k) {
      raw.sh0[k] = columns.greatest_colour > 0
                       ? static_cast<float>(sh0_of_color(at(3 + k) / columns.greatest_colour))
                       : static_cast<float>(at(3 + k));
    }
    raw.opacity_logit = at(6);
    raw.log_scales = {at(7), at(8), at(9)};
    raw.quat = {at(10), at(11), at(12), at(13)};
    for (std::size_t k = 0; k < columns.rest; ++k)
      rest[k] = static_cast<float>(at(detail::kPlyFixed + k));
    if (moving == nullptr) {
      sink.add(raw);
      continue;
    }
    detail::RawTemporal t;
    if (columns.time != PlyColumns::kNone) t.time = at(columns.time);
    if (columns.time_scale != PlyColumns::kNone) t.log_sigma = at(columns.time_scale);
    for (std::size_t k = 0; k < columns.motion_count; ++k) t.motion[k] = at(columns.motion + k);
    moving->add(row + i, t, raw, sink);
  }
}

/// Adds n rows to the sink, if all their properties are float32 in this machine's byte order.
void add_float_rows(detail::CloudSink& sink, const PlyColumns& columns, std::size_t stride,
                    const std::byte* rows, std::size_t n) {
  std::array<std::size_t, detail::kPlyFixed + 45> offsets{};
  for (std::size_t k = 0; k < columns.properties.size(); ++k) offsets[k] = columns.properties[k]->offset;
  std::array<float, 45> rest;
  RawGaussian raw;
  raw.shN = columns.rest != 0 ? rest.data() : nullptr;
  for (std::size_t i = 0; i < n; ++i, rows += stride) {
    const auto single = [&](std::size_t column) {
      return detail::load_le<float>(rows + offsets[column]);
    };
    const auto at = [&](std::size_t column) { return static_cast<double>(single(column)); };
    raw.mean = {at(0), at(1), at(2)};
    for (std::size_t k = 0; k < 3; ++k) raw.sh0[k] = single(3 + k);
    raw.opacity_logit = at(6);
    raw.log_scales = {at(7), at(8), at(9)};
    raw.quat = {at(10), at(11), at(12), at(13)};
    for (std::size_t k = 0; k < columns.rest; ++k) rest[k] = single(detail::kPlyFixed + k);
    sink.add(raw);
  }
}

bool are_floats(const PlyHeader& header, const PlyColumns& columns) {
  return header.format == detail::PlyFormat::little && columns.greatest_colour == 0 &&
         std::all_of(columns.properties.begin(), columns.properties.end(),
                     [](const PlyProperty* p) { return p->type == detail::PlyType::f32; });
}

/// The Gaussians that a header describes.
struct Vertices {
  std::vector<PlyElement>::const_iterator element;
  PlyColumns columns;
  bool points = false;  ///< Whether there are only positions and colours.
};

Result<Vertices> find_vertices(const PlyHeader& header, const std::string& source) {
  Vertices v;
  v.element = std::find_if(header.elements.begin(), header.elements.end(),
                           [](const PlyElement& e) { return e.name == "vertex"; });
  if (v.element == header.elements.end()) {
    return {Errc::invalid_file, source + ": no element 'vertex'"};
  }
  if (detail::is_compressed_ply(header)) return v;
  v.points = !v.element->has_list && detail::is_point_cloud(*v.element);
  if (v.points) return v;
  if (v.element->has_list) {
    return {Errc::unsupported, source + ": element 'vertex' has a list property"};
  }
  auto chosen = detail::choose_ply_columns(*v.element, source);
  if (!chosen) return chosen.status();
  v.columns = std::move(*chosen);
  return v;
}

/// Fills a cloud from blocks of rows. `rows_at(first, n)` returns where n rows are, or null if they are
/// missing. Text is read from `body`. `moving` is that of detail::load_ply.
template <class RowsAt>
Result<LoadedCloud> fill(const PlyHeader& header, const Vertices& v, const std::string& source,
                         TemporalCloud* moving, PlyBody* body, const RowsAt& rows_at,
                         detail::BandsApart* apart = nullptr) {
  const std::size_t count = static_cast<std::size_t>(v.element->count);
  std::optional<detail::TemporalRows> planes;
  if (moving != nullptr && v.columns.moves()) planes.emplace(count, v.columns.motion_count);
  const bool floats = are_floats(header, v.columns) && !planes;
  const auto decode = [&](std::size_t first, std::size_t last, detail::CloudSink& sink) -> Status {
    std::vector<double> block(floats ? 0 : v.columns.properties.size() * kPlyBlock);
    for (std::size_t row = first; row < last; row += kPlyBlock) {
      const std::size_t n = std::min(kPlyBlock, last - row);
      if (body != nullptr) {
        const std::size_t there = body->read(*v.element, v.columns.properties, n, block.data());
        if (there != n) return ply_rows_missing(source, *v.element, row + there);
      } else {
        const std::byte* const rows = rows_at(row, n);
        if (rows == nullptr) return ply_rows_missing(source, *v.element, row);
        if (floats) {
          add_float_rows(sink, v.columns, v.element->stride, rows, n);
          continue;
        }
        detail::unpack_ply_rows(header.format, *v.element, v.columns.properties, rows, n, block.data());
      }
      add_block(sink, planes ? &*planes : nullptr, v.columns, block.data(), row, n);
    }
    return {};
  };
  auto out = detail::fill_cloud(count, v.columns.degree, source, decode,
                                header.format != detail::PlyFormat::ascii, {}, apart);
  if (!out) return out;
  if (planes) planes->give(*moving, out->report);
  if (moving == nullptr && v.columns.moves()) {
    out->report.warnings.push_back(
        "Gaussians that move and fade: each is taken at its own time; load_scene with a time, or "
        "load_temporal, reads t, "
        "t_scale and motion_*");
  }
  out->cloud.filter = header.mip ? Filter::mip : Filter::classic;
  if (v.columns.rest_in_file == 72) {
    out->report.warnings.push_back("SH degree 4 in the file: bands up to degree 3 are read");
  }
  return out;
}

void warn_of_stray_bytes(LoadReport& report, std::uint64_t bytes, std::uint64_t rows) {
  if (bytes == 0) return;
  report.warnings.push_back(std::to_string(bytes) + " stray bytes follow the " + std::to_string(rows) +
                            " rows that the header declares");
}

Result<LoadedCloud> parse_any(std::span<const std::byte> bytes, const std::string& source,
                              TemporalCloud* moving) {
  auto parsed = detail::parse_ply_header(bytes, source);
  if (!parsed) return parsed.status();
  const PlyHeader& header = *parsed;
  const auto found = find_vertices(header, source);
  if (!found) return found.status();
  if (detail::is_compressed_ply(header)) return detail::parse_compressed_ply(bytes, header, source);
  if (found->points) return detail::parse_ply_points(bytes, header, source);
  const PlyElement& vertex = *found->element;
  PlyBody body(bytes, header);
  for (auto e = header.elements.begin(); e != found->element; ++e) {
    if (const std::uint64_t rows = body.skip(*e); rows != e->count)
      return ply_rows_missing(source, *e, rows);
  }
  if (const std::uint64_t rows = body.available(vertex); rows < vertex.count) {
    return ply_rows_missing(source, vertex, rows);
  }
  const bool text = header.format == detail::PlyFormat::ascii;
  const std::byte* const rows = body.here();
  auto out = fill(header, *found, source, moving, text ? &body : nullptr,
                  [&](std::size_t first, std::size_t) { return rows + first * vertex.stride; });
  if (!out) return out;
  if (!text) body.skip(vertex);
  for (auto e = found->element + 1; e != header.elements.end(); ++e) {
    if (const std::uint64_t there = body.skip(*e); there != e->count) {
      out->report.warnings.push_back(ply_rows_missing(source, *e, there).message());
      return out;
    }
  }
  body.skip_blanks();
  warn_of_stray_bytes(out->report, body.left(), vertex.count);
  return out;
}

/// Whether the header alone determines where each row is.
bool has_fixed_rows(const PlyHeader& header) {
  return header.format != detail::PlyFormat::ascii &&
         std::none_of(header.elements.begin(), header.elements.end(),
                      [](const PlyElement& e) { return e.has_list; });
}

/// Reads the rows in pieces, so that memory holds no more than the cloud.
Result<LoadedCloud> load_rows(const detail::RandomFile& file, const PlyHeader& header, const Vertices& v,
                              const std::string& source, TemporalCloud* moving,
                              detail::BandsApart* apart) {
  std::uint64_t left = file.size() - header.size, start = header.size, others_short = 0;
  const PlyElement* cut = nullptr;
  for (const PlyElement& e : header.elements) {
    const std::uint64_t there = e.stride == 0 ? e.count : std::min(e.count, left / e.stride);
    if (there < e.count && cut == nullptr) {
      cut = &e;
      others_short = there;
    }
    if (cut != nullptr) continue;
    if (&e < &*v.element) start += there * e.stride;
    left -= there * e.stride;
  }
  if (cut != nullptr && cut <= &*v.element) return ply_rows_missing(source, *cut, others_short);
  const PlyElement& vertex = *v.element;
  if (apart != nullptr && apart->out == nullptr) {
    if (vertex.count < apart->least_rows || v.columns.moves() || v.columns.degree == 0) {
      apart = nullptr;
    } else {
      apart->degree = v.columns.degree;
    }
  } else if (apart != nullptr &&
             (vertex.count != apart->places.size() || v.columns.degree != apart->degree)) {
    return {Errc::invalid_file, source + ": the file has changed while it was read"};
  }
  auto out = fill(
      header, v, source, moving, nullptr,
      [&](std::size_t first, std::size_t n) -> const std::byte* {
        thread_local std::vector<std::byte> rows;
        rows.resize(n * vertex.stride);
        return file.read(start + std::uint64_t{first} * vertex.stride, rows) ? rows.data() : nullptr;
      },
      apart);
  if (!out) return out;
  if (cut != nullptr) {
    out->report.warnings.push_back(ply_rows_missing(source, *cut, others_short).message());
  } else {
    warn_of_stray_bytes(out->report, left, vertex.count);
  }
  return out;
}

}  // namespace

Result<LoadedCloud> detail::parse_ply(std::span<const std::byte> bytes, const std::string& source,
                                      TemporalCloud* moving) {
  return guarded(source, [&] { return described(parse_any(bytes, source, moving), usual_up(source)); });
}

Result<LoadedCloud> detail::load_ply(const std::filesystem::path& path, TemporalCloud* moving,
                                     BandsApart* apart) {
  const std::string source = path.string();
  return guarded(source, [&]() -> Result<LoadedCloud> {
    RandomFile file;
    if (Status s = file.open(path); !s) return s;
    std::vector<std::byte> top(
        static_cast<std::size_t>(std::min<std::uint64_t>(file.size(), kLargestPlyHeader + 1)));
    if (!file.read(0, top)) return {Errc::invalid_file, source + ": reading failed"};
    const auto header = parse_ply_header(top, source);
    if (!header) return header.status();
    const auto found = find_vertices(*header, source);
    if (!found) return found.status();
    if (is_compressed_ply(*header))
      return described(parse_compressed_ply(file, *header, source), usual_up(source));
    if (has_fixed_rows(*header) && !found->points) {
      return described(load_rows(file, *header, *found, source, moving, apart), usual_up(source));
    }
    const auto bytes = read_file(path);
    if (!bytes) return bytes.status();
    return described(parse_any(bytes->span(), source, moving), usual_up(source));
  });
}

Result<LoadedCloud> parse_ply(std::span<const std::byte> bytes, std::string source) {
  return detail::parse_ply(bytes, source, nullptr);
}

Result<LoadedCloud> load_ply(const std::filesystem::path& path) {
  return detail::load_ply(path, nullptr);
}

}  // namespace gsnav::io
