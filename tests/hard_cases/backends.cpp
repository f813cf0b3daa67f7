// SPDX-License-Identifier: Apache-2.0
// What hard cases draw with, compiled once.
#include "hard_cases/backends.hpp"

#include <functional>

#include "hard_cases/arrays.hpp"
#include "support/image_hashes.hpp"

namespace gsnav_test {

using namespace gsnav;

template <class S, class B>
Frames<S> CaseRenderer<S, B>::render(const std::vector<Placed>& scene,
                                     const std::vector<Camera>& cameras, const RenderConfig& config,
                                     const std::vector<MeshInstance>& meshes) {
  std::vector<GaussianArrays<B>> arrays;
  std::vector<GaussianSet> sets;
  arrays.reserve(scene.size());
  for (const Placed& p : scene) sets.push_back(arrays.emplace_back(*backend_, *p.cloud).set(p.place));
  std::vector<MeshArrays<B>> mesh_arrays;
  std::vector<MeshInstance> instances;
  mesh_arrays.reserve(meshes.size());
  for (const MeshInstance& m : meshes) {
    instances.push_back(mesh_arrays.emplace_back(*backend_, m.mesh).instance(m.world_from_mesh, m.id));
  }
  BasicRenderer<S, B> renderer(*backend_, config);
  renderer.set_meshes(instances);
  Frames<S> frames = renderer.render(sets, cameras).value();
  record_hashes(frames, this->name());
  return frames;
}

template <class S, class B>
Frames<S> CaseRenderer<S, B>::render_with(const GaussianCloud& cloud, const SetExtras& extras,
                                          const Camera& camera, const RenderConfig& config) {
  const GaussianArrays<B> arrays(*backend_, cloud);
  Arrays<B> more(*backend_);
  GaussianSet set = arrays.set();
  for (std::size_t k = 0; k < 4 && !extras.sh_rotations[0].empty(); ++k) {
    set.gaussians.color.rotations.set(k, more.in(extras.sh_rotations[k]));
  }
  for (std::size_t k = 0; k < 9 && !extras.axes[0].empty(); ++k)
    set.gaussians.shape.axes.set(k, more.in(extras.axes[k]));
  BasicRenderer<S, B> renderer(*backend_, config);
  return renderer.render(set, camera).value();
}

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
