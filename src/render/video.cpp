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
#include <fstream>
#include <vector>

namespace fathom::render {
namespace {

/// A pipe whose reader has gone must be an error here, not the end of the program.
class IgnoreBrokenPipe {
 public:
  IgnoreBrokenPipe() : before_(std::signal(SIGPIPE, SIG_IGN)) {}
  ~IgnoreBrokenPipe() { std::signal(SIGPIPE, before_); }
  IgnoreBrokenPipe(const IgnoreBrokenPipe&) = delete;
  IgnoreBrokenPipe& operator=(const IgnoreBrokenPipe&) = delete;

 private:
  void (*before_)(int);
};

void require_writable(const std::string& path) {
  if (std::ofstream(path, std::ios::app)) return;
  throw Error(ErrorCode::file, path + ": cannot be written; check the folder and its permissions");
}

}  // namespace

Video::Video(const std::string& path, int width, int height, int frames_per_second) : path_(path) {
  if (width % 2 != 0 || height % 2 != 0) {
    throw Error(ErrorCode::invalid_argument, "films need an even width and height, not " + std::to_string(width) + "x" +
                                                 std::to_string(height) + "; change --size");
  }
  require_writable(path);
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
                                       // So that a browser may show it before it is loaded to its end.
                                       "-movflags", "+faststart", "file:" + path};
  std::vector<char*> argv;
  for (const std::string& word : words) argv.push_back(const_cast<char*>(word.c_str()));
  argv.push_back(nullptr);
  const int status = posix_spawnp(&process_, "ffmpeg", &files, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&files);
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
  // The first line tells the cause, the rest follows from it.
  said = said.substr(0, said.find('\n'));
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
}

}  // namespace fathom::render
