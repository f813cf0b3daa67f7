// SPDX-License-Identifier: Apache-2.0
// crowd: compares four policies in a crowd, as a table and as images.
#include <CLI/CLI.hpp>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <string>

#include "../../tools/common/canvas.hpp"
#include "../../tools/common/check_values.hpp"
#include "../../tools/common/parse_options.hpp"
#include "crowd.hpp"
#include "gsnav/core/replace_file.hpp"
#include "gsnav/demo.hpp"
#include "gsnav/io/image_file.hpp"

namespace {

using namespace gsnav;
using gsnav_tools::Canvas;
using gsnav_tools::Rgb;

constexpr double kPixels = 32;  // per metre
constexpr Rgb kPaper{0.97f, 0.97f, 0.96f}, kFloor{0.86f, 0.88f, 0.90f}, kPeople{0.85f, 0.45f, 0.25f},
    kAgent{0.10f, 0.35f, 0.75f}, kGoal{0.15f, 0.60f, 0.30f}, kInk{0.2f, 0.2f, 0.2f};

/// Draws the run of one policy up to a tick, seen from above.
void draw(Canvas& canvas, const NavMesh& mesh, const crowd::Episode& e, const crowd::Outcome& o,
          std::size_t tick, double x0, double y0) {
  const Vec3d low = mesh.bounds().low;
  const auto x = [&](const Vec3d& p) { return x0 + (p.x - low.x) * kPixels; };
  const auto y = [&](const Vec3d& p) { return y0 + (p.z - low.z) * kPixels; };
  for (const auto& t : mesh.triangles()) {
    const Vec2<double> p[3] = {{x(t[0]), y(t[0])}, {x(t[1]), y(t[1])}, {x(t[2]), y(t[2])}};
    canvas.triangle(p, kFloor, 1);
  }
  canvas.ring(x(e.goal.position), y(e.goal.position), 7, 3, kGoal, 1);
  const std::size_t now = min(tick, o.track.size() - 1);
  for (const crowd::Person& p : e.people) {
    for (std::size_t k = now - min<std::size_t>(now, 4); k < now; ++k) {
      canvas.stroke(x(p.at[k]), y(p.at[k]), x(p.at[k + 1]), y(p.at[k + 1]), 1.5, kPeople, 0.5f);
    }
    canvas.disc(x(p.at[now]), y(p.at[now]), 0.26 * kPixels, kPeople, 1);
  }
  for (std::size_t k = 0; k < now; ++k) {
    canvas.stroke(x(o.track[k]), y(o.track[k]), x(o.track[k + 1]), y(o.track[k + 1]), 1.5, kAgent, 1);
  }
  canvas.disc(x(o.track[now]), y(o.track[now]), crowd::kRadius * kPixels + 1, kAgent, 1);
}

Status save(const std::filesystem::path& path, const Canvas& c) {
  return io::save_png_rgb8(path, c.bytes(), c.width(), c.height());
}

/// Writes a strip with one row per policy and one column per time, and, on request, one frame
/// per tick with all policies side by side.
Status pictures(const std::filesystem::path& folder, const NavMesh& mesh, const crowd::Episode& e,
                const std::vector<crowd::Outcome>& outcomes, bool frames) {
  const Vec3d size = mesh.bounds().high - mesh.bounds().low;
  constexpr int kGap = 12, kColumns = 5;
  const int w = static_cast<int>(size.x * kPixels) + kGap, h = static_cast<int>(size.z * kPixels) + kGap;
  std::size_t last = 0;
  for (const auto& o : outcomes) last = max(last, o.track.size() - 1);
  const int rows = static_cast<int>(outcomes.size());
  Canvas strip(w * kColumns + kGap, h * rows + kGap + 14, kPaper);
  for (int c = 0; c < kColumns; ++c) {
    const std::size_t tick = last * static_cast<std::size_t>(c + 1) / kColumns;
    char text[32];
    std::snprintf(text, sizeof text, "%.1f S", static_cast<double>(tick) * crowd::kTick);
    strip.text(kGap + c * w, 4, text, 2, kInk);
    for (int r = 0; r < rows; ++r) {
      draw(strip, mesh, e, outcomes[static_cast<std::size_t>(r)], tick, kGap + c * w, 14 + kGap + r * h);
    }
  }
  for (int r = 0; r < rows; ++r)
    strip.text(kGap + 4, 14 + kGap + r * h + 4, crowd::name_of(crowd::kPolicies[r]), 2, kInk);
  if (Status s = save(folder / "strip.png", strip); !s) return s;
  for (std::size_t tick = 0; frames && tick <= last; ++tick) {
    Canvas frame(2 * w + kGap, 2 * h + kGap, kPaper);
    for (std::size_t i = 0; i < outcomes.size(); ++i) {
      draw(frame, mesh, e, outcomes[i], tick, kGap + static_cast<double>(i % 2) * w,
           kGap + static_cast<double>(i / 2) * h);
    }
    char name[32];
    std::snprintf(name, sizeof name, "frame_%04zu.png", tick);
    if (Status s = save(folder / name, frame); !s) return s;
  }
  return {};
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{
      "Compares four policies in a crowd in the embedded flat: shortest path, step filter, local "
      "planner and planner in time. Prints a table.\n\nWith --out it draws the first episode among ten "
      "people (rows: policies; columns: seconds). With --frames it also draws each quarter of a "
      "second, for a video."};
  int episodes = 50;
  std::vector<int> people{10, 30, 100};
  std::string out;
  bool frames = false;
  std::uint64_t seed = 1000000;
  app.add_option("--episodes", episodes, "number of episodes for each number of people")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--people", people, "numbers of people to try")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  app.add_option(
         "--seed", seed,
         "seed of the first episode; the weights of the local planner were chosen on seeds from 0")
      ->capture_default_str();
  app.add_option("--out", out, "folder for the images");
  app.add_flag("--frames", frames, "also write an image of each tick");
  if (const auto status = gsnav_tools::parse_options(app, argc, argv)) return *status;
  Status ready = out.empty() ? Status() : make_output_folder(out);
  if (ready && !out.empty()) ready = gsnav_tools::check_files_in(out, {".png"});
  if (!ready) return gsnav_tools::fail("crowd", "--out " + ready.message());

  const DefaultScene flat = make_default_scene(0.05).value();
  const NavMesh mesh = NavMesh::build({}, flat.vertices, flat.triangles).value();
  std::printf(
      "| people | policy | success %% | SPL %% | CR %% | PSI %% | episodes with contact %% | mean s | "
      "slowest plan ms |\n"
      "|---|---|---|---|---|---|---|---|---|\n");
  bool drawn = out.empty();
  for (const int n : people) {
    std::vector<crowd::Episode> list;
    for (int i = 0; i < episodes; ++i) {
      list.push_back(crowd::make_episode(mesh, seed + static_cast<std::uint64_t>(1000 * n + i), n));
    }
    std::vector<crowd::Outcome> first;
    for (const crowd::Policy policy : crowd::kPolicies) {
      double success = 0, spl = 0, cr = 0, psi = 0, contact = 0, seconds = 0, slowest = 0;
      for (const crowd::Episode& e : list) {
        crowd::Outcome o = crowd::run(mesh, e, policy);
        success += o.metrics.success ? 1 : 0;
        spl += o.metrics.spl;
        cr += o.metrics.collision_rate;
        psi += o.metrics.psi;
        contact += o.metrics.collision_steps > 0 ? 1 : 0;
        seconds += o.seconds;
        slowest = max(slowest, o.slowest_plan);
        if (&e == &list.front()) first.push_back(std::move(o));
      }
      const double share = 100.0 / episodes;
      std::printf("| %d | %s | %.0f | %.1f | %.2f | %.2f | %.0f | %.1f | %.1f |\n", n,
                  crowd::name_of(policy), share * success, share * spl, share * cr, share * psi,
                  share * contact, seconds / episodes, 1e3 * slowest);
      std::fflush(stdout);
    }
    if (drawn) continue;
    drawn = true;
    if (const Status s = pictures(out, mesh, list.front(), first, frames); !s) {
      std::fprintf(stderr, "crowd: %s\n", s.message().c_str());
      return 1;
    }
  }
  return 0;
}
