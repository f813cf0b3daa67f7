// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace gsnav::io {

/// Limits on the work and memory that a file may ask of a reader. A file that exceeds one is refused
/// with Errc::unsupported (a texture is left out with a warning), naming the field to raise. The defaults
/// are far above what ordinary files need. A value out of its range is invalid_argument.
struct ReadLimits {
  /// Arrays and objects inside each other in JSON text. Range [1, 10000]. Readers of JSON that take no
  /// ReadLimits (SOG, cameras, Habitat's configurations, NavMesh settings, avatar scenes) allow 64.
  int json_depth = 64;
  /// Bytes of text per byte of a gzip file; the first 64 KiB are always read. Range [1, 1032]: deflate
  /// can do no more.
  int inflation = 200;
  /// Pixels along the longer side of a texture of a glTF file (PNG, JPEG, WebP), looked at before it is
  /// decoded. Range [1, 65535]; of a JPEG never more than 16384. A larger one is left out, with a
  /// warning: its material keeps its colour factor. So are all pictures after those that together have
  /// the pixels of eight squares of this side.
  int texture_side = 8192;
};

}  // namespace gsnav::io
