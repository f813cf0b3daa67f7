// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>

#include "casters.hpp"
#include "gsnav/nav/navmesh.hpp"

namespace gsnav::python {

/// NavMesh::build from arrays of vertices [V][3] and triangles [T][3].
std::shared_ptr<NavMesh> build_navmesh(NavMeshSettings settings, nb::handle vertices,
                                       nb::handle triangles, int threads, const nb::object& progress);
/// NavMesh::surface as a pair of arrays.
nb::tuple navmesh_surface(const NavMesh& mesh, std::optional<std::size_t> island);

}  // namespace gsnav::python
