// Where a command writes its figures.
#pragma once

#include <fstream>
#include <iosfwd>
#include <string>

namespace fathom::cli {

/// A file to write to, stdout for "-", or nothing for an empty path. A file is written beside its place as "PATH.part"
/// and takes it when it is finished, so that whoever reads it never sees half of one, and an earlier file survives a
/// run that ends early. Devices and pipes are written to as they are.
class Output {
 public:
  /// Opens it before the run, so that a run is not lost to a wrong path. Throws `Error{file}`.
  explicit Output(std::string path);
  ~Output();
  Output(const Output&) = delete;
  Output& operator=(const Output&) = delete;

  bool wanted() const { return !path_.empty(); }
  bool is_stdout() const { return path_ == "-"; }
  std::ostream& stream();

  /// Throws `Error{file}` where something could not be written, e.g. on a full disk; an earlier file is then as it was.
  void finish();

 private:
  std::string path_, part_;
  std::ofstream file_;
};

}  // namespace fathom::cli
