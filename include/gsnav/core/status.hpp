// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdio>
#include <cstdlib>
#include <optional>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>

#include "gsnav/core/text.hpp"

namespace gsnav {

/// Category of an error. The message of the Status names the file, field and value.
enum class Errc {
  ok = 0,             ///< no error
  invalid_argument,   ///< The caller passed an impossible value.
  invalid_file,       ///< A file's content is malformed, truncated or hostile.
  file_not_found,     ///< A path does not exist, or cannot be opened for reading or writing.
  unsupported,        ///< Valid input that gsnav does not handle.
  out_of_memory,      ///< An allocation failed.
  nothing_navigable,  ///< There is no walkable surface, place on it, or path between two places.
  backend_failure,    ///< A device or driver reported an error.
  write_failed,  ///< A file was started and could not be finished (full disk, quota, failing device).
};

/// Exception thrown by `Result::value()` and `Status::throw_if_error()`.
class Error : public std::runtime_error {
 public:
  /// An exception with a code and its message.
  Error(Errc code, const std::string& message) : std::runtime_error(message), code_(code) {}
  /// Category of the error.
  Errc code() const noexcept { return code_; }

 private:
  Errc code_;
};

namespace detail {
/// Throws gsnav::Error. Without exceptions, prints the message and aborts.
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

/// Success, or an error code with a message for people.
class [[nodiscard]] Status {
 public:
  /// Success.
  Status() = default;
  /// An error. `message` is escaped by printable(), because it may contain file names.
  Status(Errc code, const std::string& message) : code_(code), message_(printable(message)) {}

  /// True on success.
  bool ok() const noexcept { return code_ == Errc::ok; }
  /// True on success.
  explicit operator bool() const noexcept { return ok(); }
  /// Category of the error, Errc::ok on success.
  Errc code() const noexcept { return code_; }
  /// What went wrong, where and why. Empty on success.
  const std::string& message() const noexcept { return message_; }
  /// Throws gsnav::Error if this is an error; aborts under -fno-exceptions.
  void throw_if_error() const {
    if (!ok()) detail::fail(code_, message_);
  }

 private:
  Errc code_ = Errc::ok;
  std::string message_;
};

/// Makes invalid_argument errors whose messages share a prefix.
/// @code
/// const BadArgument bad{"Camera."};
/// if (width < 1) return bad("width", width, "must be positive");
/// @endcode
struct BadArgument {
  const char* subject;  ///< prefix of the messages, such as "Camera."

  /// Error whose message is `subject` followed directly by `what`.
  Status operator()(const std::string& what) const { return {Errc::invalid_argument, subject + what}; }
  /// Error with the message "`subject` `field` = `value`: `rule`".
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

/// A value of type T, or the Status that says why there is none.
template <class T>
class [[nodiscard]] Result {
 public:
  /// Holds a value.
  Result(T value) : value_(std::move(value)) {}
  /// Holds an error. `status` must not be ok.
  Result(Status status) : status_(std::move(status)) {}
  /// Holds an error with a code and a message.
  Result(Errc code, const std::string& message) : status_(code, message) {}

  /// True if there is a value.
  bool ok() const noexcept { return value_.has_value(); }
  /// True if there is a value.
  explicit operator bool() const noexcept { return ok(); }
  /// The error, or an ok Status if there is a value.
  Status status() const { return status_; }
  /// Category of the error, Errc::ok if there is a value.
  Errc code() const noexcept { return status_.code(); }
  /// Message of the error, empty if there is a value.
  std::string message() const { return status_.message(); }

  /// The value.
  /// @throws gsnav::Error if there is none (aborts under -fno-exceptions).
  T& value() & {
    require();
    return *value_;
  }
  /// The value, read-only. Throws as above.
  const T& value() const& {
    require();
    return *value_;
  }
  /// Moves the value out. It is returned by value, so that `for (auto& x : load().value())` does not
  /// iterate over a destroyed temporary. Throws as above.
  T value() && {
    require();
    return std::move(*value_);
  }
  /// Access to a member of the value. Throws as above.
  T* operator->() { return &value(); }
  /// Read-only access to a member of the value. Throws as above.
  const T* operator->() const { return &value(); }
  /// The value. Throws as above.
  T& operator*() & { return value(); }
  /// The value, read-only. Throws as above.
  const T& operator*() const& { return value(); }
  /// Moves the value out. Throws as above.
  T operator*() && { return std::move(*this).value(); }

 private:
  void require() const {
    if (!ok()) detail::fail(status_.code(), status_.message());
  }

  Status status_;  ///< Ok if there is a value.
  std::optional<T> value_;
};

}  // namespace gsnav
