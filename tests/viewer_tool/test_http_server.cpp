// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <list>

#include "../../tools/viewer/http_server.hpp"
#include "http_client.hpp"
#include "support/files.hpp"

using namespace gsnav_test;
using namespace gsnav_viewer;

namespace {

ServerOptions quick() {
  ServerOptions o;
  o.patience = std::chrono::milliseconds(400);
  o.most_connections = 6;
  return o;
}

/// Echoes bodies; "/stream" counts.
Reply echo(const Request& r) {
  if (r.path == "/stream") {
    Reply reply;
    reply.next_part = [n = 0]() mutable -> std::optional<std::string> {
      if (++n == 2) return std::string();  // none yet
      if (n > 4) return {};
      return "part" + std::to_string(n);
    };
    return reply;
  }
  if (r.path == "/throw") throw std::bad_alloc();
  if (r.path != "/") return {404, "", "", {}};
  return {200, "text/plain", r.method + r.body, {}};
}

std::unique_ptr<HttpServer> server() { return HttpServer::start(quick(), echo).value(); }

}  // namespace

TEST_CASE("a server answers, whatever was asked before") {
  const auto s = server();
  const int port = s->port();
  const auto get = [&] { return request(port, "GET /"); };
  CHECK(status_of(get()) == 200);
  CHECK(body_of(get()) == "GET");
  CHECK(body_of(request(port, "POST /", "hello")) == "POSThello");
  const std::string head = request(port, "HEAD /");
  CHECK(status_of(head) == 200);
  CHECK(body_of(head).empty());
  CHECK(contains(head, "Content-Length: 4\r\n"));
  for (const char* path : {"/../../etc/passwd", "/%2e%2e/etc/passwd", "//etc/passwd", "/.", "/index.html", "/stream/../"}) {
    const std::string answer = request(port, std::string("GET ") + path);
    CHECK(status_of(answer) == 404);
    CHECK_FALSE(contains(answer, "root:"));
  }
  CHECK(status_of(converse(port, "nonsense\r\n\r\n")) == 400);
  CHECK(status_of(converse(port, std::string("\0\0\0\r\n\r\n", 7))) == 400);
  CHECK(status_of(converse(port, "GET / HTTP/1.1\r\nHost: localhost:1\r\n\r\n")) == 403);
  CHECK(status_of(request(port, "POST /", "x", "Origin: http://evil.example\r\n")) == 403);
  CHECK(status_of(request(port, "POST /", "x", "Origin: http://127.0.0.1:" + std::to_string(port) + "\r\n")) == 200);
  CHECK(status_of(request(port, "GET /", "", "a: " + std::string(9000, 'x') + "\r\n")) == 431);
  CHECK(status_of(converse(port, std::string(100000, 'x'))) == 431);  // no end of a line at all
  CHECK(status_of(request(port, "POST /", std::string(5000, 'x'))) == 413);
  CHECK(request(port, "GET /throw").empty());  // out of memory: that connection only
  CHECK(status_of(get()) == 200);
}

TEST_CASE("who sends half a request or nothing is sent away, and others are served meanwhile") {
  const auto s = server();
  Client silent(s->port()), half(s->port()), body(s->port());
  half.send("GET / HT");
  body.send("POST / HTTP/1.1\r\nHost: localhost:" + std::to_string(s->port()) + "\r\nContent-Length: 10\r\n\r\nabc");
  CHECK(status_of(request(s->port(), "GET /")) == 200);
  CHECK(status_of(silent.all()) == 408);
  CHECK(status_of(half.all()) == 408);
  CHECK(status_of(body.all()) == 408);
  Client gone(s->port());
  gone.send("GET / HT");
  gone.finish();
  CHECK(gone.all().empty());
  CHECK(status_of(request(s->port(), "GET /")) == 200);
}

TEST_CASE("more connections than there may be are told so, and leave room again") {
  const auto s = server();
  std::list<Client> open;
  for (int i = 0; i < 6; ++i) {
    open.emplace_back(s->port()).send("GET");
  }
  std::string answer;
  for (int i = 0; i < 50 && status_of(answer) != 503; ++i) answer = request(s->port(), "GET /");
  CHECK(status_of(answer) == 503);
  for (Client& c : open) CHECK(status_of(c.all()) == 408);
  open.clear();
  for (int i = 0; i < 50 && status_of(answer) != 200; ++i) answer = request(s->port(), "GET /");
  CHECK(status_of(answer) == 200);
}

TEST_CASE("a stream is parts with their lengths, until it is over or its reader leaves") {
  const auto s = server();
  const std::string all = request(s->port(), "GET /stream");
  CHECK(status_of(all) == 200);
  CHECK(contains(all, "multipart/x-mixed-replace; boundary=frame\r\n"));
  CHECK(body_of(all) == "--frame\r\nContent-Type: image/jpeg\r\nContent-Length: 5\r\n\r\npart1\r\n"
                        "--frame\r\nContent-Type: image/jpeg\r\nContent-Length: 5\r\n\r\npart3\r\n"
                        "--frame\r\nContent-Type: image/jpeg\r\nContent-Length: 5\r\n\r\npart4\r\n--frame\r\n");
  for (int i = 0; i < 8; ++i) {
    Client leaves(s->port());
    leaves.send("GET /stream HTTP/1.0\r\n\r\n");
  }
  CHECK(HttpServer::start({"127.0.0.1", s->port()}, echo).code() == gsnav::Errc::backend_failure);  // taken
  CHECK(HttpServer::start({"localhost", 0}, echo).code() == gsnav::Errc::invalid_argument);
}
