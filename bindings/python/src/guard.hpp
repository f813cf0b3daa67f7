// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <string>

#include "gsnav/core/status.hpp"
#include "gsnav/device/device.hpp"

namespace gsnav::python {

/// True in a process that was forked from one that had computed on the threads of OpenMP.
bool lost_threads() noexcept;
/// Notes that this process computes on the threads of OpenMP.
void note_threads() noexcept;

/// Throws gsnav::Error if a computation on `device` would wait for threads that a fork did not copy.
inline void check_fork(const Device& device, const char* what) {
  if (device.kind() == DeviceKind::serial) return;
  if (lost_threads()) {
    throw Error(Errc::unsupported,
                std::string(what) +
                    ": this process was forked after its parent had computed on the "
                    "device. Use the start method \"spawn\", or the device \"serial\".");
  }
  note_threads();
}

/// Flag of an object that one thread may use at a time.
class Busy {
 public:
  /// Holds the flag while it lives.
  class Hold {
   public:
    /// Throws gsnav::Error if the flag is held. `what` names the call.
    Hold(Busy& busy, const char* what) : busy_(busy) {
      if (busy.flag_.exchange(true)) {
        throw Error(Errc::invalid_argument,
                    std::string(what) +
                        ": another call of this object has not returned. Use one object "
                        "per thread, and do not call it from its own callback.");
      }
    }
    Hold(const Hold&) = delete;
    Hold& operator=(const Hold&) = delete;
    ~Hold() { busy_.flag_.store(false); }

   private:
    Busy& busy_;
  };

 private:
  std::atomic<bool> flag_{false};
};

/// Calls f(s.sim) while the flag `s.busy` is held.
template <class S, class F>
auto locked(S& s, const char* what, const F& f) {
  const Busy::Hold hold(s.busy, what);
  return f(s.sim);
}

}  // namespace gsnav::python
