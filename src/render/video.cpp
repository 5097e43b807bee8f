#include "render/video.hpp"

#include <fcntl.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>
#include <fathom/error.hpp>
#include <filesystem>
#include <vector>

namespace fathom::render {
namespace {

/// Makes writing to a pipe without a reader return an error instead of killing the program (SIGPIPE).
class IgnoreBrokenPipe {
 public:
  IgnoreBrokenPipe() : before_(std::signal(SIGPIPE, SIG_IGN)) {}
  ~IgnoreBrokenPipe() { std::signal(SIGPIPE, before_); }
  IgnoreBrokenPipe(const IgnoreBrokenPipe&) = delete;
  IgnoreBrokenPipe& operator=(const IgnoreBrokenPipe&) = delete;

 private:
  void (*before_)(int);
};

}  // namespace

std::string film_ending(const std::string& path) {
  const std::string ending = std::filesystem::path(path).extension().string();
  for (const char* known : {".mp4", ".m4v", ".mov", ".mkv", ".webm", ".avi", ".ogv", ".mpg", ".mpeg", ".ts", ".flv",
                            ".wmv", ".gif", ".apng", ".nut"})
    if (ending == known) return ending;
  throw Error(ErrorCode::invalid_argument,
              path + ": " + (ending.empty() ? "a film needs an ending" : ending + " is not the ending of a film") +
                  "; use .mp4, .mkv, .webm or .gif");
}

Video::Video(const std::string& path, int width, int height, int frames_per_second)
    : path_(path), file_(path, files::Writing::whole, film_ending(path)) {
  if (width % 2 != 0 || height % 2 != 0) {
    throw Error(ErrorCode::invalid_argument, "films need an even width and height, not " + std::to_string(width) + "x" +
                                                 std::to_string(height) + "; change --size");
  }
  int pipe_ends[2];
  complaints_ = memfd_create("ffmpeg", MFD_CLOEXEC);
  if (complaints_ < 0 || pipe2(pipe_ends, O_CLOEXEC) != 0) {
    throw Error(ErrorCode::unavailable, std::string("no pipe to ffmpeg: ") + std::strerror(errno));
  }
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_adddup2(&files, pipe_ends[0], STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&files, complaints_, STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&files, complaints_, STDERR_FILENO);
  const std::vector<std::string> words{"ffmpeg", "-y", "-hide_banner", "-loglevel", "error", "-f", "rawvideo",
                                       "-pixel_format", "rgb24", "-video_size",
                                       std::to_string(width) + "x" + std::to_string(height), "-framerate",
                                       std::to_string(frames_per_second), "-i", "-", "-pix_fmt", "yuv420p",
                                       // so that a browser can play it before it is completely loaded
                                       "-movflags", "+faststart", "file:" + file_.growing()};
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  // In its own process group: Ctrl-C goes only to this process, which then completes the film.
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
  std::vector<char*> argv;
  for (const std::string& word : words) argv.push_back(const_cast<char*>(word.c_str()));
  argv.push_back(nullptr);
  const int status = posix_spawnp(&process_, "ffmpeg", &files, &attributes, argv.data(), environ);
  posix_spawn_file_actions_destroy(&files);
  posix_spawnattr_destroy(&attributes);
  ::close(pipe_ends[0]);
  to_ffmpeg_ = pipe_ends[1];
  if (status != 0) {
    process_ = -1;
    ::close(to_ffmpeg_);
    ::close(complaints_);
    throw Error(ErrorCode::unavailable, std::string("the program ffmpeg cannot be started (") + std::strerror(status) +
                                            "); install the package ffmpeg, or write pictures with --at and -o");
  }
}

Video::~Video() {
  if (process_ > 0) close();
  if (complaints_ >= 0) ::close(complaints_);
}

int Video::close() {
  ::close(to_ffmpeg_);
  int status = 0;
  while (waitpid(process_, &status, 0) < 0 && errno == EINTR) {
  }
  process_ = -1;
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

void Video::fail() {
  if (process_ > 0) close();
  char text[2000];
  const ssize_t length = pread(complaints_, text, sizeof text, 0);
  std::string said(text, static_cast<std::size_t>(length > 0 ? length : 0));
  // The first line names the cause; the others are consequences.
  said = said.substr(0, said.find('\n'));
  if (const std::size_t at = said.find(file_.growing()); at != said.npos)
    said.replace(at, file_.growing().size(), path_);
  throw Error(ErrorCode::file, path_ + ": ffmpeg gave up" + (said.empty() ? "" : ": " + said) +
                                   "; check the file's ending and the space left");
}

void Video::add(const Image& image) {
  const IgnoreBrokenPipe guard;
  const std::uint8_t* next = image.pixels.data();
  std::size_t left = image.pixels.size();
  while (left > 0) {
    const ssize_t written = ::write(to_ffmpeg_, next, left);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) fail();
    next += written;
    left -= static_cast<std::size_t>(written);
  }
}

void Video::finish() {
  if (close() != 0) fail();
  file_.finish();
}

}  // namespace fathom::render
