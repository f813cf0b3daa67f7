// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace gsnav::io {

/// How much work and memory a file may ask of the readers before they refuse it. The defaults are far above what
/// ordinary files need; raise one where an error names it and you trust the file.
struct ReadLimits {
  int json_depth = 64;      ///< Arrays and objects inside each other in JSON text. Range [1, 10000].
  int inflation = 200;      ///< Bytes of text that a byte of a gzip file may become (64 KiB are always read). Range
                            ///< [1, 1032]; deflate cannot do more.
  int texture_side = 8192;  ///< Pixels along each side of a texture of a mesh. Range [1, 65535].
};

}  // namespace gsnav::io
