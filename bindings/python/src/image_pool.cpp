// SPDX-License-Identifier: Apache-2.0
#include "image_pool.hpp"

#include <algorithm>
#include <new>
#include <string>
#include <utility>

namespace gsnav::python {

void ImagePool::put_back(Block block) noexcept {
  const std::lock_guard lock(mutex_);
  const std::size_t bytes = block.floats * sizeof(float);
  if (bytes > most_ - bytes_) return;
  try {
    unused_.push_back(std::move(block));
    bytes_ += bytes;
  } catch (const std::bad_alloc&) {  // The block is freed.
  }
}

void ImagePool::begin() {
  std::vector<Block> taken;
  {
    const std::lock_guard lock(mutex_);
    taken.swap(taken_);
  }
  for (Block& block : taken) put_back(std::move(block));
}

Result<std::span<float>> ImagePool::take(std::size_t floats) {
  const std::lock_guard lock(mutex_);
  // The block that was used last is the most likely to be in a cache.
  const auto last = std::find_if(unused_.rbegin(), unused_.rend(),
                                 [floats](const Block& b) { return b.floats == floats; });
  Block block;
  if (last != unused_.rend()) {
    block = std::move(*last);
    unused_.erase(std::next(last).base());
    bytes_ -= floats * sizeof(float);
  } else {
    block.floats = floats;
    block.data.reset(
        static_cast<float*>(::operator new(floats * sizeof(float), kAlignment, std::nothrow)));
    if (block.data == nullptr) {
      return {Errc::out_of_memory,
              "cannot allocate " + std::to_string(floats * sizeof(float)) + " bytes for images"};
    }
  }
  return std::span(taken_.emplace_back(std::move(block)).data.get(), floats);
}

template <class T>
nb::object ImagePool::array(const float* data, const std::vector<std::size_t>& shape) {
  struct Held {
    std::shared_ptr<ImagePool> pool;
    Block block;
  };
  auto held = std::make_unique<Held>();
  {
    const std::lock_guard lock(mutex_);
    const auto found = std::find_if(taken_.begin(), taken_.end(),
                                    [data](const Block& b) { return b.data.get() == data; });
    if (found == taken_.end()) return {};
    held->block = std::move(*found);
    taken_.erase(found);
  }
  held->pool = shared_from_this();
  T* const first = reinterpret_cast<T*>(held->block.data.get());
  nb::capsule owner(held.get(), [](void* p) noexcept {
    const std::unique_ptr<Held> dead(static_cast<Held*>(p));
    dead->pool->put_back(std::move(dead->block));
  });
  held.release();
  return nb::cast(nb::ndarray<nb::numpy, T>(first, shape.size(), shape.data(), owner));
}
template nb::object ImagePool::array<float>(const float*, const std::vector<std::size_t>&);
template nb::object ImagePool::array<std::uint8_t>(const float*, const std::vector<std::size_t>&);

void ImagePool::close() {
  const std::lock_guard lock(mutex_);
  most_ = bytes_ = 0;
  unused_.clear();
}

std::size_t ImagePool::unused() const {
  const std::lock_guard lock(mutex_);
  return bytes_;
}

}  // namespace gsnav::python
