// SPDX-License-Identifier: Apache-2.0
#include "http_server.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <exception>
#include <utility>

namespace gsnav_viewer {
namespace {

using gsnav::Errc;
using gsnav::Status;

constexpr int kTick = 100;  // Milliseconds between checks whether the server stops.

const char* reason_of(int status) {
  switch (status) {
    case 200:
      return "OK";
    case 400:
      return "Bad Request";
    case 403:
      return "Forbidden";
    case 404:
      return "Not Found";
    case 405:
      return "Method Not Allowed";
    case 408:
      return "Request Timeout";
    case 413:
      return "Content Too Large";
    case 414:
      return "URI Too Long";
    case 431:
      return "Request Header Fields Too Large";
    case 501:
      return "Not Implemented";
    case 503:
      return "Service Unavailable";
    case 505:
      return "HTTP Version Not Supported";
    default:
      return "Internal Server Error";
  }
}

Reply plain(int status) {
  return {status, "text/plain; charset=utf-8", std::string(reason_of(status)) + "\n"};
}

std::string head_of(const Reply& reply, bool keep_alive) {
  std::string h = "HTTP/1.1 " + std::to_string(reply.status) + " " + reason_of(reply.status) + "\r\n";
  h += "Content-Type: " + reply.type + "\r\nContent-Length: " + std::to_string(reply.body.size()) +
       "\r\n";
  h += keep_alive ? "" : "Connection: close\r\n";
  h += "Cache-Control: no-store\r\nX-Content-Type-Options: nosniff\r\n";
  h += "Cross-Origin-Resource-Policy: same-origin\r\nX-Frame-Options: DENY\r\n";
  if (reply.status == 405) h += "Allow: GET, HEAD, POST\r\n";
  return h + "\r\n";
}

/// Waits for `events` on a socket. Returns 1 if they are possible, 0 if not yet, -1 if never.
int wait_for(int socket, short events) {
  pollfd p{socket, events, 0};
  const int n = poll(&p, 1, kTick);
  if (n < 0) return errno == EINTR ? 0 : -1;
  if (n == 0) return 0;
  return (p.revents & (POLLERR | POLLNVAL)) != 0 ? -1 : 1;
}

}  // namespace

gsnav::Result<std::unique_ptr<HttpServer>> HttpServer::bind(ServerOptions options) {
  std::unique_ptr<HttpServer> s(new HttpServer(std::move(options)));
  if (Status status = s->listen(); !status) return status;
  return s;
}

void HttpServer::serve(Handler handler) {
  handler_ = std::move(handler);
  thread_ = std::thread([this] { accept_connections(); });
}

HttpServer::~HttpServer() {
  stopping_ = true;
  if (thread_.joinable()) thread_.join();
  if (listener_ >= 0) close(listener_);
}

Status HttpServer::listen() {
  sockaddr_in at{};
  at.sin_family = AF_INET;
  at.sin_port = htons(static_cast<std::uint16_t>(options_.port));
  if (options_.port < 0 || options_.port > 65535 ||
      inet_pton(AF_INET, options_.address.c_str(), &at.sin_addr) != 1) {
    return {Errc::invalid_argument,
            options_.address + ":" + std::to_string(options_.port) + " is no IPv4 address and port"};
  }
  loopback_ = (ntohl(at.sin_addr.s_addr) >> 24) == 127;
  const auto failed = [&] {
    return Status(Errc::backend_failure,
                  options_.address + ":" + std::to_string(options_.port) + ": " + std::strerror(errno));
  };
  listener_ = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (listener_ < 0) return failed();
  const int on = 1;
  setsockopt(listener_, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  if (::bind(listener_, reinterpret_cast<const sockaddr*>(&at), sizeof at) != 0 ||
      ::listen(listener_, 32) != 0)
    return failed();
  socklen_t size = sizeof at;
  if (getsockname(listener_, reinterpret_cast<sockaddr*>(&at), &size) != 0) return failed();
  options_.port = ntohs(at.sin_port);
  return {};
}

void HttpServer::forget_finished() {
  for (auto c = connections_.begin(); c != connections_.end();) {
    if (c->over) {
      c->thread.join();
      close(c->socket);
      c = connections_.erase(c);
    } else {
      ++c;
    }
  }
}

/// Returns true if another connection is possible. If there are too many, the one that was idle longest
/// is dropped. A connection with a request waiting is not idle, even if its thread has not read it yet.
bool HttpServer::make_room() {
  std::size_t kept = 0;
  Connection* idle = nullptr;
  Clock::rep since = 0;
  for (Connection& c : connections_) {
    if (c.dropped) continue;
    ++kept;
    pollfd p{c.socket, POLLIN, 0};
    if (poll(&p, 1, 0) != 0) continue;
    const Clock::rep t = c.idle_since;  // Read after the poll, because it is cleared before bytes are
                                        // taken.
    if (t != 0 && (idle == nullptr || t < since)) {
      idle = &c;
      since = t;
    }
  }
  // Dropped connections take a moment to end.
  if (connections_.size() >= 2 * options_.most_connections) return false;
  if (kept < options_.most_connections) return true;
  if (idle == nullptr) return false;
  idle->dropped = true;
  shutdown(idle->socket, SHUT_RDWR);
  return true;
}

void HttpServer::accept_connections() {
  while (!stopping_) {
    const bool somebody = wait_for(listener_, POLLIN) == 1;
    forget_finished();
    if (!somebody) continue;
    const int socket = accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
    if (socket < 0) {
      if (errno == EMFILE || errno == ENFILE)
        std::this_thread::sleep_for(std::chrono::milliseconds(kTick));
      continue;
    }
    const int on = 1;
    setsockopt(socket, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    try {
      if (!make_room()) {
        send_reply(socket, plain(503), true, false);
        close(socket);
        continue;
      }
      Connection& c = connections_.emplace_back();
      c.socket = socket;
      c.thread = std::thread([this, &c] {
        try {
          talk(c);
        } catch (const std::exception&) {
          // Out of memory for one client. Its connection ends, the others continue.
        }
        shutdown(c.socket, SHUT_RDWR);
        c.over = true;
      });
    } catch (const std::exception&) {
      // Out of memory or threads. This client is disconnected, the server continues.
      close(socket);
      if (!connections_.empty() && !connections_.back().thread.joinable()) connections_.pop_back();
    }
  }
  for (Connection& c : connections_) {
    c.thread.join();
    close(c.socket);
  }
}

bool HttpServer::read_request(Connection& c, ParsedRequest& out) const {
  const auto deadline = Clock::now() + options_.patience;
  std::string& bytes = c.unread;
  std::size_t end = std::string::npos;
  std::array<char, 4096> some{};
  out = {};
  c.idle_since = bytes.empty() ? std::max<Clock::rep>(1, Clock::now().time_since_epoch().count()) : 0;
  while (!stopping_) {
    if (end == std::string::npos) {
      end = bytes.find("\r\n\r\n");
      if (end != std::string::npos) {
        out = parse_request(std::string_view(bytes).substr(0, end + 4));
        if (out.status != 200) return true;
      } else if (bytes.size() > kLongestHead) {
        out.status = 431;
        return true;
      }
    }
    if (end != std::string::npos && bytes.size() >= end + 4 + out.request.content_length) {
      out.request.body = bytes.substr(end + 4, out.request.content_length);
      bytes.erase(0, end + 4 + out.request.content_length);
      return true;
    }
    const auto now = Clock::now();
    if (now > deadline) {
      out.status = 408;
      return true;
    }
    const int ready = wait_for(c.socket, POLLIN);
    if (ready < 0) return false;
    if (ready == 0) continue;
    c.idle_since = 0;
    const ssize_t n = recv(c.socket, some.data(), some.size(), 0);
    if (n == 0 || (n < 0 && errno != EAGAIN && errno != EINTR)) return false;
    if (n > 0) bytes.append(some.data(), static_cast<std::size_t>(n));
  }
  return false;
}

void HttpServer::talk(Connection& c) const {
  for (bool first = true, more = true; more; first = false) {
    ParsedRequest r;
    if (!read_request(c, r)) return;
    c.idle_since = 0;
    if (r.status == 408 && !first && c.unread.empty()) return;  // The client has no further request.
    const Reply reply = r.status == 200 ? answer(r.request) : plain(r.status);
    more = r.status == 200 && r.request.keep_alive && !stopping_;
    if (!send_reply(c.socket, reply, r.request.method != "HEAD", more)) return;
  }
  // Read the rest, because unread bytes would make the system discard the answer.
  shutdown(c.socket, SHUT_WR);
  std::array<char, 4096> rest{};
  for (int i = 0;
       i < 16 && wait_for(c.socket, POLLIN) == 1 && recv(c.socket, rest.data(), rest.size(), 0) > 0;
       ++i) {
  }
}

Reply HttpServer::answer(const Request& request) const {
  if (!request.host.empty() && !is_allowed_host(request.host, loopback_, options_.allowed_hosts)) {
    Reply refused = plain(403);
    refused.body =
        "The viewer does not know the host name of this address. Start it with --allow-host NAME.\n";
    return refused;
  }
  // Pages of other sites must not steer or request frames.
  if (request.method == "POST" && is_from_elsewhere(request)) return plain(403);
  Reply reply = handler_(request);
  if (reply.status != 200 && reply.body.empty()) reply = plain(reply.status);
  return reply;
}

bool HttpServer::send(int socket, std::string_view bytes) const {
  const auto deadline = Clock::now() + options_.patience;  // For all bytes, however slowly they are
                                                           // read.
  while (!bytes.empty() && !stopping_) {
    const ssize_t n = ::send(socket, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (n > 0) {
      bytes.remove_prefix(static_cast<std::size_t>(n));
    } else if (n < 0 && errno != EAGAIN && errno != EINTR) {
      return false;
    } else if (wait_for(socket, POLLOUT) < 0) {
      return false;
    }
    if (Clock::now() > deadline) return bytes.empty();
  }
  return bytes.empty();
}

bool HttpServer::send_reply(int socket, const Reply& reply, bool with_body, bool keep_alive) const {
  std::string text = head_of(reply, keep_alive);
  if (with_body) text += reply.body;
  return send(socket, text);
}

}  // namespace gsnav_viewer
