// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <doctest/doctest.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "gsnav/detail/math/pack.hpp"
#include "gsnav/scene/mesh_scene.hpp"
#include "ops/backends.hpp"
#include "support/frame_images.hpp"
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

/// What a set has beyond its cloud: rotations that SH is turned back by, or blended axes.
struct SetExtras {
  std::array<std::vector<float>, 4> sh_rotations;
  std::array<std::vector<float>, 9> axes;
};

/// Renders cases in one precision on a backend whose type does not matter: cases are compiled once per
/// scalar, and what draws once for all of them (backends.cpp). `epsilon`: a rounding of the scalar.
template <class S>
class CaseImages {
 public:
  using scalar = S;
  explicit CaseImages(const char* name) : name_(name) {}
  virtual ~CaseImages() = default;

  std::string name() const { return name_; }
  static constexpr bool is_float = sizeof(S) == sizeof(float);
  static constexpr double epsilon = is_float ? 0x1p-24 : 0x1p-53;
  /// The bound for the scalar at hand.
  static constexpr double bound(double in_float, double in_double) noexcept {
    return is_float ? in_float : in_double;
  }

  /// Uploads the clouds where the backend has memory of its own, renders, and fetches the images.
  virtual gsnav::Frames<S> render(const std::vector<Placed>& scene,
                                  const std::vector<gsnav::Camera>& cameras,
                                  const gsnav::RenderConfig& config,
                                  const std::vector<gsnav::MeshInstance>& meshes = {}) = 0;
  gsnav::Frames<S> render(const std::vector<Placed>& scene, const gsnav::Camera& camera,
                          const gsnav::RenderConfig& config = {}) {
    return render(scene, std::vector<gsnav::Camera>{camera}, config);
  }
  /// Renders one cloud with extras.
  virtual gsnav::Frames<S> render_with(const gsnav::GaussianCloud& cloud, const SetExtras& extras,
                                       const gsnav::Camera& camera,
                                       const gsnav::RenderConfig& config) = 0;

 private:
  const char* name_;
};

/// One backend in one precision, with a name for messages.
template <class S, class B>
class CaseRenderer final : public CaseImages<S> {
 public:
  template <class... Args>
  explicit CaseRenderer(const char* name, Args&&... args)
      : CaseImages<S>(name), backend_(std::make_unique<B>(std::forward<Args>(args)...)) {}

  B& backend() noexcept { return *backend_; }
  using CaseImages<S>::render;
  gsnav::Frames<S> render(const std::vector<Placed>& scene, const std::vector<gsnav::Camera>& cameras,
                          const gsnav::RenderConfig& config,
                          const std::vector<gsnav::MeshInstance>& meshes = {}) override;
  gsnav::Frames<S> render_with(const gsnav::GaussianCloud& cloud, const SetExtras& extras,
                               const gsnav::Camera& camera, const gsnav::RenderConfig& config) override;

 private:
  std::unique_ptr<B> backend_;
};
extern template class CaseRenderer<float, gsnav::SerialBackend>;
extern template class CaseRenderer<double, gsnav::SerialBackend>;
extern template class CaseRenderer<float, ToyBackend>;
#if defined(_OPENMP)
extern template class CaseRenderer<float, gsnav::OpenMPBackend>;
#endif
#if defined(GSNAV_HAS_CUDA)
extern template class CaseRenderer<float, gsnav::CudaBackend>;
#endif

/// Calls f(renderer), unless the environment variable GSNAV_CASES_ON ("openmp") says that only renderers
/// whose names begin with it are tested.
template <class R, class F>
void run_if_wanted(R&& renderer, const F& f) {
  const char* const wanted = std::getenv("GSNAV_CASES_ON");
  if (wanted != nullptr && !renderer.name().starts_with(wanted)) return;
  CAPTURE(renderer.name());
  f(renderer);
}

/// Calls f(renderer) for every backend and precision there is, with its type; the scalar reference comes
/// first.
template <class F>
void for_each_backend(const F& f) {
  const auto run = [&f](auto&& renderer) { run_if_wanted(renderer, f); };
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

/// The same for functions of both precisions. It also calls in_float for batches on a GPU. Frames of
/// batches have no `stats`.
void visit_renderers(const std::function<void(CaseImages<float>&)>& in_float,
                     const std::function<void(CaseImages<double>&)>& in_double);

/// Calls f(renderer) as for_each_backend does, with a CaseImages of float or double.
template <class F>
void for_each_renderer(const F& f) {
  visit_renderers([&f](CaseImages<float>& renderer) { f(renderer); },
                  [&f](CaseImages<double>& renderer) { f(renderer); });
}

/// CHECKs that every image has the reference's bits; frames become the reference where that is empty.
void check_bits(const gsnav::Frames<float>& frames, gsnav::Frames<float>& reference);

/// Renders on every backend, with meshes on those that know them; the float32 images must have the
/// serial backend's bits. Calls check(frames, renderer) for each.
template <class F>
void render_everywhere(const std::vector<Placed>& scene, const gsnav::Camera& camera,
                       const gsnav::RenderConfig& config, const F& check,
                       const std::vector<gsnav::MeshInstance>& meshes = {}) {
  gsnav::Frames<float> reference;
  for_each_renderer([&](auto& renderer) {
    const auto frames = renderer.render(scene, {camera}, config, meshes);
    if constexpr (std::is_same_v<decltype(frames), const gsnav::Frames<float>>)
      check_bits(frames, reference);
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
