// SPDX-License-Identifier: Apache-2.0
#include "video.hpp"

#include <unistd.h>

#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <system_error>

#include "gsnav/core/replace_file.hpp"
#include "gsnav/core/text.hpp"
#if defined(GSNAV_HAS_WEBPMUX)
#include <webp/encode.h>
#include <webp/mux.h>
#endif

namespace gsnav_eval {
namespace {

using gsnav::Errc;
using gsnav::Result;
using gsnav::Status;
namespace fs = std::filesystem;

/// Writes pictures to the standard input of ffmpeg. ffmpeg writes a file with a temporary name, which is
/// renamed at the end.
class PipedVideo final : public Video {
 public:
  PipedVideo() = default;
  PipedVideo(const PipedVideo&) = delete;
  PipedVideo& operator=(const PipedVideo&) = delete;
  ~PipedVideo() override {
    pipe_.reset();
    std::error_code none;
    if (!aside_.empty()) fs::remove(aside_, none);
  }

  Status open(const std::string& path, int width, int height, double rate) {
    if (path.find_first_of("'\\\n") != std::string::npos)
      return {Errc::invalid_argument, "--video: quotes in the path"};
    path_ = path;
    aside_ = fs::path(path).replace_extension(std::to_string(::getpid()) + ".part" +
                                              fs::path(path).extension().string());
    char command[512];
    const int n = std::snprintf(
        command, sizeof command,
        "ffmpeg -y -loglevel error -f rawvideo -pix_fmt rgb24 -s %dx%d -r %g -i - "
        "-vf 'pad=ceil(iw/2)*2:ceil(ih/2)*2' -pix_fmt yuv420p '%s'",  // yuv420p needs even sizes
        width, height, rate, aside_.c_str());
    if (n < 0 || n >= static_cast<int>(sizeof command))
      return {Errc::invalid_argument, "--video: the path is too long"};
    std::signal(SIGPIPE, SIG_IGN);  // reports an early end of ffmpeg instead of ending this program
    pipe_.reset(popen(command, "w"));
    if (pipe_ == nullptr) return {Errc::unsupported, "--video: ffmpeg cannot be run"};
    return {};
  }
  Status add(const std::vector<std::uint8_t>& rgb) override {
    if (std::fwrite(rgb.data(), 1, rgb.size(), pipe_.get()) == rgb.size()) return {};
    return {Errc::unsupported, "--video: ffmpeg takes no frames; is it installed?"};
  }
  Status close() override {
    if (pclose(pipe_.release()) != 0)
      return {Errc::unsupported, "--video: ffmpeg failed; is it installed?"};
    return gsnav::replace_file(path_, [this](gsnav::OutputFile& out) -> Status {
      std::ifstream in(aside_, std::ios::binary);
      for (std::vector<char> part(1 << 16); in;) {
        in.read(part.data(), static_cast<std::streamsize>(part.size()));
        out.write(part.data(), static_cast<std::size_t>(in.gcount()));
      }
      return in.eof() ? Status() : Status(Errc::invalid_file, aside_.string() + ": cannot be read");
    });
  }

 private:
  struct Close {
    void operator()(std::FILE* f) const noexcept { pclose(f); }
  };
  std::unique_ptr<std::FILE, Close> pipe_;
  fs::path path_, aside_;
};

#if defined(GSNAV_HAS_WEBPMUX)
/// Encodes an animated WebP in memory. It is lossy and repeats endlessly.
class AnimatedWebp final : public Video {
 public:
  AnimatedWebp() = default;
  AnimatedWebp(const AnimatedWebp&) = delete;
  AnimatedWebp& operator=(const AnimatedWebp&) = delete;
  ~AnimatedWebp() override = default;

  Status open(const std::string& path, int width, int height, double rate) {
    constexpr float kQuality = 80;  // of 100
    constexpr int kMethod = 5;      // of 6; higher values make smaller files and take longer
    WebPAnimEncoderOptions options;
    if (WebPConfigInit(&config_) == 0 || WebPAnimEncoderOptionsInit(&options) == 0)
      return {Errc::unsupported, "--video: libwebp is another version than this was built for"};
    config_.quality = kQuality;
    config_.method = kMethod;
    config_.use_sharp_yuv = 1;
    path_ = path;
    width_ = width;
    height_ = height;
    milliseconds_ = 1000 / rate;
    encoder_.reset(WebPAnimEncoderNew(width, height, &options));
    if (encoder_ == nullptr)
      return {Errc::invalid_argument, path + ": a WebP is at most 16383 pixels wide and high"};
    return {};
  }
  Status add(const std::vector<std::uint8_t>& rgb) override {
    WebPPicture picture;
    if (WebPPictureInit(&picture) == 0) return failed();
    picture.use_argb = 1;
    picture.width = width_;
    picture.height = height_;
    const bool ok = WebPPictureImportRGB(&picture, rgb.data(), 3 * width_) != 0 &&
                    WebPAnimEncoderAdd(encoder_.get(), &picture, begin_of(count_), &config_) != 0;
    WebPPictureFree(&picture);
    ++count_;
    return ok ? Status() : failed();
  }
  Status close() override {
    WebPData data;
    WebPDataInit(&data);
    Status s;
    if (WebPAnimEncoderAdd(encoder_.get(), nullptr, begin_of(count_), nullptr) == 0 ||
        WebPAnimEncoderAssemble(encoder_.get(), &data) == 0) {
      s = failed();
    } else {
      s = gsnav::replace_file(path_, [&](gsnav::OutputFile& out) -> Status {
        out.write(reinterpret_cast<const char*>(data.bytes), data.size);
        return {};
      });
    }
    WebPDataClear(&data);
    return s;
  }

 private:
  struct Delete {
    void operator()(WebPAnimEncoder* e) const noexcept { WebPAnimEncoderDelete(e); }
  };
  /// Time at which picture k begins, milliseconds.
  int begin_of(int k) const { return static_cast<int>(std::lround(k * milliseconds_)); }
  Status failed() const {
    return {Errc::out_of_memory, path_.string() + ": " + WebPAnimEncoderGetError(encoder_.get())};
  }

  std::unique_ptr<WebPAnimEncoder, Delete> encoder_;
  WebPConfig config_{};
  fs::path path_;
  int width_ = 0, height_ = 0, count_ = 0;
  double milliseconds_ = 0;
};
#endif

template <class V>
Result<std::unique_ptr<Video>> opened(const std::string& path, int width, int height, double rate) {
  auto video = std::make_unique<V>();
  if (Status s = video->open(path, width, height, rate); !s) return s;
  return std::unique_ptr<Video>(std::move(video));
}

bool is_webp(const std::string& path) {
  return gsnav::lower_case(fs::path(path).extension().string()) == ".webp";
}

}  // namespace

Status can_write_video(const std::string& path) {
  if (path.empty()) return {};
  if (is_webp(path)) {
#if !defined(GSNAV_HAS_WEBPMUX)
    return {Errc::unsupported,
            "--video " + path + ": this build has no libwebpmux: use .mp4, or install libwebp-dev"};
#endif
    return {};
  }
  const char* const folders = std::getenv("PATH");
  std::stringstream all(folders != nullptr ? folders : "");
  for (std::string folder; std::getline(all, folder, ':');) {
    if (::access((fs::path(folder) / "ffmpeg").c_str(), X_OK) == 0) return {};
  }
  return {Errc::unsupported, "--video " + path + ": ffmpeg is not installed; install it, or use .webp"};
}

Result<std::unique_ptr<Video>> open_video(const std::string& path, int width, int height, double rate) {
  if (Status s = can_write_video(path); !s) return s;
#if defined(GSNAV_HAS_WEBPMUX)
  if (is_webp(path)) return opened<AnimatedWebp>(path, width, height, rate);
#endif
  return opened<PipedVideo>(path, width, height, rate);
}

}  // namespace gsnav_eval
