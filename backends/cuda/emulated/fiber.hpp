// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

namespace gsnav::emulated {

/// A stack of its own on which a function runs in turns with others, all on one thread of the host.
class Fiber {
 public:
  Fiber() = default;
  /// The fiber of the calling thread: it uses the stack that the thread has.
  static Fiber of_this_thread();

  /// Makes the stack on which main() begins at the first change to this fiber; nothing where it has one.
  /// False: no memory.
  bool start(void (*main)());

  /// Each main() must call this first.
  static void began();

  /// Leaves `from`, which runs, and goes on with `to`. Returns when something changes back to `from`.
  static void change(Fiber& from, Fiber& to);

 private:
  void* sp_ = nullptr;           ///< of a fiber that does not run
  const void* stack_ = nullptr;  ///< its lowest byte
  std::size_t bytes_ = 0;
  [[maybe_unused]] void* fake_stack_ = nullptr;  ///< AddressSanitizer's
};

}  // namespace gsnav::emulated
