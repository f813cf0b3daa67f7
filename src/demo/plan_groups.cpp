// SPDX-License-Identifier: Apache-2.0 Lists the furniture that a room should have.
#include "plan_furniture.hpp"

namespace gsnav::plan {
namespace {

using K = FurnitureKind;
using Groups = std::vector<FurnitureGroup>;

FurnitureGroup single(K kind, double width = 0, double corner = 0) {
  FurnitureGroup g{.pieces = {{kind, 0, 0, false, width, 0}},
                   .tall = kind == K::wardrobe || kind == K::bookshelf || kind == K::bed,
                   .corner = corner,
                   .picture = kind == K::sofa || kind == K::sideboard || kind == K::bed ? 0.7 : 0.0};
  return g;
}

FurnitureGroup seating(double width, bool rug) {
  FurnitureGroup g = single(K::sofa, width, -1);
  g.pieces.push_back({K::coffee_table, 0, 1.85, false, 0, 0});
  if (rug) g.pieces.push_back({K::rug, 0, 1.75, false, 2.5, 1.9});
  return g;
}

FurnitureGroup bed(int tables, bool rug) {
  FurnitureGroup g = single(K::bed, 0, tables == 1 ? 0.5 : -0.5);
  for (int i = 0; i < tables; ++i) {
    g.pieces.push_back({K::bedside_table, i == 0 ? 1.12 : -1.12, 0, false, 0, 0});
  }
  if (rug) g.pieces.push_back({K::rug, 0, 1.75, false, 2.5, 1.5});
  return g;
}

FurnitureGroup desk() {
  FurnitureGroup g = single(K::desk, 0, -0.2);
  g.pieces.push_back({K::chair, -0.1, 0.98, true, 0, 0});
  return g;
}

FurnitureGroup kitchen(double length, bool fridge) {
  FurnitureGroup g = single(K::kitchen_unit, length, 1);
  g.tall = true;
  if (fridge) g.pieces.push_back({K::fridge, length / 2 + 0.36, 0, false, 0, 0});
  return g;
}

FurnitureGroup dining(double width, double depth, int chairs) {
  FurnitureGroup g;
  g.at_wall = false;
  g.pieces.push_back({K::dining_table, 0, 0, false, width, depth});
  const int a_side = chairs / 2;
  for (int i = 0; i < chairs; ++i) {
    const double x = width * ((i / 2 + 0.5) / a_side - 0.5), z = depth / 2 + 0.18;
    g.pieces.push_back({K::chair, x, i % 2 == 0 ? -z : z, i % 2 != 0, 0, 0});
  }
  return g;
}

FurnitureGroup carpet(double width, double depth) {
  FurnitureGroup g{.pieces = {{K::rug, 0, 0, false, width, depth}}, .at_wall = false};
  return g;
}

}  // namespace

std::vector<std::vector<FurnitureGroup>> furniture_for(const PlannedRoom& room, bool only_room,
                                                       Rng& rng) {
  std::vector<Groups> out;
  const auto by_size = [](K kind, std::initializer_list<double> widths, double corner) {
    Groups g;
    for (const double w : widths) g.push_back(single(kind, w, corner));
    return g;
  };
  const auto want = [&](double probability, Groups groups) {
    if (rng.uniform() < probability) out.push_back(std::move(groups));
  };
  switch (room.kind) {
    case RoomKind::living_room:
      if (only_room) out.push_back({kitchen(2.4, true), kitchen(1.8, true)});
      if (only_room) out.push_back({bed(1, false), bed(0, false)});
      out.push_back(
          {seating(2.3, true), seating(1.9, true), seating(1.9, false), single(K::sofa, 1.5, 0)});
      want(0.9, by_size(K::bookshelf, {2.0, 1.6, 1.1}, 0.3));
      want(0.9, by_size(K::sideboard, {1.8, 1.4, 1.0}, 0));
      want(0.8, by_size(K::sofa, {0.95}, 0.6));
      break;
    case RoomKind::kitchen:
      out.push_back({kitchen(3.6, true), kitchen(3.0, true), kitchen(2.4, true), kitchen(1.8, true),
                     kitchen(1.8, false)});
      out.push_back({dining(1.45, 0.85, 4), dining(1.2, 0.8, 4), dining(0.8, 0.8, 2)});
      want(0.6, by_size(K::sideboard, {1.2, 0.9}, 0));
      break;
    case RoomKind::bedroom:
      out.push_back({bed(2, rng.uniform() < 0.6), bed(2, false), bed(1, false), bed(0, false)});
      // Better in front of a window than no bed at all.
      out.back().push_back(bed(1, false));
      out.back().back().tall = false;
      want(1.0, by_size(K::wardrobe, {2.2, 1.65, 1.1}, 0.6));
      want(0.4, {desk()});
      want(0.6, by_size(K::sideboard, {1.2, 0.9}, 0));
      want(0.5, by_size(K::bookshelf, {0.9}, 0.4));
      break;
    case RoomKind::study:
      out.push_back({desk()});
      want(1.0, by_size(K::bookshelf, {2.2, 1.6, 1.0}, 0.3));
      want(0.8, by_size(K::sofa, {1.5}, -0.2));
      want(0.6, by_size(K::bookshelf, {1.2, 0.8}, 0.3));
      want(0.6, {carpet(1.9, 1.4)});
      break;
    case RoomKind::dining_room:
      out.push_back({dining(1.9, 0.95, 6), dining(1.45, 0.85, 4), dining(0.8, 0.8, 2)});
      want(1.0, by_size(K::sideboard, {1.8, 1.2}, -0.3));
      want(0.6, by_size(K::bookshelf, {1.2, 0.8}, 0.3));
      break;
    case RoomKind::hall:
      out.push_back(by_size(K::sideboard, {1.4, 1.0}, -0.3));
      want(0.7, by_size(K::wardrobe, {1.65, 1.1}, 0.6));
      want(0.7, by_size(K::bookshelf, {1.2, 0.8}, 0.3));
      want(0.8, {carpet(2.2, 1.5), carpet(1.6, 1.1)});
      break;
  }
  const bool cosy = room.kind != RoomKind::kitchen && room.kind != RoomKind::hall;
  want(cosy ? 0.7 : 0.0, by_size(K::floor_lamp, {0}, 1));
  want(0.8, by_size(K::plant, {1.1, 0.85}, 1));
  return out;
}

FloorRect footprint_of(const FurnitureGroup::Piece& p) noexcept {
  // Leave some margin around the drawn piece, because fronts have handles and chairs are turned a
  // little.
  const auto at_wall = [](double w, double depth) { return FloorRect{-w / 2, 0, w / 2, depth}; };
  const auto centred = [](double w, double d) { return FloorRect{-w / 2, -d / 2, w / 2, d / 2}; };
  switch (p.kind) {
    case K::sofa:
      return at_wall(p.width, 0.96);
    case K::coffee_table:
      return centred(1.1, 0.58);
    case K::dining_table:
    case K::rug:
      return centred(p.width, p.length);
    case K::chair:
      return centred(0.5, 0.5);
    case K::bed:
      return at_wall(1.72, 2.09);
    case K::bedside_table:
      return at_wall(0.44, 0.42);
    case K::wardrobe:
      return at_wall(p.width, 0.64);
    case K::sideboard:
      return at_wall(p.width, 0.44);
    case K::bookshelf:
      return at_wall(p.width, 0.31);
    case K::desk:
      return at_wall(1.5, 0.67);
    case K::kitchen_unit:
      return at_wall(p.width, 0.67);
    case K::fridge:
      return at_wall(0.66, 0.70);
    case K::plant:
      return centred(p.width, p.width);
    case K::floor_lamp:
      return centred(0.44, 0.44);
  }
  return {};
}

}  // namespace gsnav::plan
