// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "gsnav/detail/core/huge_pages.hpp"
#include "gsnav/detail/scene/needed_bands.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"
#include "gsnav/scene/packed_cloud.hpp"

namespace gsnav {

namespace detail {

/// Cuts n rows of SH bands from degree `from` to degree `to` and frees the memory.
template <class T>
void narrow_bands(std::vector<T>& bands, std::size_t n, int from, int to) {
  if (bands.empty()) return;
  const std::size_t kept = n * sh_band_numbers(to);
  narrow_rows(bands.data(), n, sh_band_numbers(from), sh_band_numbers(to), bands.data());
  discard_pages(bands.data() + kept, (bands.size() - kept) * sizeof(T));
  bands = moved_through<T>(bands, kept, [](T v) { return v; });
}

}  // namespace detail

/// Drops the SH bands above `degree`, in [0, 3], and frees their memory. A cloud of a lower degree is
/// unchanged. Returns the bytes saved.
inline std::size_t limit_sh_degree(GaussianCloud& cloud, int degree) {
  if (degree >= cloud.sh_degree) return 0;
  const std::size_t before = cloud.bytes();
  detail::narrow_bands(cloud.shN, cloud.size(), cloud.sh_degree, degree);
  detail::narrow_bands(cloud.shN_half, cloud.size(), cloud.sh_degree, degree);
  cloud.sh_degree = degree;
  return before - cloud.bytes();
}
/// The same for a packed cloud.
inline std::size_t limit_sh_degree(PackedCloud& cloud, int degree) {
  GaussianCloud& rest = cloud.rest;
  if (degree >= rest.sh_degree) return 0;
  const std::size_t before = cloud.bytes();
  detail::narrow_bands(cloud.shN, cloud.size(), rest.sh_degree, degree);
  detail::narrow_bands(rest.shN, cloud.size(), rest.sh_degree, degree);
  detail::narrow_bands(rest.shN_half, cloud.size(), rest.sh_degree, degree);
  rest.sh_degree = degree;
  return before - cloud.bytes();
}

/// Drops the bands of a cloud (GaussianCloud or PackedCloud) that no chunk needs. `needed` is the result
/// of scene_bands for this cloud; it still fits afterwards, and gets the number of bytes dropped. Bands
/// that only some chunks need are kept for all (docs/concepts/scene.md has what storage by chunk would
/// save).
template <class Cloud>
void drop_bands(Cloud& cloud, SceneBands& needed) {
  needed.bytes_let_go +=
      limit_sh_degree(cloud, needed_sh_degree(needed.applied_to(cloud.set()).gaussians.color));
  const ColorRows v = cloud.view().color;
  needed.bytes_unneeded =
      bytes_of(v.band_encoding()) * (v.rest() * cloud.size() - needed.sh_numbers_read);
}

}  // namespace gsnav
