// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdio>
#include <string>
#include <utility>

#include "gsnav/core/status.hpp"
#include "gsnav/math/functions.hpp"

namespace gsnav::detail {

/// Checks the fields of a struct one after another and keeps the first error, an invalid_argument that
/// names the field, its value and the rule.
/// @code
/// return FieldCheck("Config.").positive("skin", c.skin).in("substeps", c.substeps, 1, 1000).status();
/// @endcode
class FieldCheck {
 public:
  /// @param subject prefix of the messages, such as "TaskConfig."
  explicit FieldCheck(std::string subject) : subject_(std::move(subject)) {}

  /// A value that must be positive and finite.
  FieldCheck& positive(const char* field, double value) {
    return need(value > 0 && is_finite(value), field, value, "must be positive");
  }
  /// A value that must be finite and at least 0.
  FieldCheck& not_negative(const char* field, double value) {
    return need(value >= 0 && is_finite(value), field, value, "must be >= 0");
  }
  /// A value that must be finite.
  FieldCheck& finite(const char* field, double value) {
    return need(is_finite(value), field, value, "must be finite");
  }
  /// A number that must be in [low, high].
  template <class T>
  FieldCheck& in(const char* field, T value, double low, double high) {
    if (static_cast<double>(value) >= low && static_cast<double>(value) <= high) return *this;
    char rule[80];
    std::snprintf(rule, sizeof rule, "must be in [%.12g, %.12g]", low, high);
    return need(false, field, value, rule);
  }
  /// A number or text for which `good` must hold.
  template <class T>
  FieldCheck& need(bool good, const char* field, const T& value, const char* rule) {
    if (!good && status_) status_ = BadArgument{subject_.c_str()}(field, value, rule);
    return *this;
  }

  /// The first error, or ok.
  const Status& status() const noexcept { return status_; }

 private:
  std::string subject_;
  Status status_;
};

}  // namespace gsnav::detail
