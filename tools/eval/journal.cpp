// SPDX-License-Identifier: Apache-2.0
#include "journal.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <iterator>
#include <string_view>
#include <utility>

#include "gsnav/core/replace_file.hpp"
#include "run.hpp"

namespace gsnav_eval {
namespace {

namespace fs = std::filesystem;
using gsnav::Errc;
using gsnav::Result;
using gsnav::Status;

const std::string kRemove = std::string(". Remove the line, ") + kAnew;

std::string file_text(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// Returns true if a file with this name in the folder of an evaluation is a journal.
bool is_journal(const std::string& name) {
  if (name == "journal.jsonl") return true;
  constexpr std::string_view kFront = "journal.", kEnd = ".jsonl";
  if (!name.starts_with(kFront) || !name.ends_with(kEnd) || name.size() <= kFront.size() + kEnd.size())
    return false;
  const std::string rank = name.substr(kFront.size(), name.size() - kFront.size() - kEnd.size());
  return rank.find_first_not_of("0123456789") == std::string::npos;
}

/// Returns true if a file with this name in the folder `episodes` is a picture of an episode.
bool is_picture(const std::string& name) {
  const std::size_t digits = name.find_first_not_of("0123456789");
  return digits != 0 && digits != std::string::npos &&
         (name.substr(digits) == "_strip.png" || name.substr(digits) == "_map.png");
}

/// Files of a folder with names accepted by `wanted`, in order. Empty if there is no such folder.
std::vector<fs::path> files_in(const fs::path& folder, bool (*wanted)(const std::string&)) {
  std::vector<fs::path> out;
  std::error_code error;
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    if (wanted(at->path().filename().string())) out.push_back(at->path());
  }
  std::sort(out.begin(), out.end());
  return out;
}

Status remove_file(const fs::path& path) {
  std::error_code error;
  fs::remove(path, error);
  return error ? Status(Errc::file_not_found, path.string() + ": cannot be removed: " + error.message())
               : Status();
}

Status remove_pictures(const fs::path& folder) {
  for (const fs::path& p : files_in(folder / "episodes", is_picture)) {
    if (Status s = remove_file(p); !s) return s;
  }
  return {};
}

/// First line of a file. Empty if it is incomplete.
std::string first_line(const std::string& text) {
  return text.substr(0, std::min(text.find('\n'), text.size()));
}

}  // namespace

Result<std::vector<OptionValue>> Journal::recorded_options(const fs::path& folder) {
  const fs::path path = folder / "journal.jsonl";
  if (!fs::exists(path))
    return Status(Errc::file_not_found, path.string() + ": there is no evaluation here");
  auto header = read_header(path, first_line(file_text(path)));
  if (!header) return header.status();
  return std::move(header->options);
}

Status Journal::check_options(const fs::path& folder, const Options& options, bool views) {
  for (const fs::path& path : files_in(folder, is_journal)) {
    const std::string text = file_text(path);
    if (text.find('\n') == std::string::npos) continue;  // The journal is started again.
    const auto header = read_header(path, first_line(text));
    if (!header) return header.status();
    if (Status s = compare_options(path, *header, options, views); !s) return s;
  }
  return {};
}

Status Journal::read(const fs::path& path, const Options& options, const Stage& stage,
                     const Contents& made_of, bool own, bool views) {
  const std::string text = file_text(path);
  std::size_t whole = 0,
              line = 0;  // Text after the last line end was cut off while it was written.
  for (std::size_t at = 0, end; (end = text.find('\n', at)) != std::string::npos; at = whole = end + 1) {
    const std::string one = text.substr(at, end - at);
    if (++line == 1) {
      const auto header = read_header(path, one);
      if (!header) return header.status();
      if (Status s = compare_options(path, *header, options, views); !s) return s;
      if (Status s = compare_contents(path, *header, options, made_of); !s) return s;
      continue;
    }
    const std::string where = path.string() + ": line " + std::to_string(line);
    auto r = record_of(one, where, stage);
    if (!r) return {r.status().code(), r.status().message() + kRemove};
    const auto found = records_.find(r->episode);
    if (found != records_.end() && line_of(found->second) != line_of(*r)) {
      return {Errc::invalid_file, where + ": episode = " + std::to_string(r->episode) +
                                      ": differs from " + places_[r->episode] +
                                      ", of the same episode. Remove one of them, " + kAnew};
    }
    places_.emplace(r->episode, where);
    records_.insert_or_assign(r->episode, std::move(*r));
  }
  if (whole < text.size()) {
    notes_.push_back(path.string() + ": line " + std::to_string(line + 1) +
                     " has no end, as after a kill: " + std::to_string(text.size() - whole) +
                     " bytes are dropped");
    if (own && ::truncate(path.c_str(), static_cast<::off_t>(whole)) != 0) {
      return gsnav::unwritable(path, errno);
    }
  }
  return {};
}

Status Journal::check_outcomes(const Stage& stage) const {
  if (records_.empty()) return {};
  auto world = make_world(stage);
  if (!world) return world.status();
  for (const auto& [number, record] : records_) {
    if (Status s = play_again(*world, stage.episodes[number], record); !s) {
      return {s.code(), places_.at(number) + ": " + s.message() + kRemove};
    }
  }
  return {};
}

Result<Journal> Journal::load(const fs::path& folder, const Options& options, const Stage& stage) {
  Journal j;
  j.path_ = folder / "journal.jsonl";
  if (!fs::exists(j.path_))
    return Status(Errc::file_not_found, j.path_.string() + ": there is no evaluation here");
  const Contents made_of = contents_of(stage);
  for (const fs::path& path : files_in(folder, is_journal)) {
    if (Status s = j.read(path, options, stage, made_of, false, false); !s) return s;
  }
  return j;
}

Result<Journal> Journal::open(const fs::path& folder, const Options& options, const Stage& stage,
                              int rank) {
  if (Status s = gsnav::make_output_folder(folder); !s) return s;
  Journal j;
  j.path_ = folder / (rank == 0 ? "journal.jsonl" : "journal." + std::to_string(rank) + ".jsonl");
  const Contents made_of = contents_of(stage);
  if (file_text(j.path_).find('\n') == std::string::npos) {  // There is no header, or it was cut off.
    if (Status s =
            rank == 0 && files_in(folder, is_journal).empty() ? remove_pictures(folder) : Status();
        !s)
      return s;
    if (Status s = gsnav::replace_file(j.path_, header_of(options, made_of) + "\n"); !s) return s;
  }
  if (Status s = j.lock(); !s) return s;
  if (Status s = j.read(j.path_, options, stage, made_of, true, true); !s) return s;
  for (const fs::path& path : files_in(folder, is_journal)) {
    if (rank != 0 || path == j.path_) continue;
    if (Status s = j.read(path, options, stage, made_of, false, true); !s) return s;
  }
  if (Status s = j.check_outcomes(stage); !s) return s;
  return j;
}

Status Journal::restart(const fs::path& folder) {
  if (Status s = remove_pictures(folder); !s) return s;
  for (const char* name : {"index.html", "metrics.json", "timings.json", "episodes.json.gz"}) {
    if (Status s = remove_file(folder / name); !s) return s;
  }
  for (const fs::path& path : files_in(folder, is_journal)) {
    if (Status s = remove_file(path); !s) return s;
  }
  return {};
}

Status Journal::lock() {
  const int file = ::open(path_.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return {Errc::file_not_found, path_.string() + ": cannot be opened"};
  lock_ = std::shared_ptr<const void>(this, [file](const void*) { ::close(file); });
  struct stat held {
  }, there{};
  // A process that started the journal at the same time has replaced this file by another.
  const bool own = ::flock(file, LOCK_EX | LOCK_NB) == 0 && ::fstat(file, &held) == 0 &&
                   ::stat(path_.c_str(), &there) == 0 && held.st_ino == there.st_ino;
  if (own) return {};
  return {Errc::invalid_argument,
          path_.string() + ": another process writes it; wait, or use another --out"};
}

Status Journal::add(Record record) {
  if (Status s = gsnav::append_line(path_, line_of(record)); !s) return s;
  records_.insert_or_assign(record.episode, std::move(record));
  return {};
}

}  // namespace gsnav_eval
