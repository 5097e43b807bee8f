#include "output.hpp"

#include <ostream>
#include <streambuf>
#include <utility>

#include "files/output_file.hpp"

namespace fathom::cli {

struct Output::State : std::streambuf {
  explicit State(const std::string& path) : file(path), stream(this) {
    stream.exceptions(std::ios::badbit);  // rethrows what the file throws
  }

  int_type overflow(int_type c) override {
    if (traits_type::eq_int_type(c, traits_type::eof())) return traits_type::not_eof(c);
    const char byte = traits_type::to_char_type(c);
    file.write(&byte, 1);
    return c;
  }
  std::streamsize xsputn(const char* bytes, std::streamsize size) override {
    file.write(bytes, static_cast<std::size_t>(size));
    return size;
  }

  files::OutputFile file;
  std::ostream stream;
};

Output::Output(std::string path) : path_(std::move(path)) {
  if (wanted()) state_ = std::make_unique<State>(path_);
}

Output::~Output() = default;

bool Output::is_stdout() const { return files::is_stdout(path_); }

std::ostream& Output::stream() { return state_->stream; }

void Output::finish() {
  if (state_) state_->file.finish();
}

}  // namespace fathom::cli
