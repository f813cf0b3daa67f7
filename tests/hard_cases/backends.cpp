// SPDX-License-Identifier: Apache-2.0
// What hard cases draw with, compiled once.
#include "hard_cases/backends.hpp"

#include <algorithm>
#include <functional>

#include "hard_cases/arrays.hpp"
#include "hard_cases/fast_images.hpp"
#include "ops/stage_frames.hpp"
#include "support/image_hashes.hpp"
#if defined(GSNAV_HAS_CUDA)
#include "ops/cuda_batch_images.hpp"
#endif

namespace gsnav_test {

using namespace gsnav;

namespace {

/// A scene in the memory of a backend.
template <class B>
struct Uploaded {
  std::vector<GaussianArrays<B>> arrays;
  std::vector<GaussianSet> sets;
  std::vector<MeshArrays<B>> mesh_arrays;
  std::vector<MeshInstance> instances;

  Uploaded(B& backend, const std::vector<Placed>& scene, const std::vector<MeshInstance>& meshes) {
    arrays.reserve(scene.size());
    for (const Placed& p : scene) sets.push_back(arrays.emplace_back(backend, *p.cloud).set(p.place));
    mesh_arrays.reserve(meshes.size());
    for (const MeshInstance& m : meshes) {
      instances.push_back(mesh_arrays.emplace_back(backend, m.mesh).instance(m.world_from_mesh, m.id));
    }
  }
};

/// A cloud with extras in the memory of a backend.
template <class B>
struct UploadedExtras {
  GaussianArrays<B> arrays;
  Arrays<B> more;
  GaussianSet set;

  UploadedExtras(B& backend, const GaussianCloud& cloud, const SetExtras& extras)
      : arrays(backend, cloud), more(backend), set(arrays.set()) {
    for (std::size_t k = 0; k < 4 && !extras.sh_rotations[0].empty(); ++k) {
      set.gaussians.color.rotations.set(k, more.in(extras.sh_rotations[k]));
    }
    for (std::size_t k = 0; k < 9 && !extras.axes[0].empty(); ++k)
      set.gaussians.shape.axes.set(k, more.in(extras.axes[k]));
  }
};

/// Draws by BasicRenderer. On a backend with a renderer of batches, which BatchCases draws with, by the
/// stages.
template <class S, class B>
Frames<S> draw(B& backend, std::span<const GaussianSet> sets, std::span<const Camera> cameras,
               const RenderConfig& config, std::span<const MeshInstance> meshes) {
  if constexpr (BatchBackend<B>) {
    return draw_by_stages<S>(backend, sets, cameras, config, {meshes, {}});
  } else {
    BasicRenderer<S, B> renderer(backend, config);
    renderer.set_meshes(meshes);
    return renderer.render(sets, cameras).value();
  }
}

}  // namespace

template <class S, class B>
Frames<S> CaseRenderer<S, B>::render(const std::vector<Placed>& scene,
                                     const std::vector<Camera>& cameras, const RenderConfig& config,
                                     const std::vector<MeshInstance>& meshes) {
  const Uploaded<B> there(*backend_, scene, meshes);
  Frames<S> frames = draw<S>(*backend_, there.sets, cameras, config, there.instances);
  REQUIRE(frames.stats.size() == cameras.size());  // only batches have none
  record_hashes(frames, this->name());
  if constexpr (std::is_same_v<S, double>) {
    const auto in_float = [&](const RenderConfig& how) {
      return draw<float>(*backend_, there.sets, cameras, how, there.instances);
    };
    if (judges_fast(config)) {
      const Frames<float> fast = in_float(fast_of(config));
      record_hashes(fast, this->name() + ", fast");
      check_fast(fast, in_float(config), frames);
    }
  }
  return frames;
}

template <class S, class B>
Frames<S> CaseRenderer<S, B>::render_with(const GaussianCloud& cloud, const SetExtras& extras,
                                          const Camera& camera, const RenderConfig& config) {
  const UploadedExtras<B> there(*backend_, cloud, extras);
  Frames<S> frames = draw<S>(*backend_, std::span(&there.set, 1), std::span(&camera, 1), config, {});
  REQUIRE(frames.stats.size() == 1);
  record_hashes(frames, this->name());
  return frames;
}

#if defined(GSNAV_HAS_CUDA)
namespace {

/// Whether some image of this run was drawn by lists of regions.
bool by_regions_somewhere = false;

/// Ends a run of "cuda regions" alone with an error if no image was drawn by regions: it then shows
/// nothing about them.
void expect_regions() {
  const char* const wanted = std::getenv("GSNAV_CASES_ON");
  if (wanted == nullptr || std::string_view(wanted) != "cuda regions") return;
  static const int once = std::atexit([] {
    if (by_regions_somewhere) return;
    std::fputs("no image was drawn by lists of regions\n", stderr);
    std::_Exit(3);
  });
  (void)once;
}

/// How a batch is drawn: by the small tiles of few cameras, by the tiles of many cameras, or by lists of
/// regions where the frame allows them.
enum class BatchWay { few, many, regions };

/// The most tiles of a call of few cameras with small images, on any GPU or on the emulated one.
std::size_t most_of_few() { return is_emulated() ? 32 * 4 : 32 * 192; }

/// Cameras that see nothing. With them, a call of `cameras` counts as one of many cameras. Images of
/// more than 512 tiles need none.
std::vector<Camera> blind_cameras(const std::vector<Camera>& cameras) {
  const std::size_t tiles = TileGrid::of(cameras[0].width, cameras[0].height, 16).count();
  const std::size_t wanted = (most_of_few() + tiles) / tiles;
  if (tiles > 512 || wanted <= cameras.size()) return {};
  Camera blind = cameras[0];
  blind.near_plane = 1e30;
  return std::vector<Camera>(wanted - cameras.size(), blind);
}

/// Renders by CudaBatchRenderer. What no batch supports is rendered by BasicRenderer.
class BatchCases final : public CaseImages<float> {
 public:
  BatchCases(const char* name, BatchWay way) : CaseImages<float>(name), way_(way) {}

  using CaseImages<float>::render;
  Frames<float> render(const std::vector<Placed>& scene, const std::vector<Camera>& cameras,
                       const RenderConfig& config, const std::vector<MeshInstance>& meshes) override {
    const Uploaded<CudaBackend> there(cuda_, scene, meshes);
    return draw(there.sets, cameras, config, {there.instances, {}});
  }
  Frames<float> render_with(const GaussianCloud& cloud, const SetExtras& extras, const Camera& camera,
                            const RenderConfig& config) override {
    const UploadedExtras<CudaBackend> there(cuda_, cloud, extras);
    return draw({there.set}, {camera}, config, {});
  }

 private:
  Frames<float> draw(const std::vector<GaussianSet>& sets, const std::vector<Camera>& cameras,
                     const RenderConfig& config, const MeshFrame& meshes) {
    const auto same_size = [&](const Camera& c) {
      return c.width == cameras[0].width && c.height == cameras[0].height;
    };
    if (!CudaBatchRenderer::supports(config, sets, meshes) ||
        !std::all_of(cameras.begin(), cameras.end(), same_size)) {
      BasicRenderer<float, CudaBackend> renderer(cuda_, config);
      renderer.set_meshes(meshes.instances);
      Frames<float> frames = renderer.render(sets, cameras).value();
      record_hashes(frames, name() + ", in no batch");
      return frames;
    }
    std::vector<Camera> all = cameras;
    if (way_ == BatchWay::many) {
      const std::vector<Camera> blind = blind_cameras(cameras);
      all.insert(all.end(), blind.begin(), blind.end());
    }
    const auto drawn = [&](unsigned outputs, bool by_regions) {
      CudaBatchRenderer renderer(cuda_, config);
      renderer.set_least_of_regions(by_regions ? 1 : all.size() + 1, 0);
      Batch batch = draw_batch(cuda_, renderer, sets, all, {}, outputs, false,
                               std::vector<MeshFrame>(all.size(), meshes));
      if (batch.stats.by_regions) by_regions_somewhere = true;
      for_each_image(batch.frames, batch.frames, [&](std::vector<float>& image, const auto&) {
        image.resize(image.size() / all.size() * cameras.size());
      });
      return std::move(batch.frames);
    };
    // Regions draw no depths but the median, so that the others are drawn by tiles.
    const bool regions = way_ == BatchWay::regions;
    const unsigned by_tiles = regions ? config.outputs & kAnyDepth & ~kMedianDepth : 0u;
    Frames<float> frames = drawn(config.outputs & ~by_tiles, regions);
    if (by_tiles != 0) {
      Frames<float> rest = drawn(by_tiles, false);
      frames.expected_depth = std::move(rest.expected_depth);
      frames.accumulated_depth = std::move(rest.accumulated_depth);
      frames.first_hit_depth = std::move(rest.first_hit_depth);
    }
    frames.cameras = cameras.size();
    frames.width = static_cast<std::size_t>(cameras[0].width);
    frames.height = static_cast<std::size_t>(cameras[0].height);
    record_hashes(frames, name());
    return frames;
  }

  BatchWay way_;
  CudaBackend cuda_;
};

}  // namespace
#endif

template class CaseRenderer<float, SerialBackend>;
template class CaseRenderer<double, SerialBackend>;
template class CaseRenderer<float, ToyBackend>;
#if defined(_OPENMP)
template class CaseRenderer<float, OpenMPBackend>;
#endif
#if defined(GSNAV_HAS_CUDA)
template class CaseRenderer<float, CudaBackend>;
#endif

void visit_renderers(const std::function<void(CaseImages<float>&)>& in_float,
                     const std::function<void(CaseImages<double>&)>& in_double) {
  for_each_backend([&](auto& renderer) {
    if constexpr (std::remove_reference_t<decltype(renderer)>::is_float) {
      in_float(renderer);
    } else {
      in_double(renderer);
    }
  });
#if defined(GSNAV_HAS_CUDA)
  if (CudaBackend::device_count() == 0) return;
  // A batch has much memory to prepare, which takes an emulated GPU minutes. `images` draws batches
  // there.
  if (is_emulated() && std::getenv("GSNAV_CASES_ON") == nullptr &&
      std::getenv("GSNAV_IMAGE_HASHES") == nullptr) {
    static const int once = std::printf("SKIP: hard cases in batches on the emulated GPU\n");
    (void)once;
    return;
  }
  expect_regions();
  run_if_wanted(BatchCases("cuda tiles float", BatchWay::few), in_float);
  run_if_wanted(BatchCases("cuda many float", BatchWay::many), in_float);
  run_if_wanted(BatchCases("cuda regions float", BatchWay::regions), in_float);
#endif
}

void check_bits(const Frames<float>& frames, Frames<float>& reference) {
  if (reference.cameras == 0) reference = frames;
  for_each_image(frames, reference, [](const auto& a, const auto& b) { CHECK(a == b); });
}

std::vector<bool> undecided_pixels(const std::vector<Placed>& scene, const Camera& camera,
                                   const RenderConfig& config, double relative) {
  CaseRenderer<double, SerialBackend> serial("serial double");
  RenderConfig low = config, high = config;
  low.outputs = high.outputs = kRgb | kAlpha | kMedianDepth;
  low.quality.alpha_min *= 1 - relative;
  high.quality.alpha_min *= 1 + relative;
  low.quality.transmittance_min *= 1 - relative;
  high.quality.transmittance_min *= 1 + relative;
  const auto a = serial.render(scene, camera, low), b = serial.render(scene, camera, high);
  std::vector<bool> out(a.alpha.size());
  for (std::size_t p = 0; p < out.size(); ++p) {
    out[p] = a.alpha[p] != b.alpha[p] || a.median_depth[p] != b.median_depth[p];
  }
  return out;
}

}  // namespace gsnav_test
