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
using Clock = std::chrono::steady_clock;

constexpr int kTick = 100;  // milliseconds between looks at whether the server stops
constexpr const char* kBoundary = "frame";

const char* reason_of(int status) {
  switch (status) {
    case 200: return "OK";
    case 400: return "Bad Request";
    case 403: return "Forbidden";
    case 404: return "Not Found";
    case 405: return "Method Not Allowed";
    case 408: return "Request Timeout";
    case 413: return "Content Too Large";
    case 414: return "URI Too Long";
    case 431: return "Request Header Fields Too Large";
    case 501: return "Not Implemented";
    case 503: return "Service Unavailable";
    case 505: return "HTTP Version Not Supported";
    default: return "Internal Server Error";
  }
}

Reply plain(int status) { return {status, "text/plain; charset=utf-8", std::string(reason_of(status)) + "\n", {}}; }

std::string head_of(const Reply& reply, const std::string& type) {
  std::string h = "HTTP/1.1 " + std::to_string(reply.status) + " " + reason_of(reply.status) + "\r\n";
  h += "Content-Type: " + type + "\r\nConnection: close\r\nCache-Control: no-store\r\nX-Content-Type-Options: nosniff\r\n";
  h += "Cross-Origin-Resource-Policy: same-origin\r\nX-Frame-Options: DENY\r\n";
  if (reply.status == 405) h += "Allow: GET, HEAD, POST\r\n";
  return h;
}

/// Waits until `events` can be done on a socket: 1 they can, 0 not yet, -1 never.
int wait_for(int socket, short events) {
  pollfd p{socket, events, 0};
  const int n = poll(&p, 1, kTick);
  if (n < 0) return errno == EINTR ? 0 : -1;
  if (n == 0) return 0;
  return (p.revents & (POLLERR | POLLNVAL)) != 0 ? -1 : 1;
}

}  // namespace

gsnav::Result<std::unique_ptr<HttpServer>> HttpServer::start(ServerOptions options, Handler handler) {
  std::unique_ptr<HttpServer> s(new HttpServer(std::move(options), std::move(handler)));
  if (Status status = s->listen(); !status) return status;
  s->thread_ = std::thread([p = s.get()] { p->accept_connections(); });
  return s;
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
  if (options_.port < 0 || options_.port > 65535 || inet_pton(AF_INET, options_.address.c_str(), &at.sin_addr) != 1) {
    return {Errc::invalid_argument, options_.address + ":" + std::to_string(options_.port) + " is no IPv4 address and port"};
  }
  loopback_ = (ntohl(at.sin_addr.s_addr) >> 24) == 127;
  const auto failed = [&] {
    return Status(Errc::backend_failure, options_.address + ":" + std::to_string(options_.port) + ": " + std::strerror(errno));
  };
  listener_ = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (listener_ < 0) return failed();
  const int on = 1;
  setsockopt(listener_, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  if (bind(listener_, reinterpret_cast<const sockaddr*>(&at), sizeof at) != 0 || ::listen(listener_, 32) != 0) return failed();
  socklen_t size = sizeof at;
  if (getsockname(listener_, reinterpret_cast<sockaddr*>(&at), &size) != 0) return failed();
  options_.port = ntohs(at.sin_port);
  return {};
}

void HttpServer::forget_finished() {
  for (auto c = connections_.begin(); c != connections_.end();) {
    if (c->over) {
      c->thread.join();
      c = connections_.erase(c);
    } else {
      ++c;
    }
  }
}

void HttpServer::accept_connections() {
  while (!stopping_) {
    const bool somebody = wait_for(listener_, POLLIN) == 1;
    forget_finished();
    if (!somebody) continue;
    const int socket = accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
    if (socket < 0) {
      if (errno == EMFILE || errno == ENFILE) std::this_thread::sleep_for(std::chrono::milliseconds(kTick));
      continue;
    }
    const int on = 1;
    setsockopt(socket, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    if (connections_.size() >= options_.most_connections) {
      send_reply(socket, plain(503), true);
      close(socket);
      continue;
    }
    Connection& c = connections_.emplace_back();
    c.socket = socket;
    try {
      c.thread = std::thread([this, &c] {
        try {
          serve(c.socket);
        } catch (const std::exception&) {
          // Out of memory for one client: its connection ends, the others go on.
        }
        close(c.socket);
        c.over = true;
      });
    } catch (const std::exception&) {
      close(socket);
      connections_.pop_back();
    }
  }
  for (Connection& c : connections_) c.thread.join();
}

bool HttpServer::read_request(int socket, ParsedRequest& out) const {
  const auto deadline = Clock::now() + options_.patience;
  std::string bytes;
  std::size_t end = std::string::npos;
  std::array<char, 4096> some{};
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
      return true;
    }
    if (Clock::now() > deadline) {
      out.status = 408;
      return true;
    }
    const int ready = wait_for(socket, POLLIN);
    if (ready < 0) return false;
    if (ready == 0) continue;
    const ssize_t n = recv(socket, some.data(), some.size(), 0);
    if (n == 0 || (n < 0 && errno != EAGAIN && errno != EINTR)) return false;
    if (n > 0) bytes.append(some.data(), static_cast<std::size_t>(n));
  }
  return false;
}

void HttpServer::serve(int socket) const {
  ParsedRequest r;
  if (!read_request(socket, r)) return;
  const Reply reply = r.status == 200 ? answer(r.request) : plain(r.status);
  if (reply.next_part && r.request.method == "GET") {
    send_stream(socket, reply);
  } else if (send_reply(socket, reply, r.request.method != "HEAD")) {
    // What was not read would make the system take the answer back.
    shutdown(socket, SHUT_WR);
    std::array<char, 4096> rest{};
    for (int i = 0; i < 16 && wait_for(socket, POLLIN) == 1 && recv(socket, rest.data(), rest.size(), 0) > 0; ++i) {
    }
  }
}

Reply HttpServer::answer(const Request& request) const {
  if (loopback_ && !request.host.empty() && !is_loopback_host(request.host, options_.port)) return plain(403);
  // Pages of other sites may not steer.
  if (!request.origin.empty() && request.origin != "http://" + request.host) return plain(403);
  Reply reply = handler_(request);
  if (reply.status != 200 && reply.body.empty()) reply = plain(reply.status);
  return reply;
}

bool HttpServer::send(int socket, std::string_view bytes) const {
  auto deadline = Clock::now() + options_.patience;
  while (!bytes.empty() && !stopping_) {
    const ssize_t n = ::send(socket, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (n > 0) {
      bytes.remove_prefix(static_cast<std::size_t>(n));
      deadline = Clock::now() + options_.patience;
    } else if (n < 0 && errno != EAGAIN && errno != EINTR) {
      return false;
    } else if (Clock::now() > deadline || wait_for(socket, POLLOUT) < 0) {
      return false;
    }
  }
  return bytes.empty();
}

bool HttpServer::send_reply(int socket, const Reply& reply, bool with_body) const {
  std::string text = head_of(reply, reply.type) + "Content-Length: " + std::to_string(reply.body.size()) + "\r\n\r\n";
  if (with_body) text += reply.body;
  return send(socket, text);
}

void HttpServer::send_stream(int socket, const Reply& reply) const {
  const std::string line = std::string("--") + kBoundary + "\r\n";
  if (!send(socket, head_of(reply, std::string("multipart/x-mixed-replace; boundary=") + kBoundary) + "\r\n" + line)) return;
  while (!stopping_) {
    const std::optional<std::string> part = reply.next_part();
    if (!part) return;
    // A client that has gone is noticed although there is nothing to send.
    pollfd p{socket, POLLIN, 0};
    char byte = 0;
    if (poll(&p, 1, 0) > 0 && recv(socket, &byte, 1, MSG_PEEK) == 0) return;
    if (part->empty()) continue;
    const std::string head = "Content-Type: image/jpeg\r\nContent-Length: " + std::to_string(part->size()) + "\r\n\r\n";
    if (!send(socket, head + *part + "\r\n" + line)) return;
  }
}

}  // namespace gsnav_viewer
