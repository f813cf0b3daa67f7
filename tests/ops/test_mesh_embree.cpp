// SPDX-License-Identifier: Apache-2.0
// Meshes against a packaged ray tracer, at sizes that the one in mesh_truth.hpp is too slow for.
#include <doctest/doctest.h>
#include <embree3/rtcore.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <set>
#include <utility>
#include <vector>

#include "ops/mesh_images.hpp"

namespace {

using namespace gsnav;
using namespace gsnav_test;

/// The instances' triangles in the world, in Embree.
class Traced {
 public:
  explicit Traced(const std::vector<MeshInstance>& meshes)
      : device_(rtcNewDevice(nullptr)), scene_(rtcNewScene(device_)) {
    rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_ROBUST);
    for (const MeshInstance& m : meshes) {
      RTCGeometry g = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
      auto* v = static_cast<float*>(rtcSetNewGeometryBuffer(
          g, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), m.mesh.vertices.size));
      for (const Vec3f& p : m.mesh.vertices) {
        const Vec3f w = vec_cast<float>(m.world_from_mesh * vec_cast<double>(p));
        *v++ = w.x, *v++ = w.y, *v++ = w.z;
      }
      auto* i = static_cast<std::uint32_t*>(
          rtcSetNewGeometryBuffer(g, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                  3 * sizeof(std::uint32_t), m.mesh.triangle_count()));
      for (const std::uint32_t index : m.mesh.indices) *i++ = index;
      rtcCommitGeometry(g);
      rtcAttachGeometry(scene_, g);
      rtcReleaseGeometry(g);
    }
    rtcCommitScene(scene_);
  }
  ~Traced() {
    rtcReleaseScene(scene_);
    rtcReleaseDevice(device_);
  }
  Traced(const Traced&) = delete;
  Traced& operator=(const Traced&) = delete;

  struct Hit {
    double z;
    std::uint32_t instance, triangle;  ///< instance: by place
  };
  Hit trace(const Camera& c, double px, double py) const {
    const Affine3<double> world = rigid_inverse(c.viewmat);
    const Vec3d along{(px - c.cx) / c.fx, (py - c.cy) / c.fy, 1}, d = world.linear * along;
    RTCRayHit r{};
    r.ray.org_x = static_cast<float>(world.translation.x);
    r.ray.org_y = static_cast<float>(world.translation.y);
    r.ray.org_z = static_cast<float>(world.translation.z);
    r.ray.dir_x = static_cast<float>(d.x);
    r.ray.dir_y = static_cast<float>(d.y);
    r.ray.dir_z = static_cast<float>(d.z);
    r.ray.tnear = static_cast<float>(c.near_plane);  // t is planar z: the ray has z = 1
    r.ray.tfar = std::numeric_limits<float>::infinity();
    r.ray.mask = ~0u;
    r.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcIntersect1(scene_, &context, &r);
    if (r.hit.geomID == RTC_INVALID_GEOMETRY_ID)
      return {std::numeric_limits<double>::infinity(), kNoInstance, kNoInstance};
    return {static_cast<double>(r.ray.tfar), r.hit.geomID, r.hit.primID};
  }

 private:
  RTCDevice device_;
  RTCScene scene_;
};

TEST_CASE("what each pixel shows and how far it is: Embree on the same triangles") {
  MeshScene scene;
  SurfaceMesh ball = sphere(1, 400, 200);
  ball.two_sided = true;
  scene.add(ball).value();
  scene.add(random_triangles(77, 40)).value();
  scene.add(quad({-30, 1.6f, -30}, {30, 1.6f, -30}, {30, 1.6f, 30}, {-30, 1.6f, 30})).value();
  Quatd turned{0.9, 0.1, -0.3, 0.2};
  normalize(turned);
  const std::vector<MeshInstance> meshes{scene.instance(0, {turned, {0.5, 0.2, 4}, 1.3}, 0),
                                         scene.instance(0, {turned, {-2, 0.4, 6}, 0.7}, 1),
                                         scene.instance(1, {turned, {0, 0, 3}, 1}, 2),
                                         scene.instance(2, {}, 3)};
  const Traced truth(meshes);
  Rng rng(78);
  std::size_t pixels = 0, elsewhere = 0, shown = 0;
  double worst = 0;
  std::set<std::pair<std::uint32_t, std::uint32_t>> different;
  for (int view = 0; view < 6; ++view) {
    Camera camera =
        Camera::look_at({rng.uniform(-1, 1), rng.uniform(-0.5, 0.5), rng.uniform(-1, 1)},
                        {rng.uniform(-1, 1), 0.2, 5}, {0, -1, 0}, 160, 120, rng.uniform(40, 110));
    camera.cx += rng.uniform(-20, 20);
    camera.near_plane = 0.05;
    SerialBackend serial;
    const auto drawn = draw<float>(serial, meshes, camera);
    for (int y = 0; y < camera.height; ++y) {
      for (int x = 0; x < camera.width; ++x) {
        const std::size_t i = static_cast<std::size_t>(y * camera.width + x);
        const auto same = [&](const Traced::Hit& h) {
          return h.instance == drawn.instance[i] && h.triangle == drawn.triangle[i];
        };
        Traced::Hit hit = truth.trace(camera, x + 0.5, y + 0.5);
        ++pixels;
        if (!same(hit)) {  // float's rounding of vertices and rays: what is shown lies next to the ray
          ++elsewhere;
          bool near = false;
          for (int k = 0; k < 16 && !near; ++k) {
            const double a = k * 0.39269908169872414, r = k % 2 == 0 ? 0.002 : 0.01;
            near = same(hit = truth.trace(camera, x + 0.5 + r * std::cos(a), y + 0.5 + r * std::sin(a)));
          }
          CAPTURE(x);
          CAPTURE(y);
          CHECK(near);
          continue;
        }
        if (hit.instance == kNoInstance) continue;
        ++shown;
        different.insert({hit.instance, hit.triangle});
        worst = std::max(worst, std::abs(static_cast<double>(drawn.depth[i]) / hit.z - 1));
      }
    }
  }
  CHECK(shown > pixels / 2);
  CHECK(different.size() > 10000);
  CHECK(elsewhere < pixels / 200);
  CHECK(worst < 1e-3);
  MESSAGE(shown << " of " << pixels << " pixels, " << different.size() << " triangles, depth within "
                << worst << ", " << elsewhere << " on an edge");
}

}  // namespace
