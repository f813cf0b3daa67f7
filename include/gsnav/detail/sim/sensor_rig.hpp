// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "gsnav/core/buffer.hpp"
#include "gsnav/core/rng.hpp"
#include "gsnav/detail/core/host_array.hpp"
#include "gsnav/detail/frame/cut_depth.hpp"
#include "gsnav/detail/sim/cube_map.hpp"
#include "gsnav/detail/sim/frame_batch.hpp"
#include "gsnav/detail/sim/mesh_normals.hpp"
#include "gsnav/detail/sim/scene_detail.hpp"
#include "gsnav/detail/sim/semantic.hpp"
#include "gsnav/detail/sim/sensor.hpp"
#include "gsnav/sim/config.hpp"

namespace gsnav {

/// One who looks: where it stands, what there is to see, and which row of the images is its own.
struct SensorView {
  Vec3d base{};  ///< world, metres
  Quatd rotation{};
  double pitch = 0.0;       ///< radians
  std::uint64_t noise = 0;  ///< decides what noise models draw
  std::span<const GaussianSet> sets;
  const RenderConfig* config = nullptr;  ///< outputs are chosen by the sensors
  std::size_t row = 0;
  MeshFrame meshes{};                   ///< ids are their numbers for semantic sensors
  const SceneDetail* detail = nullptr;  ///< levels of detail of the first of `sets`; null: whole.
                                        ///< Semantic sensors see all sets whole
};

/// The images of all sensors for a number of rows.
template <Backend B>
struct SensorImages {
  ImageMemory memory = ImageMemory::host;
  std::size_t rows = 0;
  std::vector<HostArray<float, B>> buffers;
  std::vector<Buffer<float, B>> on_backend;  // in place of buffers where images are not in host memory

  bool in_host_memory() const noexcept { return is_host_backend<B> || memory == ImageMemory::host; }
};

/// The sensors of a body. Whoever carries the same sensors can be drawn in one batch; sensors at one
/// place with one field of view share a render.
template <Backend B>
class SensorRig {
 public:
  /// `sensors` are valid.
  SensorRig(B& backend, std::vector<SensorSpec> sensors)
      : backend_(&backend),
        sensors_(std::move(sensors)),
        frames_(backend),
        semantic_(backend),
        normals_(backend),
        chosen_(backend) {
    for (std::size_t i = 0; i < sensors_.size(); ++i) {
      Group* group = nullptr;
      for (Group& g : groups_) {
        if (same_camera(sensors_[g.sensor], sensors_[i])) group = &g;
      }
      if (group == nullptr) {
        group = &groups_.emplace_back();
        group->sensor = i;
        if (sensors_[i].model != SensorModel::pinhole)
          group->cube = std::make_shared<const CubeMap>(sensors_[i]);
      }
      const auto kind = static_cast<std::size_t>(sensors_[i].kind);
      if (group->buffer[kind] == kNone) group->buffer[kind] = add_buffer(i);
      Output out{group->buffer[kind], group->buffer[kind]};
      if (sensors_[i].noise.kind != NoiseKind::none) out.noisy = add_buffer(i);
      outputs_.push_back(out);
    }
  }

  const std::vector<SensorSpec>& sensors() const noexcept { return sensors_; }
  /// Whether images of such sensors can be left in a backend's memory. Errors: unsupported, naming the
  /// sensor.
  static Status check_memory(std::span<const SensorSpec> sensors, ImageMemory memory) {
    if (memory == ImageMemory::host || is_host_backend<B>) return {};
    for (const SensorSpec& s : sensors) {
      const bool plain =
          s.kind == SensorKind::rgb || s.kind == SensorKind::depth || s.kind == SensorKind::alpha;
      if (BatchBackend<B> && plain && s.model == SensorModel::pinhole && s.noise.kind == NoiseKind::none)
        continue;
      return {Errc::unsupported,
              "SensorSpec \"" + s.uuid +
                  "\": images stay in a backend's memory where they are a "
                  "pinhole's colour, depth or alpha, without noise; use ImageMemory::host"};
    }
    return {};
  }
  /// The image of a sensor in one row, [height][width][channels], in host memory.
  std::span<const float> image(const SensorImages<B>& images, std::size_t sensor,
                               std::size_t row) const noexcept {
    const std::size_t n = size_[outputs_[sensor].noisy];
    return {images.buffers[outputs_[sensor].noisy].data() + row * n, n};
  }
  /// All rows of a sensor, [rows][height][width][channels], where they are in host memory.
  std::span<const float> all(const SensorImages<B>& images, std::size_t sensor) const noexcept {
    if (!images.in_host_memory()) return {};
    const HostArray<float, B>& buffer = images.buffers[outputs_[sensor].noisy];
    return {buffer.data(), buffer.size()};
  }
  /// The same where they are in the backend's.
  const float* all_on_backend(const SensorImages<B>& images, std::size_t sensor) const noexcept {
    return images.in_host_memory() ? nullptr : images.on_backend[outputs_[sensor].clean].data();
  }
  void resize(SensorImages<B>& images, std::size_t rows) const {
    images.rows = rows;
    if (!images.in_host_memory()) {
      while (images.on_backend.size() < size_.size()) images.on_backend.emplace_back(*backend_);
      for (std::size_t b = 0; b < size_.size(); ++b)
        images.on_backend[b].resize_discard(rows * size_[b]);
      return;
    }
    images.buffers.resize(size_.size());
    for (std::size_t b = 0; b < size_.size(); ++b) images.buffers[b].resize(rows * size_[b]);
  }

  /// Appends every camera that a view from there needs.
  void append_cameras(const Vec3d& base, const Quatd& rotation, double pitch,
                      std::vector<Camera>& out) const {
    for (const Group& g : groups_) {
      const Camera c = sensor_camera(sensors_[g.sensor], base, rotation, pitch);
      if (g.cube == nullptr) {
        out.push_back(c);
        continue;
      }
      for (const std::size_t face : g.cube->faces()) out.push_back(g.cube->face_camera(c, face));
    }
  }

  /// Draws all sensors of all views into their rows, in one batch. Errors: what rendering reports.
  Status render(std::span<const SensorView> views, SensorImages<B>& images) {
    // Faces of cubes, shares of sets and depths for normals are scratch: so many views at a time that it
    // stays small.
    const bool scratch = std::any_of(groups_.begin(), groups_.end(), [](const Group& g) {
      return g.cube != nullptr || g.buffer[kSemantic] != kNone || g.buffer[kNormal] != kNone;
    });
    const std::size_t most = scratch ? kScratchViews : views.size();
    for (std::size_t first = 0; first < views.size(); first += most) {
      if (Status s = render_some(views.subspan(first, std::min(most, views.size() - first)), images); !s)
        return s;
    }
    return {};
  }
  /// Renders so far: one for each view and camera (a cube counts one), and one for every three sets that
  /// a semantic sensor tells apart.
  std::size_t render_count() const noexcept { return render_count_; }
  Renderer<float, B>& renderer() noexcept { return frames_.renderer(); }

 private:
  static constexpr std::size_t kNone = ~std::size_t{0}, kScratchViews = 16;
  static constexpr auto kDepth = static_cast<std::size_t>(SensorKind::depth);
  static constexpr auto kSemantic = static_cast<std::size_t>(SensorKind::semantic);
  static constexpr auto kNormal = static_cast<std::size_t>(SensorKind::normal), kKinds = kNormal + 1;
  struct Group {  // sensors that share a camera
    std::size_t sensor = 0;
    std::array<std::size_t, kKinds> buffer{kNone, kNone, kNone, kNone, kNone};
    HostArray<float, B> seen;  // [view][pixels], median depths for normals where no sensor has them
    std::shared_ptr<const CubeMap> cube;  // none: a pinhole
  };
  struct Output {
    std::size_t clean, noisy;  // buffers; the same without noise
  };

  std::size_t add_buffer(std::size_t sensor) {
    const SensorSpec& s = sensors_[sensor];
    size_.push_back(static_cast<std::size_t>(s.resolution[0]) *
                    static_cast<std::size_t>(s.resolution[1]) *
                    static_cast<std::size_t>(channels_of(s.kind)));
    return size_.size() - 1;
  }

  template <class F>
  void for_each(std::size_t n, const F& f) {
    if constexpr (is_host_backend<B>) {
      backend_->parallel_for(n, f);
    } else {
      for (std::size_t i = 0; i < n; ++i) f(i);
    }
  }

  static FrameImages<float> frame_images(const std::array<float*, kKinds>& at) noexcept {
    FrameImages<float> out;
    out.rgb = at[static_cast<std::size_t>(SensorKind::rgb)];
    out.median_depth = at[kDepth];
    out.alpha = at[static_cast<std::size_t>(SensorKind::alpha)];
    return out;
  }

  Status render_some(std::span<const SensorView> views, SensorImages<B>& images) {
    cameras_.clear();
    for (const SensorView& v : views) append_cameras(v.base, v.rotation, v.pitch, cameras_);
    faces_.resize(groups_.size());
    jobs_.clear();
    detail_jobs_.clear();
    prepare_shares(views);
    std::size_t camera = 0;
    for (std::size_t v = 0; v < views.size(); ++v) {
      for (std::size_t g = 0; g < groups_.size(); ++g) add_jobs(views, v, g, images, camera);
    }
    while (cuts_.size() < detail_jobs_.size()) cuts_.emplace_back();
    for_each(detail_jobs_.size(), [this](std::size_t i) {
      FrameJob<float>& job = jobs_[detail_jobs_[i].job];
      job.sets = cuts_[i].select(*detail_jobs_[i].detail, job.sets, *job.camera);
      job.config = &cuts_[i].rules(*job.config);
    });
    chosen_.place(std::span(cuts_).first(detail_jobs_.size()));
    if constexpr (BatchBackend<B>) {
      if (!images.in_host_memory()) {
        if (Status s = frames_.render_on_backend(jobs_); !s) return s;
        return cut_on_backend(views, images);
      }
    }
    if (Status s = frames_.render(jobs_); !s) return s;
    for (const NormalJob& n : normal_jobs_) {
      const Group& group = groups_[n.group];
      const std::span<float> out(row(images, group.buffer[kNormal], views[n.view].row),
                                 size_[group.buffer[kNormal]]);
      const double far_plane = sensors_[group.sensor].far_plane;
      if (Status s = normals_.draw(views[n.view].meshes, cameras_[n.camera], n.seen, far_plane, out); !s)
        return s;
    }
    for_each(views.size(), [&](std::size_t v) { finish(views[v], v, images); });
    for (const Shares& s : shares_) {
      const std::span<float> out(row(images, s.buffer, views[s.view].row), size_[s.buffer]);
      label_pixels(s.images, things_in(views[s.view]), out);
    }
    return {};
  }

  /// Far planes of depths that stay in the backend's memory.
  Status cut_on_backend(std::span<const SensorView> views, SensorImages<B>& images) {
    rows_.clear();
    for (const SensorView& v : views) rows_.push_back(v.row);
    std::sort(rows_.begin(), rows_.end());
    for (const Group& group : groups_) {
      if (group.buffer[kDepth] == kNone) continue;
      for (std::size_t begin = 0, end = 0; begin < rows_.size(); begin = end) {
        for (end = begin + 1; end < rows_.size() && rows_[end] == rows_[begin] + (end - begin);) ++end;
        backend_->parallel_for(
            (end - begin) * size_[group.buffer[kDepth]],
            CutDepth(row(images, group.buffer[kDepth], rows_[begin]), sensors_[group.sensor].far_plane));
      }
    }
    return backend_->synchronize();
  }
  /// Sets and meshes.
  static std::size_t things_in(const SensorView& v) noexcept {
    std::size_t meshes = 0;
    for (const MeshInstance& m : v.meshes.instances) meshes = std::max(meshes, std::size_t{m.id} + 1);
    return v.sets.size() + meshes;
  }

  /// Scratch for the passes of semantic sensors.
  void prepare_shares(std::span<const SensorView> views) {
    shares_.clear();
    normal_jobs_.clear();
    share_configs_.clear();
    if (std::none_of(groups_.begin(), groups_.end(),
                     [](const Group& g) { return g.buffer[kSemantic] != kNone; }))
      return;
    std::size_t most = 0;
    for (const SensorView& v : views) {
      for (const GaussianSet& set : v.sets) most = std::max(most, set.gaussians.size());
    }
    semantic_.reserve(most);
    for (const SensorView& v : views) {
      share_configs_.push_back(*v.config);
      share_configs_.back().background = {};
    }
  }

  /// Appends what group g of view v needs; `camera` is the place of its first camera, then of the next
  /// group's.
  void add_jobs(std::span<const SensorView> views, std::size_t v, std::size_t g, SensorImages<B>& images,
                std::size_t& camera) {
    Group& group = groups_[g];
    const auto add = [&](const std::array<float*, kKinds>& at) {
      if (views[v].detail != nullptr) detail_jobs_.push_back({jobs_.size(), views[v].detail});
      jobs_.push_back(
          {views[v].sets, &cameras_[camera++], views[v].config, frame_images(at), views[v].meshes});
    };
    std::array<float*, kKinds> at{};
    if (group.cube == nullptr) {
      bool any = false;
      for (std::size_t k = 0; k < kSemantic; ++k) {
        if (group.buffer[k] != kNone) at[k] = row(images, group.buffer[k], views[v].row);
        any = any || at[k] != nullptr;
      }
      if (group.buffer[kNormal] != kNone) {
        const std::size_t pixels = size_[group.buffer[kNormal]] / 3;
        if (at[kDepth] == nullptr) {
          if (v == 0) group.seen.resize(views.size() * pixels);
          at[kDepth] = group.seen.data() + v * pixels;
          any = true;
        }
        normal_jobs_.push_back({v, g, camera, at[kDepth]});
      }
      if (group.buffer[kSemantic] != kNone) add_shares(views, v, group, camera);
      if (!any) {
        ++camera;
        return;
      }
      ++render_count_;
      return add(at);
    }
    ++render_count_;
    const std::size_t pixels = face_pixels(*group.cube);
    for (std::size_t k = 0; k < kKinds; ++k) {
      const std::size_t n =
          group.buffer[k] != kNone ? views.size() * CubeMap::kFaces * pixels * channels(k) : 0;
      if (v == 0) faces_[g][k].resize(n);
    }
    for (const std::size_t face : group.cube->faces()) {
      for (std::size_t k = 0; k < kKinds; ++k) {
        at[k] = group.buffer[k] != kNone
                    ? faces_[g][k].data() + (v * CubeMap::kFaces + face) * pixels * channels(k)
                    : nullptr;
      }
      add(at);
    }
  }

  void add_shares(std::span<const SensorView> views, std::size_t v, const Group& group,
                  std::size_t camera) {
    const MeshFrame& meshes = views[v].meshes;
    Shares s{v, group.buffer[kSemantic], {}, {}, {}};
    for (std::size_t pass = 0; pass < SemanticPasses<B>::count(things_in(views[v])); ++pass) {
      s.sets.push_back(semantic_.recolored(views[v].sets, pass));
      s.meshes.push_back(semantic_.recolored(meshes.instances, views[v].sets.size(), pass));
      FrameImages<float> out;
      out.rgb = s.images.emplace_back(SemanticPasses<B>::kChannels * size_[s.buffer]).data();
      jobs_.push_back(
          {s.sets.back(), &cameras_[camera], &share_configs_[v], out, {s.meshes.back(), meshes.light}});
      ++render_count_;
    }
    shares_.push_back(std::move(s));
  }

  /// What follows rendering, for one view: sampling cubes, cutting depth at the far plane, noise.
  void finish(const SensorView& view, std::size_t v, SensorImages<B>& images) {
    for (std::size_t g = 0; g < groups_.size(); ++g) {
      const Group& group = groups_[g];
      for (std::size_t k = 0; k < kSemantic; ++k) {
        if (group.buffer[k] == kNone) continue;
        const std::span<float> out(row(images, group.buffer[k], view.row), size_[group.buffer[k]]);
        if (group.cube != nullptr) sample(*group.cube, faces_[g][k].data(), v, k, out);
        if (k != kDepth) continue;
        const CutDepth cut(out.data(), sensors_[group.sensor].far_plane);
        for (std::size_t i = 0; i < out.size(); ++i) cut(i);
      }
    }
    for (std::size_t i = 0; i < sensors_.size(); ++i) {
      const NoiseModel& noise = sensors_[i].noise;
      if (noise.kind == NoiseKind::none) continue;
      const std::size_t n = size_[outputs_[i].clean];
      const std::span<const float> clean(row(images, outputs_[i].clean, view.row), n);
      const std::span<float> out(row(images, outputs_[i].noisy, view.row), n);
      // Hashed: seeds a step of the generator apart would give one stream, shifted.
      const std::uint64_t seed = Rng(view.noise + 0xd6e8feb86659fd93ull * (i + 1)).next();
      if (noise.kind == NoiseKind::redwood_depth) {
        redwood_depth(noise, seed, sensors_[i].resolution[0], sensors_[i].resolution[1], clean, out);
      } else {
        std::copy(clean.begin(), clean.end(), out.begin());
        add_gaussian_noise(noise, seed, out);
      }
    }
  }

  void sample(const CubeMap& cube, const float* faces, std::size_t v, std::size_t kind,
              std::span<float> out) const {
    const std::size_t step = face_pixels(cube) * channels(kind);
    std::array<const float*, CubeMap::kFaces> at{};
    for (std::size_t f = 0; f < CubeMap::kFaces; ++f) at[f] = faces + (v * CubeMap::kFaces + f) * step;
    if (kind == kDepth) {
      cube.sample_depth(at, out);
    } else {
      cube.sample_color(at, channels(kind), out);
    }
  }

  float* row(SensorImages<B>& images, std::size_t buffer, std::size_t r) const noexcept {
    float* const first =
        images.in_host_memory() ? images.buffers[buffer].data() : images.on_backend[buffer].data();
    return first + r * size_[buffer];
  }
  static std::size_t channels(std::size_t kind) noexcept {
    return static_cast<std::size_t>(channels_of(static_cast<SensorKind>(kind)));
  }
  static std::size_t face_pixels(const CubeMap& cube) noexcept {
    return static_cast<std::size_t>(cube.side()) * static_cast<std::size_t>(cube.side());
  }

  struct DetailJob {
    std::size_t job;
    const SceneDetail* detail;
  };
  struct NormalJob {
    std::size_t view, group, camera;
    const float* seen;
  };
  /// How much each set and mesh is of each pixel of one view.
  struct Shares {
    std::size_t view, buffer;
    std::vector<std::vector<GaussianSet>> sets;  // of each pass
    std::vector<std::vector<MeshInstance>> meshes;
    std::vector<std::vector<float>> images;
  };

  B* backend_;
  std::vector<SensorSpec> sensors_;
  FrameBatch<B> frames_;
  SemanticPasses<B> semantic_;
  MeshNormals<B> normals_;
  std::vector<Shares> shares_;
  std::vector<RenderConfig> share_configs_;  // of each view
  std::vector<Group> groups_;
  std::vector<Output> outputs_;    // of each sensor
  std::vector<std::size_t> size_;  // values in a row of each buffer
  std::vector<Camera> cameras_;
  std::vector<FrameJob<float>> jobs_;
  std::vector<NormalJob> normal_jobs_;
  std::vector<DetailJob> detail_jobs_;
  ChosenChunks<B> chosen_;
  std::vector<DetailSets> cuts_;  // of each of these
  std::vector<std::size_t> rows_;
  std::vector<std::array<HostArray<float, B>, kKinds>> faces_;  // [group][kind][view][face]
  std::size_t render_count_ = 0;
};

}  // namespace gsnav
