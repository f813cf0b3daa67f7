// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <string>
#include <vector>

#include "../../tools/viewer/http_request.hpp"
#include "gsnav/core/rng.hpp"

using namespace gsnav_viewer;

namespace {

const std::string kHost = "Host: localhost:7007\r\n";
int status(const std::string& head) { return parse_request(head).status; }

}  // namespace

TEST_CASE("requests are read as they are meant") {
  const ParsedRequest get =
      parse_request("GET /frame?x=1 HTTP/1.1\r\nhOsT:  localhost:7007 \r\nAccept: */*\r\n\r\n");
  CHECK(get.status == 200);
  CHECK(get.request.method == "GET");
  CHECK(get.request.path == "/frame");
  CHECK(get.request.host == "localhost:7007");
  CHECK(get.request.content_length == 0);
  const ParsedRequest post = parse_request("POST /frame HTTP/1.1\r\n" + kHost +
                                           "Content-Length: 12\r\nOrigin: http://a\r\n\r\n");
  CHECK(post.status == 200);
  CHECK(post.request.content_length == 12);
  CHECK(post.request.origin == "http://a");
  CHECK(status("HEAD / HTTP/1.0\r\n\r\n") == 200);
}

TEST_CASE("what is no request is refused by what is wrong with it") {
  const auto line = [](const std::string& first) { return status(first + "\r\n" + kHost + "\r\n"); };
  for (const char* bad :
       {"", " ", "GET", "GET /", "GET  / HTTP/1.1", "GET / HTTP/1.1 ", " GET / HTTP/1.1", "GET / FTP/1",
        "GET http://a/ HTTP/1.1", "GET ../etc/passwd HTTP/1.1", "G\tT / HTTP/1.1", "GET /\x01 HTTP/1.1",
        "GET /\xff HTTP/1.1", "GET / / HTTP/1.1", "\x16\x03\x01\x02"}) {
    CAPTURE(bad);
    CHECK(line(bad) == 400);
  }
  CHECK(line("GET / HTTP/2.0") == 505);
  CHECK(line("DELETE / HTTP/1.1") == 405);
  CHECK(line("get / HTTP/1.1") == 405);
  CHECK(line("GET /" + std::string(2000, 'a') + " HTTP/1.1") == 414);
  const auto fields = [](const std::string& more) {
    return status("POST / HTTP/1.1\r\n" + more + "\r\n");
  };
  CHECK(fields("") == 400);  // HTTP/1.1 without a host
  CHECK(fields(kHost + kHost) == 400);
  CHECK(fields(kHost + "Origin: http://a\r\nOrigin: http://b\r\n") == 400);
  CHECK(fields(kHost + "Sec-Fetch-Site: none\r\nSec-Fetch-Site: cross-site\r\n") == 400);
  CHECK(fields(kHost + "no colon\r\n") == 400);
  CHECK(fields(kHost + "a b: c\r\n") == 400);
  CHECK(fields(kHost + ": c\r\n") == 400);
  CHECK(fields(kHost + " folded: line\r\n") == 400);
  CHECK(fields(kHost + "a: b\x01\r\n") == 400);
  CHECK(fields(kHost + std::string("a: b\0c\r\n", 8)) == 400);
  CHECK(fields(kHost + "a: b\nContent-Length: 3\r\n") == 400);
  CHECK(fields(kHost + "Transfer-Encoding: chunked\r\n") == 501);
  for (const char* length : {"-1", "+3", "0x10", "3 3", "three", "", "1e3"}) {
    CAPTURE(length);
    CHECK(fields(kHost + "Content-Length: " + length + "\r\n") == 400);
  }
  CHECK(fields(kHost + "Content-Length: 3\r\nContent-Length: 3\r\n") == 400);
  CHECK(fields(kHost + "Content-Length: 4097\r\n") == 413);
  CHECK(fields(kHost + "Content-Length: 99999999999999999999999999\r\n") == 413);
  CHECK(fields(kHost + "a: " + std::string(9000, 'x') + "\r\n") == 431);
  CHECK(status("GET / HTTP/1.1\r\n" + kHost) == 400);  // cut off
  CHECK(status("GET / HTTP/1.1\n\n") == 400);
}

TEST_CASE("any bytes are read without harm, and what is cut off is never a request") {
  const std::string whole = "POST /frame HTTP/1.1\r\n" + kHost + "Content-Length: 12\r\n\r\n";
  for (std::size_t n = 0; n < whole.size(); ++n) CHECK(status(whole.substr(0, n)) != 200);
  gsnav::Rng rng(1);
  for (int i = 0; i < 20000; ++i) {
    std::string bytes = whole;
    for (std::uint64_t k = 0; k < 1 + rng.below(4); ++k)
      bytes[rng.below(bytes.size())] = static_cast<char>(rng.below(256));
    const ParsedRequest r = parse_request(bytes);
    if (r.status != 200) continue;
    CHECK(r.request.path.starts_with('/'));
    CHECK(r.request.content_length <= kLongestBody);
  }
}

TEST_CASE("hosts are addresses, localhost and the names that were allowed, with any port") {
  const std::vector<std::string> none, names{"robot-7.lab"};
  for (const char* host : {"127.0.0.1:7007", "localhost:7007", "LocalHost", "[::1]:7007", "127.0.0.1",
                           "127.0.0.1:80", "127.9.9.9"}) {
    CAPTURE(host);
    CHECK(is_allowed_host(host, true, none));
    CHECK(is_allowed_host(host, false, none));
  }
  for (const char* host : {"10.0.0.5:7007", "192.168.1.2", "[fe80::1]:80", "0.0.0.0:7007"}) {
    CAPTURE(host);
    CHECK_FALSE(is_allowed_host(host, true, names));
    CHECK(is_allowed_host(host, false, none));
  }
  for (const char* host :
       {"", ":7007", "evil.example:7007", "evil.example", "localhost.evil:7007",
        "127.0.0.1.evil.example:7007", "127.0.0.1:", "127.0.0.1:70 ", "127.0.0.1:700700", "localhost:x",
        "[::1", "[::1]x", "[]:1", "::1", "robot-7.lab.evil"}) {
    CAPTURE(host);
    CHECK_FALSE(is_allowed_host(host, true, names));
    CHECK_FALSE(is_allowed_host(host, false, names));
  }
  CHECK(is_allowed_host("Robot-7.Lab:7007", true, names));
  CHECK(is_allowed_host("robot-7.lab", false, names));
  CHECK_FALSE(is_allowed_host("robot-7.lab", false, none));
}

TEST_CASE("a page of another site is told from the viewer's own and from programs") {
  const auto from = [](const std::string& fields) {
    const ParsedRequest r = parse_request("POST /frame HTTP/1.1\r\n" + kHost + fields + "\r\n");
    REQUIRE(r.status == 200);
    return is_from_elsewhere(r.request);
  };
  CHECK_FALSE(from(""));
  CHECK_FALSE(from("Origin: http://localhost:7007\r\nSec-Fetch-Site: same-origin\r\n"));
  CHECK_FALSE(from("Sec-Fetch-Site: none\r\n"));
  for (const char* fields :
       {"Origin: http://evil.example\r\n", "Origin: null\r\n", "Origin: http://localhost:8000\r\n",
        "Sec-Fetch-Site: cross-site\r\n", "Sec-Fetch-Site: same-site\r\n",
        "Origin: http://localhost:7007\r\nSec-Fetch-Site: cross-site\r\n"}) {
    CAPTURE(fields);
    CHECK(from(fields));
  }
}

TEST_CASE("a connection is kept for the next request unless the client says otherwise") {
  const auto kept = [](const std::string& head) { return parse_request(head).request.keep_alive; };
  CHECK(kept("GET / HTTP/1.1\r\n" + kHost + "\r\n"));
  CHECK(kept("GET / HTTP/1.1\r\n" + kHost + "Connection: keep-alive\r\n\r\n"));
  CHECK_FALSE(kept("GET / HTTP/1.1\r\n" + kHost + "Connection: Close\r\n\r\n"));
  CHECK_FALSE(kept("GET / HTTP/1.0\r\n\r\n"));
}
