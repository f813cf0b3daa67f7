// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <optional>

#include "file.hpp"
#include "format_range.hpp"
#include "gsnav/core/replace_file.hpp"
#include "gsnav/core/text.hpp"
#include "gsnav/detail/io/gltf.hpp"
#include "gsnav/detail/io/ply.hpp"
#include "gsnav/detail/io/sog.hpp"
#include "gsnav/detail/io/splat.hpp"
#include "gsnav/detail/io/spz.hpp"
#include "gsnav/frame/sh.hpp"
#include "gsnav/io/scene_file.hpp"

namespace gsnav::io {
namespace {

/// The writer of a format, and the range of values that the format can hold.
struct SceneWriter {
  Status (*save)(const std::filesystem::path&, const GaussianCloud&);
  detail::FormatRange range;
};

std::optional<SceneWriter> writer_of(const std::filesystem::path& path) {
  using Path = std::filesystem::path;
  using Cloud = GaussianCloud;
  const std::string name = lower_case(path.filename().string());
  detail::FormatRange range;
  if (name.ends_with(".compressed.ply")) {
    range.log_scale_low = -detail::kCompressedMostLogScale;
    range.log_scale_high = detail::kCompressedMostLogScale;
    range.band_low = -detail::kCompressedBands;
    range.band_high = detail::kCompressedBands;
    return SceneWriter{save_compressed_ply, range};
  }
  if (name.ends_with(".ply"))
    return SceneWriter{[](const Path& p, const Cloud& c) { return save_ply(p, c); }, range};
  if (name.ends_with(".glb"))
    return SceneWriter{[](const Path& p, const Cloud& c) { return save_glb(p, c); }, range};
  if (name.ends_with(".splat")) {
    range.colour_low = 0;
    range.colour_high = 1;
    range.bands = false;
    return SceneWriter{save_splat, range};
  }
  if (name.ends_with(".spz")) {
    range.colour_low = 0.5 - 0.5 / detail::kSpzColour * kSh0;
    range.colour_high = 0.5 + 0.5 / detail::kSpzColour * kSh0;
    range.log_scale_low = detail::kSpzLeastLogScale;
    range.log_scale_high = detail::kSpzLeastLogScale + 255 / detail::kSpzLogSteps;
    range.band_low = -1;
    range.band_high = 1 - 1 / detail::kSpzBandSteps;
    return SceneWriter{[](const Path& p, const Cloud& c) { return save_spz(p, c); }, range};
  }
  if (name.ends_with(".sog") || name == "meta.json") {
    range.log_scale_low = detail::kSogLeastLogScale;
    return SceneWriter{save_sog, range};
  }
  return std::nullopt;
}

Status unknown_name(const std::filesystem::path& path) {
  return {
      Errc::unsupported,
      path.string() +
          ": unknown kind of file to write: use .ply, .compressed.ply, .splat, .spz, .sog, meta.json "
          "or .glb"};
}

}  // namespace

Status save_scene(const std::filesystem::path& path, const GaussianCloud& cloud) {
  if (cloud.compact()) {
    return detail::guarded(path.string(), [&] {
      GaussianCloud widened = cloud;
      expand_sh(widened);
      return save_scene(path, widened);
    });
  }
  const auto writer = writer_of(path);
  return writer ? writer->save(path, cloud) : unknown_name(path);
}

Status check_scene_output(const std::filesystem::path& path) {
  return writer_of(path) ? check_output_path(path) : unknown_name(path);
}

ClampedValues count_clamped(const std::filesystem::path& path, const GaussianCloud& cloud) {
  ClampedValues count;
  const auto writer = writer_of(path);
  if (!writer) return count;
  const detail::FormatRange& r = writer->range;
  const auto outside = [](double v, double low, double high) { return v < low || v > high ? 1u : 0u; };
  for (const float c : cloud.sh0)
    count.colours += outside(color_of_sh0(double{c}), r.colour_low, r.colour_high);
  for (const auto& axis : cloud.scales) {
    for (const float s : axis)
      count.scales += outside(std::log(double{s}), r.log_scale_low, r.log_scale_high);
  }
  for (const float b : cloud.shN) {
    if (r.bands) {
      count.bands += outside(double{b}, r.band_low, r.band_high);
    } else {
      count.lost_bands += b != 0 ? 1 : 0;
    }
  }
  return count;
}

}  // namespace gsnav::io
