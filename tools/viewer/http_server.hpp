// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <list>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "gsnav/core/status.hpp"
#include "http_request.hpp"

namespace gsnav_viewer {

/// What a request is answered with.
struct Reply {
  int status = 200;
  std::string type = "text/plain; charset=utf-8";
  std::string body;
};

struct ServerOptions {
  std::string address =
      "127.0.0.1";  ///< IPv4 to listen at; at a loopback address hosts must be loopback's too
  int port = 0;     ///< 0: any that is free
  std::vector<std::string>
      allowed_hosts{};  ///< names that a Host field may have beside addresses and localhost
  std::size_t most_connections = 16;  ///< more drop the one that was idle longest, or are answered 503
  std::chrono::milliseconds patience{
      5000};  ///< for a whole request, a whole reply, and between requests
};

/// A small HTTP/1.1 server with a thread per connection, whose requests are answered in turn. It reads
/// nothing from disk. (A library would have to be refused a full queue, drop idle connections and keep
/// one deadline per reply; Debian 12's cpp-httplib does none of the three and needs OpenSSL and brotli.)
class HttpServer {
 public:
  using Handler = std::function<Reply(const Request&)>;

  /// Listens; connections wait until serve(). Errors: invalid_argument (the address); backend_failure
  /// (the port is taken, with the system's words).
  static gsnav::Result<std::unique_ptr<HttpServer>> bind(ServerOptions options);
  /// Answers requests from now on, in threads of its own. Once.
  void serve(Handler handler);
  ~HttpServer();  ///< ends all connections
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;

  int port() const noexcept { return options_.port; }

 private:
  using Clock = std::chrono::steady_clock;
  /// Its socket is closed by the accepting thread alone, so that no number is shut down that has been
  /// given anew.
  struct Connection {
    int socket = -1;
    std::atomic<Clock::rep> idle_since{0};  ///< waits for the first byte of a request; 0: busy
    std::atomic<bool> over{false};
    bool dropped = false;
    std::string unread;  ///< received, of the next request
    std::thread thread;
  };

  explicit HttpServer(ServerOptions options) : options_(std::move(options)) {}
  gsnav::Status listen();
  void accept_connections();
  void forget_finished();
  bool make_room();
  void talk(Connection& c) const;
  Reply answer(const Request& request) const;
  bool read_request(Connection& c, ParsedRequest& out) const;
  bool send(int socket, std::string_view bytes) const;
  bool send_reply(int socket, const Reply& reply, bool with_body, bool keep_alive) const;

  ServerOptions options_;
  Handler handler_;
  bool loopback_ = true;
  int listener_ = -1;
  std::atomic<bool> stopping_{false};
  std::list<Connection> connections_;  // of the accepting thread
  std::thread thread_;
};

}  // namespace gsnav_viewer
