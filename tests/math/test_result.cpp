// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <memory>
#include <string>
#include <type_traits>
#include <utility>

#include "gsnav/core/status.hpp"

using namespace gsnav;

namespace {

/// Counts the objects that are alive.
struct Counted {
  explicit Counted(int v) : value(v) { ++alive; }
  Counted(const Counted& o) : value(o.value) { ++alive; }
  Counted(Counted&& o) noexcept : value(std::exchange(o.value, -1)) { ++alive; }
  Counted& operator=(const Counted&) = default;
  ~Counted() { --alive; }
  int value;
  static inline int alive = 0;
};

using Moved = Result<std::unique_ptr<int>>;
static_assert(std::is_nothrow_move_constructible_v<Moved> && std::is_move_assignable_v<Moved>);
static_assert(!std::is_copy_constructible_v<Moved> && !std::is_copy_assignable_v<Moved>);
static_assert(std::is_copy_constructible_v<Result<Counted>> &&
              std::is_copy_assignable_v<Result<Counted>>);

}  // namespace

TEST_CASE("a result constructs and destroys its value once, whatever it is assigned") {
  {
    Result<Counted> a(Counted(1)), error(Errc::invalid_file, "x.ply: bad");
    CHECK(Counted::alive == 1);
    Result<Counted> b(a);
    CHECK((b.ok() && b->value == 1 && a->value == 1 && Counted::alive == 2));
    b = error;
    CHECK((!b.ok() && b.code() == Errc::invalid_file && b.message() == "x.ply: bad"));
    CHECK((error.message() == "x.ply: bad" && Counted::alive == 1));
    b = std::move(a);
    CHECK((b.ok() && b.code() == Errc::ok && b.message().empty() && b->value == 1));
    b = Result<Counted>(Counted(2));
    CHECK(b.value().value == 2);
    const Result<Counted>& same = b;
    b = same;
    CHECK((b.ok() && b->value == 2));
    CHECK(std::move(b).value().value == 2);
    CHECK_THROWS_WITH_AS(static_cast<void>(error.value()), "x.ply: bad", Error);
  }
  CHECK(Counted::alive == 0);
}

TEST_CASE("a result of a type that only moves is moved") {
  Moved a(std::make_unique<int>(7));
  Moved b(std::move(a));
  REQUIRE(b.ok());
  CHECK(**b == 7);
  b = Status(Errc::unsupported, "no");
  CHECK((b.code() == Errc::unsupported && !b));
  b = Moved(std::make_unique<int>(8));
  CHECK(*std::move(b).value() == 8);
}
