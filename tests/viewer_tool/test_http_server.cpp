// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>
#include <unistd.h>

#include <chrono>
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

/// Echoes bodies; "/large" is more than the system takes before it is read.
Reply echo(const Request& r) {
  if (r.path == "/throw") throw std::bad_alloc();
  if (r.path == "/large") return {200, "text/plain", std::string(64 << 20, 'x')};
  if (r.path != "/") return {404, "", ""};
  return {200, "text/plain", r.method + r.body};
}

std::unique_ptr<HttpServer> server(const ServerOptions& options = quick()) {
  auto s = HttpServer::bind(options).value();
  s->serve(echo);
  return s;
}

const std::string kGet = "GET / HTTP/1.1\r\nHost: localhost\r\n\r\n";

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
  for (const char* path :
       {"/../../etc/passwd", "/%2e%2e/etc/passwd", "//etc/passwd", "/.", "/index.html", "/frame/../"}) {
    const std::string answer = request(port, std::string("GET ") + path);
    CHECK(status_of(answer) == 404);
    CHECK_FALSE(contains(answer, "root:"));
  }
  CHECK(status_of(converse(port, "nonsense\r\n\r\n")) == 400);
  CHECK(status_of(converse(port, std::string("\0\0\0\r\n\r\n", 7))) == 400);
  CHECK(status_of(converse(port, "GET / HTTP/1.1\r\nHost: evil.example\r\nConnection: close\r\n\r\n")) ==
        403);
  CHECK(status_of(request(port, "POST /", "x", "Origin: http://evil.example\r\n")) == 403);
  CHECK(status_of(request(port, "POST /", "x",
                          "Origin: http://127.0.0.1:" + std::to_string(port) + "\r\n")) == 200);
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
  body.send("POST / HTTP/1.1\r\nHost: localhost:" + std::to_string(s->port()) +
            "\r\nContent-Length: 10\r\n\r\nabc");
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
  ServerOptions options = quick();
  options.patience = std::chrono::seconds(2);  // none may run out before the seventh comes
  const auto s = server(options);
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

TEST_CASE("one connection serves one request after the other, also when they come together") {
  const auto s = server();
  Client c(s->port());
  for (int i = 1; i <= 3; ++i) {
    c.send(kGet);
    while (c.text.size() < 3 || !c.text.ends_with("GET")) REQUIRE(c.more());
    CHECK_FALSE(contains(c.text, "Connection: close"));
    c.text.clear();
  }
  c.send(kGet + kGet + "GET / HTTP/1.0\r\n\r\n");
  const std::string& rest = c.all();
  std::size_t answers = 0;
  for (std::size_t at = 0; (at = rest.find("HTTP/1.1 200", at)) != std::string::npos; ++at) ++answers;
  CHECK(answers == 3);
  CHECK(contains(rest, "Connection: close"));
  // Without another request a kept connection ends quietly.
  Client idle(s->port());
  idle.send(kGet);
  CHECK(idle.all().ends_with("GET"));
}

TEST_CASE("clients that do not read lose their place within the time for a reply") {
  const auto s = server();
  std::list<Client> slow;
  for (int i = 0; i < 6; ++i)
    slow.emplace_back(s->port()).send("GET /large HTTP/1.1\r\nHost: localhost\r\n\r\n");
  usleep(100000);
  const auto begin = std::chrono::steady_clock::now();
  std::string answer;
  while (status_of(answer) != 200 &&
         std::chrono::steady_clock::now() - begin < std::chrono::seconds(20)) {
    answer = request(s->port(), "GET /");
    if (status_of(answer) != 200) usleep(20000);
  }
  CHECK(status_of(answer) == 200);  // 0.4 s are the clients', the rest the machine's
  CHECK(std::chrono::steady_clock::now() - begin < std::chrono::seconds(10));
}

TEST_CASE("where every place is taken, the connection that was idle longest makes room") {
  const auto s = server();
  std::list<Client> open;
  for (int i = 0; i < 6; ++i) {
    Client& c = open.emplace_back(s->port());
    c.send(kGet);
    while (!c.text.ends_with("GET")) REQUIRE(c.more());
  }
  Client seventh(s->port());
  seventh.send(kGet);
  while (!seventh.text.ends_with("GET")) REQUIRE(seventh.more());
  CHECK(status_of(seventh.text) == 200);
}

TEST_CASE(
    "hosts and sites that are not the viewer's are refused, and the answer says what allows them") {
  ServerOptions o = quick();
  o.allowed_hosts = {"robot-7.lab"};
  auto s = HttpServer::bind(o).value();
  s->serve(echo);
  const auto from = [&](const std::string& host, const std::string& fields = "",
                        const std::string& method = "POST") {
    return converse(s->port(), method + " / HTTP/1.1\r\nHost: " + host + "\r\nConnection: close\r\n" +
                                   fields + "\r\n");
  };
  CHECK(status_of(from("robot-7.lab:7007")) == 200);
  CHECK(status_of(from("127.0.0.1")) == 200);  // port 80 is left out
  const std::string refused = from("rebound.example");
  CHECK(status_of(refused) == 403);
  CHECK(contains(refused, "--allow-host"));
  CHECK(status_of(from("localhost", "Sec-Fetch-Site: cross-site\r\n")) == 403);
  CHECK(status_of(from("localhost", "Sec-Fetch-Site: same-origin\r\n")) == 200);
  CHECK(status_of(from("localhost", "Sec-Fetch-Site: cross-site\r\n", "GET")) ==
        200);  // a link to the page
}

TEST_CASE("a port is taken when the server is made, and answered from when it serves") {
  auto s = HttpServer::bind(quick()).value();
  CHECK(HttpServer::bind({"127.0.0.1", s->port()}).code() == gsnav::Errc::backend_failure);  // taken
  CHECK(HttpServer::bind({"localhost", 0}).code() == gsnav::Errc::invalid_argument);
  Client early(s->port());
  REQUIRE(early.ok());
  early.send("GET / HTTP/1.0\r\n\r\n");
  s->serve(echo);
  CHECK(status_of(early.all()) == 200);
}
