// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace gsnav_report {

/// The processor's name and number of hardware threads.
std::string machine_name();
/// Today, UTC, YYYY-MM-DD.
std::string today();

/// Greatest resident memory of the process since `reset_peak_memory`, bytes; 0 where the system does not
/// say.
std::uint64_t peak_memory();
/// Starts peak_memory anew where the system allows it (Linux); elsewhere the peak is that of the whole
/// run.
void reset_peak_memory();

/// From here on the first Ctrl-C only raises `interrupted`; a second one ends the process.
void watch_interrupts();
bool interrupted() noexcept;

/// A line of progress: done, elapsed, what is left by the pace so far. One line that changes on a
/// terminal, else a line every ten seconds.
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
