// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>

#include <functional>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include "casters.hpp"
#include "list_casters.hpp"

namespace gsnav::python {

/// True for fields that Python reads as a new list. Its elements must not point into the C++ vector.
template <class V>
inline constexpr bool is_list = false;
template <class V>
inline constexpr bool is_list<std::vector<V>> = true;
template <class V, std::size_t N>
inline constexpr bool is_list<std::array<V, N>> = true;

/// True for fields that may be None.
template <class V>
inline constexpr bool is_optional = false;
template <class V>
inline constexpr bool is_optional<std::optional<V>> = true;

template <class V>
struct TypeName {
  static std::string get() {
    if constexpr (std::is_same_v<V, bool>) {
      return "bool";
    } else if constexpr (std::is_integral_v<V>) {
      return "int";
    } else if constexpr (std::is_floating_point_v<V>) {
      return "float";
    } else if constexpr (std::is_same_v<V, std::string>) {
      return "str";
    } else if constexpr (std::is_same_v<V, Vec3d> || std::is_same_v<V, Quatd>) {
      return "collections.abc.Sequence[float] | numpy.typing.NDArray[numpy.float64]";
    } else {
      return nb::cast<std::string>(nb::type<V>().attr("__name__"));
    }
  }
};
template <class V>
struct TypeName<std::optional<V>> {
  static std::string get() { return TypeName<V>::get() + " | None"; }
};
template <class V>
struct TypeName<std::vector<V>> {
  static std::string get() { return "collections.abc.Sequence[" + TypeName<V>::get() + "]"; }
};
template <class V, std::size_t N>
struct TypeName<std::array<V, N>> {
  static std::string get() { return "collections.abc.Sequence[" + TypeName<V>::get() + "]"; }
};

/// Adds a read-only property that is a numpy array with numbers of `type`. get(object) returns it.
template <class C, class Get>
void array_property(nb::class_<C>& c, const char* name, const char* type, const char* doc,
                    const Get& get) {
  const std::string signature =
      std::string("def ") + name + "(self) -> numpy.typing.NDArray[numpy." + type + "]";
  c.def_prop_ro(name, get, nb::sig(signature.c_str()), doc);
}

/// Name of the type of a Python object.
inline std::string type_of(nb::handle object) {
  return nb::cast<std::string>(object.type().attr("__name__"));
}

/// The exception for a field that was given a value of another type.
inline nb::builtin_exception wrong_type(const std::string& name, const std::string& field,
                                        const std::string& type, nb::handle value) {
  return nb::type_error((name + "." + field + ": expected " + type + ", got " + shown(value)).c_str());
}

/// Adds a property for a member of type V. `type` names what it takes in `name`.`field`.
template <class V, class C>
void bind_member(nb::class_<C>& c, const char* name, const char* field, const char* type, V C::*member,
                 const char* doc) {
  const std::string getter = std::string("def ") + field + "(self) -> " + type;
  const std::string setter = std::string("def ") + field + "(self, value: " + type + ", /) -> None";
  c.def_prop_rw(
      field, [member](C& object) -> V& { return object.*member; },
      [member, of = std::string(name), field = std::string(field), type = std::string(type)](
          C& object, nb::handle value) {
        V made{};
        if (!nb::try_cast<V>(value, made)) throw wrong_type(of, field, type, value);
        object.*member = std::move(made);
      },
      nb::for_getter(nb::rv_policy::reference_internal), nb::for_getter(nb::sig(getter.c_str())),
      nb::for_setter(nb::sig(setter.c_str())), nb::for_setter(nb::arg("value").none()), doc);
}

/// Binds a C++ struct of settings or results as a Python class. Fields are attributes and keywords of
/// the constructor. Objects can be printed, copied and pickled.
template <class T, class... Base>
class Struct {
 public:
  Struct(nb::module_& m, const char* name, const char* doc) : class_(m, name, doc), name_(name) {}

  /// Binds a field.
  template <class V, class C>
  Struct& field(const char* name, V C::*member, const char* doc) {
    // Python may hold the value of a field that has become None. It lies in its owner, which it keeps
    // alive, so it must not own other memory.
    static_assert(!is_optional<V> || std::is_trivially_destructible_v<V>);
    const std::string type = TypeName<V>::get();
    const auto set = [member](T& t, nb::handle h) {
      V v{};
      if constexpr (std::is_integral_v<V> && !std::is_same_v<V, bool>) {
        if (PyBool_Check(h.ptr())) return false;  // An integer to Python, and a mistake here.
      }
      if (!nb::try_cast<V>(h, v)) return false;
      if constexpr (is_optional<V>) {
        if (!v) return (t.*member).reset(), true;  // Leaves the numbers that Python may hold.
      }
      t.*member = std::move(v);
      return true;
    };
    const std::string signature = std::string("def ") + name + "(self, value: " + type + ", /) -> None";
    class_.def_prop_rw(
        name, [member](T& t) -> std::conditional_t<is_list<V>, V, V&> { return t.*member; },
        [set, type, of = name_, field = std::string(name)](T& t, nb::handle h) {
          if (!set(t, h)) throw wrong_type(of, field, type, h);
        },
        nb::for_getter(nb::rv_policy::reference_internal), nb::for_setter(nb::sig(signature.c_str())),
        nb::for_setter(nb::arg("value").none()), doc);
    fields_.push_back(
        {name, type, [member](const T& t) { return nb::cast(t.*member, nb::rv_policy::copy); }, set});
    return *this;
  }

  /// Binds a field that is converted by functions. `set` throws if a value is wrong.
  Struct& extra(const char* name, const char* type, nb::object (*get)(const T&),
                void (*set)(T&, nb::handle), const char* doc) {
    const std::string getter =
        std::string("def ") + name + "(self) -> numpy.typing.NDArray[numpy.float64]";
    const std::string setter = std::string("def ") + name + "(self, value: " + type + ", /) -> None";
    class_.def_prop_rw(name, get, set, nb::for_getter(nb::sig(getter.c_str())),
                       nb::for_setter(nb::sig(setter.c_str())), nb::for_setter(nb::arg("value").none()),
                       doc);
    fields_.push_back({name, type, get, [set](T& t, nb::handle h) { return set(t, h), true; }});
    return *this;
  }

  /// Defines the methods that need all fields. Call it last.
  nb::class_<T, Base...>& done() {
    std::string signature = "def __init__(self";
    if (!fields_.empty()) signature += ", *";
    for (const Field& f : fields_) signature += ", " + f.name + ": " + f.type + " = ...";
    signature += ") -> None";
    class_.def(
        "__init__",
        [fields = fields_, name = name_](T* self, const nb::kwargs& values) {
          T made{};
          fill(made, name, fields, values);
          new (self) T(std::move(made));
        },
        nb::sig(signature.c_str()));
    class_.def("__repr__", [fields = fields_, name = name_](const T& self) {
      std::string text = name + "(";
      for (const Field& f : fields) {
        text += (&f == &fields.front() ? "" : ", ") + f.name + "=";
        text += text_of(nb::repr(f.get(self)));
      }
      return text + ")";
    });
    class_.def(
        "__getstate__",
        [fields = fields_](const T& self) {
          nb::dict state;
          for (const Field& f : fields) state[f.name.c_str()] = f.get(self);
          return state;
        },
        nb::sig("def __getstate__(self) -> dict[str, typing.Any]"));
    class_.def("__setstate__", [fields = fields_, name = name_](T& self, const nb::dict& state) {
      T made{};
      fill(made, name, fields, state);
      new (&self) T(std::move(made));
    });
    return class_;
  }

  /// The class, for further methods.
  nb::class_<T, Base...>& python() { return class_; }

 private:
  struct Field {
    std::string name, type;
    std::function<nb::object(const T&)> get;
    std::function<bool(T&, nb::handle)> set;
  };

  static void fill(T& made, const std::string& name, const std::vector<Field>& fields,
                   const nb::dict& values) {
    // A list of its own: code of the caller may change the dict while a value is converted.
    for (const nb::handle item : nb::list(values.attr("items")())) {
      const nb::handle key = item[0], value = item[1];
      const std::string wanted = nb::cast<std::string>(key);
      const Field* found = nullptr;
      std::string known;
      for (const Field& f : fields) {
        if (f.name == wanted) found = &f;
        known += (known.empty() ? "" : ", ") + f.name;
      }
      if (found == nullptr) {
        throw nb::type_error(
            (name + " has no field \"" + cut(wanted) + "\". Its fields are " + known).c_str());
      }
      if (!found->set(made, value)) throw wrong_type(name, wanted, found->type, value);
    }
  }

  nb::class_<T, Base...> class_;
  std::string name_;
  std::vector<Field> fields_;
};

}  // namespace gsnav::python
