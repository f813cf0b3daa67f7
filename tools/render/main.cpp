// SPDX-License-Identifier: Apache-2.0
// gsnav-render: images of a scene of Gaussians from the cameras of a file.
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <iterator>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "gsnav/backends/openmp.hpp"
#include "gsnav/backends/serial.hpp"
#if defined(GSNAV_HAS_CUDA)
#include "gsnav/backends/cuda.hpp"
#endif
#include "gsnav/core/replace_file.hpp"
#include "gsnav/io/image_file.hpp"
#include "gsnav/scene/basic_renderer.hpp"
#include "gsnav/scene/prepare.hpp"
#include "gsnav/sim/basic_simulator.hpp"
#include "options.hpp"
#include "scene.hpp"

namespace {

using namespace gsnav;
using gsnav_render::DepthChoice;
using gsnav_render::fail;
using gsnav_render::Options;
using gsnav_render::Scene;

/// Depth in colours over the range asked for, or over the image's own from its 2nd to 98th percentile.
std::vector<std::uint8_t> depth_picture(const std::vector<float>& metres, const Options& o) {
  float near = static_cast<float>(o.depth_near), far = static_cast<float>(o.depth_far);
  if (!(far > near)) {
    std::vector<float> seen;
    std::copy_if(metres.begin(), metres.end(), std::back_inserter(seen), [](float z) { return z > 0; });
    std::sort(seen.begin(), seen.end());
    near = seen.empty() ? 0.0f : seen[seen.size() / 50];
    far = seen.empty() ? 0.0f : seen[seen.size() - 1 - seen.size() / 50];
    if (!(far > near)) far = near + 1.0f;
  }
  return io::colorize_depth(metres, near, far);
}

template <class B>
std::vector<MeshInstance> place_meshes(B& backend, const std::vector<PlacedMeshes>& meshes,
                                       std::vector<MeshArrays<B>>& mesh_arrays) {
  std::vector<MeshInstance> instances;
  std::size_t parts = 0;
  for (const PlacedMeshes& file : meshes) parts += file.meshes.size();
  mesh_arrays.reserve(parts);
  for (const PlacedMeshes& file : meshes) {
    const std::size_t first = mesh_arrays.size();
    for (std::size_t i = 0; i < file.meshes.size(); ++i)
      mesh_arrays.emplace_back(backend, file.meshes.view(i));
    for (const TexturedScene::Instance& i : file.instances) {
      const auto id = static_cast<std::uint32_t>(instances.size());
      instances.push_back(mesh_arrays[first + i.part].instance(i.world_from_part, id));
    }
  }
  return instances;
}

/// The files of one camera.
template <class S>
Status write_images(const Frames<S>& f, const Camera& camera, std::size_t index, const Options& o) {
  const DepthChoice& depth = o.depth_choice;
  const std::vector<S>& z = depth.output == kMedianDepth        ? f.median_depth
                            : depth.output == kExpectedDepth    ? f.expected_depth
                            : depth.output == kAccumulatedDepth ? f.accumulated_depth
                                                                : f.first_hit_depth;
  char number[24];
  std::snprintf(number, sizeof number, "%04zu", index);
  const std::filesystem::path stem = std::filesystem::path(o.out) / number;
  const std::vector<float> rgb(f.rgb.begin(), f.rgb.end()), alpha(f.alpha.begin(), f.alpha.end()),
      metres(z.begin(), z.end());
  const std::vector<std::size_t> image{f.height, f.width}, color{f.height, f.width, 3};
  Status s;
  const auto keep = [&](Status next) {
    if (s.ok()) s = std::move(next);
  };
  if (o.npy) {
    keep(io::save_npy(stem.string() + ".rgb.npy", rgb, color));
    keep(io::save_npy(stem.string() + ".depth.npy", metres, image));
    keep(io::save_npy(stem.string() + ".alpha.npy", alpha, image));
  }
  if (o.png) {
    const int w = camera.width, h = camera.height;
    keep(io::save_png_rgb(stem.string() + ".rgb.png", rgb, w, h));
    keep(io::save_png_rgb8(stem.string() + ".depth.png", depth_picture(metres, o), w, h));
  }
  return s;
}

RenderConfig config_of(const Options& o, const Scene& scene) {
  RenderConfig config;
  config.outputs = kRgb | kAlpha | o.depth_choice.output;
  config.quality = o.profile == "exact" ? Quality::exact() : Quality::fast();
  if (scene.tree) config = lod_config(config);
  config.quality.max_alpha = o.max_alpha;
  config.first_hit_tau = o.depth_choice.tau;
  config.sort_order = scene.report.sort_order;
  config.composite = o.composite == "merged" ? Composite::merged : Composite::hard_depth;
  return config;
}

/// The cloud as frames choose from it; `whole` is where the backend has it, as it will have the rest.
template <class B>
SceneDetail::Asset asset_of(B& backend, const GaussianCloud& cloud, const Scene& scene,
                            const GaussianSet& whole, std::optional<GaussianArrays<B>>& merged,
                            Buffer<std::uint32_t, B>& visible) {
  SceneDetail::Asset asset{scene.tree ? &*scene.tree : nullptr, &cloud, {}};
  asset.visible = scene.visible ? &*scene.visible : nullptr;
  if constexpr (!is_host_backend<B>) {
    if (scene.visible) {
      visible.upload(scene.visible->bits.data(), scene.visible->bits.size());
      asset.visible_there = visible.data();
    }
    if (scene.tree) {
      asset.cloud_there = whole.gaussians;
      asset.merged_there = merged.emplace(backend, scene.tree->merged).set().gaussians;
    }
  }
  return asset;
}

/// `Cloud`: GaussianCloud or PackedCloud.
template <class S, class B, class Cloud>
int run(B& backend, const Options& o, const Cloud& cloud, const Scene& scene) {
  const std::vector<Camera>& cameras = scene.cameras;
  const LodTree* const tree = scene.tree ? &*scene.tree : nullptr;
  const VisibleSets* const visible_sets = scene.visible ? &*scene.visible : nullptr;
  const RenderConfig config = config_of(o, scene);
  BasicRenderer<S, B> renderer(backend, config);
  const bool profiled = is_host_backend<B> || tree == nullptr;
  const GaussianArrays<B> arrays =
      profiled ? GaussianArrays<B>(backend, cloud, scene.profile) : GaussianArrays<B>(backend, cloud);
  const std::vector<GaussianSet> whole{arrays.set()};
  const GaussianSet whole_here = cloud.set();  // in host memory, as cuts are
  std::span<const GaussianSet> sets = whole,
                               here = is_host_backend<B> ? sets : std::span(&whole_here, 1);
  SceneDetail detail;
  detail.choice.pixels = o.lod_pixels;
  std::optional<GaussianArrays<B>> merged;
  Buffer<std::uint32_t, B> visible(backend);
  if constexpr (std::is_same_v<Cloud, GaussianCloud>) {
    if (tree != nullptr || visible_sets != nullptr) {
      detail.assets.push_back(asset_of(backend, cloud, scene, whole[0], merged, visible));
    }
  }
  GaussianSet seen_here = whole_here;
  DetailSets details;
  ChosenChunks<B> chosen(backend);
  std::vector<MeshArrays<B>> mesh_arrays;
  const std::vector<MeshInstance> instances = place_meshes(backend, scene.meshes, mesh_arrays);
  MeshLight headlight;
  headlight.unlit = false;
  Frames<S> f;
  double total_ms = 0;
  const bool terminal = isatty(fileno(stdout)) != 0;
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    const auto start = std::chrono::steady_clock::now();
    headlight.direction = -cameras[c].viewmat.linear.row[2];
    renderer.set_meshes(instances, headlight);
    const LodCut* cut = nullptr;
    if (!detail.assets.empty()) {
      sets = details.select(detail, whole, cameras[c]);
      chosen.place(std::span(&details, 1));
      if (tree != nullptr) {
        cut = &details.cut(0);
        here = cut->sets();
      } else if (is_host_backend<B>) {
        here = sets;
      } else if (const auto cell = visible_sets->cell_of(cameras[c])) {
        seen_here = whole_here;
        seen_here.selection.seen = visible_sets->seen_from(*cell);
        here = std::span(&seen_here, 1);
      }
      renderer.set_config(details.rules(config));
    }
    if (const Status s = renderer.render(sets, std::span(&cameras[c], 1), f); !s) {
      std::fprintf(stderr, "gsnav-render: camera %zu: %s\n", c, s.message().c_str());
      return 1;
    }
    const auto end = std::chrono::steady_clock::now();
    total_ms += std::chrono::duration<double, std::milli>(end - start).count();
    if (o.ledger) {
      FrameLedger l = frame_ledger(here, cameras[c], renderer.config(), f.stats[0], &scene.report,
                                   &scene.profile, cut);
      l.unseen = details.unseen();
      if (visible_sets != nullptr) l.unseen_weight = visible_sets->min_weight;
      std::printf("camera %zu:\n%s", c, ledger_text(l).c_str());
    }
    if (const Status s = write_images(f, cameras[c], c, o); !s.ok()) return fail(s.message());
    if (terminal || c + 1 == cameras.size()) {
      std::printf("%s%zu/%zu views, %.1f ms a view", terminal ? "\r" : "", c + 1, cameras.size(),
                  total_ms / static_cast<double>(c + 1));
      std::fflush(stdout);
    }
  }
  std::printf("\n");
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  Options o;
  if (const auto status = gsnav_render::parse_options(argc, argv, o)) return *status;
  if (Status s = make_output_folder(o.out); !s) return fail("--out " + s.message());
  OpenMPBackend openmp(o.threads);
  const auto scene = gsnav_render::load_scene(openmp, o);
  if (!scene) return fail(scene.message());
  const auto on = [&]<class S>(auto& backend) {
    return scene->packed ? run<S>(backend, o, *scene->packed, *scene)
                         : run<S>(backend, o, scene->full, *scene);
  };
  SerialBackend serial;
  if (o.backend == "serial") return on.operator()<float>(serial);
  if (o.backend == "serial64") return on.operator()<double>(serial);
#if defined(GSNAV_HAS_CUDA)
  if (o.backend == "cuda") {
    CudaBackend cuda;
    return on.operator()<float>(cuda);
  }
#endif
  return on.operator()<float>(openmp);
}
