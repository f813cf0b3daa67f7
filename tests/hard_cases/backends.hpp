// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdio>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "gsnav/math/pack.hpp"
#include "gsnav/scene/mesh_scene.hpp"
#include "ops/backends.hpp"
#include "support/frame_images.hpp"
#include "support/image_hashes.hpp"
#if defined(GSNAV_HAS_CUDA)
#include "gsnav/backends/cuda.hpp"
#endif

// What a hard case runs on. A backend joins all of them by one line in `for_each_renderer`.

namespace gsnav_test {

/// A cloud and where it stands in the world.
struct Placed {
  Placed(const gsnav::GaussianCloud* c, const gsnav::Similarity& p = {}) : cloud(c), place(p) {}
  const gsnav::GaussianCloud* cloud;
  gsnav::Similarity place;
};

/// One backend in one precision, with a name for messages. `epsilon`: a rounding of the scalar.
template <class S, class B>
class CaseRenderer {
 public:
  using scalar = S;
  template <class... Args>
  explicit CaseRenderer(const char* name, Args&&... args)
      : name_(name), backend_(std::make_unique<B>(std::forward<Args>(args)...)) {}

  std::string name() const { return name_; }
  static constexpr bool is_float = sizeof(S) == sizeof(float);
  static constexpr bool composes = gsnav::MeshBackend<B, S>;
  static constexpr double epsilon = is_float ? 0x1p-24 : 0x1p-53;
  /// The bound for the scalar at hand.
  static constexpr double bound(double in_float, double in_double) noexcept {
    return is_float ? in_float : in_double;
  }
  B& backend() noexcept { return *backend_; }

  /// Uploads the clouds where the backend has memory of its own, renders, and fetches the images.
  gsnav::Frames<S> render(const std::vector<Placed>& scene, const std::vector<gsnav::Camera>& cameras,
                          const gsnav::RenderConfig& config,
                          const std::vector<gsnav::MeshInstance>& meshes = {}) {
    std::vector<gsnav::GaussianArrays<B>> arrays;
    std::vector<gsnav::GaussianSet> sets;
    arrays.reserve(scene.size());
    for (const Placed& p : scene) {
      sets.push_back(arrays.emplace_back(*backend_, *p.cloud).set(p.place));
    }
    std::vector<gsnav::MeshArrays<B>> mesh_arrays;
    std::vector<gsnav::MeshInstance> instances;
    mesh_arrays.reserve(meshes.size());
    for (const gsnav::MeshInstance& m : meshes) {
      instances.push_back(mesh_arrays.emplace_back(*backend_, m.mesh).instance(m.world_from_mesh, m.id));
    }
    gsnav::Renderer<S, B> renderer(*backend_, config);
    renderer.set_meshes(instances);
    gsnav::Frames<S> frames = renderer.render(sets, cameras).value();
    record_hashes(frames, name());
    return frames;
  }
  gsnav::Frames<S> render(const std::vector<Placed>& scene, const gsnav::Camera& camera,
                          const gsnav::RenderConfig& config = {}) {
    return render(scene, std::vector<gsnav::Camera>{camera}, config);
  }

 private:
  const char* name_;
  std::unique_ptr<B> backend_;
};

/// Calls f(renderer) for every backend and precision there is; the scalar reference comes first.
template <class F>
void for_each_renderer(const F& f) {
  const auto run = [&f](auto&& renderer) {
    CAPTURE(renderer.name());
    f(renderer);
  };
  using namespace gsnav;
  run(CaseRenderer<float, SerialBackend>("serial float"));
  run(CaseRenderer<double, SerialBackend>("serial double"));
  run(CaseRenderer<float, ToyBackend>("third-party float, memory of its own"));
#if defined(_OPENMP)
  run(CaseRenderer<float, OpenMPBackend>("openmp float, 1 thread", 1));
  run(CaseRenderer<float, OpenMPBackend>("openmp float, 3 threads", 3));
#endif
#if defined(GSNAV_HAS_CUDA)
  if (CudaBackend::device_count() > 0) {
    run(CaseRenderer<float, CudaBackend>("cuda float"));
  } else {
    static const int once = std::printf("SKIP: hard cases on cuda: no GPU\n");
    (void)once;
  }
#endif
}

/// Renders on every backend, with meshes on those that know them; the float32 images must have the serial backend's
/// bits. Calls check(frames, renderer) for each.
template <class F>
void render_everywhere(const std::vector<Placed>& scene, const gsnav::Camera& camera,
                       const gsnav::RenderConfig& config, const F& check,
                       const std::vector<gsnav::MeshInstance>& meshes = {}) {
  gsnav::Frames<float> reference;
  for_each_renderer([&](auto& renderer) {
    using R = std::remove_reference_t<decltype(renderer)>;
    if (!R::composes && !meshes.empty()) return;
    const auto frames = renderer.render(scene, {camera}, config, meshes);
    if constexpr (R::is_float) {
      if (reference.cameras == 0) reference = frames;
      for_each_image(frames, reference, [](const auto& a, const auto& b) { CHECK(a == b); });
    }
    check(frames, renderer);
  });
}

/// Calls f.operator()<L>(name) for the scalars and lanes that kernels are instantiated with.
template <class F>
void for_each_lane_type(const F& f) {
  using namespace gsnav;
  f.template operator()<float>("float");
  f.template operator()<double>("double");
  f.template operator()<Pack<float, 4>>("Pack<float, 4>");
  f.template operator()<Pack<float, 8>>("Pack<float, 8>");
  f.template operator()<Pack<float, 16>>("Pack<float, 16>");
}

/// Lanes of L from an array of float, and back: a scalar is one lane.
template <class L>
struct LaneIo {
  static constexpr int width = 1;
  static L load(const float* p) { return static_cast<L>(*p); }
  static void store(const L& v, double* p) { *p = static_cast<double>(v); }
};
template <int N>
struct LaneIo<gsnav::Pack<float, N>> {
  static constexpr int width = N;
  static gsnav::Pack<float, N> load(const float* p) { return gsnav::Pack<float, N>::load(p); }
  static void store(const gsnav::Pack<float, N>& v, double* p) {
    for (int i = 0; i < N; ++i) p[i] = static_cast<double>(v[i]);
  }
};

}  // namespace gsnav_test
