// SPDX-License-Identifier: Apache-2.0
// gsnav-viewer: shows a scene in the browser and lets the user walk through it.
#include <CLI/CLI.hpp>
#include <atomic>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <mutex>
#include <thread>

#include "../common/parse_options.hpp"
#include "http_server.hpp"
#include "page.hpp"
#include "session.hpp"

namespace gsnav_viewer {
namespace {

using gsnav::Status;

/// Paths are compared literally, and nothing else is served.
Reply answer(Session& session, const Request& r) {
  if (r.path == "/") {
    if (r.method == "POST") return {405, "", ""};
    return {200, "text/html; charset=utf-8", std::string(page())};
  }
  if (r.path != "/frame") return {404, "", ""};
  if (r.method != "POST") return {405, "", ""};  // Pictures and links of other sites use GET.
  auto frame = session.frame(r.body);
  if (!frame) return {400, "text/plain; charset=utf-8", frame.message() + "\n"};
  return {200, "application/octet-stream", std::move(*frame)};
}

/// Waits for SIGINT and SIGTERM in its own thread during its lifetime. Before there is a session, they
/// end the process. Files are written aside and renamed, so none is left incomplete.
class Signals {
 public:
  Signals() {
    sigemptyset(&signals_);
    sigaddset(&signals_, SIGINT);
    sigaddset(&signals_, SIGTERM);
    pthread_sigmask(SIG_BLOCK, &signals_, nullptr);  // Threads inherit the mask.
    thread_ = std::thread([this] { wait(); });
  }
  ~Signals() {
    ended_ = true;
    pthread_kill(thread_.native_handle(), SIGTERM);  // Ends the wait if it still waits.
    thread_.join();
  }
  Signals(const Signals&) = delete;
  Signals& operator=(const Signals&) = delete;

  /// Sets the session that the first signal stops. Null: none.
  void stop(Session* session) {
    std::lock_guard lock(mutex_);
    session_ = session;
  }

 private:
  void wait() {
    for (bool stopped = false; !ended_; stopped = true) {
      int which = 0;
      sigwait(&signals_, &which);
      if (ended_) return;
      std::lock_guard lock(mutex_);
      if (session_ == nullptr || stopped) {
        std::fprintf(stderr, "gsnav-viewer: stopped\n");
        std::_Exit(128 + which);
      }
      session_->stop();
    }
  }

  sigset_t signals_;
  std::atomic<bool> ended_{false};
  std::mutex mutex_;
  Session* session_ = nullptr;
  std::thread thread_;
};

Status run(const gsnav_eval::Options& o, const SessionOptions& how, const ServerOptions& where) {
  Signals signals;
  // Before anything is loaded, so that a port in use is reported at once.
  auto server = HttpServer::bind(where);
  if (!server) return server.status();
  auto stage = gsnav_eval::prepare(o);
  if (!stage) return stage.status();
  auto made = Session::create(o, std::move(*stage), how);
  if (!made) return made.status();
  Session& session = **made;
  signals.stop(&session);
  (*server)->serve([&session](const Request& r) { return answer(session, r); });
  std::printf("http://%s:%d/\n", where.address.c_str(), (*server)->port());
  std::fflush(stdout);
  const Status s = session.run();
  session.stop();  // Releases threads that wait for a frame.
  server->reset();
  signals.stop(nullptr);
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
      "Shows a scene in the browser and lets you walk in it: colour, depth, map, people and "
      "metrics.\nOpen the address that it prints. From another machine: ssh -L 7007:127.0.0.1:7007 "
      "HOST.\nCtrl-C ends it."};
  gsnav_eval::add_scene_options(app, o);
  app.add_option("--port", where.port, "port to listen on; 0 takes any free port")
      ->capture_default_str()
      ->check(CLI::Range(0, 65535));
  app.add_option("--bind", where.address,
                 "IPv4 address to listen on; everyone who can reach it can look and steer")
      ->capture_default_str();
  app.add_option("--allow-host", where.allowed_hosts,
                 "host name that browsers may use for the viewer, besides addresses and localhost; may "
                 "be repeated")
      ->type_name("NAME");
  app.add_option("--rate", how.rate, "largest number of frames per second")
      ->capture_default_str()
      ->check(CLI::Range(1.0, 120.0));
  app.add_option("--speed", how.speed, "walking speed, metres per second")
      ->capture_default_str()
      ->check(CLI::Range(0.05, 20.0));
  app.add_option("--quality", how.quality, "quality of JPEG images")
      ->capture_default_str()
      ->check(CLI::Range(1, 100));
  app.add_flag("--paused", how.paused, "begin with time stopped");
  if (const auto status = gsnav_tools::parse_options(app, argc, argv)) return *status;
  const gsnav::Status s = gsnav_viewer::run(o, how, where);
  if (!s) std::fprintf(stderr, "gsnav-viewer: %s\n", s.message().c_str());
  return s ? 0 : 1;
} catch (const std::exception& e) {
  std::fprintf(stderr, "gsnav-viewer: %s\n", e.what());
  return 1;
}
