// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/demo/default_scene.hpp"

#include <string>

#include "flat_parts.hpp"
#include "gsnav/detail/core/field_check.hpp"

namespace gsnav {
namespace flat {
namespace {

constexpr double kWest = 0.0, kEast = 10.0, kSouth = 0.0, kNorth = 8.0;  // z grows to the north
constexpr double kKitchen = 6.0, kStudy = 4.6, kMiddle = 4.6;            // centres of the inner walls
constexpr double kHalf = kWallThickness / 2;

using O = Opening;
const O kLivingKitchen{O::door, 1.3, 3.1, 0, 2.2};
const O kLivingBedroom{O::door, 0.7, 1.7, 0, 2.1};
const O kLivingStudy{O::door, 4.75, 5.75, 0, 2.1};
const O kKitchenStudy{O::door, 7.1, 8.1, 0, 2.1};
const O kBedroomStudy{O::door, 6.3, 7.3, 0, 2.1};

O far_side(O o) {
  o.kind = O::doorway_made_elsewhere;
  return o;
}

void walls(Painter& p, const Vec3d (&paint)[4], const std::vector<Opening> (&openings)[4]) {
  const Side sides[] = {Side::x_low, Side::x_high, Side::z_low, Side::z_high};
  for (int i = 0; i < 4; ++i) wall(p, sides[i], paint[i], openings[i]);
}

void living_room(Painter& p) {
  p.add_room({{kWest, 0, kSouth}, {kKitchen - kHalf, kCeiling, kMiddle - kHalf}}, srgb(0xe0bf94));
  const Vec3d cream = srgb(0xf0eadf), sage = srgb(0x9cab92);
  walls(p, {sage, cream, cream, cream},
        {{},
         {kLivingKitchen},
         {{O::window, 1.25, 2.65, 0.85, 2.25}, {O::window, 3.5, 4.9, 0.85, 2.25}},
         {kLivingBedroom, kLivingStudy}});
  wood_floor(p, srgb(0xc0905c));

  p.place({0, 0, 0});
  const Vec3d linen = srgb(0xe9dfcc);
  for (const double x : {0.86, 2.62, 3.12, 4.88}) curtain(p, x, x + 0.42, linen);
  p.place({0.06, 0, 2.35}, kQuarter);
  sofa(p, 2.35, srgb(0x3c6a70), srgb(0xd9a441), srgb(0xc8553d));
  picture(p, -0.45, 1.58, 1.10, 0.74, 3);
  picture(p, 0.58, 1.62, 0.52, 0.66, 1);
  p.place({2.35, 0, 2.35});
  rug(p, 2.7, 2.1, 0);
  p.place({2.15, 0, 2.35}, kQuarter);
  coffee_table(p);
  p.place({3.05, 0, 4.54}, 2 * kQuarter);
  bookshelf(p, 1.75, 2.05, 1);
  p.place({5.94, 0, 3.75}, -kQuarter);
  sideboard(p, 1.05);
  picture(p, 0.0, 1.55, 0.60, 0.80, 2);
  p.place({4.15, 0, 0.50}, -0.35);
  sofa(p, 0.92, srgb(0xb9a184), srgb(0x2f5d62), srgb(0x2f5d62));
  p.place({0.45, 0, 0.55});
  floor_lamp(p);
  p.place({5.48, 0, 0.48});
  plant(p, 1.15, 1);
  p.place({3.1, 0, 2.3});
  pendant(p, 0.55, 0.8);
  ceiling(p);
}

void kitchen_room(Painter& p) {
  p.add_room({{kKitchen + kHalf, 0, kSouth}, {kEast, kCeiling, kMiddle - kHalf}}, srgb(0xd8d2c6));
  const Vec3d white = srgb(0xf2efe8);
  walls(p, {white, white, srgb(0xe9e4d6), white},
        {{far_side(kLivingKitchen)}, {}, {{O::window, 6.9, 8.5, 0.95, 2.2}}, {kKitchenStudy}});
  tile_floor(p);
  p.place({10.0, 0, 1.75}, -kQuarter);
  kitchen(p, 3.4);
  p.place({10.0, 0, 3.85}, -kQuarter);
  fridge(p);
  p.place({7.65, 0, 1.95});
  table(p, 1.45, 0.85, 0.75, srgb(0xb98a5a));
  vase(p, {-0.1, 0.75, 0.05});
  p.cone({0.35, 0.75, -0.1}, 0.07, 0.13, 0.06, plain(srgb(0xe8e0cf)), 0.018, false);
  p.box({-0.62, 0.75, -0.32}, {-0.28, 0.756, -0.08}, plain(srgb(0x7a9e9f)), 0.024, Painter::kAll, false);
  p.place({7.27, 0, 1.36}, 0.0);
  chair(p, srgb(0xd9a441));
  p.place({8.05, 0, 1.33}, -0.12);
  chair(p, srgb(0xd9a441));
  p.place({7.25, 0, 2.56}, 2 * kQuarter + 0.10);
  chair(p, srgb(0xd9a441));
  p.place({8.07, 0, 2.58}, 2 * kQuarter);
  chair(p, srgb(0xd9a441));
  p.place({6.06, 0, 3.85}, kQuarter);
  picture(p, 0.0, 1.6, 0.85, 0.6, 6);
  p.place({9.55, 0, 0.30});
  p.place({7.65, 0, 1.95});
  pendant(p, 0.95, 1.0);
  ceiling(p);
}

void bedroom(Painter& p) {
  p.add_room({{kWest, 0, kMiddle + kHalf}, {kStudy - kHalf, kCeiling, kNorth}}, srgb(0xd8b890));
  const Vec3d cream = srgb(0xefe9df), blue = srgb(0x8ea3b5);
  walls(p, {blue, cream, cream, cream},
        {{}, {kBedroomStudy}, {far_side(kLivingBedroom)}, {{O::window, 2.2, 3.8, 0.85, 2.25}}});
  wood_floor(p, srgb(0xb98a5a));
  p.place({0, 0, 8}, 2 * kQuarter);
  for (const double x : {-4.22, -2.20}) curtain(p, x, x + 0.44, srgb(0xdfe5e8));
  p.place({0.02, 0, 6.5}, kQuarter);
  bed(p, srgb(0x7f97a8));
  picture(p, 0.0, 1.62, 1.15, 0.62, 9);
  p.place({0.02, 0, 5.36}, kQuarter);
  bedside(p, true);
  p.place({0.02, 0, 7.64}, kQuarter);
  bedside(p, false);
  p.place({3.15, 0, 4.66}, 0.0);
  wardrobe(p, 1.95);
  p.place({2.85, 0, 6.35}, kQuarter);
  rug(p, 1.9, 1.2, 1);
  p.place({4.14, 0, 7.62});
  plant(p, 0.85, 2);
  p.place({2.3, 0, 6.3});
  pendant(p, 0.50, 0.6);
  ceiling(p);
}

void study(Painter& p) {
  p.add_room({{kStudy + kHalf, 0, kMiddle + kHalf}, {kEast, kCeiling, kNorth}}, srgb(0xd8b890));
  const Vec3d cream = srgb(0xf1ebe0), clay = srgb(0xcf9f7c);
  walls(p, {cream, clay, cream, cream},
        {{far_side(kBedroomStudy)},
         {},
         {far_side(kLivingStudy), far_side(kKitchenStudy)},
         {{O::window, 6.6, 8.4, 0.9, 2.2}}});
  wood_floor(p, srgb(0xc0905c));
  p.place({0, 0, 8}, 2 * kQuarter);
  for (const double x : {-8.80, -6.62}) curtain(p, x, x + 0.42, srgb(0xe8d9c0));
  p.place({7.5, 0, 7.92}, 2 * kQuarter);
  desk(p);
  p.place({7.45, 0, 6.92}, 0.25);
  chair(p, srgb(0x3a4a52));
  p.place({10.0, 0, 6.45}, -kQuarter);
  bookshelf(p, 1.9, 2.05, 7);
  p.place({9.05, 0, 4.72});
  sofa(p, 1.45, srgb(0x8a8f6a), srgb(0xe6d8bd), srgb(0xb0573b));
  picture(p, 0.0, 1.55, 0.95, 0.62, 5);
  p.place({7.0, 0, 6.0});
  round_rug(p, 0.95);
  p.place({4.95, 0, 7.62});
  plant(p, 1.0, 3);
  p.place({9.62, 0, 7.64});
  floor_lamp(p);
  p.place({7.2, 0, 6.1});
  pendant(p, 0.55, 0.7);
  ceiling(p);
}

}  // namespace
}  // namespace flat

std::array<DefaultView, 4> default_scene_views() noexcept {
  return {{{"living", {5.65, 1.5, 3.35}, {1.5, 0.95, 1.55}},
           {"kitchen", {6.5, 1.5, 4.1}, {8.9, 1.0, 1.0}},
           {"bedroom", {4.3, 1.5, 5.55}, {0.9, 0.75, 6.95}},
           {"study", {5.2, 1.5, 5.1}, {8.6, 0.95, 7.2}}}};
}

Status validate(const SceneSampling& s) {
  detail::FieldCheck check("");
  check.in("density", s.density, 0.05, 20);
  check.need(s.gaussians <= kMostSceneGaussians, "gaussians", s.gaussians,
             ("must be at most " + std::to_string(kMostSceneGaussians)).c_str());
  return check.in("sh_degree", s.sh_degree, 0, kMaxShDegree).status();
}

Result<DefaultScene> make_default_scene(const SceneSampling& sampling) {
  flat::Painter painter;
  flat::living_room(painter);
  flat::kitchen_room(painter);
  flat::bedroom(painter);
  flat::study(painter);
  return painter.finish(sampling);
}

Result<DefaultScene> make_default_scene(double density) {
  SceneSampling sampling;
  sampling.density = density;
  return make_default_scene(sampling);
}

}  // namespace gsnav
