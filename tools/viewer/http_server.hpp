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

/// Answer to a request.
struct Reply {
  int status = 200;
  std::string type = "text/plain; charset=utf-8";
  std::string body;
};

struct ServerOptions {
  std::string address = "127.0.0.1";  ///< IPv4 address to listen on. On a loopback address, only
                                      ///< loopback hosts are accepted.
  int port = 0;                       ///< 0: any free port.
  std::vector<std::string>
      allowed_hosts{};  ///< Names that a Host field may have in addition to addresses and localhost.
  std::size_t most_connections = 16;  ///< Beyond this, the connection that was idle longest is dropped,
                                      ///< or the new one gets 503.
  std::chrono::milliseconds patience{
      5000};  ///< Time for a whole request, for a whole reply, and between requests.
};

/// A small HTTP/1.1 server with one thread per connection, which answers requests in order. It reads
/// nothing from disk. (A library would have to limit its queue, drop idle connections and apply one
/// deadline per reply. cpp-httplib of Debian 12 does none of these and needs OpenSSL and brotli.)
class HttpServer {
 public:
  using Handler = std::function<Reply(const Request&)>;

  /// Starts listening. Connections wait until serve().
  /// @return invalid_argument for the address; backend_failure, with the system's message, if the port
  /// is taken.
  static gsnav::Result<std::unique_ptr<HttpServer>> bind(ServerOptions options);
  /// Starts answering requests, in threads of the server. Call it once.
  void serve(Handler handler);
  ~HttpServer();  ///< Ends all connections.
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;

  int port() const noexcept { return options_.port; }

 private:
  using Clock = std::chrono::steady_clock;
  /// Only the accepting thread closes the socket, so that no reused descriptor is shut down.
  struct Connection {
    int socket = -1;
    std::atomic<Clock::rep> idle_since{0};  ///< Time since which it waits for the first byte of a
                                            ///< request. 0: busy.
    std::atomic<bool> over{false};
    bool dropped = false;
    std::string unread;  ///< Received bytes of the next request.
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
  std::list<Connection> connections_;  // Used by the accepting thread.
  std::thread thread_;
};

}  // namespace gsnav_viewer
