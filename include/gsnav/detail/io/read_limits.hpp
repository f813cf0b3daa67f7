// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace gsnav::io {

/// Limits on the work and memory that a file may cost. A file that exceeds one is refused with
/// Errc::unsupported, naming the field to raise; a texture is left out with a warning. The defaults are
/// far above what ordinary files need. A limit out of its range is invalid_argument.
struct ReadLimits {
  /// Nesting of arrays and objects in JSON. Range [1, 10000]. Readers of JSON without ReadLimits (SOG,
  /// cameras, Habitat's configurations, NavMesh settings, avatar scenes) allow 64.
  int json_depth = 64;
  /// Largest ratio of decompressed to compressed size of a gzip file. The first 64 KiB of the
  /// decompressed data are read whatever the ratio. Range [1, 1032]: deflate cannot expand more.
  int inflation = 200;
  /// Pixels along the longer side of a texture of a glTF file (PNG, JPEG, WebP), checked before it is
  /// decoded. Range [1, 65535]; a JPEG is limited to 16384. A larger texture is left out with a warning,
  /// and its material keeps the colour factor. All textures of a file together may have the pixels of
  /// eight squares of this side; those beyond are left out too.
  int texture_side = 8192;
};

}  // namespace gsnav::io
