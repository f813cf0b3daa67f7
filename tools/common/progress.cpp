// SPDX-License-Identifier: Apache-2.0
#include "progress.hpp"

#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <functional>

#include "gsnav/core/text.hpp"

namespace gsnav_tools {

std::function<void(const std::string&, double)> progress_printer() {
  using Clock = std::chrono::steady_clock;
  const auto since = [](Clock::time_point t) {
    return std::chrono::duration<double>(Clock::now() - t).count();
  };
  return [since, task = std::string(), begin = Clock::time_point{}, shown = Clock::time_point{},
          open = false](const std::string& name, double share) mutable {
    const bool terminal = isatty(fileno(stderr)) != 0;
    if (name != task || (share <= 0 && !open)) {
      if (open) std::fputc('\n', stderr);  // End the line of the previous task.
      task = name;
      begin = Clock::now();
      shown = {};
      open = false;
    }
    const double spent = since(begin);
    const bool last = share >= 1;
    if (spent < 2 || (since(shown) < (terminal ? 0.2 : 10.0) && !(last && open))) return;
    shown = Clock::now();
    char left[48] = "";
    if (share > 0.02 && !last)
      std::snprintf(left, sizeof left, ", about %.0f s left", spent * (1 - share) / share);
    std::fprintf(stderr, "%s%s: %3.0f %%%s%s", terminal ? "\r\x1b[K" : "",
                 gsnav::printable(name).c_str(), 100 * share, left, terminal && !last ? "" : "\n");
    std::fflush(stderr);
    open = terminal && !last;
  };
}

}  // namespace gsnav_tools
