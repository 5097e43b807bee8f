// Films: pictures piped to ffmpeg.
#pragma once

#include <string>

#include "files/output_file.hpp"
#include "render/image.hpp"

namespace fathom::render {

/// The file extension; ffmpeg infers the format from it. Throws `Error{invalid_argument}` if it is not a film's.
std::string film_ending(const std::string& path);

class Video {
 public:
  /// The file extension selects the format. Throws `Error{unavailable}` if there is no ffmpeg, `Error{file}` if the
  /// file cannot be written, `Error{invalid_argument}` for an odd width or height, or an extension that is not a
  /// film's.
  Video(const std::string& path, int width, int height, int frames_per_second);
  /// Without `finish`, leaves nothing behind.
  ~Video();
  Video(const Video&) = delete;
  Video& operator=(const Video&) = delete;

  /// Throws `Error{file}` with ffmpeg's message if it gave up.
  void add(const Image& image);
  void finish();

 private:
  [[noreturn]] void fail();
  /// Waits for ffmpeg to end; returns its exit code.
  int close();

  std::string path_;
  files::OutputFile file_;  // written by ffmpeg
  int to_ffmpeg_ = -1;
  int complaints_ = -1;  // a file with ffmpeg's stderr
  int process_ = -1;
};

}  // namespace fathom::render
