// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <string>

namespace gsnav_test {

/// A connection to a port of this machine; what is sent need not be HTTP.
class Client {
 public:
  explicit Client(int port) : socket_(::socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in at{};
    at.sin_family = AF_INET;
    at.sin_port = htons(static_cast<std::uint16_t>(port));
    at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    ok_ = connect(socket_, reinterpret_cast<const sockaddr*>(&at), sizeof at) == 0;
  }
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;
  ~Client() { close(socket_); }

  bool ok() const { return ok_; }
  void send(const std::string& bytes) const {
    (void)!::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
  }
  void finish() const { shutdown(socket_, SHUT_WR); }
  /// Waits for more; false at the end or after `seconds` of silence.
  bool more(int seconds = 20) {
    pollfd p{socket_, POLLIN, 0};
    if (poll(&p, 1, 1000 * seconds) <= 0) return false;
    char some[65536];
    const ssize_t n = recv(socket_, some, sizeof some, 0);
    if (n <= 0) return false;
    text.append(some, static_cast<std::size_t>(n));
    return true;
  }
  const std::string& all() {
    while (more()) {
    }
    return text;
  }

  std::string text;  ///< received so far

 private:
  int socket_;
  bool ok_ = false;
};

/// The whole answer to these bytes.
inline std::string converse(int port, const std::string& bytes) {
  Client c(port);
  c.send(bytes);
  return c.all();
}

inline std::string request(int port, const std::string& line, const std::string& body = "",
                           const std::string& fields = "") {
  return converse(port, line + " HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(port) + "\r\n" + fields +
                            "Connection: close\r\nContent-Length: " + std::to_string(body.size()) +
                            "\r\n\r\n" + body);
}

inline int status_of(const std::string& answer) {
  return answer.starts_with("HTTP/1.1 ") && answer.size() > 12 ? std::atoi(answer.c_str() + 9) : 0;
}
inline std::string body_of(const std::string& answer) {
  const std::size_t end = answer.find("\r\n\r\n");
  return end == std::string::npos ? std::string() : answer.substr(end + 4);
}

}  // namespace gsnav_test
