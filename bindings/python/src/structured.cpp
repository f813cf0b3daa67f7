// SPDX-License-Identifier: Apache-2.0
#include "structured.hpp"

#include <cstddef>
#include <type_traits>

namespace gsnav::python {
namespace {

/// Collects the fields of a struct for numpy.dtype.
class Layout {
 public:
  template <class T, class V>
  void add(const char* name, const T& object, const V& member) {
    names_.append(name);
    formats_.append(std::is_same_v<V, bool> ? "?" : std::is_same_v<V, double> ? "f8" : "u8");
    static_assert(std::is_same_v<V, bool> || sizeof(V) == 8);
    offsets_.append(reinterpret_cast<const char*>(&member) - reinterpret_cast<const char*>(&object));
  }
  nb::object dtype(std::size_t size) const {
    nb::dict fields;
    fields["names"] = names_;
    fields["formats"] = formats_;
    fields["offsets"] = offsets_;
    fields["itemsize"] = size;
    return nb::module_::import_("numpy").attr("dtype")(fields);
  }

 private:
  nb::list names_, formats_, offsets_;
};

}  // namespace

nb::object step_info_dtype() {
  const StepInfo s;
  Layout layout;
  layout.add("collided", s, s.collided);
  layout.add("wall_collision", s, s.wall_collision);
  layout.add("capsule_blocked", s, s.capsule_blocked);
  layout.add("avatar_contact", s, s.avatar_contact);
  layout.add("avatar_touched", s, s.avatar_touched);
  layout.add("pushed_into", s, s.pushed_into);
  layout.add("moved", s, s.moved);
  layout.add("avatar_clearance", s, s.avatar_clearance);
  layout.add("reward", s, s.reward);
  return layout.dtype(sizeof(StepInfo));
}

nb::object metrics_dtype() {
  const EpisodeMetrics metrics;
  Layout layout;
  for_each_metric(metrics,
                  [&](const char* name, const auto& value) { layout.add(name, metrics, value); });
  return layout.dtype(sizeof(EpisodeMetrics));
}

}  // namespace gsnav::python
