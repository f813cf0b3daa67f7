// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace gsnav {

/// From 0 at u = 0 to 1 at u = 1, with slope 0 at both. `u` in [0, 1].
inline constexpr double smoothstep(double u) noexcept { return u * u * (3 - 2 * u); }

}  // namespace gsnav
