// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

// The emulator's own functions that run at every operation of a warp are not instrumented: sanitizers
// are for device code. They call no functions of containers: those are instrumented, so not inlined.
#define GSNAV_UNCHECKED __attribute__((no_sanitize("address"), no_sanitize("undefined")))

namespace gsnav::emulated {

/// A function with its own stack that takes turns with others on one thread of the host.
class Fiber {
 public:
  Fiber() = default;
  /// Fiber of the calling thread. It uses the thread's own stack.
  static Fiber of_this_thread();

  /// Allocates the stack on which main() begins at the first change to this fiber. Does nothing if there
  /// is a stack.
  /// @return false if there is no memory.
  bool start(void (*main)());

  /// Must be called first in each main().
  static void began();

  /// Leaves the running fiber `from` and continues with `to`. Returns when another fiber changes back to
  /// `from`.
  static void change(Fiber& from, Fiber& to);

 private:
  void* sp_ = nullptr;           ///< Stack pointer while the fiber does not run.
  const void* stack_ = nullptr;  ///< Lowest byte of the stack.
  std::size_t bytes_ = 0;
  [[maybe_unused]] void* fake_stack_ = nullptr;  ///< For AddressSanitizer.
};

}  // namespace gsnav::emulated
