// SPDX-License-Identifier: Apache-2.0
#include "runner_system.hpp"

#if defined(__GLIBC__)
#include <malloc.h>
#endif
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <thread>

namespace gsnav_report {

namespace {

volatile std::sig_atomic_t stop_asked = 0;

double seconds_now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

std::string clock_text(double seconds) {
  char text[32];
  const long s = static_cast<long>(seconds);
  std::snprintf(text, sizeof text, "%ld:%02ld", s / 60, s % 60);
  return text;
}

}  // namespace

std::string machine_name() {
  std::string name = "unknown processor", line;
  std::ifstream in("/proc/cpuinfo");
  while (std::getline(in, line)) {
    const std::size_t colon = line.find(": ");
    if (line.rfind("model name", 0) == 0 && colon != line.npos) {
      name = line.substr(colon + 2);
      break;
    }
  }
  return name + ", " + std::to_string(std::thread::hardware_concurrency()) + " threads";
}

std::string today() {
  char text[16] = "";
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  if (gmtime_r(&now, &utc) != nullptr) std::strftime(text, sizeof text, "%Y-%m-%d", &utc);
  return text;
}

std::uint64_t peak_memory() {
  std::ifstream in("/proc/self/status");
  std::string line;
  while (std::getline(in, line)) {
    if (line.rfind("VmHWM:", 0) == 0) return 1024 * std::strtoull(line.c_str() + 6, nullptr, 10);
  }
  return 0;
}

void reset_peak_memory() {
#if defined(__GLIBC__)
  malloc_trim(0);  // returns memory that earlier measurements have freed to the system first
#endif
  std::ofstream("/proc/self/clear_refs") << "5";
}

void watch_interrupts() {
  std::signal(SIGINT, [](int) {
    stop_asked = 1;
    std::signal(SIGINT, SIG_DFL);
  });
}

bool interrupted() noexcept { return stop_asked != 0; }

Progress::Progress(std::size_t total)
    : total_(total), begin_(seconds_now()), terminal_(isatty(fileno(stderr)) != 0) {}

void Progress::show(std::size_t done, const std::string& what) {
  const double now = seconds_now();
  if (!terminal_ && now - last_ < 10) return;
  last_ = now;
  const double elapsed = now - begin_;
  std::string left = "?";
  if (done > 0)
    left = clock_text(elapsed / static_cast<double>(done) * static_cast<double>(total_ - done));
  std::fprintf(stderr, "%s[%zu/%zu] %s, about %s left: %s%s", terminal_ ? "\r\033[K" : "", done, total_,
               clock_text(elapsed).c_str(), left.c_str(), what.c_str(), terminal_ ? "" : "\n");
}

void Progress::finish() {
  std::fprintf(stderr, "%s[%zu] done in %s\n", terminal_ ? "\r\033[K" : "", total_,
               clock_text(seconds_now() - begin_).c_str());
}

}  // namespace gsnav_report
