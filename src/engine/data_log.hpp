// Named series of numbers for later analysis, in one CSV file: series,frame,step,time,value.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

namespace fathom::files {
class OutputFile;
}

namespace fathom::engine {

/// Nearly free without a file. For the engine's thread only.
class DataLog {
 public:
  DataLog();
  /// The file grows in place, so other programs can follow it. Empty: no file. Throws `Error{file}` if it cannot be
  /// written.
  explicit DataLog(const std::string& path);
  ~DataLog();

  bool is_open() const { return file_ != nullptr; }
  /// Sets frame, step and time of the following rows.
  void set_now(std::uint64_t frame, std::uint64_t step, double time) { frame_ = frame, step_ = step, time_ = time; }
  /// Adds a row. Values that are not finite are written as such (nan, inf). A comma or quote in the name becomes '_'.
  /// Throws `Error{file}` if rows could not be written (disk full).
  void add(std::string_view series, double value);
  /// Throws like `add`.
  void flush();

 private:
  std::unique_ptr<files::OutputFile> file_;
  std::uint64_t frame_ = 0, step_ = 0;
  double time_ = 0;
};

}  // namespace fathom::engine
