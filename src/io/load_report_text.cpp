// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <string>

#include "gsnav/core/text.hpp"
#include "gsnav/io/scene_file.hpp"

namespace gsnav::io {

std::string report_text(const LoadReport& r) {
  std::string out;
  const auto line = [&out](const char* format, auto... values) {
    char text[320];
    std::snprintf(text, sizeof text, format, values...);
    out += std::string("  ") + text + "\n";
  };
  const auto count = [&](std::uint64_t n, const char* what) {
    if (n != 0) line("%llu %s", static_cast<unsigned long long>(n), what);
  };
  line("%llu Gaussians of %llu rows, SH degree %d (%d in use), %.1f MB%s",
       static_cast<unsigned long long>(r.kept), static_cast<unsigned long long>(r.read), r.sh_degree,
       r.sh_degree_used, static_cast<double>(r.memory) / 1e6,
       r.packed    ? ", packed"
       : r.compact ? ", compact"
                   : "");
  out = r.source + ":" + out.substr(1);
  count(r.dropped_non_finite, "dropped: a value that is not finite");
  count(r.dropped_zero_quat, "dropped: a zero quaternion");
  count(r.dropped_transparent, "left out: opacity below 1/255, never visible");
  count(r.clamped_scales, "repaired: log-scale clamped to [-20, 20]");
  if (r.kept != 0) {
    const Vec3d &a = r.bounds.low, &b = r.bounds.high;
    line("means from (%.6g, %.6g, %.6g) to (%.6g, %.6g, %.6g) m", a.x, a.y, a.z, b.x, b.y, b.z);
    const char* axis = r.up.y > 0 ? "+y" : r.up.y < 0 ? "-y" : r.up.z > 0 ? "+z" : "-z";
    if (r.up_seen) {
      line("up: %s, seen from the ground (confidence %.2f)", axis, r.up_confidence);
    } else {
      line("up: %s, the usual axis of such files", axis);
    }
  }
  line("filter %s, eps2d %.3g, sorted by %s", r.filter == Filter::mip ? "mip" : "classic",
       static_cast<double>(r.eps2d), r.sort_order == SortOrder::z_depth ? "depth" : "distance");
  if (r.moving) line("moving: own times from %.6g to %.6g s", r.first_time, r.last_time);
  if (r.sh_bytes_let_go != 0)
    line("SH bands of zeros alone, not held: %llu bytes",
         static_cast<unsigned long long>(r.sh_bytes_let_go));
  if (r.compact) line("SH as binary16: coefficients differ by up to %.3g", r.sh_storage_error);
  if (r.packed) {
    const PackErrors& e = r.packing;
    line(
        "packed: means in %d bits, off by up to %.3g m (%.3g deviations), scales by %.3g of the "
        "largest, rotations by "
        "%.3g",
        e.mean_bits, e.mean, e.mean_deviations, e.scale, e.rotation);
    line("opacities by %.3g, colours by %.3g; SH in %d bits, off by up to %.3g, root mean square %.3g",
         e.opacity, e.sh0, e.sh_bits, e.sh, e.sh_rms);
  }
  for (const std::string& w : r.warnings) out += "  warning: " + w + "\n";
  return printable(out);
}

}  // namespace gsnav::io
