// SPDX-License-Identifier: Apache-2.0
// Every storage and every selection of rows, on every backend: the float32 images have the serial
// backend's bits. By `fast` a device has bits of its own, and a batch those of one camera.
#include <doctest/doctest.h>

#include <algorithm>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "gsnav/backends/serial.hpp"
#include "hard_cases/cases.hpp"
#include "scenes.hpp"
#include "support/frame_images.hpp"
#include "support/image_hashes.hpp"
#include "support/scenes.hpp"
#if defined(_OPENMP)
#include "gsnav/backends/openmp.hpp"
#endif
#if defined(GSNAV_HAS_CUDA)
#include "ops/cuda_batch_images.hpp"
#endif

using namespace gsnav;
using namespace gsnav_test;

namespace {

template <class S, class B>
Frames<S> draw(B& backend, const ImageScene& scene, const std::string& name) {
  const SceneThere<B> there(backend, scene);
  BasicRenderer<S, B> renderer(backend, there.config());
  renderer.set_meshes(there.meshes());
  Frames<S> frames = renderer.render(there.sets(), std::span(&scene.camera, 1)).value();
  record_hashes(frames, name + ", " + scene.name);
  return frames;
}

void check_same_bits(const Frames<float>& a, const Frames<float>& b) {
  for_each_image(a, b, [](const auto& x, const auto& y) { CHECK(x == y); });
}

bool shows_something(const Frames<float>& f) {
  for (const auto* image : {&f.rgb, &f.median_depth, &f.first_hit_depth}) {
    if (std::any_of(image->begin(), image->end(), [&](float v) { return v != image->front(); }))
      return true;
  }
  return false;
}

}  // namespace

TEST_CASE("images: every storage and selection of rows draws the same bits on every backend") {
  [[maybe_unused]] int by_regions_count = 0;
  for (const ImageScene& scene : image_scenes()) {
    CAPTURE(scene.name);
    SerialBackend serial;
    const Frames<float> reference = draw<float>(serial, scene, "serial");
    CHECK(all_finite(reference));
    CHECK(shows_something(reference));
    if (scene.config.quality.exponential == Exponential::exact) {
      const Frames<double> in_double = draw<double>(serial, scene, "serial double");
      if (!reference.rgb.empty()) CHECK(image_error(reference.rgb, in_double.rgb, 3).psnr > 80);
    }
#if defined(_OPENMP)
    OpenMPBackend openmp(2);
    check_same_bits(draw<float>(openmp, scene, "openmp"), reference);
#endif
#if defined(GSNAV_HAS_CUDA)
    if (scene.on_device && CudaBackend::device_count() > 0) {
      CudaBackend cuda;
      const SceneThere<CudaBackend> there(cuda, scene);
      const Frames<float> single = draw_by_stages<float>(cuda, there.sets(), std::span(&scene.camera, 1),
                                                         there.config(), {there.meshes(), {}});
      record_hashes(single, "cuda, " + scene.name);
      if (there.config().quality.exponential == Exponential::exact) {
        check_same_bits(single, reference);
      } else if (!reference.rgb
                      .empty()) {  // the device has an exponential of its own there (docs/notes/cuda.md)
        CHECK(image_error(single.rgb, reference.rgb, 3).psnr > 80);
      }
      BasicRenderer<float, CudaBackend> renderer(cuda, there.config());
      renderer.set_meshes(there.meshes());
      const Frames<float> one = renderer.render(there.sets(), std::span(&scene.camera, 1)).value();
      check_same_bits(one, single);
      record_hashes(one, (scene.in_batches ? "cuda batch, " : "cuda in no batch, ") + scene.name);
      if (!scene.in_batches) continue;
      CHECK(one.stats[0].visible == 0);  // A batch of one, which counts none.
      CudaBatchRenderer regions(cuda, there.config());
      regions.set_least_of_regions(1, 0);
      const Batch batch = draw_batch(cuda, regions, there.sets(), {scene.camera}, {},
                                     scene.config.outputs, false, {MeshFrame{there.meshes(), {}}});
      if (!batch.stats.by_regions) continue;
      ++by_regions_count;
      record_hashes(batch.frames, "cuda regions, " + scene.name);
      check_same_bits(batch.frames, single);
    }
#endif
  }
#if defined(GSNAV_HAS_CUDA)
  if (CudaBackend::device_count() > 0) CHECK(by_regions_count > 10);
#endif
}
