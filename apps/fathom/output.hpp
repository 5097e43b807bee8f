// The output of a command.
#pragma once

#include <iosfwd>
#include <memory>
#include <string>

namespace fathom::cli {

/// A file as `files::OutputFile` writes it, stdout for "-", or nothing for an empty path.
class Output {
 public:
  /// Opens it before the run, so that a wrong path does not cost a run. Throws `Error{file}`.
  explicit Output(std::string path);
  ~Output();
  Output(const Output&) = delete;
  Output& operator=(const Output&) = delete;

  bool wanted() const { return !path_.empty(); }
  bool is_stdout() const;
  /// Writing to it throws `Error{file}` on failure, for example on a full disk.
  std::ostream& stream();
  /// Throws `Error{file}` if something could not be written; an earlier file is then unchanged.
  void finish();

 private:
  struct State;

  std::string path_;
  std::unique_ptr<State> state_;
};

}  // namespace fathom::cli
