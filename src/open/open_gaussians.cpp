// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cstdio>
#include <utility>

#include "gsnav/detail/demo/default_scene.hpp"
#include "gsnav/detail/io/lod_file.hpp"
#include "gsnav/device/renderer.hpp"
#include "gsnav/io/scene_file.hpp"
#include "gsnav/scene/prepare.hpp"
#include "parts.hpp"

namespace gsnav::detail {
namespace {

/// The Gaussians as read or made so far.
struct Gaussians {
  GaussianCloud cloud;
  std::optional<PackedCloud> packed;  ///< used instead of `cloud`
  std::optional<LodTree> tree;
};

Result<Gaussians> read_file(OpeningScene& s) {
  const OpenOptions& o = s.options;
  const std::string& file = s.source.gaussians;
  Gaussians made;
  io::LoadSceneOptions load{
      .level = o.level,
      .time = o.time,
      .storage = o.storage == CloudStorage::compact ? io::Storage::compact : io::Storage::full,
      .keep_zero_bands = o.keep_zero_bands};
  if (o.levels == SceneLevels::shipped) {
    auto set = io::load_shipped_levels(file, load);
    if (!set) return set.status();
    if (*set) {
      made.cloud = std::move((*set)->cloud);
      made.tree = std::move((*set)->tree);
      s.out.report = std::move((*set)->report);
      return made;
    }
  }
  if (o.storage == CloudStorage::packed) {
    auto read = io::load_packed_scene(file, load);
    if (!read) return read.status();
    made.packed = std::move(read->cloud);
    s.out.report = std::move(read->report);
    return made;
  }
  auto read = io::load_scene(file, load);
  if (!read) return read.status();
  made.cloud = std::move(read->cloud);
  s.out.report = std::move(read->report);
  return made;
}

/// Makes the embedded flat, with its triangles.
Result<Gaussians> make_flat(OpeningScene& s) {
  SceneSampling sampling;
  sampling.density = s.options.density;
  sampling.progress = [&s](double share) { s.tell("Gaussians", share); };
  auto flat = make_default_scene(sampling);
  if (!flat) return flat.status();
  s.triangles = {std::move(flat->vertices), std::move(flat->triangles)};
  s.out.report.source = s.source.name;
  s.out.report.read = s.out.report.kept = flat->cloud.size();
  s.out.report.bounds = flat->bounds;
  s.out.report.up = {0, 1, 0};
  Gaussians made;
  if (s.options.storage == CloudStorage::packed) {
    made.packed = pack_cloud(std::move(flat->cloud), {}, &s.out.report.packing);
    s.out.report.packed = true;
  } else {
    made.cloud = std::move(flat->cloud);  // compact changes nothing: there is no SH above degree 0
  }
  return made;
}

/// Decides which axis is up.
Status place(OpeningScene& s) {
  const std::string& asked = s.options.up;
  OpenedScene& out = s.out;
  if (asked == "keep") {
    out.up = "keep";
    return {};
  }
  if (asked == "auto") {
    // The flat's frame is known, and Habitat's data stays as it is stored.
    out.up = s.source.embedded || s.source.has_frame || s.source.gaussians.empty()
                 ? "y"
                 : axis_name(out.report.up);
    out.up_guessed = !s.source.embedded && !s.source.has_frame && out.report.up_seen;
    if (out.up_guessed) {
      char text[96];
      std::snprintf(text, sizeof text, "up is %s, by the scene's ground (confidence %.2f)",
                    out.up.c_str(), out.report.up_confidence);
      s.note(text);
    } else if (!s.source.embedded && !s.source.has_frame && !s.source.gaussians.empty()) {
      s.warn("up is " + out.up + ", as usual for such files: no ground was recognised");
    }
  } else {
    out.up = asked;
  }
  auto turned = upright(out.up);
  if (!turned) return Status(turned.code(), "OpenOptions.up: " + turned.message());
  s.world_from_file = *turned;
  return {};
}

/// Levels of detail of a scene that ships none: read from next to its file, or built and stored there.
Status build_levels(OpeningScene& s, Gaussians& made) {
  if (s.options.levels == SceneLevels::none) return {};
  char text[96];
  const auto describe = [&](const char* origin) {
    std::snprintf(text, sizeof text, "levels of detail: %zu, %.1f MB, %s", made.tree->levels(),
                  static_cast<double>(made.tree->bytes()) * 1e-6, origin);
    s.note(text);
  };
  if (made.tree) {
    describe("shipped");
    return {};
  }
  LodSettings settings;
  if (s.options.progress) {
    settings.progress = [&s](double share) { s.options.progress("levels of detail", share); };
  }
  const auto build = [&] { return build_lod(s.options.device, made.cloud, settings); };
  if (s.source.embedded) {
    auto tree = build();
    if (!tree) return tree.status();
    made.tree = std::move(*tree);
    describe("built");
    return {};
  }
  auto cached = io::cached_lod(s.source.gaussians, made.cloud, settings, build);
  if (!cached) return cached.status();
  made.tree = std::move(cached->tree);
  describe(cached->built ? "built" : "read");
  if (!cached->warning.empty()) s.warn(cached->warning);
  return {};
}

/// Drops SH bands as OpenOptions::unseen_color says.
SceneBands fit_bands(OpeningScene& s, Gaussians& made) {
  const auto fit = [&](auto& cloud) {
    SceneBands bands = scene_bands(cloud, s.options.unseen_color);
    drop_bands(cloud, bands);
    return bands;
  };
  SceneBands bands = made.packed ? fit(*made.packed) : fit(made.cloud);
  if (made.tree) {
    const SceneBands merged = fit(made.tree->merged);
    bands.bytes_let_go += merged.bytes_let_go;
    bands.color_error = std::max(bands.color_error, merged.color_error);
  }
  if (bands.sh_numbers != 0) {
    std::array<std::size_t, kMaxShDegree + 1> chunks{};
    for (const std::uint8_t degree : bands.chunk_sh_degrees) ++chunks[degree];
    char text[192];
    std::snprintf(text, sizeof text,
                  "SH: %zu, %zu, %zu, %zu chunks need degree 0 to 3; %llu bytes let go that none needs, "
                  "%llu held that only others need",
                  chunks[0], chunks[1], chunks[2], chunks[3],
                  static_cast<unsigned long long>(bands.bytes_let_go),
                  static_cast<unsigned long long>(bands.bytes_unneeded));
    s.note(text);
  }
  return bands;
}

}  // namespace

Status open_gaussians(OpeningScene& s) {
  if (!s.source.embedded && s.source.gaussians.empty()) return place(s);
  if (s.options.levels != SceneLevels::none && s.options.storage == CloudStorage::packed) {
    return {Errc::invalid_argument,
            "OpenOptions.storage: packed Gaussians have no levels of detail; use full or compact"};
  }
  auto made = s.source.embedded ? make_flat(s) : read_file(s);
  if (!made) return made.status();
  for (const std::string& w : s.out.report.warnings) s.warn(w);
  Status status = place(s);
  if (status.ok()) status = build_levels(s, *made);
  if (!status) return status;
  const auto shared = []<class T>(T& part) { return std::make_shared<const T>(std::move(part)); };
  SceneAsset asset;
  if (!s.options.keep_zero_bands) {
    SceneBands bands = fit_bands(s, *made);
    asset.bands = shared(bands);
  }
  asset.world_from_asset = s.world_from_file;
  if (made->packed) {
    asset.packed = shared(*made->packed);
  } else {
    asset.cloud = shared(made->cloud);
  }
  if (made->tree) asset.lod = shared(*made->tree);
  s.scene.assets.push_back(std::move(asset));
  return {};
}

}  // namespace gsnav::detail
