// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <list>
#include <memory>
#include <optional>
#include <string>
#include <thread>

#include "gsnav/core/status.hpp"
#include "http_request.hpp"

namespace gsnav_viewer {

/// What a request is answered with: one body or, where `next_part` is set, JPEG images without end (MJPEG:
/// multipart/x-mixed-replace).
struct Reply {
  int status = 200;
  std::string type = "text/plain; charset=utf-8";
  std::string body;
  /// Waits for the next image; an empty one means none yet, none at all that the stream is over.
  std::function<std::optional<std::string>()> next_part;
};

struct ServerOptions {
  std::string address = "127.0.0.1";  ///< IPv4; at loopback's, requests must name loopback as their host
  int port = 0;                       ///< 0: any that is free
  std::size_t most_connections = 16;  ///< more are answered 503
  std::chrono::milliseconds patience{5000};  ///< for a whole request, and for a client that takes no bytes
};

/// A small HTTP/1.1 server: one request a connection, each answered by `handler` in a thread of its own. Whatever
/// arrives is answered or dropped; nothing is ever read from disk.
class HttpServer {
 public:
  using Handler = std::function<Reply(const Request&)>;

  /// Listens at once. Errors: invalid_argument (the address); backend_failure (the port is taken, with the system's words).
  static gsnav::Result<std::unique_ptr<HttpServer>> start(ServerOptions options, Handler handler);
  ~HttpServer();  ///< ends all connections
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;

  int port() const noexcept { return options_.port; }

 private:
  struct Connection {
    int socket = -1;
    std::atomic<bool> over{false};
    std::thread thread;
  };

  HttpServer(ServerOptions options, Handler handler) : options_(std::move(options)), handler_(std::move(handler)) {}
  gsnav::Status listen();
  void accept_connections();
  void forget_finished();
  void serve(int socket) const;
  Reply answer(const Request& request) const;
  bool read_request(int socket, ParsedRequest& out) const;
  bool send(int socket, std::string_view bytes) const;
  bool send_reply(int socket, const Reply& reply, bool with_body) const;
  void send_stream(int socket, const Reply& reply) const;

  ServerOptions options_;
  Handler handler_;
  bool loopback_ = true;
  int listener_ = -1;
  std::atomic<bool> stopping_{false};
  std::list<Connection> connections_;  // of the accepting thread
  std::thread thread_;
};

}  // namespace gsnav_viewer
