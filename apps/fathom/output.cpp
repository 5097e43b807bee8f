#include "output.hpp"

#include <fathom/error.hpp>
#include <filesystem>
#include <iostream>
#include <utility>

namespace fathom::cli {

namespace fs = std::filesystem;

Output::Output(std::string path) : path_(std::move(path)) {
  if (path_.empty() || path_ == "-") return;
  std::error_code ignored;
  const fs::file_status status = fs::status(path_, ignored);
  const bool replaced = !fs::exists(status) || fs::is_regular_file(status);
  if (replaced) part_ = path_ + ".part";
  file_.open(replaced ? part_ : path_);
  if (!file_) {
    part_.clear();
    throw Error(ErrorCode::file, path_ + ": cannot be written; check the folder and its permissions");
  }
}

Output::~Output() {
  if (part_.empty()) return;
  file_.close();
  std::error_code ignored;
  fs::remove(part_, ignored);
}

std::ostream& Output::stream() { return is_stdout() ? std::cout : file_; }

void Output::finish() {
  if (!wanted()) return;
  stream().flush();
  if (!stream()) throw Error(ErrorCode::file, path_ + ": could not be written to its end; is the disk full?");
  if (part_.empty()) return;
  file_.close();
  std::error_code failed;
  if (file_) fs::rename(part_, path_, failed);
  if (!file_ || failed) throw Error(ErrorCode::file, path_ + ": could not be put in its place; is the disk full?");
  part_.clear();
}

}  // namespace fathom::cli
