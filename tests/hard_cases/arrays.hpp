// SPDX-License-Identifier: Apache-2.0
#pragma once

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
    backend_->copy(
        host.data(), view.data, view.size * sizeof(T),
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

/// Every image has the same bits.
template <class S>
bool same_images(const gsnav::Frames<S>& a, const gsnav::Frames<S>& b) {
  bool same = true;
  for_each_image(a, b, [&same](const auto& x, const auto& y) { same = same && x == y; });
  return same;
}

/// Pixels whose content hangs on less than `relative` of a threshold (1/255, the stop): the reference
/// renderer draws them otherwise where the thresholds move by so much.
std::vector<bool> undecided_pixels(const std::vector<Placed>& scene, const gsnav::Camera& camera,
                                   const gsnav::RenderConfig& config, double relative);

}  // namespace gsnav_test
