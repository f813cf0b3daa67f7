// SPDX-License-Identifier: Apache-2.0
#include "sweep.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <string>
#include <utility>

#include "gsnav/core/rng.hpp"
#include "gsnav/sweep/capsule.hpp"
#include "runner_timing.hpp"

namespace gsnav_report {

using namespace gsnav;

namespace {

using Real = long double;
constexpr Real kInf = std::numeric_limits<Real>::infinity();
/// A motion that comes nearer than half a skin must be stopped.
constexpr Real kContact = 0.5e-4L;
using V = Vec3<Real>;

template <class S>
MovingCapsule<S> cast(const MovingCapsule<double>& m) {
  const auto one = [](const Capsule<double>& c) {
    return Capsule<S>{vec_cast<S>(c.p0), vec_cast<S>(c.p1), static_cast<S>(c.radius)};
  };
  return {one(m.begin), one(m.end)};
}

V random_direction(Rng& rng) { return normalized(V{rng.normal(), rng.normal(), rng.normal()}); }

/// A standing agent that moves by at most 0.25 m and a bone that moves `speed` metres, aimed such that
/// the two meet within a metre. Coordinates are float32 values, so that both precisions get the same
/// motion.
struct Pair {
  MovingCapsule<double> agent, body;
};

Pair random_pair(Rng& rng, double speed) {
  const auto near_float = [](const V& v) { return vec_cast<double>(vec_cast<float>(v)); };
  const auto capsule = [&](const V& p, const V& q, double r) {
    return Capsule<double>{near_float(p), near_float(q), static_cast<double>(static_cast<float>(r))};
  };
  const double radius = rng.uniform(0.1, 0.3), height = rng.uniform(2 * radius, 1.8);
  const V step = random_direction(rng) * static_cast<Real>(0.25 * rng.uniform()),
          up{0, height - 2 * radius, 0};
  Pair p;
  p.agent = {capsule({}, up, radius), capsule(step, step + up, radius)};
  const V travel = random_direction(rng) * static_cast<Real>(speed * rng.uniform(0.5, 1.0));
  const Real when = rng.uniform();
  const V meet = step * when + random_direction(rng) * static_cast<Real>(rng.uniform());
  const V bone = random_direction(rng) * static_cast<Real>(0.2),
          spin = random_direction(rng) * Real(0.2);
  const double r0 = rng.uniform(0.03, 0.2), r1 = rng.uniform(0.03, 0.2);
  const V start = meet - travel * when, stop = meet + travel * (1 - when);
  p.body = {capsule(start - bone, start + bone, r0),
            capsule(stop - bone + spin, stop + bone - spin, r1)};
  return p;
}

Capsule<Real> at(const MovingCapsule<Real>& m, Real t) {
  const auto mix = [t](const auto& x, const auto& y) { return x + (y - x) * t; };
  return {mix(m.begin.p0, m.end.p0), mix(m.begin.p1, m.end.p1), mix(m.begin.radius, m.end.radius)};
}

/// Vector to the nearest point of segment a from the nearest point of segment b. Finds it by bisection
/// on the slope of the distance from a point that moves along a to the segment b, which is convex.
V segment_offset(const V& a0, const V& a1, const V& b0, const V& b1) {
  const V u = a1 - a0, v = b1 - b0;
  const Real vv = dot(v, v);
  const auto offset = [&](Real s) {
    const V w = a0 + u * s - b0;
    return w - v * (vv > 0 ? std::clamp(dot(w, v) / vv, Real(0), Real(1)) : Real(0));
  };
  Real low = 0, high = 1;
  if (dot(offset(0), u) >= 0) high = 0;
  if (dot(offset(1), u) <= 0) low = 1;
  for (int i = 0; i < 66 && low < high; ++i) {
    const Real middle = (low + high) / 2;
    (dot(offset(middle), u) < 0 ? low : high) = middle;
  }
  return offset(std::min(low, high));
}

template <class S>
Row distance_row(const SweepOptions& o, const char* precision) {
  Rng rng(5);
  std::vector<Pair> pairs;
  for (int i = 0; i < o.pairs; ++i) pairs.push_back(random_pair(rng, 1));
  std::vector<MovingCapsule<S>> a, b;
  std::vector<double> errors;
  for (const Pair& p : pairs) {
    a.push_back(cast<S>(p.agent));
    b.push_back(cast<S>(p.body));
    const auto& u = a.back().begin;
    const auto& v = b.back().begin;
    const Real truth = segment_distance_truth(vec_cast<Real>(u.p0), vec_cast<Real>(u.p1),
                                              vec_cast<Real>(v.p0), vec_cast<Real>(v.p1));
    const Real d = segment_distance(u.p0, u.p1, v.p0, v.p1).distance;
    errors.push_back(static_cast<double>(std::abs(d - truth) / std::max(truth, Real(0.01))));
  }
  volatile S sink = 0;
  const Timing t = measure(
      [&] {
        S sum = 0;
        for (std::size_t i = 0; i < a.size(); ++i) {
          sum += segment_distance(a[i].begin.p0, a[i].begin.p1, b[i].begin.p0, b[i].begin.p1).distance;
        }
        sink = sum;
      },
      o.runs, 2.0);
  Row row;
  row.set("kind", "sweep").set("name", std::string("distance, ") + precision).set("backend", "serial");
  row.set("threads", 1)
      .set("error_max", percentile(errors, 1.0))
      .set("error_p99", percentile(errors, 0.99));
  row.set("error_unit", "relative").set("time_p50_ms", t.p50_ms).set("time_p99_ms", t.p99_ms);
  row.set("items_per_second", 1e3 * static_cast<double>(a.size()) / t.p50_ms);
  return row.set("note", "of segments up to 2 m apart, relative to at least 1 cm, against long double");
}

/// Two rows for one speed. The first is the depth that motion reaches in a body before the sweep stops
/// it (0 if the sweep is correct). The second is the room beyond contact that a stopped motion would
/// have left.
template <class S>
void speed_rows(const SweepOptions& o, const char* precision, double speed, std::vector<Row>& rows) {
  Rng rng(static_cast<std::uint64_t>(speed * 1024));
  std::vector<Pair> pairs;
  while (static_cast<int>(pairs.size()) < o.pairs) {
    Pair p = random_pair(rng, speed);
    if (least_gap(p.agent, p.body, 0) > Real(1e-3)) pairs.push_back(p);
  }
  const SweepRules<S> rules;
  std::vector<MovingCapsule<S>> a, b;
  std::vector<double> depth, room;
  for (const Pair& p : pairs) {
    a.push_back(cast<S>(p.agent));
    b.push_back(cast<S>(p.body));
    const auto r = sweep(a.back(), b.back(), rules);
    const Real reached = r.hit ? Real(r.time) : Real(1);
    depth.push_back(static_cast<double>(std::max(-least_gap(p.agent, p.body, reached, 0), Real(0))));
    if (!r.hit) continue;
    const Real whole = least_gap(p.agent, p.body, 1, kInf, kContact);
    room.push_back(static_cast<double>(std::max(whole - kContact, Real(0))));
  }
  volatile S sink = 0;
  const Timing t = measure(
      [&] {
        S sum = 0;
        for (std::size_t i = 0; i < a.size(); ++i) sum += sweep(a[i], b[i], rules).time;
        sink = sum;
      },
      o.runs, 2.0);
  Row row;
  row.set("kind", "sweep")
      .set("backend", "serial")
      .set("threads", 1)
      .set("knob", "speed")
      .set("knob_value", speed);
  row.set("error_unit", "m").set("time_p50_ms", t.p50_ms).set("time_p99_ms", t.p99_ms);
  row.set("items_per_second", 1e3 * static_cast<double>(a.size()) / t.p50_ms);
  const std::string hits = std::to_string(room.size()) + " of " + std::to_string(o.pairs) + " stopped; ";
  row.set("name", std::string("penetration, ") + precision).set("error_max", percentile(depth, 1.0));
  row.set("error_p99", percentile(depth, 0.99)).set("note", hits + "depth reached before the stop");
  rows.push_back(row);
  row.set("name", std::string("needless stop, ") + precision).set("error_max", percentile(room, 1.0));
  row.set("error_p99", percentile(room, 0.99))
      .set("note", hits + "room that the whole motion would have left beyond contact");
  rows.push_back(row);
}

}  // namespace

long double segment_distance_truth(const V& a0, const V& a1, const V& b0, const V& b1) {
  return norm(segment_offset(a0, a1, b0, b1));
}

long double least_gap(const MovingCapsule<double>& a, const MovingCapsule<double>& b, long double end,
                      long double ceiling, long double enough) {
  constexpr Real kTolerance = 1e-8L;
  const MovingCapsule<Real> ma = cast<Real>(a), mb = cast<Real>(b);
  Real least = kInf;
  // Along a fixed direction, the separation of each of the four pairs of endpoints is linear in time.
  // Their least separation at the ends of an interval is therefore a lower bound of the gap within it.
  const auto separation = [&](const V& n, Real t) {
    const Capsule<Real> p = at(ma, t), q = at(mb, t);
    return std::min(dot(n, p.p0), dot(n, p.p1)) - std::max(dot(n, q.p0), dot(n, q.p1)) - p.radius -
           q.radius;
  };
  std::vector<std::pair<Real, Real>> open{{0, end}};
  while (!open.empty()) {
    const auto [t0, t1] = open.back();
    open.pop_back();
    const Real t = (t0 + t1) / 2;
    const Capsule<Real> p = at(ma, t), q = at(mb, t);
    const V offset = segment_offset(p.p0, p.p1, q.p0, q.p1);
    const Real distance = norm(offset);
    least = std::min(least, distance - p.radius - q.radius);
    const V n = distance > 0 ? offset * (1 / distance) : V{};
    if (least < enough) break;
    const Real bound = std::min(separation(n, t0), separation(n, t1));
    if (bound >= std::min(least - kTolerance, ceiling) || t1 - t0 < Real(1e-10)) continue;
    open.push_back({t0, t});
    open.push_back({t, t1});
  }
  return least;
}

std::vector<Row> sweep_rows(const SweepOptions& o) {
  constexpr std::array kSpeeds{0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0};  // metres per motion
  std::size_t done = 0;
  const auto stopped = [&](const std::string& what) {
    return o.on_step && !o.on_step(done, 2 * kSpeeds.size(), what);
  };
  if (stopped("distances of segments")) return {};  // fast, so that it does not count as a step
  std::vector<Row> rows{distance_row<float>(o, "float32"), distance_row<double>(o, "float64")};
  for (const double speed : kSpeeds) {
    char metres[16];
    std::snprintf(metres, sizeof metres, "%g m", speed);
    if (stopped(std::string("sweeps over ") + metres + ", float32")) return {};
    speed_rows<float>(o, "float32", speed, rows);
    ++done;
    if (stopped(std::string("sweeps over ") + metres + ", float64")) return {};
    speed_rows<double>(o, "float64", speed, rows);
    ++done;
  }
  return rows;
}

}  // namespace gsnav_report
