#include "engine/data_log.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <fathom/error.hpp>
#include <iterator>

namespace fathom::engine {

DataLog::DataLog(const std::string& path) : path_(path) {
  if (path.empty()) return;
  file_.reset(std::fopen(path.c_str(), "w"));
  if (!file_) throw Error(ErrorCode::file, path + ": data cannot be written; check the folder and its permissions");
  std::fputs("series,frame,step,time,value\n", file_.get());
}

void DataLog::add(std::string_view series, double value) {
  if (!file_) return;
  fmt::memory_buffer row;
  std::transform(series.begin(), series.end(), std::back_inserter(row),
                 [](char c) { return c == ',' || c == '"' || c == '\n' ? '_' : c; });
  fmt::format_to(std::back_inserter(row), ",{},{},{},{}\n", frame_, step_, time_, value);
  std::fwrite(row.data(), 1, row.size(), file_.get());
}

void DataLog::flush() {
  if (!file_) return;
  if (std::fflush(file_.get()) != 0 || std::ferror(file_.get()))
    throw Error(ErrorCode::file, path_ + ": could not be written to its end; is the disk full?");
}

}  // namespace fathom::engine
