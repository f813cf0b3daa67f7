// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gsnav/core/status.hpp"
#include "gsnav/math/functions.hpp"

namespace gsnav {

/// Settings of LodCut: how large an error may be before a finer node is drawn.
struct LodChoice {
  double pixels = 1;  ///< Largest error of a node, in pixels. A node whose error is larger is refined.
  /// Largest product of a node's error and its grain, as a multiple of `pixels`, in square pixels. The
  /// larger the Gaussians of the cloud are on the image, the closer direct rendering is to the photo,
  /// and the less may be merged.
  double grain = 0.5;
  /// Hysteresis, in [0, 1), against flicker where a camera rests. A node that is drawn is refined once
  /// its error exceeds (1 + hysteresis) times the limit; a refined one is drawn again below (1 -
  /// hysteresis) times the limit.
  double hysteresis = 0.1;
  /// The reference image, O_photo(k): the mean of k x k samples in each pixel. k is in [1, 16].
  int photo = 4;
  /// True: simulators and renderers of scenes draw the levels of bodies, but assets whole. Assets then
  /// need no levels. LodCut ignores it.
  bool bodies_only = false;
};

/// Returns invalid_argument naming the field that is out of range, or ok.
inline Status validate(const LodChoice& c) {
  const BadArgument bad{"LodChoice."};
  if (!(c.pixels > 0 && is_finite(c.pixels))) return bad("pixels", c.pixels, "must be positive");
  if (!(c.grain > 0 && is_finite(c.grain))) return bad("grain", c.grain, "must be positive");
  if (!(c.hysteresis >= 0 && c.hysteresis < 1))
    return bad("hysteresis", c.hysteresis, "must be in [0, 1)");
  if (c.photo < 1 || c.photo > 16) return bad("photo", c.photo, "must be in [1, 16]");
  return {};
}

}  // namespace gsnav
