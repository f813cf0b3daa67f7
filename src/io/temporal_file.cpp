// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/io/temporal_file.hpp"

#include <utility>

#include "file.hpp"
#include "ply_temporal.hpp"
#include "temporal_npz.hpp"

namespace gsnav::io {
namespace {

Result<LoadedTemporalCloud> joined(Result<LoadedCloud> loaded, TemporalCloud& moving) {
  if (!loaded) return loaded.status();
  LoadedTemporalCloud out{std::move(moving), std::move(loaded->report)};
  out.scene.cloud = std::move(loaded->cloud);
  if (out.scene.times.empty()) stand_still(out.scene);
  out.report.memory = out.scene.bytes();
  return out;
}

}  // namespace

Result<LoadedTemporalCloud> parse_temporal_ply(std::span<const std::byte> bytes, std::string source) {
  return detail::guarded(source, [&] {
    TemporalCloud moving;
    return joined(detail::parse_ply(bytes, source, &moving), moving);
  });
}

Result<LoadedTemporalCloud> load_temporal(const std::filesystem::path& path) {
  return detail::guarded(path.string(), [&]() -> Result<LoadedTemporalCloud> {
    if (path.extension() == ".npz") return detail::load_temporal_npz(path);
    if (path.extension() != ".ply") {
      return {Errc::unsupported,
              path.string() + ": not a moving scene that is read here: .ply (.4dgs.ply) or .4dgs.npz"};
    }
    TemporalCloud moving;
    return joined(detail::load_ply(path, &moving), moving);
  });
}

}  // namespace gsnav::io
