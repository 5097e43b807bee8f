// Films: pictures piped to the program ffmpeg.
#pragma once

#include <string>

#include "files/output_file.hpp"
#include "render/image.hpp"

namespace fathom::render {

class Video {
 public:
  /// The file's ending decides the format. Throws `Error{unavailable}` where there is no ffmpeg, `Error{file}` where
  /// the file cannot be written, `Error{invalid_argument}` on an odd width or height, or an ending that is no film's.
  Video(const std::string& path, int width, int height, int frames_per_second);
  /// Without `finish` nothing is left behind.
  ~Video();
  Video(const Video&) = delete;
  Video& operator=(const Video&) = delete;

  /// Throws `Error{file}` with what ffmpeg said where it gave up.
  void add(const Image& image);
  void finish();

 private:
  [[noreturn]] void fail();
  /// Waits for ffmpeg to end; its exit code.
  int close();

  std::string path_;
  files::OutputFile file_;  // grows by ffmpeg's hand
  int to_ffmpeg_ = -1;
  int complaints_ = -1;  // a file of what ffmpeg writes to stderr
  int process_ = -1;
};

}  // namespace fathom::render
