// SPDX-License-Identifier: Apache-2.0
#include "settings.hpp"

#include <cerrno>
#include <cstdio>
#include <cstdlib>

namespace gsnav::emulated {

namespace {

std::uint64_t number(const char* name, std::uint64_t unless_told, std::uint64_t least,
                     std::uint64_t most) {
  const char* const text = std::getenv(name);
  if (text == nullptr || *text == 0) return unless_told;
  char* end = nullptr;
  errno = 0;
  const std::uint64_t n = std::strtoull(text, &end, 10);
  if (errno == 0 && *end == 0 && *text != '-' && n >= least && n <= most) return n;
  std::fprintf(stderr, "%s = %s: must be in [%llu, %llu]\n", name, text,
               static_cast<unsigned long long>(least), static_cast<unsigned long long>(most));
  std::exit(2);
}

}  // namespace

std::uint64_t seed() {
  static const std::uint64_t value = number("GSNAV_EMULATED_SEED", 0, 0, ~std::uint64_t{0});
  return value;
}

std::uint64_t processors() {
  static const std::uint64_t value = number("GSNAV_EMULATED_PROCESSORS", 4, 1, 1024);
  return value;
}

}  // namespace gsnav::emulated
