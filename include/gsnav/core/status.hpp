// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdio>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>

#include "gsnav/core/printable.hpp"

namespace gsnav {

/// What kind of thing went wrong; the message says which file, field and value.
enum class Errc {
  ok = 0,
  invalid_argument,   ///< a value the caller gave is impossible
  invalid_file,       ///< a file's content is malformed, truncated or hostile
  file_not_found,     ///< a path does not exist or cannot be opened, for reading or for writing
  unsupported,        ///< legal, but not handled
  out_of_memory,      ///< an allocation failed
  nothing_navigable,  ///< a NavMesh build found no walkable surface
  backend_failure,    ///< a device or driver reported an error
  write_failed,  ///< a file was begun and could not be finished: a full disk, a quota, a failing device
};

/// The exception behind `.value()` and `.throw_if_error()`.
class Error : public std::runtime_error {
 public:
  /// An exception with the kind of error and a message.
  Error(Errc code, const std::string& message) : std::runtime_error(message), code_(code) {}
  /// Kind of the error; Errc::ok for a success.
  Errc code() const noexcept { return code_; }

 private:
  Errc code_;
};

namespace detail {
[[noreturn]] inline void fail(Errc code, const std::string& message) {
#if defined(__cpp_exceptions)
  throw Error(code, message);
#else
  (void)code;
  std::fprintf(stderr, "gsnav: %s\n", message.c_str());
  std::abort();
#endif
}
}  // namespace detail

/// Success, or a code with a message for people.
class [[nodiscard]] Status {
 public:
  Status() = default;
  /// `message` may hold names of files: it is kept as printable() makes it.
  Status(Errc code, const std::string& message) : code_(code), message_(printable(message)) {}

  /// Whether it is a success.
  bool ok() const noexcept { return code_ == Errc::ok; }
  explicit operator bool() const noexcept { return ok(); }
  /// Kind of the error; Errc::ok for a success.
  Errc code() const noexcept { return code_; }
  /// Text for people; empty for a success.
  const std::string& message() const noexcept { return message_; }
  /// Throws gsnav::Error (aborts under -fno-exceptions) unless ok.
  void throw_if_error() const {
    if (!ok()) detail::fail(code_, message_);
  }

 private:
  Errc code_ = Errc::ok;
  std::string message_;
};

/// Makes invalid_argument errors whose messages begin with the same words:
///
///     const BadArgument bad{"Camera."};
///     if (width < 1) return bad("width", width, "must be positive");
struct BadArgument {
  const char* subject;  ///< What the message begins with, for example the name of a struct and a dot.

  /// invalid_argument with this message behind the subject.
  Status operator()(const std::string& what) const { return {Errc::invalid_argument, subject + what}; }
  /// "`field` = `value`: `rule`".
  template <class T>
  Status operator()(const char* field, const T& value, const char* rule) const {
    std::string text;
    if constexpr (std::is_arithmetic_v<T>) {
      text = std::to_string(value);
    } else {
      text = value;
    }
    return (*this)(std::string(field) + " = " + text + ": " + rule);
  }
};

/// A value or the Status that says why there is none.
template <class T>
class [[nodiscard]] Result {
 public:
  /// A success.
  Result(T value) : content_(std::move(value)) {}
  /// An error. The status must not be ok.
  Result(Status status) : content_(std::move(status)) {}
  /// An error.
  Result(Errc code, const std::string& message) : content_(Status(code, message)) {}

  /// Whether it is a success.
  bool ok() const noexcept { return content_.index() == 0; }
  explicit operator bool() const noexcept { return ok(); }
  /// The error, or an ok Status.
  Status status() const { return ok() ? Status() : *std::get_if<1>(&content_); }
  /// Kind of the error; Errc::ok for a success.
  Errc code() const noexcept { return ok() ? Errc::ok : std::get_if<1>(&content_)->code(); }
  /// Text for people; empty for a success.
  std::string message() const { return status().message(); }

  /// The value; throws gsnav::Error (aborts under -fno-exceptions) where there is none.
  T& value() & {
    require();
    return *std::get_if<0>(&content_);
  }
  const T& value() const& {
    require();
    return *std::get_if<0>(&content_);
  }
  /// By value, so that `for (auto& x : load().value())` does not outlive what it walks.
  T value() && {
    require();
    return std::move(*std::get_if<0>(&content_));
  }
  /// Member of the value. Throws Error if there is none.
  T* operator->() { return &value(); }
  const T* operator->() const { return &value(); }
  /// The value. Throws Error if there is none.
  T& operator*() & { return value(); }
  const T& operator*() const& { return value(); }
  T operator*() && { return std::move(*this).value(); }

 private:
  void require() const {
    if (!ok()) {
      const Status& s = *std::get_if<1>(&content_);
      detail::fail(s.code(), s.message());
    }
  }
  std::variant<T, Status> content_;
};

}  // namespace gsnav
