// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>

namespace gsnav_report {

/// The processor's name and number of hardware threads.
std::string machine_name();
/// Today's date, UTC, YYYY-MM-DD.
std::string today();

/// Greatest resident memory of the process since `reset_peak_memory`, bytes; 0 if the system does not
/// report it.
std::uint64_t peak_memory();
/// Resets peak_memory() where the system allows it (Linux). Elsewhere the peak is that of the whole run.
void reset_peak_memory();

/// After this call the first Ctrl-C only sets interrupted(); a second one ends the process.
void watch_interrupts();
bool interrupted() noexcept;

/// Called before each step of a longer task, with the number of steps done, that of all steps, and the
/// name of the next one. The task ends if it returns false.
using OnStep = std::function<bool(std::size_t done, std::size_t total, const std::string& what)>;

/// A line of progress: settings done, time elapsed, and the remaining time at the pace so far. On a
/// terminal it is one line that changes, otherwise a new line every ten seconds.
class Progress {
 public:
  explicit Progress(std::size_t total);
  void set_total(std::size_t total) noexcept { total_ = total; }
  void show(std::size_t done, const std::string& what);
  void finish();

 private:
  std::size_t total_;
  double begin_, last_ = -1e9;
  bool terminal_;
};

}  // namespace gsnav_report
