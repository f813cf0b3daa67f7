// SPDX-License-Identifier: Apache-2.0
// gsnav-viewer: walks a scene in the browser.
#include <csignal>
#include <cstdio>
#include <exception>
#include <thread>

#include "http_server.hpp"
#include "page.hpp"
#include "session.hpp"

namespace gsnav_viewer {
namespace {

using gsnav::Status;

/// Paths are compared as they are: nothing else is served, whatever a path looks like.
Reply answer(Session& session, const Request& r) {
  if (r.path == "/") return {200, "text/html; charset=utf-8", std::string(page()), {}};
  if (r.path == "/control") {
    if (r.method != "POST") return {405, "", "", {}};
    auto state = session.control(r.body);
    if (!state) return {400, "text/plain; charset=utf-8", state.message() + "\n", {}};
    return {200, "application/json", std::move(*state), {}};
  }
  const Panel panel = r.path == "/stream/color"   ? Panel::color
                      : r.path == "/stream/depth" ? Panel::depth
                                                  : Panel::map;
  if (panel == Panel::map && r.path != "/stream/map") return {404, "", "", {}};
  if (r.method == "POST") return {405, "", "", {}};
  Reply reply{200, "image/jpeg", "", {}};
  reply.next_part = [watcher = Session::Watcher(session, panel)]() mutable { return watcher.next(); };
  return reply;
}

Status run(const gsnav_eval::Options& o, const SessionOptions& how, const ServerOptions& where) {
  // Signals are taken by a thread that waits for them.
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  auto stage = gsnav_eval::prepare(o);
  if (!stage) return stage.status();
  auto made = Session::create(o, std::move(*stage), how);
  if (!made) return made.status();
  Session& session = **made;
  auto server = HttpServer::start(where, [&session](const Request& r) { return answer(session, r); });
  if (!server) return server.status();
  std::printf("http://%s:%d/\n", where.address.c_str(), (*server)->port());
  std::fflush(stdout);
  std::thread waiter([&session, signals] {
    int which = 0;
    sigwait(&signals, &which);
    session.stop();
  });
  const Status s = session.run();
  pthread_kill(waiter.native_handle(), SIGTERM);  // where it still waits
  waiter.join();
  return s;
}

}  // namespace
}  // namespace gsnav_viewer

int main(int argc, char** argv) try {
  gsnav_eval::Options o;
  gsnav_viewer::SessionOptions how;
  gsnav_viewer::ServerOptions where;
  o.width = 448;
  o.height = 336;
  where.port = 7007;
  CLI::App app{
      "Walks a scene in the browser: open the address that it prints (from elsewhere: ssh -L 7007:127.0.0.1:7007 HOST).\n"
      "Colour, depth and map side by side, people, capsules and NavMesh, metrics. Ends with Ctrl-C."};
  gsnav_eval::add_scene_options(app, o);
  app.add_option("--port", where.port, "port to listen at; 0: any that is free")->capture_default_str()->check(CLI::Range(0, 65535));
  app.add_option("--bind", where.address, "IPv4 address to listen at; whoever reaches it can look and steer")
      ->capture_default_str();
  app.add_option("--rate", how.rate, "frames a second at most")->capture_default_str()->check(CLI::Range(1.0, 120.0));
  app.add_option("--speed", how.speed, "of walking, m/s")->capture_default_str()->check(CLI::Range(0.05, 20.0));
  app.add_option("--quality", how.quality, "of JPEG images")->capture_default_str()->check(CLI::Range(1, 100));
  app.add_flag("--paused", how.paused, "time stands still at first");
  CLI11_PARSE(app, argc, argv);
  const gsnav::Status s = gsnav_viewer::run(o, how, where);
  if (!s) std::fprintf(stderr, "gsnav-viewer: %s\n", s.message().c_str());
  return s ? 0 : 1;
} catch (const std::exception& e) {
  std::fprintf(stderr, "gsnav-viewer: %s\n", e.what());
  return 1;
}
