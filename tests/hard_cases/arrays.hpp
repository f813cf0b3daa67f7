// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "gsnav/core/buffer.hpp"
#include "hard_cases/backends.hpp"

namespace gsnav_test {

/// Arrays in the memory of a backend, for what a GaussianCloud does not hold; kept until it goes.
template <class B>
class Arrays {
 public:
  explicit Arrays(B& backend) : backend_(&backend) {}

  template <class T>
  gsnav::View<const T> in(const std::vector<T>& host) {
    gsnav::Buffer<T, B>& buffer = make<T>();
    buffer.upload(host.data(), host.size());
    return {buffer.data(), host.size()};
  }
  template <class T>
  gsnav::View<T> out(std::size_t n) {
    gsnav::Buffer<T, B>& buffer = make<T>();
    buffer.resize_discard(n);
    return {buffer.data(), n};
  }
  /// Back to the host.
  template <class T>
  std::vector<T> fetch(const gsnav::View<T>& view) {
    std::vector<T> host(view.size);
    backend_->copy(host.data(), view.data, view.size * sizeof(T),
                   gsnav::is_host_backend<B> ? gsnav::CopyKind::host_to_host : gsnav::CopyKind::device_to_host);
    backend_->synchronize().throw_if_error();
    return host;
  }

 private:
  template <class T>
  gsnav::Buffer<T, B>& make() {
    auto buffer = std::make_shared<gsnav::Buffer<T, B>>(*backend_);
    kept_.push_back(buffer);
    return *buffer;
  }
  B* backend_;
  std::vector<std::shared_ptr<void>> kept_;
};

/// What a set has beyond its cloud: rotations that SH is turned back by, or blended axes.
struct SetExtras {
  std::array<std::vector<float>, 4> sh_rotations;
  std::array<std::vector<float>, 9> axes;
};

/// Renders one cloud with extras on the backend of a CaseRenderer.
template <class R>
auto render_with(R& renderer, const gsnav::GaussianCloud& cloud, const SetExtras& extras,
                 const gsnav::Camera& camera, const gsnav::RenderConfig& config) {
  using B = std::remove_cvref_t<decltype(renderer.backend())>;
  const gsnav::GaussianArrays<B> arrays(renderer.backend(), cloud);
  Arrays<B> more(renderer.backend());
  gsnav::GaussianSet set = arrays.set();
  for (std::size_t k = 0; k < 4 && !extras.sh_rotations[0].empty(); ++k) {
    set.gaussians.sh_rotations[k] = more.in(extras.sh_rotations[k]);
  }
  for (std::size_t k = 0; k < 9 && !extras.axes[0].empty(); ++k) set.gaussians.axes[k] = more.in(extras.axes[k]);
  gsnav::Renderer<typename R::scalar, B> r(renderer.backend(), config);
  return r.render(set, camera).value();
}

/// Every image has the same bits.
template <class S>
bool same_images(const gsnav::Frames<S>& a, const gsnav::Frames<S>& b) {
  bool same = true;
  for_each_image(a, b, [&same](const auto& x, const auto& y) { same = same && x == y; });
  return same;
}

/// Pixels whose content hangs on less than `relative` of a threshold (1/255, the stop): the reference
/// renderer draws them otherwise where the thresholds move by so much.
inline std::vector<bool> undecided_pixels(const std::vector<Placed>& scene, const gsnav::Camera& camera,
                                          const gsnav::RenderConfig& config, double relative) {
  using namespace gsnav;
  CaseRenderer<double, SerialBackend> serial("serial double");
  RenderConfig low = config, high = config;
  low.outputs = high.outputs = kRgb | kAlpha | kMedianDepth;
  low.alpha_min *= 1 - relative;
  high.alpha_min *= 1 + relative;
  low.transmittance_min *= 1 - relative;
  high.transmittance_min *= 1 + relative;
  const auto a = serial.render(scene, camera, low), b = serial.render(scene, camera, high);
  std::vector<bool> out(a.alpha.size());
  for (std::size_t p = 0; p < out.size(); ++p) {
    out[p] = a.alpha[p] != b.alpha[p] || a.median_depth[p] != b.median_depth[p];
  }
  return out;
}

}  // namespace gsnav_test
