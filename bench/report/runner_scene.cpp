// SPDX-License-Identifier: Apache-2.0
#include "runner_scene.hpp"

#include <cstdio>
#include <filesystem>
#include <optional>
#include <system_error>

#if defined(GSNAV_HAS_CUDA)
#include "gsnav/backends/cuda.hpp"
#include "gsnav/core/text.hpp"
#endif
#include "gsnav/io.hpp"
#include "gsnav/scene/lod_cut.hpp"
#include "gsnav/scene/packed_cloud.hpp"
#include "runner_images.hpp"
#include "runner_reference.hpp"
#include "runner_system.hpp"

namespace gsnav_report {

using namespace gsnav;

Camera SceneRunner::camera(const Setting& s) const {
  return camera_of(scene_.views[s.view], s.size.width, s.size.height, options_.hfov,
                   options_.near_plane);
}

int SceneRunner::threads(const Setting& s) const {
  return s.backend == "openmp" ? openmp_.threads() : 1;
}

std::string SceneRunner::key(const Setting& s, Oracle oracle) const {
  Hasher h;
  h.text(scene_.hash);
  hash_camera(h, camera(s));
  for (const std::string& t :
       {stamp_.get("commit"), stamp_.get("machine"), scene_.name, s.sensor, s.backend, s.profile, s.knob,
        s.knob_value, std::string(to_string(oracle))}) {
    h.text(t);
  }
  h.value(threads(s));
  if (s.profile == "visible") h.array(scene_.visible->bits);
  return h.hex();
}

namespace {

bool is_exact(const Setting& s) { return s.profile == "exact" && s.knob == "none"; }

}  // namespace

template <class B, class Cloud>
Result<SceneRunner::Outcome> SceneRunner::render_on(B& backend, const Setting& s, const Cloud& cloud,
                                                    int runs) {
  Outcome out;
  const GaussianArrays<B> arrays(backend, cloud);
  GaussianSet set = arrays.set();
  const Camera c = camera(s);
  if (s.profile == "visible") {
    const auto cell = scene_.visible->cell_of(c);
    out.cell_known = cell.has_value();
    if (cell) set.selection.seen = scene_.visible->seen_from(*cell);
  }
  BasicRenderer<float, B> renderer(backend, render_config(s, scene_.cloud.sort_order));
  const Result<const LodTree*> tree = tree_of(s);
  if (!tree) return tree.status();
  std::optional<LodCut> cut;
  if (*tree != nullptr) cut.emplace(**tree, scene_.cloud);
  Status status;
  const auto draw = [&] {
    const std::span<const GaussianSet> sets = cut ? cut->select(c) : std::span(&set, 1);
    if (cut) renderer.set_config(lod_config(renderer.config()));
    if (Status next = renderer.render(sets, std::span(&c, 1), out.frames); !next) status = next;
  };
  reset_peak_memory();
  draw();
  out.peak_memory = peak_memory();
  if (runs > 0 && is_exact(s)) {
    out.timing = {measure(draw, runs, options_.max_seconds), 1};
  } else if (runs > 0) {
    Setting plain = s;
    plain.profile = "exact";
    plain.knob = "none";
    const GaussianArrays<B> stored(backend, scene_.cloud);
    const GaussianSet all = stored.set();
    BasicRenderer<float, B> exact(backend, render_config(plain, scene_.cloud.sort_order));
    Frames<float> frames;
    const auto draw_exact = [&] {
      if (Status next = exact.render(std::span(&all, 1), std::span(&c, 1), frames); !next) status = next;
    };
    out.timing = measure_beside(draw, draw_exact, runs, options_.max_seconds);
  }
  if constexpr (is_host_backend<B>) {
    if (s.knob == "none") {
      out.culled = count_culled(backend, cut ? cut->sets() : std::span(&set, 1), c, renderer.config());
    }
  }
  out.scratch_bytes = renderer.scratch_bytes();
  if (!status) return status;
  return out;
}

Result<const LodTree*> SceneRunner::tree_of(const Setting& s) {
  if (s.profile != "lod") return static_cast<const LodTree*>(nullptr);
  if (!tree_) {
    if (scene_.path.empty()) {
      Result<LodTree> built = build_lod(openmp_, scene_.cloud);
      if (!built) return built.status();
      tree_ = std::move(*built);
    } else {
      Result<io::CachedLod> cached = io::cached_lod(scene_.path, scene_.cloud, {},
                                                    [this] { return build_lod(openmp_, scene_.cloud); });
      if (!cached) return cached.status();
      if (!cached->warning.empty())
        std::fprintf(stderr, "\ngsnav-report: warning: %s\n", cached->warning.c_str());
      tree_ = std::move(cached->tree);
    }
  }
  return &*tree_;
}

std::uint64_t SceneRunner::row_bytes(const GaussianCloud& cloud, const std::string& sensor) noexcept {
  const auto colors = static_cast<std::uint64_t>(3 * sh_coefficient_count(cloud.sh_degree));
  return sizeof(float) * (11 + (sensor == "depth" ? 0 : colors));
}

template <class Cloud>
Result<SceneRunner::Outcome> SceneRunner::render(const Setting& s, const Cloud& cloud, int runs) {
#if defined(GSNAV_HAS_CUDA)
  if (s.backend == "cuda") {
    if (CudaBackend::device_count() == 0)
      return {Errc::backend_failure, "--backends cuda: no GPU, or no driver"};
    CudaBackend cuda;
    return render_on(cuda, s, cloud, runs);
  }
#endif
  if (s.backend == "serial") return render_on(serial_, s, cloud, runs);
  return render_on(openmp_, s, cloud, runs);
}

Result<SceneRunner::Named> SceneRunner::reference(const Setting& s, Oracle oracle) {
  const Camera c = camera(s);
  const SortOrder order = scene_.cloud.sort_order;
  const std::string hash = reference_hash(scene_.hash, c, oracle, order);
  for (const Named& n : recent_) {
    if (n.hash == hash) return n;
  }
  std::string warning;
  std::optional<Reference> found = cache_.load(hash, warning);
  if (!warning.empty())
    std::fprintf(stderr, "\ngsnav-report: warning: %s\n", gsnav::printable(warning).c_str());
  if (!found) {
    Result<Reference> made = render_reference(scene_.cloud.set(), c, oracle, order, options_.threads);
    if (!made) return made.status();
    if (Status stored = cache_.store(hash, *made); !stored) return stored;
    found = std::move(*made);
  }
  recent_.push_back({hash, std::make_shared<const Reference>(std::move(*found))});
  if (recent_.size() > 5) recent_.pop_front();
  return recent_.back();
}

Status SceneRunner::run(const Setting& s) {
  std::vector<Oracle> missing;
  for (const Oracle q : s.oracles) {
    if (!csv_.has(key(s, q))) missing.push_back(q);
  }
  if (missing.empty()) return {};
  const bool packed = s.knob == "storage" && s.knob_value == kPackedStorage;
  GaussianCloud encoded;
  const GaussianCloud* cloud = &scene_.cloud;
  if (packed && !packed_) {
    Result<StoredPacked> stored = scene_.path.empty()
                                      ? Result<StoredPacked>(StoredPacked{pack_cloud(scene_.cloud)})
                                      : read_packed(scene_.path);
    if (!stored) return stored.status();
    packed_ = std::move(*stored);
  } else if (s.knob == "storage" && !packed) {
    Result<GaussianCloud> stored = through_storage(scene_.cloud, s.knob_value);
    if (!stored) return stored.status();
    encoded = std::move(*stored);
    cloud = &encoded;
  }
  std::size_t cloud_bytes = packed ? packed_->cloud.bytes() : cloud->bytes(),
              bands = packed ? band_bytes(packed_->cloud)
                             : sizeof(float) * cloud->shN.size() +
                                   sizeof(std::uint16_t) * cloud->shN_half.size();
  const std::uint64_t read_peak = packed ? packed_->read_peak : 0;
  for (const StorageCodec& c : storage_codecs()) {
    if (s.knob == "storage" && c.name == s.knob_value) cloud_bytes = stored_bytes(scene_.cloud, c);
  }
  const Result<Outcome> outcome =
      packed ? render(s, packed_->cloud, options_.runs) : render(s, *cloud, options_.runs);
  if (!outcome) return outcome.status();
  if (s.profile == "lod") cloud_bytes += tree_->bytes();
  if (s.profile == "visible") cloud_bytes += scene_.visible->bytes();
  for (const Oracle q : missing) {
    const Result<Named> named = reference(s, q);
    if (!named) return named.status();
    Row row = stamp_;
    row.set("kind", "render").set("scene", scene_.name).set("view", scene_.views[s.view].name);
    row.set("width", s.size.width).set("height", s.size.height).set("sensor", s.sensor);
    row.set("backend", s.backend).set("threads", threads(s)).set("profile", s.profile);
    row.set("knob", s.knob).set("knob_value", s.knob_value).set("oracle", std::string(to_string(q)));
    if (Status judged = judge_(outcome->frames, *named->reference, named->hash, row); !judged)
      return judged;
    const RenderStats& stats = outcome->frames.stats[0];
    const Timing& timing = outcome->timing.timing;
    row.set("time_p50_ms", timing.p50_ms).set("time_p99_ms", timing.p99_ms);
    row.set("time_over_exact", outcome->timing.ratio);
    row.set("gaussians", stats.gaussians)
        .set("visible", stats.visible)
        .set("pairs", stats.tile_intersections);
    if (outcome->culled.rows != 0)
      row.set("touched", outcome->culled.touched).set("emitting", outcome->culled.emitting);
    row.set("row_bytes", row_bytes(scene_.cloud, s.sensor))
        .set("cloud_bytes", std::uint64_t{cloud_bytes});
    row.set("band_bytes", std::uint64_t{bands});
    // Pairs that the contract needs; knobs have other counts of their own.
    if (s.knob == "none" && q == Oracle::contract) row.set("evaluations", named->reference->evaluations);
    row.set("bytes", static_cast<std::uint64_t>(outcome->scratch_bytes + cloud_bytes));
    if (read_peak != 0) row.set("read_peak", read_peak);
    row.set("peak_rss", outcome->peak_memory);
    row.set("note", std::to_string(timing.runs) + " runs" +
                        (outcome->cell_known ? "" : "; no visible set serves this view: all is drawn"));
    row.set("key", key(s, q));
    if (Status added = csv_.add(std::move(row)); !added) return added;
  }
  return {};
}

Status SceneRunner::save_worst_view(const ImageSize& size, const std::string& profile) {
  Row* worst = nullptr;
  for (Row& row : csv_.rows()) {
    const bool candidate =
        row.get("scene") == scene_.name && row.get("commit") == stamp_.get("commit") &&
        row.get("kind") == "render" && row.get("knob") == "none" && row.get("oracle") == "contract" &&
        row.get("profile") == profile && row.get("backend") == options_.backends.front() &&
        row.get("sensor") != "depth" && row.get("width") == std::to_string(size.width) &&
        row.get("height") == std::to_string(size.height) && row.number("rgb_max");
    if (candidate && (worst == nullptr || *row.number("rgb_max") > *worst->number("rgb_max")))
      worst = &row;
  }
  if (worst == nullptr || !worst->get("image").empty()) return {};
  Setting s;
  while (s.view < scene_.views.size() && scene_.views[s.view].name != worst->get("view")) ++s.view;
  if (s.view == scene_.views.size())
    return {};  // a resumed row may have a view that this run does not
                // have
  s.size = size;
  s.sensor = worst->get("sensor");
  s.backend = worst->get("backend");
  s.profile = profile;
  const Result<Outcome> outcome = render(s, scene_.cloud, 0);
  if (!outcome) return outcome.status();
  const Result<Named> named = reference(s, Oracle::contract);
  if (!named) return named.status();
  const std::filesystem::path images("images"), folder = std::filesystem::path(options_.out) / images;
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  const std::string file = scene_.name + "_" + to_string(size) + "_" + profile + ".png";
  const Result<std::string> text =
      save_comparison(folder / file, outcome->frames.rgb, *named->reference);
  if (!text) return text.status();
  worst->set("image", (images / file).string())
      .set("note", worst->get("note") + "; worst view: " + *text);
  return {};
}

Status SceneRunner::save_worst_views() {
  for (const ImageSize& size : options_.sizes) {
    for (const std::string& profile : options_.profiles) {
      if (Status s = save_worst_view(size, profile); !s) return s;
    }
  }
  return csv_.save();
}

}  // namespace gsnav_report
