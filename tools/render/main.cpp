// SPDX-License-Identifier: Apache-2.0
// gsnav-render: images of a scene of Gaussians from the cameras of a file.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
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

#include "../common/parse_options.hpp"
#include "gsnav/backends/openmp.hpp"
#include "gsnav/backends/serial.hpp"
#if defined(GSNAV_HAS_CUDA)
#include "gsnav/backends/cuda.hpp"
#endif
#include "gsnav/core/lower_case.hpp"
#include "gsnav/core/replace_file.hpp"
#include "gsnav/io.hpp"
#include "gsnav/io/image_file.hpp"
#include "gsnav/io/scene_file.hpp"
#include "gsnav/render.hpp"
#include "gsnav/scene/lod_cut.hpp"
#include "gsnav/scene/prepare.hpp"
#include "gsnav/scene/renderer.hpp"
#include "gsnav/sim.hpp"
#include "gsnav/sim/simulator.hpp"

namespace {

using namespace gsnav;

struct Options {
  std::string scene, cameras, out, backend = "openmp", profile = "exact", depth = "median",
                                   composite = "merged", storage = "full", lod_levels = "shipped",
                                   visible_sets;
  std::vector<std::string> meshes;
  int width = 0, height = 0, threads = 0, orbit = 4;
  double time = 0, near_plane = 0.2, max_alpha = 0.99, depth_near = 0, depth_far = 0,
         lod_pixels = LodChoice{}.pixels;
  bool npy = false, png = false, ledger = false;
};

/// What is known of the cloud that is drawn.
struct Scene {
  const LoadReport& report;
  const SceneProfile& profile;
  const LodTree* tree;         ///< where the profile is lod
  const VisibleSets* visible;  ///< where some are given
};

/// Which image --depth names; first hit may carry its tau.
struct DepthChoice {
  unsigned output = kMedianDepth;
  double tau = 0.5;
};

std::optional<DepthChoice> parse_depth(const std::string& text) {
  if (text == "median") return DepthChoice{kMedianDepth, 0.5};
  if (text == "expected") return DepthChoice{kExpectedDepth, 0.5};
  if (text == "accumulated") return DepthChoice{kAccumulatedDepth, 0.5};
  if (text == "first") return DepthChoice{kFirstHitDepth, 0.5};
  if (text.rfind("first:", 0) == 0) {
    try {
      std::size_t used = 0;
      const double tau = std::stod(text.substr(6), &used);
      if (used == text.size() - 6 && tau > 0 && tau < 1) return DepthChoice{kFirstHitDepth, tau};
    } catch (const std::exception&) {
    }
  }
  return std::nullopt;
}

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

/// `Cloud`: GaussianCloud or PackedCloud.
template <class S, class B, class Cloud>
int run(B& backend, const Options& o, const DepthChoice& depth, const Cloud& cloud, const Scene& scene,
        const std::vector<PlacedMeshes>& meshes, const std::vector<Camera>& cameras) {
  RenderConfig config;
  config.outputs = kRgb | kAlpha | depth.output;
  config.quality = o.profile == "exact" ? Quality::exact() : Quality::fast();
  if (scene.tree != nullptr) config = lod_config(config);
  config.quality.max_alpha = o.max_alpha;
  config.first_hit_tau = depth.tau;
  config.sort_order = scene.report.sort_order;
  config.composite = o.composite == "merged" ? Composite::merged : Composite::hard_depth;
  Renderer<S, B> renderer(backend, config);
  const bool profiled = is_host_backend<B> || scene.tree == nullptr;
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
    if (scene.tree != nullptr || scene.visible != nullptr) {
      detail.assets.push_back({scene.tree, &cloud, {}});
      SceneDetail::Asset& asset = detail.assets[0];
      asset.visible = scene.visible;
      if constexpr (!is_host_backend<B>) {
        if (scene.visible != nullptr) {
          visible.upload(scene.visible->bits.data(), scene.visible->bits.size());
          asset.visible_there = visible.data();
        }
        if (scene.tree != nullptr) {
          asset.cloud_there = whole[0].gaussians;
          asset.merged_there = merged.emplace(backend, scene.tree->merged).set().gaussians;
        }
      }
    }
  }
  GaussianSet seen_here = whole_here;
  DetailSets details;
  ChosenChunks<B> chosen(backend);
  std::vector<MeshArrays<B>> mesh_arrays;
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
      if (scene.tree != nullptr) {
        cut = &details.cut(0);
        here = cut->sets();
      } else if (is_host_backend<B>) {
        here = sets;
      } else if (const auto cell = scene.visible->cell_of(cameras[c])) {
        seen_here = whole_here;
        seen_here.selection.seen = scene.visible->seen_from(*cell);
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
      if (scene.visible != nullptr) l.unseen_weight = scene.visible->min_weight;
      std::printf("camera %zu:\n%s", c, ledger_text(l).c_str());
    }
    const std::vector<S>& z = depth.output == kMedianDepth        ? f.median_depth
                              : depth.output == kExpectedDepth    ? f.expected_depth
                              : depth.output == kAccumulatedDepth ? f.accumulated_depth
                                                                  : f.first_hit_depth;
    char number[24];
    std::snprintf(number, sizeof number, "%04zu", c);
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
      const int w = cameras[c].width, h = cameras[c].height;
      keep(io::save_png_rgb(stem.string() + ".rgb.png", rgb, w, h));
      keep(io::save_png_rgb8(stem.string() + ".depth.png", depth_picture(metres, o), w, h));
    }
    if (!s) {
      std::fprintf(stderr, "gsnav-render: %s\n", s.message().c_str());
      return 1;
    }
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
  CLI::App app{
      "Renders a scene of 3D Gaussians from the cameras of an INRIA cameras.json or from around it. "
      "Writes NNNN.rgb.npy "
      "(H, W, 3 float32, unclamped), NNNN.depth.npy and NNNN.alpha.npy (H, W float32; metres, 0 = no "
      "return) and PNG pictures. The scene is used in its own frame: no up axis is applied."};
  app.add_option("--scene", o.scene,
                 "Any scene of Gaussians that can be read, or a folder's sibling tiles: DIR/2_0,2_1,2_2")
      ->required();
  app.add_option("--time", o.time, "Moment of a scene that moves (4D Gaussians), seconds");
  app.add_option("--storage", o.storage,
                 "full; compact: SH in half of the memory; packed: all in a third (docs/formats.md)")
      ->check(CLI::IsMember({"full", "compact", "packed"}))
      ->capture_default_str();
  app.add_option("--cameras", o.cameras,
                 "INRIA cameras.json (camera-to-world, OpenCV axes); without it --orbit views around "
                 "the scene, upright by "
                 "the guess of which way is up");
  app.add_option("--orbit", o.orbit, "Number of views around the scene where no --cameras are given")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  app.add_option("--out", o.out, "Folder for the images; made where it does not exist")->required();
  app.add_option("--width", o.width, "Image width; with --height, focal lengths scale by it")
      ->check(CLI::Range(1, kMaxImageSide));
  app.add_option("--height", o.height, "Image height")->check(CLI::Range(1, kMaxImageSide));
  app.add_option("--near", o.near_plane,
                 "Gaussians whose centre is not beyond this are not drawn, metres")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--backend", o.backend,
                 "serial (float32), serial64 (the float64 reference), openmp, cuda")
      ->check(CLI::IsMember({"serial", "serial64", "openmp", "cuda"}))
      ->capture_default_str();
  app.add_option("--profile", o.profile,
                 "exact, fast (docs/accuracy.md), or lod: a level of detail for each part of the scene "
                 "(docs/lod.md)")
      ->check(CLI::IsMember({"exact", "fast", "lod"}))
      ->capture_default_str();
  app.add_option("--lod-error", o.lod_pixels,
                 "Of the profile lod: how far merged Gaussians may be off, pixels")
      ->check(CLI::Range(0.01, 100.0))
      ->capture_default_str();
  app.add_option("--lod-levels", o.lod_levels,
                 "Of the profile lod: shipped, those that a streamed set has, where it has any; built: "
                 "the tree of its finest")
      ->check(CLI::IsMember({"shipped", "built"}))
      ->capture_default_str();
  app.add_option("--visible-sets", o.visible_sets,
                 "Of the profiles fast and lod: file of what is seen from where (gsnav-navmesh writes "
                 "it); the rest is "
                 "not drawn")
      ->check(CLI::ExistingFile);
  app.add_flag("--ledger", o.ledger,
               "Print what each frame skipped, merged, limited and rounded, and by how much");
  app.add_option("--depth", o.depth, "median, expected, accumulated, first or first:TAU")
      ->capture_default_str();
  app.add_option("--max-alpha", o.max_alpha, "Largest alpha of one Gaussian at a pixel")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  app.add_option("--mesh", o.meshes,
                 "Triangle meshes among the Gaussians (.gltf and .glb with colours and textures; .obj "
                 "and .ply grey), in the "
                 "scene's frame, lit from the camera (docs/composition.md)");
  app.add_option("--composite", o.composite, "merged, or hard_depth: Habitat-GS's rule, to compare with")
      ->check(CLI::IsMember({"merged", "hard_depth"}))
      ->capture_default_str();
  app.add_option("--threads", o.threads, "Threads of the openmp backend; 0: OMP_NUM_THREADS")
      ->check(CLI::Range(0, 1024));
  app.add_option("--depth-near", o.depth_near, "Depth picture: nearest metre of the colour scale");
  app.add_option("--depth-far", o.depth_far,
                 "Depth picture: farthest; 0: the image's own range (2nd to 98th percentile)");
  app.add_flag("--npy", o.npy, "Write NPY arrays");
  app.add_flag("--png", o.png, "Write PNG pictures (both are written where neither flag is given)");
  if (const auto status = gsnav_tools::parse_options(app, argc, argv)) return *status;

  if (!o.npy && !o.png) o.npy = o.png = true;
  const auto fail = [](const std::string& message) {
    std::fprintf(stderr, "gsnav-render: %s\n", printable(message).c_str());
    return 1;
  };
  const std::optional<DepthChoice> depth = parse_depth(o.depth);
  if (!depth) {
    return fail("--depth " + o.depth +
                ": use median, expected, accumulated, first or first:TAU, 0 < TAU < 1");
  }
  if ((o.width > 0) != (o.height > 0)) return fail("--width and --height go together");
#if defined(GSNAV_HAS_CUDA)
  if (o.backend == "cuda" && CudaBackend::device_count() == 0) {
    return fail("--backend cuda: no GPU, or no driver for it; use openmp");
  }
#else
  if (o.backend == "cuda") return fail("--backend cuda: this build has no CUDA backend; use openmp");
#endif

  if (Status s = make_output_folder(o.out); !s) return fail("--out " + s.message());
  io::LoadSceneOptions load;
  load.time = o.time;
  load.storage = o.storage == "compact" ? io::Storage::compact : io::Storage::full;
  GaussianCloud full;
  std::optional<PackedCloud> packed;
  std::optional<LodTree> shipped;
  LoadReport report;
  if (o.profile == "lod" && o.storage == "packed") {
    return fail("--profile lod: not with --storage packed; use full or compact");
  }
  if (o.profile == "lod" && o.lod_levels == "shipped") {
    auto set = io::load_shipped_levels(o.scene, load);
    if (!set) return fail(set.message());
    if (*set) {
      full = std::move((*set)->cloud);
      report = std::move((*set)->report);
      shipped = std::move((*set)->tree);
    }
  }
  if (shipped) {
    std::printf("levels of detail: %zu, %.1f MB, shipped\n", shipped->levels(),
                static_cast<double>(shipped->bytes()) * 1e-6);
  } else if (o.storage == "packed") {
    auto scene = io::load_packed_scene(o.scene, load);
    if (!scene) return fail(scene.message());
    packed = std::move(scene->cloud);
    report = std::move(scene->report);
  } else {
    auto scene = io::load_scene(o.scene, load);
    if (!scene) return fail(scene.message());
    full = std::move(scene->cloud);
    report = std::move(scene->report);
  }
  std::fputs(io::report_text(report).c_str(), stdout);
  std::vector<PlacedMeshes> meshes;
  for (const std::string& file : o.meshes) {
    auto surface = io::load_textured_scene(file);
    if (!surface) return fail(surface.message());
    const std::string kind = lower_case(std::filesystem::path(file).extension().string());
    std::size_t triangles = 0;
    for (TexturedPart& part : surface->parts) {
      triangles += part.geometry.triangles.size();
      // What says nothing of its looks is grey.
      if (kind == ".obj" || kind == ".ply") part.material = {{0.5, 0.5, 0.5}, 0, -1, true, false};
    }
    auto placed = placed_meshes(std::move(*surface));
    if (!placed) return fail(file + ": " + placed.message());
    std::printf("%s: %zu triangles in %zu places\n", printable(file).c_str(), triangles,
                placed->instances.size());
    for (const std::string& w : placed->warnings)
      std::printf("%s: %s\n", printable(file).c_str(), printable(w).c_str());
    meshes.push_back(std::move(*placed));
  }
  const auto orbit = [&]() -> Result<std::vector<Camera>> {
    const int w = o.width > 0 ? o.width : 640, h = o.height > 0 ? o.height : 480;
    if (packed) return views_around(report.bounds, report.up, o.orbit, w, h);
    return views_around(full, report.up, o.orbit, w, h);
  };
  auto cameras = o.cameras.empty() ? orbit() : io::load_cameras(o.cameras, o.width, o.height);
  if (!cameras) return fail(cameras.message());
  for (Camera& c : *cameras) c.near_plane = o.near_plane;
  std::optional<io::CachedLod> lod;
  OpenMPBackend openmp(o.threads);
  if (o.profile == "lod" && !shipped) {
    LodSettings settings;
    const bool terminal = isatty(fileno(stdout)) != 0;
    settings.progress = [terminal](double share) {
      if (terminal) std::printf("\rbuilding levels of detail: %.0f %%", 100 * share);
      if (terminal) std::fflush(stdout);
    };
    auto made =
        io::cached_lod(o.scene, full, settings, [&] { return build_lod(openmp, full, settings); });
    if (!made) return fail(made.message());
    lod = std::move(*made);
    std::printf("%slevels of detail: %zu, %.1f MB, %s\n", terminal && lod->built ? "\r" : "",
                lod->tree.levels(), static_cast<double>(lod->tree.bytes()) * 1e-6,
                lod->built ? "built" : "read");
    if (!lod->warning.empty()) std::printf("%s\n", lod->warning.c_str());
  }
  std::optional<VisibleSets> visible;
  if (!o.visible_sets.empty()) {
    if (o.profile == "exact")
      return fail("--visible-sets: sampled, so not for --profile exact; use fast or lod");
    if (packed) return fail("--visible-sets: not with --storage packed; use full or compact");
    auto sets = io::load_visible_sets(o.visible_sets, full);
    if (!sets) return fail(sets.message());
    std::printf("%s: %zu cells, from %zu viewpoints\n", printable(o.visible_sets).c_str(), sets->cells(),
                sets->viewpoints);
    visible = std::move(*sets);
  }
  // What cannot be seen is not held and not read; in exact, what is zero.
  const auto fit = [unseen = o.profile == "exact" ? 0 : kUnseenColor](auto& cloud) {
    SceneProfile made = profile_scene(cloud, unseen);
    drop_bands(cloud, made);
    return made;
  };
  SceneProfile profile = packed ? fit(*packed) : fit(full);
  LodTree* const tree = shipped ? &*shipped : lod ? &lod->tree : nullptr;
  if (tree != nullptr) {
    const SceneProfile merged = fit(tree->merged);
    profile.bytes_let_go += merged.bytes_let_go;
    profile.color_error = std::max(profile.color_error, merged.color_error);
  }
  if (profile.sh_numbers != 0) {
    std::array<std::size_t, kMaxShDegree + 1> chunks{};
    for (const std::uint8_t degree : profile.chunk_sh_degrees) ++chunks[degree];
    std::printf(
        "SH: %zu, %zu, %zu, %zu chunks need degree 0 to 3; %llu bytes let go that none needs, %llu held "
        "that only others "
        "need\n",
        chunks[0], chunks[1], chunks[2], chunks[3],
        static_cast<unsigned long long>(profile.bytes_let_go),
        static_cast<unsigned long long>(profile.bytes_unneeded));
  }
  const Scene drawn{report, profile, tree, visible ? &*visible : nullptr};

  const auto on = [&]<class S>(auto& backend) {
    return packed ? run<S>(backend, o, *depth, *packed, drawn, meshes, *cameras)
                  : run<S>(backend, o, *depth, full, drawn, meshes, *cameras);
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
