#include "engine/data_log.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "files/output_file.hpp"

namespace fathom::engine {

DataLog::DataLog() = default;

DataLog::DataLog(const std::string& path) {
  if (path.empty()) return;
  file_ = std::make_unique<files::OutputFile>(path, files::Writing::live);
  file_->write("series,frame,step,time,value\n");
}

DataLog::~DataLog() = default;

void DataLog::add(std::string_view series, double value) {
  if (!file_) return;
  fmt::memory_buffer row;
  std::transform(series.begin(), series.end(), std::back_inserter(row),
                 [](char c) { return c == ',' || c == '"' || c == '\n' ? '_' : c; });
  fmt::format_to(std::back_inserter(row), ",{},{},{},{}\n", frame_, step_, time_, value);
  file_->write(row.data(), row.size());
}

void DataLog::flush() {
  if (file_) file_->flush();
}

}  // namespace fathom::engine
