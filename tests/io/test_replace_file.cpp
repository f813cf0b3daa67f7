// SPDX-License-Identifier: Apache-2.0
// What every writer goes through: a file is whole or what it was, on a full disk and under kill -9 too.
#include <doctest/doctest.h>
#include <fcntl.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <set>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "gsnav/core/replace_file.hpp"
#include "support/files.hpp"
#include "support/small_disk.hpp"

using namespace gsnav;
using namespace gsnav_test;
namespace fs = std::filesystem;

namespace {

std::set<std::string> names_in(const fs::path& folder) {
  std::set<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder))
    names.insert(entry.path().filename().string());
  return names;
}

using Names = std::set<std::string>;

std::atomic<int> folders_synced{0}, files_synced{0};

int count_sync(int fd, long call) {
  struct ::stat found {};
  if (::fstat(fd, &found) == 0) ++(S_ISDIR(found.st_mode) ? folders_synced : files_synced);
  return static_cast<int>(::syscall(call, fd));
}

}  // namespace

// In place of the C library's, for this program.
extern "C" int fsync(int fd) { return count_sync(fd, SYS_fsync); }
extern "C" int fdatasync(int fd) { return count_sync(fd, SYS_fdatasync); }

TEST_CASE("replace_file: new, again, and nothing beside it") {
  const TempFolder folder("replace");
  REQUIRE(replace_file(folder / "a", "first").ok());
  CHECK(read_file(folder / "a") == "first");
  REQUIRE(replace_file(folder / "a", [](OutputFile& f) {
            f.write("sec");
            f.write(nullptr, 0);
            f.write("ond", 3);
          }).ok());
  CHECK(read_file(folder / "a") == "second");
  REQUIRE(replace_file(folder / "empty", "").ok());
  CHECK(fs::file_size(folder / "empty") == 0);
  const std::string longest(255, 'n');
  CHECK(replace_file(folder / longest, "x").ok());
  CHECK(names_in(folder.path()) == Names{"a", "empty", longest});
}

TEST_CASE("replace_file: a writer that fails, or throws, leaves what was there") {
  const TempFolder folder("replace_fails");
  write_file(folder / "a", "before");
  for (const char* name : {"a", "new"}) {
    const Status s = replace_file(folder / name, [](OutputFile& f) -> Status {
      f.write("half");
      return {Errc::unsupported, "no more"};
    });
    CHECK(s.code() == Errc::unsupported);
    CHECK_THROWS_AS(static_cast<void>(replace_file(folder / name,
                                                   [](OutputFile& f) {
                                                     f.write("half");
                                                     throw std::runtime_error("no more");
                                                   })),
                    std::runtime_error);
  }
  CHECK(read_file(folder / "a") == "before");
  CHECK(names_in(folder.path()) == Names{"a"});
}

TEST_CASE("replace_file: permissions, links, devices and pipes stay what they are") {
  const TempFolder folder("replace_kinds");
  const auto mode = [&](const char* name) {
    struct ::stat s {};
    REQUIRE(::stat((folder / name).c_str(), &s) == 0);
    return s.st_mode & 0777;
  };
  write_file(folder / "a", "before");
  fs::permissions(folder / "a", fs::perms(0640));
  REQUIRE(replace_file(folder / "a", "after").ok());
  CHECK(mode("a") == 0640);
  const ::mode_t mask = ::umask(027);
  REQUIRE(replace_file(folder / "new", "x").ok());
  ::umask(mask);
  CHECK(mode("new") == 0640);

  fs::create_directory(folder / "in");
  fs::create_symlink("a", folder / "link");
  fs::create_symlink("in/not_yet", folder / "dangling");
  REQUIRE(replace_file(folder / "link", "through").ok());
  REQUIRE(replace_file(folder / "dangling", "made").ok());
  CHECK(fs::is_symlink(folder / "link"));
  CHECK(fs::is_symlink(folder / "dangling"));
  CHECK(read_file(folder / "a") == "through");
  CHECK(read_file(folder / "in/not_yet") == "made");
  fs::create_symlink("loop", folder / "loop");
  CHECK(!replace_file(folder / "loop", "x").ok());

  // In place: a pipe or a device must not become a file.
  REQUIRE(::mkfifo((folder / "pipe").c_str(), 0600) == 0);
  const int reader = ::open((folder / "pipe").c_str(), O_RDONLY | O_NONBLOCK);
  CHECK(replace_file(folder / "pipe", "piped").ok());
  std::string got(5, ' ');
  CHECK(::read(reader, got.data(), got.size()) == 5);
  ::close(reader);
  CHECK(got == "piped");
  REQUIRE(fs::is_fifo(folder / "pipe"));  // or root's /dev/null would go
  REQUIRE(replace_file("/dev/null", "x").ok());
  CHECK(fs::is_character_file("/dev/null"));
  if (fs::exists("/dev/full")) {
    const Status s = replace_file("/dev/full", std::string(100000, 'x'));
    CHECK(s.code() == Errc::write_failed);
    CHECK(contains(s.message(), "/dev/full: cannot be written: No space left on device"));
  }
}

TEST_CASE("check_output_path: what cannot be written is said before anything is done") {
  const TempFolder folder("replace_checked");
  fs::create_directory(folder / "in");
  write_file(folder / "file", "x");
  const auto says = [&](const fs::path& path, const char* part) {
    CAPTURE(path.string());
    for (const Status& s : {check_output_path(path), replace_file(path, "x")}) {
      CHECK(s.code() == Errc::file_not_found);
      CAPTURE(s.message());
      CHECK(contains(s.message(), part));
    }
  };
  says({}, "empty");
  says(folder / "in", "it is a folder");
  says(folder / "in/", "it is a folder");
  says(folder / "none/a", "none does not exist; make it first");
  says(folder / "file/a", "file does not exist; make it first");
  says(folder / std::string(300, 'n'), "File name too long");
  CHECK(check_output_path(folder / "in/a").ok());
  CHECK(check_output_path(folder / "file").ok());
  CHECK(check_output_path("a_name_alone").ok());
  if (::geteuid() != 0) {  // root may write everywhere
    fs::permissions(folder / "file", fs::perms(0444));
    says(folder / "file", "Permission denied");
    fs::permissions(folder / "in", fs::perms(0555));
    says(folder / "in/a", "Permission denied");
    fs::permissions(folder / "in", fs::perms(0755));
  }
  CHECK(names_in(folder.path()) == Names{"file", "in"});
  CHECK(fs::is_empty(folder / "in"));
}

TEST_CASE("make_output_folder: with those above it, whatever is in it") {
  const TempFolder folder("output_folder");
  REQUIRE(make_output_folder(folder / "a/b").ok());
  REQUIRE(fs::is_directory(folder / "a/b"));
  for (const char* name : {"file", "a/file"}) fs::create_directories(folder / "a/b" / name);
  CHECK(make_output_folder(folder / "a/b").ok());
  CHECK(make_output_folder(folder / "a/b/").ok());
  write_file(folder / "taken", "x");
  for (const char* name : {"taken", "taken/in"}) {
    const Status s = make_output_folder(folder / name);
    CHECK(s.code() == Errc::file_not_found);
    CHECK(contains(s.message(), (folder / name).string()));
  }
  CHECK(read_file(folder / "taken") == "x");
}

TEST_CASE("replace_file: a full disk leaves what was there and nothing else") {
  const TempFolder folder("replace_full");
  const SmallDisk disk(folder.path(), 256);
  if (!disk.mounted()) return;
  const std::string before(100'000, 'b');
  REQUIRE(replace_file(folder / "a", before).ok());
  for (const char* name : {"a", "new"}) {
    const Status s = replace_file(folder / name, std::string(300'000, 'n'));
    CHECK(s.code() == Errc::write_failed);
    CHECK(contains(s.message(), "cannot be written: No space left on device"));
  }
  CHECK(read_file(folder / "a") == before);
  CHECK(names_in(folder.path()) == Names{"a"});
  // What the failed ones took is free again.
  CHECK(replace_file(folder / "b", std::string(100'000, 'c')).ok());
}

TEST_CASE("replace_file: a file larger than the process may write") {
  const TempFolder folder("replace_limit");
  write_file(folder / "a", "before");
  const pid_t child = ::fork();
  if (child == 0) {
    ::signal(SIGXFSZ, SIG_IGN);
    const ::rlimit limit{1000, 1000};
    ::setrlimit(RLIMIT_FSIZE, &limit);
    const Status s = replace_file(folder / "a", std::string(2000, 'n'));
    ::_exit(contains(s.message(), "File too large") ? 0 : 1);
  }
  int status = -1;
  REQUIRE(::waitpid(child, &status, 0) == child);
  CHECK(WIFEXITED(status));
  CHECK(WEXITSTATUS(status) == 0);
  CHECK(read_file(folder / "a") == "before");
  CHECK(names_in(folder.path()) == Names{"a"});
}

TEST_CASE("replace_file: kill -9 at any moment leaves a whole file") {
  const TempFolder folder("replace_killed");
  constexpr std::size_t kSize = 400'000;
  REQUIRE(replace_file(folder / "a", std::string(kSize, 'a')).ok());
  for (unsigned trial = 0; trial < 40; ++trial) {
    const pid_t child = ::fork();
    if (child == 0) {
      for (char c = 'a';; c = c == 'z' ? 'a' : static_cast<char>(c + 1)) {
        static_cast<void>(replace_file(folder / "a", [c](OutputFile& f) {
          const std::string part(1000, c);
          for (std::size_t k = 0; k < kSize / 1000; ++k) f.write(part);
        }));
      }
    }
    ::usleep(500 + 917 * trial % 12000);
    ::kill(child, SIGKILL);
    REQUIRE(::waitpid(child, nullptr, 0) == child);
    const std::string found = read_file(folder / "a");
    REQUIRE(found.size() == kSize);
    CHECK(found == std::string(kSize, found[0]));
  }
  // At most what was killed between its name aside and its own one; all others were nameless.
  for (const std::string& name : names_in(folder.path())) {
    CHECK((name == "a" || (name.starts_with("a.") && name.ends_with(".part"))));
  }
  const std::size_t left = names_in(folder.path()).size() - 1;
  MESSAGE(left, " of 40 killed writers left a .part file");
}

TEST_CASE("replace_file: threads that write one name do not mix") {
  const TempFolder folder("replace_threads");
  std::vector<std::thread> threads;
  for (int t = 0; t < 8; ++t) {
    threads.emplace_back([&, t] {
      for (int k = 0; k < 50; ++k) {
        CHECK(replace_file(folder / "a", std::string(20'000, static_cast<char>('a' + t))).ok());
      }
    });
  }
  for (std::thread& t : threads) t.join();
  const std::string found = read_file(folder / "a");
  CHECK(found == std::string(20'000, found.at(0)));
  CHECK(names_in(folder.path()) == Names{"a"});
}

TEST_CASE("replace_file: a new name is on the disk, as the bytes are") {
  const TempFolder folder("replace_synced");
  for (const char* what : {"new", "again"}) {
    folders_synced = files_synced = 0;
    REQUIRE(replace_file(folder / "a", what).ok());
    CHECK(files_synced == 1);
    CHECK(folders_synced == 1);
  }
  folders_synced = 0;
  REQUIRE(replace_file("/dev/null", "x").ok());
  CHECK(folders_synced == 0);
  // A folder that may be written to but not read.
  if (::geteuid() == 0) return;
  fs::permissions(folder.path(), fs::perms::owner_write | fs::perms::owner_exec);
  CHECK(replace_file(folder / "b", "x").ok());
  fs::permissions(folder.path(), fs::perms::owner_all);
}

TEST_CASE("append_line: on the disk when it returns; a full disk leaves whole lines") {
  const TempFolder folder("append");
  CHECK(append_line(folder / "none", "x").code() == Errc::file_not_found);
  write_file(folder / "a", "head\n");
  files_synced = 0;
  CHECK(append_line(folder / "a", "one").ok());
  CHECK(files_synced == 1);
  CHECK(read_file(folder / "a") == "head\none\n");
  fs::create_directories(folder / "disk");
  const SmallDisk disk(folder / "disk", 64);
  if (!disk.mounted()) return;
  write_file(folder / "disk/a", "head\n");
  std::string expected = "head\n";
  const std::string line(10000, 'x');
  Status s;
  while ((s = append_line(folder / "disk/a", line))) expected += line + "\n";
  CHECK(s.code() == Errc::write_failed);
  CHECK(read_file(folder / "disk/a") == expected);
}
