// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "arrays.hpp"
#include "gsnav/core/status.hpp"

namespace gsnav::python {

/// Memory that a batch draws into and that arrays own afterwards. A block whose array is dead is used
/// again, because new memory costs a page fault for each of its pages. All functions are thread-safe.
class ImagePool : public std::enable_shared_from_this<ImagePool> {
 public:
  /// @param most Number of bytes of unused blocks that are kept.
  explicit ImagePool(std::size_t most) : most_(most) {}
  ImagePool(const ImagePool&) = delete;
  ImagePool& operator=(const ImagePool&) = delete;

  /// Begins a call of the simulator. Blocks that the last one took and that no array owns become unused.
  void begin();
  /// Takes a block for one image. See ImageSource.
  /// @return out_of_memory, with the number of bytes.
  Result<std::span<float>> take(std::size_t floats);
  /// A writable array that owns a block that was taken in this call, from its first number on. Null if
  /// `data` is no such block, or if an array owns it already.
  /// T: float or std::uint8_t.
  template <class T>
  nb::object array(const float* data, const std::vector<std::size_t>& shape);
  /// Frees unused blocks, now and later.
  void close();
  /// Number of bytes of unused blocks.
  std::size_t unused() const;

 private:
  struct Block {
    std::unique_ptr<float, FreeAligned> data;
    std::size_t floats = 0;
  };
  void put_back(Block block) noexcept;

  mutable std::mutex mutex_;
  std::vector<Block> unused_, taken_;
  std::size_t most_, bytes_ = 0;  // bytes_: of unused_
};

}  // namespace gsnav::python
