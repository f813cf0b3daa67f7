// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <doctest/doctest.h>

#include <string>

#include "gsnav/core/status.hpp"
#include "support/files.hpp"

namespace gsnav_test {

/// Checks an error (a Status or a Result without its value): its code, and that its message names the
/// source and says `part`.
template <class Outcome>
void check_refused(const Outcome& outcome, gsnav::Errc code, const std::string& source,
                   const std::string& part) {
  CAPTURE(part);
  CAPTURE(outcome.message());
  CHECK(outcome.code() == code);
  CHECK(contains(outcome.message(), source));
  CHECK(contains(outcome.message(), part));
}

/// `text` with the first `from`, which must be there, replaced.
inline std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  REQUIRE(at != std::string::npos);
  return text.replace(at, from.size(), to);
}

}  // namespace gsnav_test
