// SPDX-License-Identifier: Apache-2.0
// gsnav::Error becomes the exception of gsnav._errors for its code.
#include <pthread.h>

#include <atomic>
#include <exception>

#include "bind.hpp"
#include "guard.hpp"

namespace gsnav::python {
namespace {

std::atomic<bool> used_threads{false}, forked{false};

const char* name_of(Errc code) noexcept {
  switch (code) {
    case Errc::ok:
      break;
    case Errc::invalid_argument:
      return "invalid_argument";
    case Errc::invalid_file:
      return "invalid_file";
    case Errc::file_not_found:
      return "file_not_found";
    case Errc::unsupported:
      return "unsupported";
    case Errc::out_of_memory:
      return "out_of_memory";
    case Errc::nothing_navigable:
      return "nothing_navigable";
    case Errc::backend_failure:
      return "backend_failure";
    case Errc::write_failed:
      return "write_failed";
  }
  return "backend_failure";
}

void translate(const std::exception_ptr& pointer, void*) {
  try {
    std::rethrow_exception(pointer);
  } catch (const Error& e) {
    const nb::object known = nb::module_::import_("gsnav._errors").attr("BY_CODE");
    const nb::object type = known[name_of(e.code())];
    PyErr_SetString(type.ptr(), cut(e.what(), 8000).c_str());
  }
}

}  // namespace

bool lost_threads() noexcept { return forked.load(); }
void note_threads() noexcept { used_threads.store(true); }

void bind_errors(nb::module_&) {
  nb::register_exception_translator(translate);
  pthread_atfork(nullptr, nullptr, [] {
    if (used_threads.load()) forked.store(true);
  });
}

}  // namespace gsnav::python
