// SPDX-License-Identifier: Apache-2.0
// Progress of a build, and its end by an exception.
#include <doctest/doctest.h>

#include <algorithm>
#include <span>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "gsnav/detail/nav/navmesh_file.hpp"
#include "meshes.hpp"
#include "support/files.hpp"

using namespace gsnav;
using gsnav_test::random_boxes;
using gsnav_test::Soup;

namespace {

NavMeshSettings in_tiles_of(int tile_size) {
  NavMeshSettings s;
  s.cell_size = 0.1;
  s.tile_size = tile_size;
  return s;
}

std::string bytes_of(const NavMesh& mesh) {
  const gsnav_test::TempFolder folder("navmesh_progress");
  save_navmesh(mesh, (folder / "a.navmesh").string()).throw_if_error();
  return gsnav_test::read_file((folder / "a.navmesh").string());
}

}  // namespace

TEST_CASE("progress of a NavMesh rises, comes from the calling thread and changes no bit") {
  const Soup boxes = random_boxes(3, 30, 20);
  for (const int size : {0, 50}) {
    for (const int threads : {1, 3}) {
      std::vector<double> shares;
      bool own = true;
      const auto caller = std::this_thread::get_id();
      const auto mesh =
          NavMesh::build(in_tiles_of(size), boxes.vertices, boxes.triangles, threads, [&](double share) {
            own = own && std::this_thread::get_id() == caller;
            shares.push_back(share);
          });
      REQUIRE(mesh.ok());
      CHECK(own);
      // With threads, the caller may get few of the tiles.
      CHECK(shares.size() > (threads == 1 || size == 0 ? 50u : 0u));
      CHECK(std::is_sorted(shares.begin(), shares.end()));
      CHECK(shares.front() >= 0.0);
      CHECK(shares.back() <= 1.0);
      const auto quiet = NavMesh::build(in_tiles_of(size), boxes.vertices, boxes.triangles, threads);
      CHECK(bytes_of(*mesh) == bytes_of(*quiet));
    }
  }
}

TEST_CASE("an exception of progress leaves the build of a NavMesh, at any share") {
  const Soup boxes = random_boxes(5, 20, 12);
  struct Enough {};  // no std::exception
  for (const int size : {0, 32}) {
    for (const int threads : {1, 3}) {
      for (const double until : {0.0, 0.1, 0.2, 0.4, 0.52, 0.7, 0.97}) {
        double last = 0;
        const auto stop = [&](double share) {
          last = share;
          if (share >= until) throw Enough{};
        };
        // The caller may have no tile left at the last shares.
        bool thrown = false;
        try {
          (void)NavMesh::build(in_tiles_of(size), boxes.vertices, boxes.triangles, threads, stop);
        } catch (const Enough&) {
          thrown = true;
        }
        CHECK(thrown == (last >= until));
        CHECK((thrown || threads > 1));
      }
    }
  }
  const NavMeshPart part{boxes.vertices, boxes.triangles, {}};
  CHECK_THROWS_AS((void)NavMesh::build(in_tiles_of(0), std::span(&part, 1), 0,
                                       [](double) { throw std::runtime_error("parts"); }),
                  std::runtime_error);
}
