// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/open/open_scene.hpp"

#include <chrono>
#include <cmath>
#include <exception>
#include <new>
#include <string>
#include <utility>

#include "gsnav/detail/core/field_check.hpp"
#include "gsnav/detail/demo/people.hpp"
#include "gsnav/detail/scene/up_axis.hpp"
#include "parts.hpp"

namespace gsnav {
namespace {

/// Returns invalid_argument naming the field that is out of range, or ok.
Status validate(const OpenOptions& o) {
  detail::FieldCheck check("OpenOptions.");
  check.finite("time", o.time).need(o.level >= 0, "level", o.level, "must be >= 0");
  check.not_negative("unseen_color", o.unseen_color).positive("cell_size", o.cell_size);
  check.not_negative("agent_radius", o.agent_radius).positive("agent_height", o.agent_height);
  for (int k = 0; o.crop && k < 3; ++k) {
    for (const auto& [field, at] : {std::pair{"crop.low", o.crop->low}, {"crop.high", o.crop->high}})
      check.need(!std::isnan(at[k]), field, at[k], "must be a number");
  }
  check.in("people", o.people, 0, static_cast<double>(kMaxPeople));
  if (!check.in("density", o.density, 0.05, 20).status()) return check.status();
  if (o.up != "auto" && o.up != "keep") {
    if (const auto turned = upright(o.up); !turned)
      return {turned.code(), "OpenOptions.up: " + turned.message() + ", or auto or keep"};
  }
  return {};
}

Result<OpenedScene> open(const std::string& name, const OpenOptions& options) {
  const auto from = std::chrono::steady_clock::now();
  if (Status s = validate(options); !s) return s;
  auto source = detail::scene_source(name);
  if (!source) return source.status();
  detail::OpeningScene s{options, std::move(*source), {}, {}, {}, {}};
  s.out.name = s.source.name;
  s.tell("Gaussians");
  if (Status status = detail::open_gaussians(s); !status) return status;
  s.tell("triangles");
  if (Status status = detail::open_triangles(s); !status) return status;
  s.out.load_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - from).count();
  if (Status status = detail::open_navmesh(s); !status) return status;
  if (Status status = detail::open_visible_sets(s); !status) return status;
  if (options.keep_triangles)
    s.out.triangles = std::make_shared<const NavMeshTriangles>(std::move(s.triangles));
  s.out.scene = std::make_shared<const SimulatorScene>(std::move(s.scene));
  return std::move(s.out);
}

}  // namespace

Result<OpenedScene> open_scene(const std::string& name, const OpenOptions& options) {
  // Some of the work turns exceptions into errors, or goes on after an error.
  std::exception_ptr thrown;
  OpenOptions watched = options;
  if (options.progress) {
    watched.progress = [&](const std::string& task, double share) {
      if (thrown) std::rethrow_exception(thrown);
      try {
        options.progress(task, share);
      } catch (...) {
        thrown = std::current_exception();
        throw;
      }
    };
  }
  Result<OpenedScene> opened = Status(Errc::backend_failure, name);
  try {
    opened = open(name, watched);
  } catch (const std::bad_alloc&) {
    opened = Status(Errc::out_of_memory, name + ": out of memory");
  } catch (const std::exception& e) {
    opened = Status(Errc::backend_failure, name + ": " + e.what());
  } catch (...) {
    if (!thrown) throw;
  }
  if (thrown) std::rethrow_exception(thrown);
  return opened;
}

}  // namespace gsnav
